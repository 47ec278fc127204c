//! The least time between two changes of the pilot.
//!
//! A car may take seconds to follow the pilot, and some cars stop charging when it moves too often.
//! With a gap, a change waits until the last one is that old. A pause is never kept waiting, and
//! neither is a limit: a current that is above the limits is lowered at once.
//!
//! A change waits for one gap at most, so the gap counts as delay: a table whose proof allows less
//! than it does not fit ([`crate::charger::Misfits::PACE`]).

/// Paces the currents that are offered.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    gap_ms: u32,
    offered_ma: u32,
    /// When it last changed, for as long as the gap since then has not passed.
    since_ms: Option<u32>,
}

impl Pace {
    /// No gap.
    pub const NONE: Self = Self::new(0);

    /// At least this time between two changes \[ms\].
    pub const fn new(gap_ms: u32) -> Self {
        Self {
            gap_ms,
            offered_ma: 0,
            since_ms: None,
        }
    }

    /// What to offer now \[mA\], when `wanted_ma` is wanted and `limit_ma` is the lowest limit; 0
    /// pauses. To be asked at every tick.
    pub const fn admit(&mut self, wanted_ma: u32, limit_ma: u32, now_ms: u32) -> u32 {
        if let Some(since_ms) = self.since_ms
            && now_ms.wrapping_sub(since_ms) >= self.gap_ms
        {
            self.since_ms = None;
        }
        let waits = self.since_ms.is_some() && wanted_ma > 0 && self.offered_ma <= limit_ma;
        if wanted_ma != self.offered_ma && !waits {
            self.offered_ma = wanted_ma;
            self.since_ms = Some(now_ms);
        }
        self.offered_ma
    }

    /// Nothing is offered, for there is no car to be spared: the next offer does not wait.
    pub const fn reset(&mut self) {
        self.offered_ma = 0;
        self.since_ms = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn without_a_gap_everything_passes() {
        let mut pace = Pace::NONE;
        for (n, ma) in [6_000, 7_000, 0, 32_000, 31_999].into_iter().enumerate() {
            assert_eq!(pace.admit(ma, 32_000, n as u32), ma);
        }
    }

    #[test]
    fn a_change_waits_and_a_pause_and_a_limit_do_not() {
        let mut pace = Pace::new(5_000);
        // The clock wraps on the way.
        let start = u32::MAX - 2_000;
        let mut at = |ms: u32, wanted, limit| pace.admit(wanted, limit, start.wrapping_add(ms));
        assert_eq!(at(0, 32_000, 32_000), 32_000);
        assert_eq!(at(4_900, 20_000, 32_000), 32_000);
        assert_eq!(at(5_000, 20_000, 32_000), 20_000);
        assert_eq!(at(5_100, 16_000, 16_000), 16_000);
        assert_eq!(at(5_200, 0, 16_000), 0);
        // The way back from a pause is a change like any other.
        assert_eq!(at(10_100, 16_000, 16_000), 0);
        assert_eq!(at(10_200, 16_000, 16_000), 16_000);
        pace.reset();
        assert_eq!(pace.admit(10_000, 16_000, start), 10_000);
    }

    proptest! {
        /// Two changes to something that is no pause and keeps to the limits are a gap apart, a
        /// limit is kept at every tick, and what is wanted is offered within the gap.
        #[test]
        fn changes_are_a_gap_apart_and_none_waits_longer(
            gap in 0u32..60_000, start: u32,
            ticks in proptest::collection::vec((0u32..8, 0u32..8, 1u32..2_000), 1..300),
        ) {
            let mut pace = Pace::new(gap);
            let (mut now, mut before, mut changed) = (start, 0, None::<u32>);
            let mut unmet = None::<u32>;
            for (wanted, limit, step) in ticks {
                let limit = limit * 4_000;
                let wanted = (wanted * 4_000).min(limit);
                let offered = pace.admit(wanted, limit, now);
                prop_assert!(offered <= limit);
                if offered != before {
                    let free = offered == 0 || before > limit;
                    let apart = changed.is_none_or(|at| now.wrapping_sub(at) >= gap);
                    prop_assert!(free || apart);
                    changed = Some(now);
                }
                unmet = if offered == wanted { None } else { unmet.or(Some(now)) };
                prop_assert!(unmet.is_none_or(|since| now.wrapping_sub(since) < gap));
                before = offered;
                now = now.wrapping_add(step);
            }
        }
    }
}
