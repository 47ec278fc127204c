//! The spec in the whole numbers of a table: plant, droop, hypotheses and the law of a response.
//!
//! Generator and verifier both take them from here, so a header can be held against its spec.

use firmware::droop::Droop;
use firmware::response::ResponseLaw;
use firmware::table::{Direction, Hypotheses, LossProfile, PlantParameters};

use crate::spec::{self, Spec};

/// A number of the spec that does not fit the table's field.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{key} = {value} does not fit the table: {allowed}")]
pub struct FieldError {
    /// Key of the spec.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What fits.
    pub allowed: &'static str,
}

/// A number in whole units of the table.
fn whole(key: &'static str, value: f64, scale: f64) -> Result<u32, FieldError> {
    let scaled = (value * scale).round();
    if (0.0..=f64::from(i32::MAX)).contains(&scaled) {
        return Ok(scaled as u32);
    }
    let allowed = "a number from 0 that fits 31 bits in the table's unit";
    Err(FieldError {
        key,
        value,
        allowed,
    })
}

/// The same with a sign.
fn signed(key: &'static str, value: f64, scale: f64) -> Result<i32, FieldError> {
    let size = whole(key, value.abs(), scale)?.cast_signed();
    Ok(if value < 0.0 { -size } else { size })
}

/// A time in ms.
fn ms(key: &'static str, value_ms: f64) -> Result<u16, FieldError> {
    let rounded = value_ms.round();
    if (0.0..=f64::from(u16::MAX)).contains(&rounded) {
        return Ok(rounded as u16);
    }
    let allowed = "0 to 65535 ms";
    Err(FieldError {
        key,
        value: value_ms,
        allowed,
    })
}

/// A range of times in ms, outward.
fn ms_range(key: &'static str, [least, most]: [f64; 2]) -> Result<[u16; 2], FieldError> {
    // Sums of decimal times are off by their last bits.
    const NOISE_MS: f64 = 1e-6;
    Ok([
        ms(key, (least + NOISE_MS).floor())?,
        ms(key, (most - NOISE_MS).ceil())?,
    ])
}

/// Parts per million of 1, micro-units of a unit.
const MICRO: f64 = 1e6;

/// The plant for the observer.
///
/// # Errors
/// A number that does not fit its field.
pub fn plant(spec: &Spec) -> Result<PlantParameters, FieldError> {
    let plant = &spec.plant;
    let micro = |key, value| whole(key, value, MICRO);
    Ok(PlantParameters {
        governor_gain_kw_per_hz: signed(
            "plant.governor_gain_gw_per_hz",
            plant.governor_gain_gw_per_hz,
            MICRO,
        )?,
        governor_time_us: micro("plant.governor_time_s", plant.governor_time_s)?,
        turbine_time_us: micro("plant.turbine_time_s", plant.turbine_time_s)?,
        lead_time_us: micro("plant.lead_time_s", plant.lead_time_s)?,
        lag_time_us: micro("plant.lag_time_s", plant.lag_time_s)?,
        damping_kw_per_hz: micro("plant.damping_gw_per_hz", plant.damping_gw_per_hz)?,
        inertia_kw_s_per_hz: micro("plant.inertia_gw_s_per_hz", plant.inertia_gw_s_per_hz)?,
        fleet_kw: micro("fleet.chargers", spec.fleet_power_gw())?,
    })
}

/// The fallback. The baseline's droop rests at e / (R_ev D); with D = 0 its integrator saturates at
/// once.
///
/// # Errors
/// A number that does not fit its field.
pub fn droop(spec: &Spec) -> Result<Droop, FieldError> {
    let baseline = &spec.baseline;
    let full_hz = baseline.droop_hz * spec.plant.damping_gw_per_hz;
    Ok(Droop {
        deadband_uhz: whole("baseline.deadband_hz", baseline.deadband_hz, MICRO)?,
        full_uhz: whole("baseline.droop_hz", full_hz, MICRO)?.max(1),
    })
}

