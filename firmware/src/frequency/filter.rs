//! Moving average of the accepted readings.
//!
//! Over N ticks it lags a ramp by (N - 1)/2 ticks and divides independent noise by √N. N = 1 passes
//! readings through, which is right for a source that averages over a tick itself (zero crossings
//! over 100 ms): every tick of lag acts like a tick of actuation delay.

use crate::wide::divide;

/// Most ticks averaged.
pub const FILTER_TICKS_MAX: usize = 8;

/// Moving average over up to [`FILTER_TICKS_MAX`] ticks.
#[derive(Debug, Clone)]
pub struct Filter {
    /// The last deviations, the newest first.
    samples: [i32; FILTER_TICKS_MAX],
    /// How many of them there are, at most `ticks`.
    known: u8,
    ticks: u8,
}

impl Filter {
    /// A filter over this many ticks, limited to 1..=[`FILTER_TICKS_MAX`].
    pub fn new(ticks: u8) -> Self {
        Self {
            samples: [0; FILTER_TICKS_MAX],
            known: 0,
            ticks: ticks.clamp(1, FILTER_TICKS_MAX as u8),
        }
    }

    /// Lag behind a ramp, in half ticks: N - 1.
    pub const fn lag_half_ticks(&self) -> usize {
        self.ticks as usize - 1
    }

    /// Takes a deviation \[µHz\] and returns the mean of the last N, rounded down; of fewer while
    /// it fills.
    pub fn step(&mut self, deviation_uhz: i32) -> i32 {
        // A few words to move are less code than a ring.
        let mut moved = deviation_uhz;
        for sample in &mut self.samples {
            moved = core::mem::replace(sample, moved);
        }
        self.known = self.ticks.min(self.known + 1);
        if self.ticks == 1 {
            return deviation_uhz;
        }
        // Raised by 2^31, so that nothing is negative and the quotient is rounded down.
        let raised = |sample: &i32| u64::from(sample.wrapping_sub(i32::MIN).cast_unsigned());
        let known = self.samples.iter().take(self.known.into());
        let sum: u64 = known.map(raised).sum();
        divide(sum, self.known.into())
            .cast_signed()
            .wrapping_add(i32::MIN)
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.known = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lags_a_ramp_by_the_stated_time() {
        for ticks in 1..=8 {
            let mut filter = Filter::new(ticks);
            let out = (0..100).map(|k| filter.step(2000 * k)).last();
            let lag = filter.lag_half_ticks() as i32 * 1000;
            assert_eq!(out, Some(99 * 2000 - lag), "{ticks} ticks");
        }
    }

    #[test]
    fn averages_extremes_without_overflow() {
        let mut filter = Filter::new(8);
        assert_eq!(filter.step(i32::MIN), i32::MIN);
        assert_eq!(filter.step(i32::MIN), i32::MIN);
        assert_eq!(filter.step(i32::MAX), -715_827_883);
    }
}
