//! The exact discrete step of the linear plant for a net power that is constant over the step.
//!
//! `x(t + h) = Φ x(t) + Γ v` with both blocks from one matrix exponential (nalgebra's). Plain f64:
//! simulation, not proof.

use nalgebra::SMatrix;

use crate::plant::{Plant, STATES};

/// States and the drive.
const AUGMENTED: usize = STATES + 1;

/// Φ and Γ of one step length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Propagator {
    phi: [[f64; STATES]; STATES],
    gamma: [f64; STATES],
}

impl Propagator {
    /// The step of a plant over a time \[s\].
    pub fn new(plant: &Plant, time_s: f64) -> Self {
        let (a, b) = plant.matrices_f64();
        let mut augmented = SMatrix::<f64, AUGMENTED, AUGMENTED>::zeros();
        for i in 0..STATES {
            for j in 0..STATES {
                augmented[(i, j)] = a[i][j] * time_s;
            }
            augmented[(i, STATES)] = b[i] * time_s;
        }
        let exponential = augmented.exp();
        Self {
            phi: std::array::from_fn(|i| std::array::from_fn(|j| exponential[(i, j)])),
            gamma: std::array::from_fn(|i| exponential[(i, STATES)]),
        }
    }

    /// The state after the step for a net power \[GW\].
    #[inline]
    pub fn step(&self, x: &[f64; STATES], net_power: f64) -> [f64; STATES] {
        std::array::from_fn(|i| {
            let mut sum = self.gamma[i] * net_power;
            for j in 0..STATES {
                sum += self.phi[i][j] * x[j];
            }
            sum
        })
    }
}
