//! How many steps of a chain begin in a time.

use firmware::table::Header;
use serde::Serialize;

/// How long steps last.
///
/// Laws and Hold decide for a whole period. In Fixed a step may end after a tick, but a whole
/// period follows it then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Pace {
    /// Ticks of a period.
    pub period_ticks: u32,
    /// Whether every step lasts a period: tables with Hold, which have no Fixed.
    pub whole: bool,
}

impl Pace {
    /// The pace of a table of laws by games.
    pub fn of(header: &Header) -> Self {
        Self {
            period_ticks: u32::from(header.period_ticks),
            whole: header.stay,
        }
    }

    /// Steps that may begin in so many ticks.
    pub const fn steps_in(self, ticks: u32) -> u32 {
        if self.whole {
            ticks / self.period_ticks + 1
        } else {
            2 * (ticks / (self.period_ticks + 1)) + 2
        }
    }

    /// The longest time \[ticks\] in which no more than so many steps are certain to be enough,
    /// and how many are; nothing where they are not enough for any.
    pub const fn covered(self, steps: u32) -> Option<(u32, u32)> {
        if self.whole {
            match steps.checked_sub(1) {
                Some(periods) => Some((periods * self.period_ticks, steps)),
                None => None,
            }
        } else {
            match steps.checked_sub(2) {
                Some(more) => Some((more / 2 * (self.period_ticks + 1), more / 2 * 2 + 2)),
                None => None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_that_steps_cover_needs_no_more_of_them() {
        for whole in [false, true] {
            let pace = Pace {
                period_ticks: 15,
                whole,
            };
            for steps in 0..40 {
                let Some((ticks, used)) = pace.covered(steps) else {
                    assert!(steps < 2);
                    continue;
                };
                assert!(used <= steps && pace.steps_in(ticks) == used);
                // A period later more are needed.
                assert!(pace.steps_in(ticks + 16) > steps.min(used));
            }
        }
        let pace = Pace {
            period_ticks: 10,
            whole: true,
        };
        // Ticks 0, 10, 20 and 30 begin steps in 39 ticks; in Fixed every eleven ticks two may.
        assert_eq!(pace.steps_in(39), 4);
        assert_eq!(
            Pace {
                whole: false,
                ..pace
            }
            .steps_in(39),
            8
        );
    }
}
