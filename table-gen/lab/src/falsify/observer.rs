//! What the device's observer knows of a plant that is not the spec's.
//!
//! The observer drives the chain of the spec's own numbers with the real f. Where the real time
//! constants are the spec's own, that is the real chain times a share; else it is a chain of its
//! own, whose exact step is three rows of the exponential of both together.

use model::plant::{Plant, STATES};
use nalgebra::SMatrix;

/// g, l and p of the observer.
pub(super) type Chain = [f64; 3];

/// The plant, the observer's chain and the drive.
const TOGETHER: usize = STATES + 4;

/// Of the observer's chain over a step of the plant.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainStep([[f64; TOGETHER]; 3]);

impl ChainStep {
    /// For a plant that a nominal observer watches, over a time \[s\].
    pub(super) fn new(real: &Plant, nominal: &Plant, time_s: f64) -> Self {
        let (a, b) = real.matrices_f64();
        let (known, _) = nominal.matrices_f64();
        let mut together = SMatrix::<f64, TOGETHER, TOGETHER>::zeros();
        for i in 0..STATES {
            for j in 0..STATES {
                together[(i, j)] = a[i][j] * time_s;
            }
            together[(i, TOGETHER - 1)] = b[i] * time_s;
        }
        // f is the real one, the rest of the row the observer's own.
        for i in 1..STATES {
            let row = STATES - 1 + i;
            together[(row, 0)] = known[i][0] * time_s;
            for j in 1..STATES {
                together[(row, STATES - 1 + j)] = known[i][j] * time_s;
            }
        }
        let exponential = together.exp();
        Self(std::array::from_fn(|i| {
            std::array::from_fn(|j| exponential[(STATES + i, j)])
        }))
    }

    /// The observer's chain after the step, from the real state and its own before it, under a net
    /// power \[GW\].
    pub(super) fn step(&self, x: &[f64; STATES], chain: &Chain, net_power: f64) -> Chain {
        let before = x.iter().chain(chain).chain(std::iter::once(&net_power));
        self.0
            .map(|row| row.iter().zip(before.clone()).map(|(a, x)| a * x).sum())
    }
}

/// Whether a plant's chain has other time constants than another's.
pub(super) fn differs(real: &Plant, nominal: &Plant) -> bool {
    let times = |plant: &Plant| {
        [
            plant.governor_time,
            plant.turbine_time,
            plant.lead_time,
            plant.lag_time,
        ]
    };
    times(real) != times(nominal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a Runge-Kutta integration of both chains.
    #[test]
    fn the_observers_chain_follows_the_real_frequency() {
        let nominal = Plant::new(&model::spec::Spec::load("gb-bi-band", &[]).unwrap());
        let real = Plant {
            governor_gain: -6.0,
            governor_time: 2.0,
            turbine_time: 0.6,
            lead_time: 2.3,
            lag_time: 14.0,
            inertia: 3.5,
            ..nominal
        };
        let (mut x, mut chain) = ([-0.1, 0.5, 0.3, 0.2], [0.4, 0.3, 0.1]);
        let step = ChainStep::new(&real, &nominal, 3.0);
        let expected = step.step(&x, &chain, -1.2);
        const STEPS: u32 = 10_000;
        let h = 3.0 / f64::from(STEPS);
        let rates = |x: &[f64; STATES], q: &Chain| {
            let [_, g, l, p] = nominal.derivative([x[0], q[0], q[1], q[2]], -1.2);
            (real.derivative(*x, -1.2), [g, l, p])
        };
        for _ in 0..STEPS {
            // By the midpoint, which errs by less than a tenth of what is allowed.
            let (dx, dq) = rates(&x, &chain);
            let middle: [f64; STATES] = std::array::from_fn(|d| x[d] + 0.5 * h * dx[d]);
            let middle_chain: Chain = std::array::from_fn(|d| chain[d] + 0.5 * h * dq[d]);
            let (dx, dq) = rates(&middle, &middle_chain);
            x = std::array::from_fn(|d| x[d] + h * dx[d]);
            chain = std::array::from_fn(|d| chain[d] + h * dq[d]);
        }
        for (found, known) in expected.iter().zip(&chain) {
            assert!((found - known).abs() < 1e-6, "{expected:?} {chain:?}");
        }
        assert!(differs(&real, &nominal) && !differs(&nominal, &nominal));
    }
}
