//! What a Monte Carlo run draws: one scenario, and one plant if the spec has bands, from one seed.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use crate::simulation::chance::{between, unit};
use crate::simulation::closed_loop::Estimator;
use crate::simulation::scenario::{Scenario, ScenarioError};
use model::plant::{Plant, STATES};
use model::plant_bands::{Band, PlantBands};
use model::spec::Spec;

/// Sets the draws of a plant apart from those of the scenario of the same seed.
const PLANT_STREAM: u128 = 0x50_4c41_4e54;

/// Bands from which each run draws; all uniform.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Draws {
    /// Relative error of the delivered participation, anew each tick, within ± this.
    pub participation_error: f64,
    /// Error of the measured state (f, g, l, p), anew each tick, within ± this \[Hz, GW\].
    pub measurement_error: [f64; STATES],
    /// Lost infeed, once a run \[GW\].
    pub loss_gw: [f64; 2],
    /// Actuation delay, once a run \[s\].
    pub delay_s: [f64; 2],
    /// Lower corner of the box of states in which the event finds the grid.
    pub initial_lower: [f64; STATES],
    /// Its upper corner.
    pub initial_upper: [f64; STATES],
    /// Longest time from the event to the first tick, once a run \[s\]: a tick.
    pub event_offset_s: f64,
    /// Length of a run \[s\].
    pub duration_s: f64,
    /// The plant: each parameter that the spec has in a band, once a run.
    #[serde(serialize_with = "bands")]
    pub plant: PlantBands,
}

fn bands<S: serde::Serializer>(plant: &PlantBands, serializer: S) -> Result<S::Ok, S::Error> {
    <[Band]>::serialize(plant.bands(), serializer)
}

impl Draws {
    /// The uncertainty of a spec, over its horizon (or 120 s).
    pub fn of(spec: &Spec) -> Self {
        let uncertainty = &spec.uncertainty;
        Self {
            participation_error: uncertainty.participation,
            measurement_error: uncertainty.measurement,
            loss_gw: uncertainty.loss_gw,
            delay_s: *uncertainty.actuation_delay_s.ends_s(),
            initial_lower: uncertainty.initial.lower,
            initial_upper: uncertainty.initial.upper,
            event_offset_s: spec.sampling.watch_s,
            duration_s: spec.requirements.horizon_s.unwrap_or(120.0),
            plant: PlantBands::of(spec),
        }
    }

    /// The scenario of a seed: the same on every machine.
    pub fn scenario(&self, seed: u64) -> Scenario {
        let mut random = Pcg64::seed_from_u64(seed);
        // Every number takes a draw, whatever its band: one band does not move the others' draws.
        let loss_gw = between(&mut random, self.loss_gw);
        let delay_s = between(&mut random, self.delay_s);
        let event_offset_s = self.event_offset_s * unit(&mut random);
        let initial = std::array::from_fn(|i| {
            between(&mut random, [self.initial_lower[i], self.initial_upper[i]])
        });
        Scenario {
            loss_gw,
            duration_s: self.duration_s,
            participation_error: self.participation_error,
            measurement: self.measurement_error,
            delay_s,
            event_offset_s,
            seed: random.next_u64(),
            initial,
        }
    }

    /// The plant of a seed, if the spec's lies in bands. It has draws of its own, so that scenarios
    /// are the same with bands and without.
    pub fn plant(&self, seed: u64) -> Option<Plant> {
        if self.plant.bands().is_empty() {
            return None;
        }
        let mut random = Pcg64::new(u128::from(seed), PLANT_STREAM);
        Some(self.plant.at(|band| between(&mut random, band.within)))
    }

    /// How the firmware comes to know the state, where it would be told that of a plant that is
    /// known. Of one that is drawn nobody could tell it, and what is proven of such plants is
    /// proven of its observer.
    pub fn estimator(&self) -> Estimator {
        if self.plant.bands().is_empty() {
            Estimator::FullState
        } else {
            Estimator::Observer
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first number that is not finite or out of range, or a band that is upside down.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let bands = [("--loss-gw", self.loss_gw), ("--delay-s", self.delay_s)];
        for (option, [low, high]) in bands {
            if high < low {
                return Err(ScenarioError {
                    option,
                    value: high,
                    allowed: "LOW,HIGH with LOW at most HIGH",
                });
            }
        }
        for end in 0..2 {
            let mut scenario = self.scenario(0);
            scenario.loss_gw = self.loss_gw[end];
            scenario.delay_s = self.delay_s[end];
            scenario.initial = [self.initial_lower, self.initial_upper][end];
            scenario.check()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_draws_within_its_bands_and_always_the_same() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let draws = Draws {
            loss_gw: [1.8, 2.2],
            delay_s: [0.0, 0.5],
            initial_lower: [-0.02, -0.1, 0.0, 0.0],
            initial_upper: [0.02, 0.1, 0.0, 0.0],
            ..Draws::of(&spec)
        };
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for seed in 0..1000 {
            let scenario = draws.scenario(seed);
            assert_eq!(scenario, draws.scenario(seed));
            assert!((1.8..=2.2).contains(&scenario.loss_gw));
            assert!((0.0..=0.5).contains(&scenario.delay_s));
            assert!((0.0..0.1).contains(&scenario.event_offset_s));
            assert!(scenario.initial[0].abs() <= 0.02 && scenario.initial[2] == 0.0);
            lowest = scenario.loss_gw.min(lowest);
            highest = scenario.loss_gw.max(highest);
        }
        // All 1000 miss the outer 2 % at one end with probability 0.98^1000 = 2e-9.
        assert!(lowest < 1.808 && highest > 2.192);
    }

    #[test]
    fn bands_upside_down_are_refused() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let mut draws = Draws::of(&spec);
        draws.delay_s = [1.0, 0.5];
        assert!(draws.check().is_err());
        draws.delay_s = [0.5, 61.0];
        assert!(draws.check().is_err());
        draws.delay_s = [0.0, f64::NAN];
        assert!(draws.check().is_err());
    }
}
