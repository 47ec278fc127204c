//! What goes with a response, and what goes with games only.

use firmware::response::WINDOW_TICKS_MAX;

use super::keys::RECOVERY;
use super::meter::MeterKind;
use super::origin::{Origin, inconsistent};
use super::sampling::to_whole_ms;
use super::{Domain, LossProfile, Spec, SpecError};
use crate::independence::Crowd;
use crate::table_fields;

/// Least H that may be left \[GW s/Hz\].
const INERTIA_LEAST: f64 = 0.1;

/// Checks the preferred law, and that the spec's method covers what is uncertain.
pub(super) fn check(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    if let Some(lost) = spec.uncertainty.inertia_lost_s_per_hz
        && spec.inertia_band()[0] < INERTIA_LEAST
    {
        let key = "uncertainty.inertia_lost_s_per_hz";
        let found = format!(
            "{lost}, which leaves H = {} GW s/Hz",
            spec.inertia_band()[0]
        );
        let allowed = format!("at least {INERTIA_LEAST} GW s/Hz after the largest loss");
        return Err(inconsistent(origin, key, found, allowed));
    }
    if spec.preference.always_on {
        check_law(spec, origin)
    } else {
        check_games(spec, origin)
    }
}

/// A law that the device can hold in whole numbers.
fn check_law(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    if let Some(lost) = spec.uncertainty.inertia_lost_s_per_hz
        && spec.uncertainty.loss_profile != LossProfile::Constant
    {
        let key = "uncertainty.inertia_lost_s_per_hz";
        let found = format!("{lost}, beside a loss that moves (uncertainty.loss_profile)");
        let allowed = "none, or uncertainty.loss_profile = \"constant\": the proof of a response \
                       knows an H that stays what it is after the event";
        return Err(inconsistent(origin, key, found, allowed));
    }
    let preference = &spec.preference;
    if let Some(found) = preference.recovery_per_s {
        let allowed = "none beside preference.always_on = true: no game leaves anything free";
        return Err(inconsistent(origin, RECOVERY, found.to_string(), allowed));
    }
    let watch_ms = spec.sampling.watch_ms().max(1);
    let window_s = preference.slope_window_s;
    let ticks = spec.sampling.ticks_of(window_s);
    let whole = to_whole_ms(window_s).is_some_and(|ms| ms % watch_ms == 0);
    if !whole || ticks == 0 || ticks > WINDOW_TICKS_MAX.into() {
        let found = format!(
            "{window_s} s, beside sampling.watch_s = {} s",
            spec.sampling.watch_s
        );
        let allowed = format!("1 to {WINDOW_TICKS_MAX} whole watch ticks");
        let key = "preference.slope_window_s";
        return Err(inconsistent(origin, key, found, allowed));
    }
    let power_gw = spec.fleet_power_gw();
    if preference.slope_most_gw > power_gw {
        let found = format!("{} GW", preference.slope_most_gw);
        let allowed = format!("at most the fleet's {power_gw} GW");
        let key = "preference.slope_most_gw";
        return Err(inconsistent(origin, key, found, allowed));
    }
    // The device's own limit: the whole fleet within 1 mHz.
    if preference.droop_gw_per_hz > 1e3 * power_gw {
        let found = format!("{} GW/Hz", preference.droop_gw_per_hz);
        let allowed = format!("at most {} GW/Hz for this fleet", 1e3 * power_gw);
        let key = "preference.droop_gw_per_hz";
        return Err(inconsistent(origin, key, found, allowed));
    }
    match table_fields::response(spec) {
        Ok(_) => check_discrepancy(spec, origin).and_then(|()| check_confidence(spec, origin)),
        Err(error) => {
            let found = error.value.to_string();
            Err(inconsistent(origin, error.key, found, error.allowed))
        }
    }
}

/// One charger's offset is an arc of no length: no N chargers are nearer to even than 1/N.
fn check_discrepancy(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let least = 1.0 / f64::from(spec.fleet.chargers.max(1));
    match spec.uncertainty.level_discrepancy {
        Some(found) if found < least => {
            let chargers = spec.fleet.chargers;
            let allowed = format!("at least {least:.3e} for fleet.chargers = {chargers}");
            let key = "uncertainty.level_discrepancy";
            Err(inconsistent(origin, key, found.to_string(), allowed))
        }
        _ => Ok(()),
    }
}

/// Errors of the participation that cover as many independent chargers with the probability that is
/// asked for.
fn check_confidence(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let uncertainty = &spec.uncertainty;
    let Some(confidence) = uncertainty.participation_confidence else {
        return Ok(());
    };
    let Some(time_s) = spec.requirements.horizon_s else {
        let key = "requirements.horizon_s";
        let allowed = "a time, over which uncertainty.participation_confidence is meant";
        return Err(inconsistent(origin, key, "none", allowed));
    };
    let (relative, absolute) = (
        uncertainty.participation,
        uncertainty.participation_absolute,
    );
    let crowd = Crowd::of(spec, time_s);
    if crowd.outside(relative, absolute) <= 1.0 - confidence {
        return Ok(());
    }
    let least = crowd.absolute_error(relative, confidence);
    let found = format!("{absolute}, beside uncertainty.participation = {relative}");
    let allowed = format!(
        "at least {} for {} independent chargers that together decide {} times in {time_s} s, with \
         a probability of {confidence}",
        // As few digits as are read, rounded up.
        (least * 1e5).ceil() / 1e5,
        crowd.chargers,
        crowd.moments
    );
    let key = "uncertainty.participation_absolute";
    Err(inconsistent(origin, key, found, allowed))
}

/// What games do not cover must not be there.
fn check_games(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    if let (Some(found), Domain::Reachable) = (spec.preference.recovery_per_s, spec.table.domain) {
        let allowed = "none beside table.domain = \"reachable\", which follows no preferred law";
        return Err(inconsistent(origin, RECOVERY, found.to_string(), allowed));
    }
    let uncertainty = &spec.uncertainty;
    let is_response = "a response: preference.always_on = true";
    let refuse = |key: &'static str, found: String, other: &str| {
        Err(inconsistent(
            origin,
            key,
            format!("{found}, which games do not cover"),
            format!("{other}, or {is_response}"),
        ))
    };
    if spec.has_plant_band() && spec.requirements.containment_hz.is_none() {
        let key = "requirements.containment_hz";
        let allowed = "a limit of f, since games count a plant in bands for f above it";
        return Err(inconsistent(origin, key, "none".to_owned(), allowed));
    }
    if uncertainty.own_clocks {
        return refuse("uncertainty.own_clocks", "true".to_owned(), "false");
    }
    if uncertainty.participation_absolute > 0.0 {
        let found = uncertainty.participation_absolute.to_string();
        return refuse("uncertainty.participation_absolute", found, "0");
    }
    if let Some(confidence) = uncertainty.participation_confidence {
        let key = "uncertainty.participation_confidence";
        return refuse(key, confidence.to_string(), "none");
    }
    if let Some(discrepancy) = uncertainty.level_discrepancy {
        let key = "uncertainty.level_discrepancy";
        return refuse(key, discrepancy.to_string(), "none");
    }
    if spec.meter.kind != MeterKind::Ideal {
        let found = format!("{:?}", spec.meter.kind.name());
        return refuse("meter.kind", found, "\"ideal\"");
    }
    Ok(())
}
