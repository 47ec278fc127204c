//! The end of an event: when a charger goes back to ordinary charging, and how.
//!
//! The table's laws know how an event begins (f below I1) and how it goes on. They know no end:
//! Hold and Fixed stay in force for as long as f stays in I2. Meanwhile the operator replaces the
//! lost power by reserves, and f recovers. Then the fleet must give the grid its demand back, but
//! not at once: a fleet of 2 GW that resumes in one tick is the next event.
//!
//! | f | while the event lasts | while it is released |
//! |---|---|---|
//! | above I1 | ends it, if no law covers the state | participation falls ten times as fast |
//! | recovered | counts, and ends it in time | participation falls slowly |
//! | below recovered | counts from zero again | participation stands still |
//! | below I1 | | the event begins anew: the table decides at once |
//!
//! The times are those of [`EventEnd`]. At a participation of zero the machine is in No control
//! again.
//!
//! ## Why so
//! f may have recovered only because the fleet holds it. So the release is slow against the grid:
//! minutes, where the grid needs half a minute. f then follows the release as if at rest. The
//! release stands still when f is no longer recovered. A release that comes too early therefore
//! stops well above I1, and goes on when the reserves have come.
//!
//! Where no law covers the state because f is above I1, the event ends too. The droop's answer
//! would be zero there. Jumping to it would push f down into I2, the law would answer, f would rise
//! out of I2, and so on for ever.
//!
//! ## What is proven
//! The verdict on a table is about the event, and the event ends where the release begins. The
//! release is tested, not proven. The next event is covered again once it begins from a grid near
//! rest, as the spec's `uncertainty.initial` says.

use crate::units::{Band, Participation};

/// How much faster participation is released while f is above I1.
const FAST: u32 = 10;

/// When an event is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventEnd {
    /// Lowest deviation that counts as recovered \[µHz\]; I1's lower end if that is higher.
    pub recovered_uhz: i32,
    /// Time for which f must have been recovered without a break \[s\].
    pub recovered_s: u16,
    /// Time in which the whole fleet is released \[s\].
    pub release_s: u16,
}

impl EventEnd {
    /// Recovered from 49.9 Hz up, for 5 minutes; released over 10 minutes.
    pub const DEFAULT: Self = Self {
        recovered_uhz: -100_000,
        recovered_s: 300,
        release_s: 600,
    };
}

/// What a tick is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// Ask the table.
    Follow,
    /// The event begins anew: forget the old one and ask the table.
    Anew,
    /// The event is being released: this participation, without asking the table.
    Release(Participation),
    /// The event is over: forget it and ask the table.
    Over,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// No event, or one that lasts; ticks in a row with f recovered.
    Lasting(u32),
    /// What is not released yet \[ppm\]. It is not read back from the command in force: where
    /// commands act late, that one is rounded to whole levels, and small steps of the release would
    /// be lost.
    Releasing(u32),
}

/// Follows one event after another.
#[derive(Debug, Clone, Copy)]
pub struct EventWatch {
    recovered_uhz: i32,
    recovered_ticks: u32,
    release_ppm: u32,
    outer: Band,
    stage: Stage,
}

impl EventWatch {
    /// A watch for tables with this I1 and this tick.
    pub fn new(end: EventEnd, outer: Band, tick_ms: u16) -> Self {
        let tick_ms = u32::from(tick_ms).max(1);
        let ticks = |s: u16| (u32::from(s) * 1000).div_ceil(tick_ms).max(1);
        Self {
            recovered_uhz: end.recovered_uhz.max(outer.low_uhz),
            recovered_ticks: ticks(end.recovered_s),
            release_ppm: Participation::ALL.ppm().div_ceil(ticks(end.release_s)),
            outer,
            stage: Stage::Lasting(0),
        }
    }

    /// Forgets the event.
    pub const fn reset(&mut self) {
        self.stage = Stage::Lasting(0);
    }

    /// Before the table is asked: what to do at a tick, `ticks` after the last one, at this
    /// frequency \[µHz\].
    pub fn course(&mut self, f_uhz: i32, ticks: u16) -> Course {
        let Stage::Releasing(last) = self.stage else {
            return Course::Follow;
        };
        if f_uhz < self.outer.low_uhz {
            self.reset();
            return Course::Anew;
        }
        let rate = if f_uhz > self.outer.high_uhz {
            self.release_ppm.saturating_mul(FAST)
        } else if f_uhz >= self.recovered_uhz {
            self.release_ppm
        } else {
            0
        };
        let released = rate.saturating_mul(u32::from(ticks));
        let left = last.saturating_sub(released);
        if left == 0 {
            self.reset();
            return Course::Over;
        }
        self.stage = Stage::Releasing(left);
        Course::Release(Participation::from_ppm(left))
    }

