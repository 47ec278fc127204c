//! The limited plant in time, driven like the linear one.
//!
//! Steps of at most 10 ms: the method's local error is about (h / T_t)⁵ / 120 = 3e-11 for the
//! turbine's 0.5 s, and where a limit of the governors begins or ends within a step, h² / 2 times
//! the jump of g'', below 5e-5 s² times that jump.

use super::plant::{BeyondPlant, runge_kutta};
use crate::simulation::monitor::{Knot, Monitor};
use crate::simulation::power_system::{Part, PartLengths, PowerSystem};
use model::plant::STATES;

/// Longest step \[s\].
const STEP_S: f64 = 0.01;

/// A power system beyond the paper's plant.
#[derive(Debug, Clone)]
pub struct BeyondSystem {
    plant: BeyondPlant,
    lengths: PartLengths,
    x: [f64; STATES],
}

impl BeyondSystem {
    /// One at a state.
    pub fn new(plant: BeyondPlant, lengths: PartLengths, initial: [f64; STATES]) -> Self {
        Self {
            plant,
            lengths,
            x: initial,
        }
    }
}

impl PowerSystem for BeyondSystem {
    fn state(&self) -> [f64; STATES] {
        self.x
    }

    fn advance(&mut self, part: Part, from_s: f64, fleet_gw: f64, monitor: &mut Monitor) {
        let end_s = from_s + self.lengths[part as usize];
        let mut at_s = from_s;
        // Steps below a nanosecond are rounding dust; each loop advances by a step or reaches a
        // jump.
        while end_s - at_s > 1e-9 {
            let to_s = self.plant.next_jump(at_s, end_s.min(at_s + STEP_S));
            let drive = self.plant.drive(0.5 * (at_s + to_s));
            let derivative = |x: &[f64; STATES]| self.plant.derivative(x, &drive, fleet_gw);
            let slope = derivative(&self.x);
            let knot = |time_s: f64, x: &[f64; STATES], df: f64| Knot {
                time_s,
                f: x[0],
                df,
            };
            let mut next = runge_kutta(&derivative, &self.x, slope, to_s - at_s);
            self.plant.limit(&mut next);
            let end_slope = derivative(&next)[0];
            monitor.segment(knot(at_s, &self.x, slope[0]), knot(to_s, &next, end_slope));
            self.x = next;
            at_s = to_s;
        }
    }
}
