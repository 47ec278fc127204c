//! One step of a plant in plain numbers: exact where the plant is linear, by Runge-Kutta where its
//! governors are limited.

use crate::governor::Governor;
use crate::plant::{Plant, STATES};
use crate::propagator::Propagator;

/// Longest step of the integration \[s\]. The method's local error is about (h / T_t)⁵ / 120 =
/// 3e-11 for a turbine of 0.5 s; where a limit begins or ends within a step, h² / 2 times the jump
/// of g''.
const STEP_S: f64 = 0.01;

/// A step of one length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepper {
    /// One exact step.
    Linear(Propagator),
    /// Several short ones.
    Limited {
        /// The plant.
        plant: Plant,
        /// Its governors.
        governor: Governor,
        /// Number of short steps.
        steps: u32,
        /// Length of each \[s\].
        step_s: f64,
    },
}

impl Stepper {
    /// The step of a plant over a time \[s\].
    pub fn new(plant: &Plant, governor: Governor, time_s: f64) -> Self {
        if governor.is_linear() {
            return Self::Linear(Propagator::new(plant, time_s));
        }
        let steps = (time_s / STEP_S - 1e-9).ceil().max(1.0);
        Self::Limited {
            plant: *plant,
            governor,
            steps: steps as u32,
            step_s: time_s / steps,
        }
    }

    /// The state after the step for a net power \[GW\].
    #[inline]
    pub fn step(&self, x: &[f64; STATES], net_power: f64) -> [f64; STATES] {
        match self {
            Self::Linear(propagator) => propagator.step(x, net_power),
            Self::Limited {
                plant,
                governor,
                steps,
                step_s,
            } => {
                let slope = |x: &[f64; STATES]| governor.derivative(plant, x, net_power);
                let mut x = *x;
                for _ in 0..*steps {
                    x = runge_kutta(&slope, &x, slope(&x), *step_s);
                    governor.limit(&mut x);
                }
                x
            }
        }
    }
}

/// One step of the classical Runge-Kutta method; `k1` is the slope at `y`.
#[inline]
pub fn runge_kutta<const N: usize>(
    derivative: &impl Fn(&[f64; N]) -> [f64; N],
    y: &[f64; N],
    k1: [f64; N],
    h: f64,
) -> [f64; N] {
    let along = |k: &[f64; N], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let k2 = derivative(&along(&k1, 0.5 * h));
    let k3 = derivative(&along(&k2, 0.5 * h));
    let k4 = derivative(&along(&k3, h));
    std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;

    /// Limits that are never reached: the two ways must agree to the method's error. Over 1 s that
    /// is 100 steps of at most 3e-11 of a state below 4, some 1e-8.
    #[test]
    fn limits_out_of_reach_change_nothing() {
        let plant = Plant::new(&Spec::default());
        let far = Governor {
            output_gw: [-100.0, 100.0],
            ..Governor::LINEAR
        };
        let x = [-0.2, 0.4, 0.1, 0.3];
        let exact = Stepper::new(&plant, Governor::LINEAR, 1.0).step(&x, -2.0);
        let short = Stepper::new(&plant, far, 1.0).step(&x, -2.0);
        for (a, b) in exact.into_iter().zip(short) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }
}
