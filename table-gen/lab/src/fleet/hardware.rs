//! What stands in for a charger's hardware: a frequency meter with its errors, a pilot, a
//! contactor, a power stage.

use core::convert::Infallible;
use core::num::NonZeroU16;
use core::sync::atomic::{AtomicU32, Ordering};
use std::sync::Arc;

use embedded_hal::digital::{ErrorType as PinError, OutputPin};
use embedded_hal::pwm::{ErrorType as PwmError, SetDutyCycle};
use firmware::charger::Watchdog;
use firmware::dispatch::bidirectional::{Bidirectional, PowerStage};
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::dispatch::{Dispatch, DispatchError, Limits, SetPoint};
use firmware::frequency::{FrequencyError, FrequencySource, Reading};
use firmware::units::Participation;
use rand::SeedableRng;
use rand_pcg::Pcg32;

use crate::simulation::chance::{symmetric, unit};

/// A meter that errs, and now and then fails to answer for a while.
#[derive(Debug, Clone)]
pub(super) struct Meter {
    /// True deviation \[µHz\].
    pub(super) f_uhz: i32,
    random: Pcg32,
    noise_uhz: u32,
    /// Probability per tick that an outage begins.
    outage_begins: f64,
    /// Mean length of an outage \[ticks\].
    outage_ticks: f64,
    outage_left: u32,
    /// Ticks without an answer so far.
    pub(super) missed_ticks: u32,
}

impl Meter {
    pub(super) fn new(
        seed: u64,
        serial: u32,
        noise_uhz: u32,
        outage_begins: f64,
        outage_ticks: f64,
    ) -> Self {
        Self {
            f_uhz: 0,
            // Far apart: consecutive seeds would be hashed to unrelated states as well.
            random: Pcg32::seed_from_u64(seed ^ (u64::from(serial) << 32)),
            noise_uhz,
            outage_begins,
            outage_ticks,
            outage_left: 0,
            missed_ticks: 0,
        }
    }
}

impl FrequencySource for Meter {
    fn error_uhz(&self) -> u32 {
        self.noise_uhz
    }

    fn lag_ms(&self) -> u16 {
        0
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        None
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        if self.outage_begins > 0.0 {
            if self.outage_left == 0 && unit(&mut self.random) < self.outage_begins {
                // Exponential, at least a tick.
                let length = -self.outage_ticks * (1.0 - unit(&mut self.random)).ln();
                self.outage_left = length.ceil().clamp(1.0, f64::from(u32::MAX)) as u32;
            }
            if self.outage_left > 0 {
                self.outage_left -= 1;
                self.missed_ticks += 1;
                return Err(FrequencyError::Bus);
            }
        }
        let error = f64::from(self.noise_uhz) * symmetric(&mut self.random);
        Ok(Reading {
            deviation_uhz: self.f_uhz.saturating_add(error.round() as i32),
            age_ms: 0,
        })
    }
}

/// A pilot whose duty nobody reads: the set-point says it all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pwm;

impl PwmError for Pwm {
    type Error = Infallible;
}

impl SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }

    fn set_duty_cycle(&mut self, _duty: u16) -> Result<(), Infallible> {
        Ok(())
    }
}

/// How often a contactor has moved; shared with whoever counts.
#[derive(Debug, Clone, Default)]
pub(super) struct Operations(Arc<AtomicU32>);

impl Operations {
    /// Operations so far.
    pub(super) fn number(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }

    /// Counts from here on.
    pub(super) fn forget(&self) {
        self.0.store(0, Ordering::Relaxed);
    }
}

/// A contactor's coil: the firmware sets its pin only where the contactor is to move.
impl PinError for Operations {
    type Error = Infallible;
}

impl OutputPin for Operations {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

/// A power stage that follows at once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage;

impl PowerStage for Stage {
    type Error = Infallible;

    fn set_power_w(&mut self, _power_w: i32) -> Result<(), Infallible> {
        Ok(())
    }
}

/// No watchdog bites here.
#[derive(Debug, Clone, Copy)]
pub(super) struct NoWatchdog;

impl Watchdog for NoWatchdog {
    fn feed(&mut self) {}
}

/// The firmware's dispatcher of one direction or the other.
#[derive(Debug)]
pub(super) enum Dispatcher {
    Unidirectional(Unidirectional<Pwm, Operations>),
    Bidirectional(Bidirectional<Stage>),
}

impl Dispatcher {
    /// A charger that draws up to a current \[mA\].
    pub(super) fn unidirectional(
        serial: u32,
        limit_ma: u32,
        times: ContactorTimes,
        coil: Operations,
    ) -> Self {
        let threshold = Threshold::of_serial(serial);
        let limits = Limits::all(limit_ma);
        Self::Unidirectional(Unidirectional::new(Pwm, coil, times, threshold, limits))
    }

    /// A charger that draws or feeds up to a power \[W\].
    pub(super) fn bidirectional(limit_w: u32) -> Self {
        let limits = Limits::all(limit_w);
        Self::Bidirectional(Bidirectional::new(Stage, limits, limits))
    }
}

impl Dispatch for Dispatcher {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        match self {
            Self::Unidirectional(dispatch) => dispatch.apply(participation, now_ms),
            Self::Bidirectional(dispatch) => dispatch.apply(participation, now_ms),
        }
    }

    fn rest(&mut self, now_ms: u32) -> Result<SetPoint, DispatchError> {
        match self {
            Self::Unidirectional(dispatch) => dispatch.rest(now_ms),
            Self::Bidirectional(dispatch) => dispatch.rest(now_ms),
        }
    }
}
