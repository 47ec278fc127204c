//! Where a set came from: one line for every decision on its way, kept for the counterexample.

use firmware::phase::Phase;
use model::interval::Interval;
use model::verdict::ShownStep;

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
            phase: self.phase,
            level: self.level,
            cell: self.cell,
            f_low_hz: self.set.low / 1e6,
            f_high_hz: self.set.high / 1e6,
        }
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

    /// The path that ends in a step, from the event on. NoControl ticks in which nothing changed
    /// are left out.
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
