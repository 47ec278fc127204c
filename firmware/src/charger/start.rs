//! When a charger may energise its output: not before it has seen the mains, and not at once.
//!
//! After a reset, and after the mains was gone, nothing is energised until a frequency has been
//! believed and a delay has passed. A part of the delay is the same for all chargers. It covers the
//! time for which a contactor stays open, for nobody knows when it opened before the reset. The
//! rest is drawn at random, so that the chargers of a street do not all return in one moment.

/// Delays after the mains has been seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StartDelay {
    /// Part that is the same for all \[s\].
    pub fixed_s: u16,
    /// Most of the part that is drawn at random \[s\].
    pub random_s: u16,
    /// What chargers differ in: the serial number.
    pub seed: u32,
}

impl StartDelay {
    /// None, for chargers that are simulated from the middle of their life on.
    pub const NONE: Self = Self {
        fixed_s: 0,
        random_s: 0,
        seed: 0,
    };

    /// For a charger in the street: 60 s, the least time for which a contactor stays open, and up
    /// to 600 s, the largest random delay of the UK rules for smart charging.
    pub const fn street(seed: u32) -> Self {
        Self {
            fixed_s: 60,
            random_s: 600,
            seed,
        }
    }

    /// The same for a charger that has started so often: even at the same reading in the same
    /// millisecond it draws anew.
    #[must_use]
    pub const fn after_starts(self, starts: u8) -> Self {
        Self {
            seed: self
                .seed
                .wrapping_add((starts as u32).wrapping_mul(0xC2B2_AE35)),
            ..self
        }
    }

    /// The delay \[ms\], drawn with noise that differs from start to start.
    const fn draw_ms(&self, noise: u32) -> u32 {
        // Two rounds of multiply and shift: every bit of the input reaches the upper bits.
        let mut hash = (self.seed ^ noise.rotate_left(16)).wrapping_mul(0x9E37_79B9);
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x85EB_CA6B);
        hash ^= hash >> 13;
        let random_ms = (hash as u64 * (self.random_s as u64 * 1000 + 1)) >> 32;
        self.fixed_s as u32 * 1000 + random_ms as u32
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// No frequency believed yet.
    Dark,
    /// Seen; energised once the delay has passed.
    Waiting { since_ms: u32, delay_ms: u32 },
    /// May be energised.
    Ready,
}

/// Follows a start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    delay: StartDelay,
    stage: Stage,
}

impl Start {
    /// Before the first reading.
    pub(super) const fn new(delay: StartDelay) -> Self {
        let stage = Stage::Dark;
        Self { delay, stage }
    }

    /// A frequency was believed. Its last digits are noise, and so is the moment.
    pub(super) const fn seen(&mut self, f_uhz: i32, now_ms: u32) {
        if let Stage::Dark = self.stage {
            self.stage = Stage::Waiting {
                since_ms: now_ms,
                delay_ms: self.delay.draw_ms(f_uhz.cast_unsigned() ^ now_ms),
            };
        }
    }

    /// The mains was gone: as before the first reading.
    pub(super) const fn dark(&mut self) {
        self.stage = Stage::Dark;
    }

    /// Whether the output may be energised now.
    pub(super) const fn ready(&mut self, now_ms: u32) -> bool {
        if let Stage::Waiting { since_ms, delay_ms } = self.stage
            && now_ms.wrapping_sub(since_ms) >= delay_ms
        {
            self.stage = Stage::Ready;
        }
        matches!(self.stage, Stage::Ready)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_for_the_mains_then_for_the_delay() {
        let delay = StartDelay {
            fixed_s: 60,
            random_s: 0,
            seed: 1,
        };
        let mut start = Start::new(delay);
        // The clock wraps on the way.
        let zero = u32::MAX - 1_000;
        let at = |ms: u32| zero.wrapping_add(ms);
        assert!(!start.ready(at(900_000)));
        start.seen(-3, at(0));
        assert!(!start.ready(at(59_999)));
        assert!(start.ready(at(60_000)));
        // Once ready, a later reading changes nothing.
        start.seen(5, at(60_100));
        assert!(start.ready(at(60_100)));
        start.dark();
        assert!(!start.ready(at(70_000)));
        start.seen(5, at(70_000));
        assert!(!start.ready(at(129_999)));
        assert!(start.ready(at(130_000)));
    }

    #[test]
    fn without_a_delay_the_first_reading_is_enough() {
        let mut start = Start::new(StartDelay::NONE);
        assert!(!start.ready(0));
        start.seen(0, 100);
        assert!(start.ready(100));
    }

    /// 10 000 chargers with neighbouring serial numbers and the same reading: each minute of the
    /// ten gets its tenth. The share of a minute is binomial with a deviation of sqrt(0.09 n) = 30;
    /// five of them are exceeded once in 1.7 million.
    #[test]
    fn a_street_returns_evenly() {
        let mut minutes = [0u32; 10];
        for serial in 0..10_000 {
            let ms = StartDelay::street(serial).draw_ms(12_345);
            assert!((60_000..=660_000).contains(&ms));
            minutes[((ms - 60_000) / 60_000).min(9) as usize] += 1;
        }
        for count in minutes {
            assert!(count.abs_diff(1_000) <= 150, "{minutes:?}");
        }
    }

    /// The same charger after the same number of milliseconds, the reading differing by a µHz.
    #[test]
    fn one_charger_draws_anew_at_every_start() {
        let delay = StartDelay::street(7);
        let mut drawn: [u32; 16] = core::array::from_fn(|n| delay.draw_ms(n as u32));
        drawn.sort_unstable();
        assert!(drawn.windows(2).all(|pair| pair[0] != pair[1]), "{drawn:?}");
        let mut drawn: [u32; 256] =
            core::array::from_fn(|n| delay.after_starts(n as u8).draw_ms(0));
        drawn.sort_unstable();
        let distinct = drawn.windows(2).filter(|pair| pair[0] != pair[1]).count();
        // 256 of 600 000 values: 0.05 pairs agree on average.
        assert!(distinct >= 253, "{distinct}");
    }
}