/// What the header says that the proof assumed. `generator` is left 0.
///
/// # Errors
/// A number that does not fit its field.
pub fn hypotheses(spec: &Spec) -> Result<Hypotheses, FieldError> {
    let uncertainty = &spec.uncertainty;
    let mut estimate_error = [0; 4];
    for (stored, error) in estimate_error.iter_mut().zip(uncertainty.measurement) {
        *stored = whole("uncertainty.measurement", error, MICRO)?;
    }
    let [lag_least, lag_most] = spec.meter.lag_ms();
    let [delay_least, delay_most] = spec.command_delay_s();
    let [loss_low, loss_high] = uncertainty.loss_gw;
    let inertia = spec.inertia_band();
    let gain = spec.governor_gain_band();
    let damping = spec.damping_band();
    let lag = "meter.latest_age_ms";
    let delay = "uncertainty.actuation_delay_s";
    let loss = "uncertainty.loss_gw";
    Ok(Hypotheses {
        estimate_error,
        meter_lag_ms: ms_range(lag, [lag_least, lag_most])?,
        actuation_delay_ms: ms_range(delay, [1e3 * delay_least, 1e3 * delay_most])?,
        participation_relative_ppm: whole(
            "uncertainty.participation",
            uncertainty.participation,
            MICRO,
        )?,
        participation_absolute_ppm: whole(
            "uncertainty.participation_absolute",
            uncertainty.participation_absolute,
            MICRO,
        )?,
        loss_kw: [
            signed(loss, loss_low, MICRO)?,
            signed(loss, loss_high, MICRO)?,
        ],
        loss_profile: match uncertainty.loss_profile {
            spec::LossProfile::Band => LossProfile::Band,
            spec::LossProfile::Constant => LossProfile::Constant,
            spec::LossProfile::NonDecreasing => LossProfile::NonDecreasing,
        },
        direction: match spec.fleet.direction {
            spec::Direction::Unidirectional => Direction::Unidirectional,
            spec::Direction::Bidirectional => Direction::Bidirectional,
        },
        own_clocks: uncertainty.own_clocks,
        tick_most_ms: ms("sampling.watch_s", f64::from(spec.sampling.watch_ms()))?,
        inertia_kw_s_per_hz: [
            whole("uncertainty.inertia_gw_s_per_hz", inertia[0], MICRO)?,
            whole("uncertainty.inertia_gw_s_per_hz", inertia[1], MICRO)?,
        ],
        governor_gain_kw_per_hz: [
            signed("uncertainty.governor_gain_gw_per_hz", gain[0], MICRO)?,
            signed("uncertainty.governor_gain_gw_per_hz", gain[1], MICRO)?,
        ],
        damping_kw_per_hz: [
            whole("uncertainty.damping_gw_per_hz", damping[0], MICRO)?,
            whole("uncertainty.damping_gw_per_hz", damping[1], MICRO)?,
        ],
        power_per_charger_w: whole(
            "fleet.power_per_charger_kw",
            spec.fleet.power_per_charger_kw,
            1e3,
        )?,
        chargers: spec.fleet.chargers,
        table_version: spec.table.version,
        generator: 0,
    })
}

/// The response of a spec, if its preferred law is always on: the parameters in whole numbers,
/// rounded to the nearest.
///
/// # Errors
/// A number that does not fit its field.
pub fn response(spec: &Spec) -> Result<Option<ResponseLaw>, FieldError> {
    let preference = &spec.preference;
    if !preference.always_on {
        return Ok(None);
    }
    let share = MICRO / spec.fleet_power_gw();
    let tick_s = f64::from(spec.sampling.watch_ms()) / 1e3;
    let release = preference.slope_release_gw_per_s * tick_s;
    Ok(Some(ResponseLaw {
        droop_gain_ppm_per_hz: whole(
            "preference.droop_gw_per_hz",
            preference.droop_gw_per_hz,
            share,
        )?,
        setpoint_uhz: signed("preference.setpoint_hz", preference.setpoint_hz, MICRO)?,
        slope_gain_ppm_s_per_hz: whole(
            "preference.slope_gain_gw_s_per_hz",
            preference.slope_gain_gw_s_per_hz,
            share,
        )?,
        slope_threshold_uhz_per_s: whole(
            "preference.slope_threshold_hz_per_s",
            preference.slope_threshold_hz_per_s,
            MICRO,
        )?,
        // At most 32: checked with the spec.
        window_ticks: spec.sampling.ticks_of(preference.slope_window_s) as u16,
        slope_most_ppm: whole("preference.slope_most_gw", preference.slope_most_gw, share)?,
        release_ppm: whole(
            "preference.slope_release_gw_per_s",
            release.min(spec.fleet_power_gw()),
            share,
        )?,
        smallest_change_ppm: whole(
            "preference.smallest_change",
            preference.smallest_change,
            MICRO,
        )?,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bidirectional_response_in_whole_numbers() {
        let set = ["preference.always_on=true".to_owned()];
        let spec = Spec::load("paper-bi", &set).unwrap();
        // P = 1.4 GW: 6/1.4, 2/1.4, 0.9/1.4, and 0.05 GW/s over 0.1 s.
        let law = response(&spec).unwrap().unwrap();
        assert_eq!(law.droop_gain_ppm_per_hz, 4_285_714);
        assert_eq!(law.setpoint_uhz, -50_000);
        assert_eq!(law.slope_gain_ppm_s_per_hz, 1_428_571);
        assert_eq!(law.slope_threshold_uhz_per_s, 30_000);
        assert_eq!(law.window_ticks, 5);
        assert_eq!(law.slope_most_ppm, 642_857);
        assert_eq!(law.release_ppm, 3_571);
        assert_eq!(law.smallest_change_ppm, 50_000);
        assert_eq!(response(&Spec::default()).unwrap(), None);
    }

    #[test]
    fn the_papers_hypotheses_are_the_firmwares() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let found = hypotheses(&spec).unwrap();
        let table_version = spec.table.version;
        assert_eq!(
            found,
            Hypotheses {
                table_version,
                ..Hypotheses::PAPER
            }
        );
    }
}
