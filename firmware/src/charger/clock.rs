//! From a millisecond clock to ticks: how many are due, and when the clock cannot be believed.

/// Most ticks made good by one late tick: longer gaps make the interpolation a guess.
pub const CATCH_UP_TICKS_MAX: u16 = 5;

/// What a moment of the clock means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    /// So many ticks are due: 0 for a tick that came too early, more than 1 for one that came late.
    Ticks(u16),
    /// The clock jumped.
    Jumped,
}

/// When the last tick was due, by a clock that may wrap.
#[derive(Debug, Clone, Copy)]
pub(super) struct TickClock {
    tick_ms: u32,
    last_ms: Option<u32>,
}

impl TickClock {
    /// A clock before its first tick.
    pub(super) fn new(tick_ms: u16) -> Self {
        Self {
            tick_ms: u32::from(tick_ms),
            last_ms: None,
        }
    }

    /// The ticks that are due now.
    pub(super) fn due(&mut self, now_ms: u32) -> Due {
        // Not zero; said so that no panic is compiled in.
        let tick = self.tick_ms.max(1);
        let Some(last_ms) = self.last_ms else {
            self.last_ms = Some(now_ms);
            return Due::Ticks(1);
        };
        // The nearest whole number of ticks; a tick may come up to half a tick early or late.
        let elapsed = now_ms.wrapping_sub(last_ms).wrapping_add(tick / 2);
        if elapsed >= u32::MAX / 2 {
            // Before the half tick of tolerance: a little early is nothing, more is a clock that
            // went back.
            let early = last_ms.wrapping_sub(now_ms);
            if early <= tick {
                return Due::Ticks(0);
            }
        } else {
            let due = elapsed / tick;
            if due <= u32::from(CATCH_UP_TICKS_MAX) {
                self.last_ms = Some(last_ms.wrapping_add(due * tick));
                return Due::Ticks(due as u16);
            }
        }
        self.last_ms = Some(now_ms);
        Due::Jumped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_early_and_lost() {
        let mut clock = TickClock::new(100);
        // The clock wraps on the way.
        let start = u32::MAX - 500;
        let mut at = |ms: i32| clock.due(start.wrapping_add_signed(ms));
        assert_eq!(at(0), Due::Ticks(1));
        assert_eq!(at(149), Due::Ticks(1));
        assert_eq!(at(150), Due::Ticks(1));
        assert_eq!(at(210), Due::Ticks(0));
        assert_eq!(at(110), Due::Ticks(0));
        assert_eq!(at(700), Due::Ticks(5));
        assert_eq!(at(1_250), Due::Jumped);
        assert_eq!(at(1_350), Due::Ticks(1));
        assert_eq!(at(1_249), Due::Jumped);
    }
}