    /// After the table was asked: whether the release begins, now. `responding` says that an event
    /// is on; `covered`, that a law covers the state; `last` is the participation in force, from
    /// which the release starts.
    pub fn ends(
        &mut self,
        f_uhz: i32,
        responding: bool,
        covered: bool,
        last: Participation,
        ticks: u16,
    ) -> bool {
        let Stage::Lasting(so_far) = self.stage else {
            return false;
        };
        let recovered = if responding && f_uhz >= self.recovered_uhz {
            so_far.saturating_add(u32::from(ticks))
        } else {
            0
        };
        let above = responding && !covered && f_uhz > self.outer.high_uhz;
        if above || recovered >= self.recovered_ticks {
            self.stage = Stage::Releasing(last.ppm());
            return true;
        }
        self.stage = Stage::Lasting(recovered);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OUTER: Band = Band {
        low_uhz: -300_000,
        high_uhz: 0,
    };

    const ALL: Participation = Participation::ALL;

    fn watch() -> EventWatch {
        EventWatch::new(EventEnd::DEFAULT, OUTER, 100)
    }

    fn releasing(last: Participation) -> EventWatch {
        let mut watch = watch();
        assert!(watch.ends(1, true, false, last, 1));
        watch
    }

    #[test]
    fn five_minutes_without_a_break_end_an_event() {
        let mut watch = watch();
        for n in 1..3000 {
            assert!(!watch.ends(-100_000, true, true, ALL, 1), "{n}");
        }
        assert!(!watch.ends(-100_001, true, true, ALL, 1));
        for n in 1..3000 {
            assert!(!watch.ends(-100_000, true, true, ALL, 1), "{n}");
        }
        assert!(watch.ends(-100_000, true, true, ALL, 1));
        // Without an event there is nothing to end.
        let mut quiet = self::watch();
        assert!((0..10_000).all(|_| !quiet.ends(1_000, false, true, ALL, 1)));
    }

    #[test]
    fn a_release_takes_ten_minutes_and_waits_for_the_frequency() {
        let mut watch = releasing(ALL);
        // 1e6 ppm over 6000 ticks, rounded up.
        let at = |ppm| Course::Release(Participation::from_ppm(ppm));
        assert_eq!(watch.course(-50_000, 1), at(1_000_000 - 167));
        assert_eq!(watch.course(-50_000, 3), at(1_000_000 - 4 * 167));
        assert_eq!(watch.course(-100_001, 1), at(1_000_000 - 4 * 167));
        assert_eq!(watch.course(1, 1), at(1_000_000 - 14 * 167));
        // 5989 = ⌈1e6 / 167⌉ steps in all.
        for n in 15..5989 {
            assert_eq!(watch.course(-50_000, 1), at(1_000_000 - n * 167));
        }
        assert_eq!(watch.course(-50_000, 1), Course::Over);
        assert_eq!(watch.course(-50_000, 1), Course::Follow);
    }

    #[test]
    fn below_i1_the_event_begins_anew() {
        let mut watch = releasing(ALL);
        assert_eq!(watch.course(-300_001, 1), Course::Anew);
        assert_eq!(watch.course(-300_001, 1), Course::Follow);
    }

    #[test]
    fn recovered_is_never_below_i1() {
        let narrow = Band {
            low_uhz: -50_000,
            high_uhz: 0,
        };
        let mut watch = EventWatch::new(EventEnd::DEFAULT, narrow, 100);
        assert!((0..10_000).all(|_| !watch.ends(-50_001, true, true, ALL, 1)));
    }

    proptest! {
        /// A release never raises participation and never lowers it faster than stated.
        #[test]
        fn a_release_is_bounded(f in any::<i32>(), ppm in 0u32..=1_000_000, ticks in 0u16..10) {
            let last = Participation::from_ppm(ppm);
            let bound = 1_670 * u32::from(ticks);
            match releasing(last).course(f, ticks) {
                Course::Release(now) => {
                    prop_assert!(now <= last && last.ppm() - now.ppm() <= bound);
                }
                Course::Over => prop_assert!(ppm <= bound),
                Course::Anew => prop_assert!(f < OUTER.low_uhz),
                Course::Follow => prop_assert!(false),
            }
        }
    }
}
