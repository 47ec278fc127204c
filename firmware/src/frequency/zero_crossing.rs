//! Frequency from the timer ticks of mains zero crossings.
//!
//! ## Design
//! A timer captures its counter at every positive-going crossing. The frequency is `cycles /
//! (t_last - t_first)` over a window of whole cycles: crossings in between cancel out, and so does
//! an offset of the comparator.
//!
//! ## Phase steps
//! When a line trips or a transformer switches, the phase of the mains steps by some degrees while
//! its frequency goes on. One period is then longer or shorter than its neighbours: a step of 4
//! degrees takes 0.22 ms, which over five cycles looks like 0.11 Hz. A frequency cannot do that: at
//! [`RATE_HZ_PER_S`] two neighbouring periods differ by 16 µs. So a period that differs from the
//! one before by more is taken for a step of the phase. The stamps before it are moved by the
//! excess, as if the phase had been the new one all along. The reading goes on without a delay.
//!
//! A single late crossing is a step there and a step back, and leaves nothing behind. Two steps the
//! same way, one after the other, are no steps: then the window starts again.
//!
//! ## Tradeoffs
//! Five cycles at 50 Hz are 100 ms, one tick of the control loop. The reading lags by half the
//! window (50 ms). Its error is that of [`FrequencySource::error_uhz`]: a timer tick, the jitter of
//! two crossings, the clock. A jitter of 1 µs is worth 1 mHz. While a step is in the window, one of
//! the five periods is the one before it: 2 mHz more in a fall of 0.5 Hz/s.
//!
//! A crossing much less than a period after the last is a glitch and ignored; one much later
//! restarts the window.

use core::num::NonZeroU16;

use super::captures::Captures;
use super::gate::GateLimits;
use super::{FrequencyError, FrequencySource, Nominal, Reading};
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
/// Time without a crossing after which the mains is not there \[ms\]. Younger readings are judged
/// by the gate.
pub const GONE_MS: u32 = 1_000;
/// Fastest change of a frequency that is believed \[Hz/s\], as at the gate.
pub const RATE_HZ_PER_S: u32 = GateLimits::DEFAULT.rate_uhz_per_s / MICRO as u32;

const _: () = assert!(RATE_HZ_PER_S > 0);

