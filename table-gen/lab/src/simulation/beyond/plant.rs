//! The equations of the plant with its limits, and how they are integrated.
//!
//! ```text
//! f' = (p + P u - w(t) - n(t) - D f) / 2H(t)
//! g' = clamp((K z(f) - g) / T_G, ± rate), 0 at a limit of g
//! l' = (g + T_1 g' - l) / T_2                     p' = (l - p) / T_t
//! ```
//!
//! with z(f) the deviation past the governors' dead band. Integrated by the classical Runge-Kutta
//! method, with a step's end on every jump of w, n and H.

use super::noise::{HOLD_S, Noise};
use super::{Disturbances, Governor, Loss};
use model::plant::{Plant, STATES};

pub use model::stepper::runge_kutta;

/// A plant with its disturbances of one run.
#[derive(Debug, Clone)]
pub struct BeyondPlant {
    plant: Plant,
    governor: Governor,
    /// Moments of the losses \[s\], in order.
    jumps_s: Vec<f64>,
    /// What is lost before the first of them, then after each.
    lost: Vec<Loss>,
    noise: Noise,
}

/// What drives the plant between two jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Lost power and noise of the demand \[GW\].
    missing_gw: f64,
    /// 2H \[GW s/Hz\].
    twice_inertia: f64,
}

impl BeyondPlant {
    /// The plant under disturbances that last for at least `duration_s`.
    pub fn new(plant: Plant, disturbances: &Disturbances, duration_s: f64, seed: u64) -> Self {
        let mut lost = vec![Loss {
            at_s: f64::NEG_INFINITY,
            power_gw: 0.0,
            inertia_gw_s_per_hz: 0.0,
        }];
        for loss in &disturbances.losses {
            let before = lost[lost.len() - 1];
            lost.push(Loss {
                at_s: loss.at_s,
                power_gw: before.power_gw + loss.power_gw,
                inertia_gw_s_per_hz: before.inertia_gw_s_per_hz + loss.inertia_gw_s_per_hz,
            });
        }
        Self {
            plant,
            governor: disturbances.governor,
            jumps_s: disturbances.losses.iter().map(|loss| loss.at_s).collect(),
            lost,
            noise: Noise::new(&disturbances.demand, duration_s, seed),
        }
    }

    /// What drives the plant around a time that is no jump \[s\].
    pub fn drive(&self, time_s: f64) -> Drive {
        let lost = self.lost[self.jumps_s.partition_point(|at| *at < time_s)];
        Drive {
            missing_gw: self.noise.at(time_s) + lost.power_gw,
            twice_inertia: 2.0 * (self.plant.inertia - lost.inertia_gw_s_per_hz),
        }
    }

    /// The first jump after a time, or `limit_s`.
    pub fn next_jump(&self, time_s: f64, limit_s: f64) -> f64 {
        // A jump that rounding puts just before the time has happened.
        let after = time_s + 1e-9;
        let next = self.jumps_s.partition_point(|at| *at <= after);
        let loss = self.jumps_s.get(next).copied();
        let noise = (!self.noise.is_silent()).then(|| ((after / HOLD_S).floor() + 1.0) * HOLD_S);
        let next = loss.into_iter().chain(noise);
        next.fold(limit_s, f64::min)
    }

    /// x' for a drive and a power of the fleet \[GW\].
    pub fn derivative(&self, x: &[f64; STATES], drive: &Drive, fleet_gw: f64) -> [f64; STATES] {
        let [f, g, l, p] = *x;
        let plant = &self.plant;
        let dg = self.governor.rate(plant, f, g);
        let net = p + fleet_gw - drive.missing_gw - plant.damping * f;
        [
            net / drive.twice_inertia,
            dg,
            (g + plant.lead_time * dg - l) / plant.lag_time,
            (l - p) / plant.turbine_time,
        ]
    }

    /// The governor's output within its limits; a step may end past one by a rate times the step.
    pub fn limit(&self, x: &mut [f64; STATES]) {
        self.governor.limit(x);
    }
}
