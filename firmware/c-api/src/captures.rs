//! The functions of a window of zero crossings: from time stamps of a timer to readings.

use core::ffi::c_void;

use firmware::frequency::zero_crossing::{ZeroCrossing, ZeroCrossingError};
use firmware::frequency::{FrequencyError, FrequencySource, Nominal};

use crate::memory::{self, Resident};
use crate::numbers::{Reading, Status};
use crate::records::{CapturesConfig, Config, Input};

/// Largest jitter that is taken: 1 ms.
const JITTER_MOST_NS: u32 = 1_000_000;
/// Worst clock that is taken.
const CLOCK_MOST_PPM: u16 = 1_000;

/// Memory of a window of zero crossings, as that of a provider.
#[derive(Debug)]
#[repr(C)]
pub struct Captures {
    /// Not for the caller.
    pub words: [usize; 40],
}

impl Resident for ZeroCrossing {
    type Memory = Captures;
    const MARK: u32 = 0x486C_6443;
}

fn window(config: &CapturesConfig) -> Result<ZeroCrossing, Status> {
    let nominal = match config.nominal_hz {
        50 => Nominal::Hz50,
        60 => Nominal::Hz60,
        _ => return Err(Status::BadNominal),
    };
    if config.jitter_ns > JITTER_MOST_NS || config.clock_ppm > CLOCK_MOST_PPM {
        return Err(Status::BadClock);
    }
    match ZeroCrossing::new(config.timer_hz, config.cycles, config.clock_ppm) {
        Ok(window) => Ok(window
            .with_jitter_ns(config.jitter_ns)
            .with_nominal(nominal)),
        Err(ZeroCrossingError::TimerRate) => Err(Status::BadTimer),
        Err(ZeroCrossingError::Cycles) => Err(Status::BadCycles),
    }
}

/// Bytes of a holdfast_captures, as the library has it.
#[unsafe(no_mangle)]
pub extern "C" fn holdfast_captures_size() -> usize {
    size_of::<Captures>()
}

/// Makes a window of zero crossings in the caller's memory of `size` bytes, and fills the meter's
/// fields of the provider's configuration: error and lag.
///
/// # Safety
/// Each pointer is NULL or as described, and nobody else uses the memory during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_captures_init(
    captures: *mut c_void,
    size: usize,
    captures_config: *const CapturesConfig,
    config: *mut Config,
) -> Status {
    // SAFETY: the caller's promises are those of `read`, `place` and `write`.
    let made = unsafe {
        memory::read(captures_config).and_then(|captures_config| {
            let window = window(&captures_config)?;
            let mut told = memory::read(config)?;
            told.meter_error_uhz = window.error_uhz();
            told.meter_lag_ms = window.lag_ms();
            told.stuck_after_ticks = 0;
            memory::place(captures, size, window)?;
            memory::write(config, told)
        })
    };
    match made {
        Ok(()) => Status::Ok,
        Err(status) => status,
    }
}

/// Takes the timer's count at a positive-going crossing, seen at `now_ms` of the clock of the
/// ticks.
///
/// # Safety
/// `captures` is NULL, or zeroed or initialised memory of that type that nobody else uses during
/// the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_captures_add(
    captures: *mut Captures,
    stamp: u32,
    now_ms: u32,
) -> Status {
    // SAFETY: the caller's promise is that of `resident`.
    match unsafe { memory::resident::<ZeroCrossing>(captures) } {
        Ok(window) => {
            window.capture(stamp, now_ms);
            Status::Ok
        }
        Err(status) => status,
    }
}

/// A crossing was captured and lost before it was taken: the window starts again.
///
/// # Safety
/// As for holdfast_captures_add.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_captures_lost(captures: *mut Captures) -> Status {
    // SAFETY: the caller's promise is that of `resident`.
    match unsafe { memory::resident::<ZeroCrossing>(captures) } {
        Ok(window) => {
            window.restart();
            Status::Ok
        }
        Err(status) => status,
    }
}

/// Fills the time and the reading of an input: now_ms, deviation_uhz, age_ms and reading.
///
/// # Safety
/// As for holdfast_captures_add; `input` is NULL or an input that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_captures_read(
    captures: *mut Captures,
    now_ms: u32,
    input: *mut Input,
) -> Status {
    // SAFETY: the caller's promises are those of `resident`, `read` and `write`.
    let filled = unsafe {
        memory::resident::<ZeroCrossing>(captures).and_then(|window| {
            let mut told = memory::read(input)?;
            told.now_ms = now_ms;
            match window.read(now_ms) {
                Ok(reading) => {
                    told.reading = Reading::Valid as u8;
                    told.deviation_uhz = reading.deviation_uhz;
                    told.age_ms = reading.age_ms;
                }
                Err(FrequencyError::NoSignal) => told.reading = Reading::None as u8,
                Err(_) => told.reading = Reading::MeterFailed as u8,
            }
            memory::write(input, told)
        })
    };
    match filled {
        Ok(()) => Status::Ok,
        Err(status) => status,
    }
}
