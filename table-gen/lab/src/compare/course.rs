//! The grid in time under one controller.
//!
//! The plant takes steps of a part of a tick, exact ones where it is linear, over each of which the
//! fleet's power is constant. The chargers watch a quiet grid before the event. The limit responds
//! between two steps, at the moment itself.

use super::chargers::{Chargers, PARTS};
use super::outcome::Outcome;
use crate::simulation::NOMINAL_HZ;
use crate::simulation::closed_loop::measured;
use crate::simulation::monitor::{Knot, Monitor};
use model::governor::Governor;
use model::plant::{Plant, STATES};
use model::spec::Spec;
use model::stepper::Stepper;

/// Time for which the chargers watch the quiet grid before the event \[s\]; longer than any window
/// of a law.
const QUIET_S: f64 = 5.0;
/// Time from which the ripple is measured \[s\].
const RIPPLE_FROM_S: f64 = 60.0;
/// Halvings in which the moment of the trigger is found: 10 ms / 2^30.
const HALVINGS: u32 = 30;

/// A run that goes on.
#[derive(Debug, Clone)]
pub struct Course {
    plant: Plant,
    governor: Governor,
    part_s: f64,
    parts: usize,
    step: Stepper,
    loss_gw: f64,
    x: [f64; STATES],
    time_s: f64,
    monitor: Monitor,
    lowest: f64,
    highest: f64,
    given_gw_s: f64,
}

impl Course {
    /// A loss \[GW\] at time 0 on a plant, from the middle of the spec's initial box.
    pub fn new(spec: &Spec, plant: &Plant, tick_ms: u16, duration_s: f64, loss_gw: f64) -> Self {
        let part_s = f64::from(tick_ms) / 1000.0 / PARTS as f64;
        let initial = &spec.uncertainty.initial;
        Self {
            plant: *plant,
            governor: Governor::of(spec),
            part_s,
            parts: (duration_s / part_s).round().max(1.0) as usize,
            step: Stepper::new(plant, Governor::of(spec), part_s),
            loss_gw,
            x: std::array::from_fn(|d| 0.5 * (initial.lower[d] + initial.upper[d])),
            time_s: 0.0,
            monitor: Monitor::new(spec),
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            given_gw_s: 0.0,
        }
    }

    /// Without a response.
    pub fn without(mut self) -> Outcome {
        for part in 0..self.parts {
            self.part(part, 0.0);
        }
        self.outcome((0.0, 0))
    }

    /// With a fleet.
    pub fn with(mut self, mut chargers: Chargers<'_>) -> Outcome {
        let quiet = (QUIET_S / self.part_s).ceil() as usize;
        // Whole ticks: the first charger's tick comes with the event.
        for _ in 0..quiet.next_multiple_of(PARTS) {
            chargers.part(measured(&self.x).frequency_uhz());
        }
        chargers.forget_changes();
        for part in 0..self.parts {
            let given = chargers.part(measured(&self.x).frequency_uhz());
            self.part(part, given);
        }
        self.outcome(chargers.changes())
    }

    /// Everything from the moment on at which f passes a deviation \[Hz\].
    pub fn limit(mut self, trigger_hz: f64) -> Outcome {
        let mut given = 0.0;
        for part in 0..self.parts {
            if given == 0.0 && self.step.step(&self.x, -self.loss_gw)[0] < trigger_hz {
                given = 1.0;
                let before_s = self.until(trigger_hz);
                let step = Stepper::new(&self.plant, self.governor, before_s);
                self.advance(&step, before_s, 0.0);
                let after_s = (part + 1) as f64 * self.part_s - self.time_s;
                let step = Stepper::new(&self.plant, self.governor, after_s);
                self.advance(&step, after_s, given);
                continue;
            }
            self.part(part, given);
        }
        let changes = u32::from(given > 0.0);
        self.outcome((f64::from(changes), changes))
    }

