//! Frequency from the timer ticks of mains zero crossings.
//!
//! ## Design
//! A timer captures its counter at every positive-going crossing. The frequency is `cycles /
//! (t_last - t_first)` over a window of whole cycles: crossings in between cancel out, and so does
//! an offset of the comparator.
//!
//! ## Tradeoffs
//! Five cycles at 50 Hz are 100 ms, one tick of the control loop. The reading lags by half the
//! window (50 ms). One timer tick of uncertainty in the window is `f / (window in ticks)`: 0.5 mHz
//! at 1 MHz, and a crystal of 20 ppm adds a constant 1 mHz. A crossing less than 1/55 s after the
//! last is a glitch and ignored; more than 1/45 s restarts the window.

use core::num::NonZeroU16;

use super::{FrequencyError, FrequencySource, NOMINAL_HZ, Reading};
use crate::board::Hardware;
use crate::units::MICRO;
use crate::wide::divide;

/// Most cycles of a window.
pub const CYCLES_MAX: usize = 16;
/// Cycles of the product's window: 100 ms, one tick.
pub const CYCLES_DEFAULT: u8 = 5;
/// Fastest timer \[Hz\]: a window of [`CYCLES_MAX`] cycles must not wrap 32 bits.
pub const TIMER_HZ_MAX: u32 = 200_000_000;
/// Slowest timer \[Hz\]: below, one timer tick is worth more than 50 mHz over one cycle.
pub const TIMER_HZ_MIN: u32 = 50_000;
/// Readings in a row that may be equal. A window of a real mains differs by timer ticks all the
/// time.
const STUCK_TICKS: u16 = 100;

const _: () = assert!(CYCLES_MAX as u64 * TIMER_HZ_MAX as u64 / 45 < u32::MAX as u64);

/// Hardware that keeps the timer's count at a zero crossing until it is read.
pub trait Captures {
    /// Rate of the timer \[Hz\].
    const TIMER_HZ: u32;
    /// Tolerance of the timer's clock \[ppm\].
    const CLOCK_PPM: u16;

    /// The count at the last crossing, if there was one since the last call.
    fn take(&mut self) -> Option<u32>;
}

/// A window fed by capture hardware.
#[derive(Debug)]
pub struct Captured<C> {
    captures: C,
    window: ZeroCrossing,
}

impl<C: Captures> Captured<C> {
    /// A window of [`CYCLES_DEFAULT`] cycles on this hardware.
    ///
    /// # Errors
    /// The hardware's timer is too slow or too fast.
    pub fn new(captures: C) -> Result<Self, ZeroCrossingError> {
        let window = ZeroCrossing::new(C::TIMER_HZ, CYCLES_DEFAULT, C::CLOCK_PPM)?;
        Ok(Self { captures, window })
    }
}

/// The source on a board's captures; `None` if the board has none that serve.
pub fn on<H: Hardware>(hardware: &mut H) -> Option<Captured<H::Captures>> {
    Captured::new(hardware.captures()?).ok()
}

impl<C: Captures> FrequencySource for Captured<C> {
    fn error_uhz(&self) -> u32 {
        self.window.error_uhz()
    }

    fn lag_ms(&self) -> u16 {
        self.window.lag_ms()
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        self.window.stuck_after()
    }

    fn poll(&mut self, now_ms: u32) {
        if let Some(stamp) = self.captures.take() {
            self.window.capture(stamp, now_ms);
        }
    }

    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError> {
        self.window.read(now_ms)
    }
}

/// Why a capture cannot be set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZeroCrossingError {
    /// The timer is outside [`TIMER_HZ_MIN`]..=[`TIMER_HZ_MAX`].
    TimerRate,
    /// The window is not 1..=[`CYCLES_MAX`] cycles.
    Cycles,
}

/// Window of crossings.
#[derive(Debug, Clone)]
pub struct ZeroCrossing {
    timer_hz: u32,
    cycles: u8,
    clock_ppm: u16,
    shortest: u32,
    longest: u32,
    stamps: heapless::Deque<u32, { CYCLES_MAX + 1 }>,
    last_ms: Option<u32>,
    glitches: u32,
}

impl ZeroCrossing {
    /// A window of `cycles` periods on a timer of this rate \[Hz\] whose clock is good to
    /// `clock_ppm`.
    ///
    /// # Errors
    /// A rate or a number of cycles out of range.
    pub const fn new(timer_hz: u32, cycles: u8, clock_ppm: u16) -> Result<Self, ZeroCrossingError> {
        if timer_hz < TIMER_HZ_MIN || timer_hz > TIMER_HZ_MAX {
            return Err(ZeroCrossingError::TimerRate);
        }
        if cycles == 0 || cycles as usize > CYCLES_MAX {
            return Err(ZeroCrossingError::Cycles);
        }
        Ok(Self {
            timer_hz,
            cycles,
            clock_ppm,
            shortest: timer_hz / 55,
            longest: timer_hz / 45,
            stamps: heapless::Deque::new(),
            last_ms: None,
            glitches: 0,
        })
    }

    /// Crossings ignored because they came too early.
    pub const fn glitches(&self) -> u32 {
        self.glitches
    }

