//! Where a set came from: one line for every decision on its way, kept for the counterexample.

use firmware::phase::Phase;
use serde::Serialize;

use model::interval::Interval;

/// One step of a path of sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathStep {
    pub(crate) tick: u32,
    pub(crate) phase: Phase,
    pub(crate) level: u8,
    pub(crate) cell: Option<[u16; 4]>,
    /// Frequencies of the set \[µHz\].
    pub(crate) set: Interval,
}

impl PathStep {
    /// The moment of the event.
    pub(crate) fn event(set: Interval) -> Self {
        Self {
            tick: 0,
            phase: Phase::NoControl,
            level: 0,
            cell: None,
            set,
        }
    }

    /// For the verdict.
    pub(crate) fn shown(&self, tick_s: f64) -> ShownStep {
        ShownStep {
            time_s: f64::from(self.tick) * tick_s,
            phase: phase_name(self.phase),
            level: self.level,
            cell: self.cell,
            f_low_hz: self.set.low / 1e6,
            f_high_hz: self.set.high / 1e6,
        }
    }
}

/// One step of a counterexample's path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShownStep {
    /// Time from the first tick after the event \[s\].
    pub time_s: f64,
    /// Law in force from then on.
    pub phase: &'static str,
    /// Input level from then on.
    pub level: u8,
    /// Cell of the measured state, where one was looked up.
    pub cell: Option<[u16; 4]>,
    /// Lowest deviation of the set \[Hz\].
    pub f_low_hz: f64,
    /// Highest deviation of the set \[Hz\].
    pub f_high_hz: f64,
}

/// Name of a phase in verdicts.
pub(crate) fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::NoControl => "No control",
        Phase::C1 => "C1",
        Phase::C2 => "C2",
        Phase::Fixed => "Fixed",
        Phase::Hold => "Hold",
        Phase::Fallback => "Fallback",
    }
}

/// The steps of all paths of an exploration, as a tree.
#[derive(Debug, Clone, Default)]
pub(crate) struct Traces {
    steps: Vec<(Option<u32>, PathStep)>,
}

impl Traces {
    pub(crate) fn push(&mut self, parent: Option<u32>, step: PathStep) -> u32 {
        self.steps.push((parent, step));
        (self.steps.len() - 1) as u32
    }

    pub(crate) fn len(&self) -> usize {
        self.steps.len()
    }

    /// The path that ends in a step, from the event on. Watching ticks in which nothing changed are left out.
    pub(crate) fn path(&self, last: u32) -> Vec<PathStep> {
        let mut path: Vec<PathStep> = Vec::new();
        let mut at = Some(last);
        // A parent comes before its child, so this ends.
        while let Some(index) = at {
            let (parent, step) = self.steps[index as usize];
            if let Some(later) = path.last_mut()
                && path_same(later, &step)
            {
                *later = step;
            } else {
                path.push(step);
            }
            at = parent;
        }
        path.reverse();
        path
    }
}

fn path_same(later: &PathStep, step: &PathStep) -> bool {
    matches!(step.phase, Phase::NoControl | Phase::Fixed)
        && later.phase == step.phase
        && later.level == step.level
}
