//! When a new table has run well enough to be kept.

use firmware::charger::Report;
use firmware::fault::{Faults, Mode};

/// Ticks that the table must have decided \[ticks\]: a minute at 100 ms.
pub const HEALTHY_TICKS: u16 = 600;

/// Faults that a table can be the cause of: a tick that takes too long, a set-point that the
/// hardware refuses, a table that does not do after all.
const OF_A_TABLE: [Faults; 5] = [
    Faults::OVERRUN,
    Faults::CLOCK_JUMP,
    Faults::DISPATCH,
    Faults::TABLE_REJECTED,
    Faults::MISFIT,
];

/// Counts the good ticks of a table on trial.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Trial {
    good_ticks: u16,
}

impl Trial {
    /// Before the first tick.
    pub const DEFAULT: Self = Self { good_ticks: 0 };

    /// A tick of the charger; whether the table has now proven itself, and is to be confirmed.
    ///
    /// A tick counts if the table decided. One with a fault that a table can cause starts the count
    /// again. One without, where the frequency is missing for instance, says nothing.
    pub fn tick(&mut self, report: &Report) -> bool {
        if OF_A_TABLE
            .iter()
            .any(|fault| report.faults.contains(*fault))
        {
            self.good_ticks = 0;
        } else if matches!(report.mode, Mode::Table | Mode::Release) {
            self.good_ticks = self.good_ticks.saturating_add(1);
        }
        self.good_ticks >= HEALTHY_TICKS
    }
}