    /// Takes the timer's count at a crossing; `now_ms` is the clock of [`FrequencySource::read`].
    pub fn capture(&mut self, stamp: u32, now_ms: u32) {
        if let Some(last) = self.stamps.back() {
            let period = stamp.wrapping_sub(*last);
            if period < self.shortest {
                self.glitches = self.glitches.saturating_add(1);
                return;
            }
            if period > self.longest {
                self.stamps.clear();
            }
        }
        if self.stamps.len() > usize::from(self.cycles) {
            let _oldest = self.stamps.pop_front();
        }
        // There is room: at most `cycles` stamps are left.
        let _ = self.stamps.push_back(stamp);
        self.last_ms = Some(now_ms);
    }
}

impl FrequencySource for ZeroCrossing {
    fn error_uhz(&self) -> u32 {
        // One timer tick in a window of `cycles` nominal periods: 50 Hz * 50 / (cycles * timer_hz).
        const SQUARED: u32 = NOMINAL_HZ * NOMINAL_HZ * MICRO as u32;
        // More than 32 bits of timer ticks divide to zero, as `u32::MAX` does.
        let window = u32::from(self.cycles).saturating_mul(self.timer_hz);
        SQUARED / window.max(1) + 1 + u32::from(self.clock_ppm) * NOMINAL_HZ
    }

    fn lag_ms(&self) -> u16 {
        u16::from(self.cycles) * 1000 / NOMINAL_HZ as u16 / 2
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        NonZeroU16::new(STUCK_TICKS)
    }

    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError> {
        let (Some(first), Some(last), Some(last_ms)) =
            (self.stamps.front(), self.stamps.back(), self.last_ms)
        else {
            return Err(FrequencyError::NoSignal);
        };
        if self.stamps.len() <= usize::from(self.cycles) {
            return Err(FrequencyError::NoSignal);
        }
        // Not zero: every period of the window was at least `shortest`.
        let window = last.wrapping_sub(*first);
        let ticks = u64::from(self.cycles) * u64::from(self.timer_hz);
        let frequency_uhz = divide(ticks * MICRO as u64, window);
        let deviation_uhz = frequency_uhz
            .wrapping_sub(NOMINAL_HZ * MICRO as u32)
            .cast_signed();
        let age = now_ms.wrapping_sub(last_ms);
        Ok(Reading {
            deviation_uhz,
            age_ms: u16::try_from(age).unwrap_or(u16::MAX),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn source() -> ZeroCrossing {
        ZeroCrossing::new(1_000_000, 5, 0).expect("in range")
    }

    #[test]
    fn reads_whole_windows_across_a_wrap_of_the_timer() {
        let mut source = source();
        let start = u32::MAX - 50_000;
        for k in 0..5 {
            source.capture(start.wrapping_add(20_000 * k), 20 * k);
            assert_eq!(source.read(20 * k), Err(FrequencyError::NoSignal));
        }
        source.capture(start.wrapping_add(100_000), 100);
        let reading = Reading {
            deviation_uhz: 0,
            age_ms: 7,
        };
        assert_eq!(source.read(107), Ok(reading));
        // 25 µs later than nominal: 5e6/100025 - 50 Hz = -12.497 mHz.
        source.capture(start.wrapping_add(120_025), 120);
        assert_eq!(source.read(120).map(|r| r.deviation_uhz), Ok(-12_497));
    }

    #[test]
    fn ignores_glitches_and_restarts_after_a_gap() {
        let mut source = source();
        for k in 0..=5 {
            source.capture(20_000 * k, 0);
            source.capture(20_000 * k + 300, 0);
        }
        assert_eq!(source.glitches(), 6);
        assert_eq!(source.read(0).map(|r| r.deviation_uhz), Ok(0));
        source.capture(140_000, 140);
        assert_eq!(source.read(140), Err(FrequencyError::NoSignal));
    }

    #[test]
    fn error_and_lag_are_those_of_the_tradeoffs() {
        let source = ZeroCrossing::new(1_000_000, 5, 20).expect("in range");
        assert_eq!(source.error_uhz(), 501 + 1000);
        assert_eq!(source.lag_ms(), 50);
    }

    proptest! {
        #[test]
        fn any_ticks_give_a_reading_between_45_and_55_hz_or_an_error(
            stamps in proptest::collection::vec(any::<u32>(), 0..60),
            steps in proptest::collection::vec(17_000u32..24_000, 0..60),
        ) {
            let mut source = source();
            let mut at = 0u32;
            let walk = steps.iter().map(|step| { at = at.wrapping_add(*step); at });
            let all: std::vec::Vec<u32> = stamps.iter().copied().chain(walk).collect();
            for stamp in all {
                source.capture(stamp, stamp);
                if let Ok(reading) = source.read(stamp) {
                    // Each period is within [timer/55, timer/45] rounded down, so 45 Hz to 55 Hz
                    // and a rounding.
                    prop_assert!(reading.deviation_uhz.abs() <= 5_004_000, "{reading:?}");
                }
            }
        }

        #[test]
        fn a_steady_frequency_is_read_within_the_stated_error(
            millihertz in 46_000u64..54_000, offset in any::<u32>(),
        ) {
            let mut source = source();
            for k in 0..=5u64 {
                let stamp = (k * 1_000_000_000 / millihertz) as u32;
                source.capture(offset.wrapping_add(stamp), 0);
            }
            let read = source.read(0).expect("a whole window").deviation_uhz;
            let truth = millihertz as i32 * 1000 - 50_000_000;
            // The stated error is for 50 Hz; one timer tick is worth f²/(50·f0) of it at f,
            // (54/50)² at most.
            let bound = source.error_uhz() * 117 / 100 + 1;
            prop_assert!(read.abs_diff(truth) <= bound, "{read} {truth}");
        }
    }
}