    /// Time within the next part until f, not responded to, passes a deviation.
    fn until(&self, trigger_hz: f64) -> f64 {
        let (mut before, mut after) = (0.0, self.part_s);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (before + after);
            let step = Stepper::new(&self.plant, self.governor, middle);
            if step.step(&self.x, -self.loss_gw)[0] < trigger_hz {
                after = middle;
            } else {
                before = middle;
            }
        }
        after
    }

    fn part(&mut self, part: usize, given: f64) {
        let step = self.step;
        self.advance(&step, self.part_s, given);
        // Sums of many parts would drift.
        self.time_s = (part + 1) as f64 * self.part_s;
    }

    fn advance(&mut self, step: &Stepper, length_s: f64, given: f64) {
        let power = self.plant.fleet * given;
        let net = power - self.loss_gw;
        let plant = self.plant;
        let knot = |time_s: f64, x: &[f64; STATES]| Knot {
            time_s,
            f: x[0],
            df: plant.derivative(*x, net)[0],
        };
        let from = knot(self.time_s, &self.x);
        self.x = step.step(&self.x, net);
        self.time_s += length_s;
        self.monitor.segment(from, knot(self.time_s, &self.x));
        self.given_gw_s += power * length_s;
        if self.time_s >= RIPPLE_FROM_S {
            self.lowest = self.lowest.min(self.x[0]);
            self.highest = self.highest.max(self.x[0]);
        }
    }

    fn outcome(&self, (changes_per_charger, changes_most): (f64, u32)) -> Outcome {
        let summary = self.monitor.summary();
        Outcome {
            nadir_hz: summary.nadir_hz,
            nadir_time_s: summary.nadir_time_s,
            final_hz: NOMINAL_HZ + self.x[0],
            seconds_below_49_5: summary.seconds_below_49_5,
            participation_gw_s: self.given_gw_s,
            changes_per_charger,
            changes_most,
            ripple_hz: (self.highest - self.lowest).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::baseline;
    use crate::simulation::scenario::Scenario;

    fn course(loss_gw: f64) -> Course {
        let spec = Spec::default();
        Course::new(&spec, &Plant::new(&spec), 100, 300.0, loss_gw)
    }

    /// Numbers of an independent program (scipy), four digits.
    #[test]
    fn without_a_response_the_grid_is_the_papers() {
        let outcome = course(2.0).without();
        assert!((outcome.nadir_hz - 49.1285).abs() < 5e-5, "{outcome:?}");
        assert!((outcome.final_hz - 49.6667).abs() < 5e-5, "{outcome:?}");
        // The loop of `simulate` integrates the same plant in steps of 1 ms.
        let spec = Spec::default();
        let other = baseline::simulate(&spec, &Scenario::of(&spec), false).summary;
        let apart = outcome.seconds_below_49_5 - other.seconds_below_49_5;
        assert!(apart.abs() < 1e-6, "{outcome:?} {other:?}");
        assert_eq!((outcome.participation_gw_s, outcome.changes_most), (0.0, 0));
    }

    /// An independent simulation that decides every 0.1 s: it responds up to a tick late, in which
    /// f falls by at most 0.1 s of its slope, loss / 2H. Its nadir is lower by no more than that,
    /// half a millihertz of rounding included.
    #[test]
    fn the_limit_is_what_an_independent_program_found() {
        for (loss_gw, nadir_hz) in [(0.6, 49.898), (1.8, 49.811), (2.0, 49.728), (2.2, 49.646)] {
            let outcome = course(loss_gw).limit(-0.1);
            let late_hz = 0.1 * loss_gw / 8.0;
            let above = outcome.nadir_hz - nadir_hz;
            assert!(
                above > -5e-4 && above < late_hz + 5e-4,
                "{loss_gw}: {outcome:?}"
            );
        }
        let nothing = course(0.3).limit(-0.5);
        assert_eq!(nothing.changes_most, 0);
        assert_eq!(nothing, course(0.3).without());
    }

    /// All of 1.4 GW from the trigger on, less the time before it: 2 GW of loss pass -0.1 Hz after
    /// 0.43 s at most.
    #[test]
    fn what_was_given_is_an_energy() {
        let outcome = course(2.0).limit(-0.1);
        let all = 1.4 * 300.0;
        assert!(outcome.participation_gw_s < all && outcome.participation_gw_s > all - 1.4 * 0.5);
    }
}
