//! What is kept of a run while it goes: everything, or nothing but the monitor's summary.

use firmware::control_loop::Action;

use super::trajectory::{PhaseSpan, Sample, extend_phases};

/// Takes each tick of a run.
pub trait Recorder {
    /// A tick and what the firmware answered; it holds for `tick_s`.
    fn tick(&mut self, sample: &Sample, action: &Action, tick_s: f64);
}

/// Keeps nothing.
impl Recorder for () {
    #[inline]
    fn tick(&mut self, _sample: &Sample, _action: &Action, _tick_s: f64) {}
}

/// Keeps samples and phases.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// One sample a tick.
    pub samples: Vec<Sample>,
    /// Phases in order.
    pub phases: Vec<PhaseSpan>,
}

impl Recorder for History {
    fn tick(&mut self, sample: &Sample, action: &Action, tick_s: f64) {
        self.samples.push(*sample);
        let until_s = sample.time_s + tick_s;
        extend_phases(&mut self.phases, action.phase, sample.time_s, until_s);
    }
}
