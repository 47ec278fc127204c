//! What is drawn anew at each tick of a run.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::scenario::Scenario;
use model::plant::STATES;

/// The random errors of a run: a pure function of the scenario's seed.
#[derive(Debug, Clone)]
pub struct Chance {
    random: Pcg64,
    participation: f64,
    measurement: [f64; STATES],
    measures: bool,
}

impl Chance {
    /// The errors of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            random: Pcg64::seed_from_u64(scenario.seed),
            participation: scenario.participation_error,
            measurement: scenario.measurement,
            measures: scenario.measurement.iter().any(|bound| *bound != 0.0),
        }
    }

    /// Relative error of the participation delivered until the next tick, uniform within its bound.
    #[inline]
    pub fn participation(&mut self) -> f64 {
        if self.participation == 0.0 {
            0.0
        } else {
            self.participation * symmetric(&mut self.random)
        }
    }

    /// A state as it is measured: each value with an error uniform within its bound.
    #[inline]
    pub fn measure(&mut self, x: [f64; STATES]) -> [f64; STATES] {
        if !self.measures {
            return x;
        }
        std::array::from_fn(|i| x[i] + self.measurement[i] * symmetric(&mut self.random))
    }
}

/// Uniform in [0, 1) from the upper 53 bits.
#[inline]
pub fn unit(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Uniform in [-1, 1).
#[inline]
pub fn symmetric(random: &mut impl Rng) -> f64 {
    2.0 * unit(random) - 1.0
}

/// Uniform between two ends.
#[inline]
pub fn between(random: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * unit(random)
}