const _: () = assert!(CYCLES_MAX as u64 * TIMER_HZ_MAX as u64 / 45 < u32::MAX as u64);

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
        let window = window.with_jitter_ns(C::JITTER_NS);
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
        if self.captures.lost() {
            self.window.restart();
        }
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
    nominal: Nominal,
    cycles: u8,
    clock_ppm: u16,
    jitter_ns: u32,
    /// Shortest and longest period \[timer ticks\].
    shortest: u32,
    longest: u32,
    /// Most by which neighbouring periods differ without a step of the phase \[timer ticks\].
    same: u32,
    /// The last period's excess, if it was taken for a step of the phase; else 0 \[timer ticks\].
    step: i32,
    stamps: heapless::Deque<u32, { CYCLES_MAX + 1 }>,
    last_ms: Option<u32>,
    glitches: u32,
    steps: u32,
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
        let window = Self {
            timer_hz,
            nominal: Nominal::Hz50,
            cycles,
            clock_ppm,
            jitter_ns: 0,
            shortest: 0,
            longest: 0,
            same: 0,
            step: 0,
            stamps: heapless::Deque::new(),
            last_ms: None,
            glitches: 0,
            steps: 0,
        };
        Ok(window.derived())
    }

    /// For crossings that are captured up to so much early or late \[ns\].
    #[must_use]
    pub const fn with_jitter_ns(mut self, jitter_ns: u32) -> Self {
        self.jitter_ns = jitter_ns;
        self.derived()
    }

    /// For a mains of another nominal frequency than 50 Hz; deviations are from that.
    #[must_use]
    pub const fn with_nominal(mut self, nominal: Nominal) -> Self {
        self.nominal = nominal;
        self.derived()
    }

    /// The limits that follow from the settings.
    const fn derived(mut self) -> Self {
        let nominal = self.nominal.hz();
        // Nominal and a tenth of it.
        self.shortest = self.timer_hz / (nominal + nominal / 10);
        self.longest = self.timer_hz / (nominal - nominal / 10);
        // A period is timer / f, so by the rate r it changes by timer r / f³ from one to the next.
        // The excess of a period over the one before takes in three crossings, the middle one
        // twice, and each is rounded to a tick.
        let by_rate = self.timer_hz / (nominal * nominal * nominal / RATE_HZ_PER_S);
        let jitter = 4 * self.jitter_ns as u64 * self.timer_hz as u64;
        self.same = divide(jitter, 1_000_000_000)
            .saturating_add(by_rate)
            .saturating_add(3);
        self
    }

    /// Crossings ignored because they came too early.
    pub const fn glitches(&self) -> u32 {
        self.glitches
    }

    /// Periods taken for a step of the phase.
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// Forgets the window, as after a crossing that was missed.
    pub fn restart(&mut self) {
        self.stamps.clear();
        self.step = 0;
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
                self.restart();
            } else {
                self.follow_phase(period);
            }
        }
        if self.stamps.len() > usize::from(self.cycles) {
            let _oldest = self.stamps.pop_front();
        }
        // There is room: at most `cycles` stamps are left.
        let _ = self.stamps.push_back(stamp);
        self.last_ms = Some(now_ms);
    }

    /// Moves the stamps by what the coming period exceeds the one before it, if that is a step of
    /// the phase.
    fn follow_phase(&mut self, period: u32) {
        let mut newest = self.stamps.iter().rev();
        let (Some(last), Some(before)) = (newest.next(), newest.next()) else {
            return;
        };
        // Both are at most a period: the difference fits.
        let excess = period
            .wrapping_sub(last.wrapping_sub(*before))
            .cast_signed();
        if excess.unsigned_abs() <= self.same {
            self.step = 0;
            return;
        }
        let again = self.step != 0 && (self.step < 0) == (excess < 0);
        if again {
            self.restart();
            return;
        }
        self.step = excess;
        self.steps = self.steps.saturating_add(1);
        for stamp in &mut self.stamps {
            *stamp = stamp.wrapping_add_signed(excess);
        }
    }
}

impl FrequencySource for ZeroCrossing {
    fn error_uhz(&self) -> u32 {
        // A window of n periods 1/f that is wrong by t is n f² t / n² = f² t / n of frequency, for
        // one timer tick and for the jitter of its two ends.
        let nominal = self.nominal.hz();
        let squared = nominal * nominal;
        let cycles = u32::from(self.cycles);
        // More than 32 bits of timer ticks divide to zero, as `u32::MAX` does.
        let window = cycles.saturating_mul(self.timer_hz).max(1);
        let tick = squared.saturating_mul(MICRO as u32) / window + 1;
        let jitter = divide(
            2 * u64::from(squared) * u64::from(self.jitter_ns),
            cycles * 1_000,
        );
        let clock = u32::from(self.clock_ppm) * nominal;
        tick.saturating_add(jitter + 1).saturating_add(clock)
    }

    fn lag_ms(&self) -> u16 {
        (u32::from(self.cycles) * 1000 / self.nominal.hz() / 2) as u16
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        // A capture cannot stand still: without an edge there is no new stamp, and the reading
        // grows old. A mains that runs at exactly its nominal frequency repeats itself, and is
        // healthy.
        None
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
            .wrapping_sub(self.nominal.hz() * MICRO as u32)
            .cast_signed();
        let age = now_ms.wrapping_sub(last_ms);
        if age > GONE_MS {
            return Err(FrequencyError::NoSignal);
        }
        Ok(Reading {
            deviation_uhz,
            age_ms: u16::try_from(age).unwrap_or(u16::MAX),
        })
    }
}

#[cfg(test)]
mod tests;
