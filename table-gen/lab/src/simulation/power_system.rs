//! A power system that can be driven through the parts of a tick, and the linear one with its exact
//! steps.

use super::monitor::{Knot, Monitor};
use model::plant::{Plant, STATES};
use model::propagator::Propagator;

/// A part of a tick; in each the fleet's power is constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// From the event to the first tick.
    Offset = 0,
    /// From a tick until a command that is under way arrives.
    Early = 1,
    /// From then to the next tick.
    Late = 2,
}

/// Lengths of the parts \[s\], in the order of [`Part`]; 0 for a part that does not exist.
pub type PartLengths = [f64; 3];

/// A power system in time.
pub trait PowerSystem {
    /// Its state (f, g, l, p) \[Hz, GW\].
    fn state(&self) -> [f64; STATES];

    /// Advances through a part of a tick under a constant power of the fleet \[GW\] and shows the
    /// frequency to the monitor.
    fn advance(&mut self, part: Part, from_s: f64, fleet_gw: f64, monitor: &mut Monitor);
}

/// The plant of the spec after a step of lost power: linear, so that a part of a tick is one exact
/// step.
#[derive(Debug, Clone, Copy)]
pub struct LinearSystem {
    plant: Plant,
    steps: [Option<Propagator>; 3],
    lengths: PartLengths,
    loss_gw: f64,
    x: [f64; STATES],
}

impl LinearSystem {
    /// A plant that loses a power \[GW\] at time 0. `tick` is the step over a whole tick; it serves
    /// when no delay splits it.
    pub fn new(
        plant: Plant,
        tick: &Propagator,
        lengths: PartLengths,
        loss_gw: f64,
        initial: [f64; STATES],
    ) -> Self {
        let step = |part: Part| {
            let length = lengths[part as usize];
            (length > 0.0).then(|| Propagator::new(&plant, length))
        };
        let late = if lengths[Part::Early as usize] == 0.0 {
            Some(*tick)
        } else {
            step(Part::Late)
        };
        Self {
            plant,
            steps: [step(Part::Offset), step(Part::Early), late],
            lengths,
            loss_gw,
            x: initial,
        }
    }
}

impl PowerSystem for LinearSystem {
    #[inline]
    fn state(&self) -> [f64; STATES] {
        self.x
    }

    #[inline]
    fn advance(&mut self, part: Part, from_s: f64, fleet_gw: f64, monitor: &mut Monitor) {
        let Some(step) = &self.steps[part as usize] else {
            return;
        };
        let net = fleet_gw - self.loss_gw;
        let knot = |time_s: f64, x: &[f64; STATES]| Knot {
            time_s,
            f: x[0],
            df: self.plant.derivative(*x, net)[0],
        };
        let next = step.step(&self.x, net);
        let to_s = from_s + self.lengths[part as usize];
        monitor.segment(knot(from_s, &self.x), knot(to_s, &next));
        self.x = next;
    }
}
