//! Measured mains frequency: where it comes from and what is believed of it.
//!
//! A [`FrequencySource`] turns bytes on a bus or timer ticks into a [`Reading`]; the [`gate`]
//! decides whether the reading is believed; the [`filter`] averages what was believed. Whatever is
//! wrong with a reading is a [`FrequencyError`].

pub mod ade7953;
pub mod captures;
pub mod filter;
pub mod gate;
pub mod zero_crossing;

/// The meter of this build's product, by cargo feature: the captures of zero crossings unless a
/// feature names a chip.
#[cfg(feature = "ade7953")]
pub use ade7953 as meter;
#[cfg(not(feature = "ade7953"))]
pub use zero_crossing as meter;

use core::num::NonZeroU16;

/// Nominal frequency of the grids that the shipped specs describe \[Hz\].
pub const NOMINAL_HZ: u32 = Nominal::Hz50.hz();

/// Nominal frequency of a mains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nominal {
    /// Europe, most of Asia, Africa and Australia.
    Hz50,
    /// North America, Korea, parts of Japan.
    Hz60,
}

impl Nominal {
    /// The frequency \[Hz\].
    pub const fn hz(self) -> u32 {
        match self {
            Self::Hz50 => 50,
            Self::Hz60 => 60,
        }
    }
}

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// Deviation from nominal, averaged over the measured interval \[µHz\].
    pub deviation_uhz: i32,
    /// Time since the measured interval ended \[ms\].
    pub age_ms: u16,
}

/// Why a tick has no frequency to go by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrequencyError {
    /// The metering chip did not answer: check wiring and supply.
    Bus,
    /// The controller runs on a clock that its error is not stated for: check the crystal.
    Clock,
    /// No complete measurement yet, or the mains is not there.
    NoSignal,
    /// The last measurement is too old.
    Stale {
        /// Its age \[ms\].
        age_ms: u16,
    },
    /// The same value for longer than the source's noise and resolution allow.
    Stuck {
        /// Ticks for which it has not changed.
        ticks: u16,
    },
    /// Farther from nominal than any public grid runs.
    OutOfRange {
        /// Deviation \[µHz\], saturated.
        deviation_uhz: i32,
    },
    /// A jump that the inertia of the grid forbids.
    Implausible {
        /// Difference from the last accepted reading \[µHz\].
        jump_uhz: u32,
        /// The most that was possible \[µHz\].
        allowed_uhz: u32,
    },
}

/// A source of frequency readings.
///
/// The implementation is responsible for decoding every possible byte or tick into a reading or an
/// error, without panicking or blocking for longer than one bus transfer. The caller is responsible
/// for polling once a tick and for judging the reading ([`gate::Gate`]).
pub trait FrequencySource {
    /// Bound on a reading's error, lag apart \[µHz\]: resolution and clock tolerance.
    fn error_uhz(&self) -> u32;

    /// Delay of the reading behind the frequency of this moment, for a ramp \[ms\]: half the
    /// averaging interval.
    fn lag_ms(&self) -> u16;

    /// Ticks of unchanged readings after which the source is stuck; `None` for sources that may
    /// repeat themselves.
    fn stuck_after(&self) -> Option<NonZeroU16>;

    /// Between the ticks: takes what the hardware has captured, if anything. Sources that are read
    /// when a tick asks have nothing to do here.
    fn poll(&mut self, now_ms: u32) {
        let _ = now_ms;
    }

    /// The latest reading. `now_ms` is the caller's monotonic clock, which may wrap.
    ///
    /// # Errors
    /// [`FrequencyError::Bus`], [`FrequencyError::NoSignal`] or [`FrequencyError::OutOfRange`]; the
    /// rest is the gate's.
    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError>;
}
