//! A configuration from C, checked field by field, as the library takes it.

use core::num::NonZeroU16;

use firmware::charger::{ChargerConfig, Installation, MeterFacts, StartDelay};
use firmware::event::EventEnd;
use firmware::fault::{Faults, ResetCause};
use firmware::frequency::filter::FILTER_TICKS_MAX;
use firmware::frequency::gate::GateLimits;
use firmware::frequency::{FrequencyError, Reading};
use firmware::limit_provider::{Connection, Inputs, PHASES_MAX, ProviderConfig, VOLTAGE_MAX_V};
use firmware::response::LevelOffset;
use firmware::table::Direction;
use firmware::units::MICRO;

use crate::numbers::Status;
use crate::numbers::{self, HOLDFAST_METER_UNKNOWN, HOLDFAST_VERSION, HOLDFAST_WARM_UP_BY_PLANT};
use crate::records::{Config, Input};

/// Largest error and range: 10 Hz.
const FREQUENCY_MOST_UHZ: u32 = 10 * MICRO as u32;

/// Direction of a byte.
const fn direction(byte: u8) -> Option<Direction> {
    match byte {
        0 => Some(Direction::Unidirectional),
        1 => Some(Direction::Bidirectional),
        _ => None,
    }
}

/// What holdfast_default_config gives.
///
/// # Errors
/// Not a direction.
pub fn defaults(direction_byte: u8, serial: u32) -> Result<Config, Status> {
    let reference = match direction(direction_byte) {
        Some(Direction::Unidirectional) => Installation::REFERENCE_UNIDIRECTIONAL,
        Some(Direction::Bidirectional) => Installation::REFERENCE_BIDIRECTIONAL,
        None => return Err(Status::BadDirection),
    };
    let connection = Connection::THREE_PHASES;
    let charger = ChargerConfig::DEFAULT;
    let start = StartDelay::street(serial);
    Ok(Config {
        version: HOLDFAST_VERSION,
        direction: direction_byte,
        phases: connection.phases,
        voltage_v: connection.voltage_v,
        power_w: reference.power_w,
        serial,
        meter_error_uhz: HOLDFAST_METER_UNKNOWN,
        meter_lag_ms: 0,
        stuck_after_ticks: 0,
        tick_most_ms: reference.tick_most_ms,
        hold_ticks: charger.hold_ticks,
        release_ppm: charger.release_ppm,
        range_uhz: charger.gate.range_uhz,
        rate_uhz_per_s: charger.gate.rate_uhz_per_s,
        recovered_uhz: charger.event_end.recovered_uhz,
        recovered_s: charger.event_end.recovered_s,
        recovered_release_s: charger.event_end.release_s,
        age_ms: charger.gate.age_ms,
        warm_up_ticks: HOLDFAST_WARM_UP_BY_PLANT,
        start_fixed_s: start.fixed_s,
        start_random_s: start.random_s,
        filter_ticks: charger.filter_ticks,
        reset_cause: numbers::ResetCause::PowerOn as u8,
        reserved: 0,
    })
}

/// A configuration as the library takes it, and why the controller started.
///
/// # Errors
/// The first field that is wrong.
pub fn checked(config: &Config) -> Result<(ProviderConfig, ResetCause), Status> {
    let check = |ok: bool, status: Status| if ok { Ok(()) } else { Err(status) };
    check(config.version == HOLDFAST_VERSION, Status::WrongVersion)?;
    let direction = direction(config.direction).ok_or(Status::BadDirection)?;
    let phases = (1..=PHASES_MAX).contains(&config.phases);
    let voltage = (1..=VOLTAGE_MAX_V).contains(&config.voltage_v);
    check(phases && voltage, Status::BadConnection)?;
    check(config.power_w > 0, Status::BadPower)?;
    check(config.tick_most_ms > 0, Status::BadTick)?;
    check(
        config.meter_error_uhz <= FREQUENCY_MOST_UHZ,
        Status::BadMeter,
    )?;
    let range = (1..=FREQUENCY_MOST_UHZ).contains(&config.range_uhz);
    let believed = range && config.rate_uhz_per_s > 0 && config.age_ms > 0;
    check(believed, Status::BadGate)?;
    let filter = (1..=FILTER_TICKS_MAX).contains(&usize::from(config.filter_ticks));
    check(filter, Status::BadFilter)?;
    let release = (1..=MICRO as u32).contains(&config.release_ppm);
    check(
        release && config.recovered_release_s > 0,
        Status::BadRelease,
    )?;
    let cause = match config.reset_cause {
        0 => ResetCause::PowerOn,
        1 => ResetCause::BrownOut,
        2 => ResetCause::Watchdog,
        _ => return Err(Status::BadResetCause),
    };
    let charger = ChargerConfig {
        gate: GateLimits {
            range_uhz: config.range_uhz,
            rate_uhz_per_s: config.rate_uhz_per_s,
            age_ms: config.age_ms,
        },
        filter_ticks: config.filter_ticks,
        hold_ticks: config.hold_ticks,
        release_ppm: config.release_ppm,
        warm_up_ticks: (config.warm_up_ticks != HOLDFAST_WARM_UP_BY_PLANT)
            .then_some(config.warm_up_ticks),
        level_offset: LevelOffset::NONE,
        installation: None,
        event_end: EventEnd {
            recovered_uhz: config.recovered_uhz,
            recovered_s: config.recovered_s,
            release_s: config.recovered_release_s,
        },
        start_delay: StartDelay {
            fixed_s: config.start_fixed_s,
            random_s: config.start_random_s,
            seed: config.serial,
        },
        standing_faults: Faults::NONE,
    };
    let provider = ProviderConfig {
        installation: Installation {
            direction,
            power_w: config.power_w,
            tick_most_ms: config.tick_most_ms,
            // How often the pilot changes is the caller's business.
            change_gap_ms: 0,
        },
        connection: Connection {
            phases: config.phases,
            voltage_v: config.voltage_v,
        },
        meter: MeterFacts {
            error_uhz: config.meter_error_uhz,
            lag_ms: config.meter_lag_ms,
        },
        stuck_after: NonZeroU16::new(config.stuck_after_ticks),
        serial: config.serial,
        charger,
    };
    Ok((provider, cause))
}

/// An input as the library takes it: every byte means something.
pub const fn inputs(input: &Input) -> Inputs {
    const NONE: u8 = numbers::Reading::None as u8;
    const VALID: u8 = numbers::Reading::Valid as u8;
    Inputs {
        reading: match input.reading {
            VALID => Ok(Reading {
                deviation_uhz: input.deviation_uhz,
                age_ms: input.age_ms,
            }),
            NONE => Err(FrequencyError::NoSignal),
            _ => Err(FrequencyError::Bus),
        },
        car_present: input.car_present != 0,
        limit_ma: input.limit_ma,
        charge_limit_w: input.charge_limit_w,
        discharge_limit_w: input.discharge_limit_w,
    }
}
