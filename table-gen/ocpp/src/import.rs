//! Messages to a fallback.
//!
//! Read are a call as OCPP-J sends it, its payload alone, a charging profile alone, or a list of
//! any of them. What the charger cannot do is refused with the field's name if it changes the
//! droop, and named in [`Imported::not_taken`] if it is about the way back.

use firmware::event::EventEnd;
use model::spec::Direction;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::curve::{FieldError, FreqWattCurve};
use crate::export::{NEVER_HZ, WHOLE_PCT};
use crate::fallback::{Fallback, NOMINAL_HZ, deviation_uhz, rounded};
use crate::messages::{
    ChargingProfile, DerCurve, EnterService, FreqDroop, SchedulePeriod, SetChargingProfile,
    SetDerControl,
};

/// Why messages are not taken.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// Not JSON.
    #[error("not JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// A field has a wrong type, is unknown or is missing.
    #[error("{field}: {reason}")]
    Shape {
        /// The field, with its place in the message.
        field: String,
        /// What is wrong.
        reason: String,
    },
    /// A field has a value that the charger cannot follow.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// No message that is known.
    #[error("no SetChargingProfile, ChargingProfile or SetDERControl was found")]
    Nothing,
    /// Two messages say different things.
    #[error("{what}: one message says {first}, another {second}")]
    Differ {
        /// Of what.
        what: &'static str,
        /// The earlier.
        first: String,
        /// The later.
        second: String,
    },
}

/// What messages say; `None` where they do not say it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Imported {
    /// Dead band and slope \[µHz\].
    pub droop_uhz: Option<(u32, u32)>,
    /// Change of power at full response \[W\], and whether it goes past zero.
    pub swing: Option<(f64, Direction)>,
    /// Time constant of the response \[s\].
    pub time_s: Option<f64>,
    /// The event's end.
    pub event_end: Option<EventEnd>,
    /// What was read and cannot be followed, with the field's name.
    pub not_taken: Vec<String>,
}

impl Imported {
    /// Changes a fallback to what the messages say.
    pub fn put_into(&self, fallback: &mut Fallback) {
        if let Some((deadband_uhz, full_uhz)) = self.droop_uhz {
            fallback.deadband_uhz = deadband_uhz;
            fallback.full_uhz = full_uhz;
        }
        if let Some((swing_w, direction)) = self.swing {
            fallback.swing_w = swing_w;
            fallback.direction = direction;
        }
        fallback.time_s = self.time_s.unwrap_or(fallback.time_s);
        fallback.event_end = self.event_end.unwrap_or(fallback.event_end);
    }

    fn note(&mut self, field: &str, value: impl std::fmt::Display, why: &str) {
        self.not_taken.push(format!("{field} = {value}: {why}"));
    }
}

/// Keeps the first of two equal statements.
fn settle<T: PartialEq + std::fmt::Debug>(
    what: &'static str,
    slot: &mut Option<T>,
    said: T,
) -> Result<(), ImportError> {
    match slot {
        Some(first) if *first != said => Err(ImportError::Differ {
            what,
            first: format!("{first:?}"),
            second: format!("{said:?}"),
        }),
        _ => {
            *slot = Some(said);
            Ok(())
        }
    }
}

/// Reads messages.
///
/// # Errors
/// The first field that is not understood or cannot be followed.
pub fn read(text: &str) -> Result<Imported, ImportError> {
    let document: Value = serde_json::from_str(&quote_non_numbers(text))?;
    let mut imported = Imported::default();
    let mut found = 0;
    for payload in payloads(&document) {
        found += take(payload, &mut imported)?;
    }
    if found == 0 {
        return Err(ImportError::Nothing);
    }
    Ok(imported)
}

/// `NaN` and `Infinity` are no JSON, but some programs write them. As texts they are refused where
/// they stand, with the field's name.
fn quote_non_numbers(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut in_string, mut escaped) = (false, false);
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if !in_string
            && let Some(word) = ["NaN", "-Infinity", "Infinity"]
                .into_iter()
                .find(|word| rest.starts_with(word))
        {
            out.push('"');
            out.push_str(word);
            out.push('"');
            rest = &rest[word.len()..];
            continue;
        }
        if c == '"' && !escaped {
            in_string = !in_string;
        }
        escaped = in_string && c == '\\' && !escaped;
        out.push(c);
        rest = &rest[c.len_utf8()..];
    }
    out
}

/// The payloads of a document: of a call, of each element of a list, or the document itself.
fn payloads(document: &Value) -> Vec<&Value> {
    match document {
        Value::Array(items) => match items.as_slice() {
            [
                Value::Number(_),
                Value::String(_),
                Value::String(_),
                payload,
            ] => vec![payload],
            _ => items.iter().flat_map(payloads).collect(),
        },
        other => vec![other],
    }
}

/// Takes one payload; the number of messages that it was.
fn take(payload: &Value, imported: &mut Imported) -> Result<usize, ImportError> {
    if payload.get("chargingProfile").is_some() {
        let message: SetChargingProfile = typed(payload)?;
        profile("chargingProfile.", &message.charging_profile, imported)?;
    } else if payload.get("chargingSchedule").is_some() {
        profile("", &typed::<ChargingProfile>(payload)?, imported)?;
    } else if payload.get("controlType").is_some() {
        control(&typed(payload)?, imported)?;
    } else {
        return Ok(0);
    }
    Ok(1)
}

fn typed<T: DeserializeOwned>(payload: &Value) -> Result<T, ImportError> {
    serde_path_to_error::deserialize(payload).map_err(|error| ImportError::Shape {
        field: error.path().to_string(),
        reason: error.inner().to_string(),
    })
}

fn profile(
    path: &str,
    profile: &ChargingProfile,
    imported: &mut Imported,
) -> Result<(), ImportError> {
    let [schedule] = profile.charging_schedule.as_slice() else {
        let found = format!("{} schedules", profile.charging_schedule.len());
        return Err(FieldError::new(format!("{path}chargingSchedule"), found, "one").into());
    };
    let path = format!("{path}chargingSchedule[0].");
    if schedule.charging_rate_unit != "W" {
        let field = format!("{path}chargingRateUnit");
        let allowed = "W, for a curve gives power";
        return Err(FieldError::new(field, &schedule.charging_rate_unit, allowed).into());
    }
    let [period] = schedule.charging_schedule_period.as_slice() else {
        let found = format!("{} periods", schedule.charging_schedule_period.len());
        let field = format!("{path}chargingSchedulePeriod");
        return Err(FieldError::new(field, found, "one, for a spec knows no schedule").into());
    };
    schedule_period(
        &format!("{path}chargingSchedulePeriod[0]."),
        period,
        imported,
    )
}

fn schedule_period(
    path: &str,
    period: &SchedulePeriod,
    imported: &mut Imported,
) -> Result<(), ImportError> {
    let mode = period.operation_mode.as_deref().unwrap_or("ChargingOnly");
    if mode != "LocalFrequency" {
        let field = format!("{path}operationMode");
        return Err(FieldError::new(field, mode, "LocalFrequency").into());
    }
    let baseline_w = period.v2x_baseline.unwrap_or(0.0);
    let curve = FreqWattCurve::new(path, baseline_w, &period.v2x_freq_watt_curve)?;
    let (droop_uhz, swing_w) = droop_of(path, &curve)?;
    let lowest_w = curve.power_w(0.0);
    let direction = if lowest_w < 0.0 {
        Direction::Bidirectional
    } else {
        Direction::Unidirectional
    };
    settle("droop [µHz]", &mut imported.droop_uhz, droop_uhz)?;
    settle("swing [W]", &mut imported.swing, (swing_w, direction))?;
    let as_exported = Fallback {
        deadband_uhz: droop_uhz.0,
        full_uhz: droop_uhz.1,
        time_s: 0.0,
        swing_w,
        direction,
        event_end: EventEnd::DEFAULT,
    };
    let draw_w = lowest_w + swing_w;
    if draw_w != as_exported.draw_w() {
        let why = "a spec knows the swing, not the draw that it starts from";
        imported.note(&format!("{path}v2xBaseline"), baseline_w, why);
    }
    Ok(())
}

/// Dead band and slope \[µHz\], and swing \[W\], of a curve that is one line between two levels.
fn droop_of(path: &str, curve: &FreqWattCurve) -> Result<((u32, u32), f64), FieldError> {
    let points = curve.points();
    let field = |index: usize, name: &str| format!("{path}v2xFreqWattCurve[{index}].{name}");
    let last = points.len() - 1;
    let (bottom, top) = (points[0].power, points[last].power);
    let swing_w = top - bottom;
    if swing_w <= 0.0 {
        let allowed = format!("above {bottom}, for a fall takes power away");
        return Err(FieldError::new(field(last, "power"), top, allowed));
    }
    let foot = points.iter().rposition(|p| p.power == bottom).unwrap_or(0);
    let head = points.iter().position(|p| p.power == top).unwrap_or(last);
    for (index, point) in points.iter().enumerate() {
        let share = (point.frequency - points[foot].frequency)
            / (points[head].frequency - points[foot].frequency);
        let line_w = bottom + share.clamp(0.0, 1.0) * swing_w;
        // Half a watt: what a rounded table of a line may be off.
        if (point.power - line_w).abs() > 0.5 {
            let allowed = format!("{line_w}, for the droop is one line between two levels");
            return Err(FieldError::new(field(index, "power"), point.power, allowed));
        }
    }
    let begins = deviation_uhz(&field(head, "frequency"), points[head].frequency)?;
    let full = deviation_uhz(&field(foot, "frequency"), points[foot].frequency)?;
    Ok(((begins, full - begins), swing_w))
}

fn control(message: &SetDerControl, imported: &mut Imported) -> Result<(), ImportError> {
    let missing = |field: &str| {
        let found = format!("none in a {}", message.control_type);
        ImportError::Field(FieldError::new(field, found, "its settings"))
    };
    match message.control_type.as_str() {
        "FreqDroop" => {
            let droop = message
                .freq_droop
                .as_ref()
                .ok_or_else(|| missing("freqDroop"))?;
            freq_droop(droop, imported)
        }
        "EnterService" => {
            let service = message.enter_service.as_ref();
            enter_service(service.ok_or_else(|| missing("enterService"))?, imported)
        }
        "FreqWatt" => freq_watt(
            message.curve.as_ref().ok_or_else(|| missing("curve"))?,
            imported,
        ),
        other => {
            let allowed = "FreqDroop, EnterService or FreqWatt";
            Err(FieldError::new("controlType", other, allowed).into())
        }
    }
}

fn freq_droop(droop: &FreqDroop, imported: &mut Imported) -> Result<(), ImportError> {
    let deadband_uhz = deviation_uhz("freqDroop.underFreq", droop.under_freq)?;
    let full_uhz = (droop.under_droop * NOMINAL_HZ * 1e6).round();
    if !(1.0..=5e6).contains(&full_uhz) {
        let allowed = "above 0 to 0.1, relative to 50 Hz";
        return Err(FieldError::new("freqDroop.underDroop", droop.under_droop, allowed).into());
    }
    settle(
        "droop [µHz]",
        &mut imported.droop_uhz,
        (deadband_uhz, full_uhz as u32),
    )?;
    settle(
        "response time [s]",
        &mut imported.time_s,
        time_constant_s("freqDroop.responseTime", droop.response_time)?,
    )?;
    if droop.over_freq < NEVER_HZ {
        imported.note(
            "freqDroop.overFreq",
            droop.over_freq,
            "the charger answers a fall alone",
        );
    }
    Ok(())
}

fn time_constant_s(field: &str, response_time_s: f64) -> Result<f64, FieldError> {
    if (0.0..=1000.0).contains(&response_time_s) {
        Ok(rounded(response_time_s / std::f64::consts::LN_10))
    } else {
        Err(FieldError::new(field, response_time_s, "0 to 1000 s"))
    }
}

/// A whole number of seconds that fits the charger's setting.
fn whole_s(field: &str, value_s: f64) -> Result<u16, FieldError> {
    if (0.0..=65_535.0).contains(&value_s) && (value_s - value_s.round()).abs() < 1e-6 {
        Ok(value_s.round() as u16)
    } else {
        Err(FieldError::new(field, value_s, "whole seconds, 0 to 65535"))
    }
}

fn enter_service(service: &EnterService, imported: &mut Imported) -> Result<(), ImportError> {
    let default = EventEnd::DEFAULT;
    let below = deviation_uhz("enterService.lowFreq", service.low_freq)?;
    let seconds = |field: &str, value: Option<f64>, default: u16| {
        value.map_or(Ok(default), |value_s| whole_s(field, value_s))
    };
    let end = EventEnd {
        recovered_uhz: -(below as i32),
        recovered_s: seconds("enterService.delay", service.delay, default.recovered_s)?,
        release_s: seconds(
            "enterService.rampRate",
            service.ramp_rate,
            default.release_s,
        )?,
    };
    settle("event's end", &mut imported.event_end, end)?;
    if service.high_freq < NEVER_HZ {
        let why = "the charger's way back has no upper bound: above I1 it is faster";
        imported.note("enterService.highFreq", service.high_freq, why);
    }
    if let Some(delay_s) = service.random_delay.filter(|delay_s| *delay_s != 0.0) {
        let why = "the charger's way back is a ramp, not a step to be spread";
        imported.note("enterService.randomDelay", delay_s, why);
    }
    Ok(())
}

fn freq_watt(curve: &DerCurve, imported: &mut Imported) -> Result<(), ImportError> {
    if curve.y_unit != "PctMaxW" {
        return Err(FieldError::new("curve.yUnit", &curve.y_unit, "PctMaxW").into());
    }
    let [full, begins] = curve.curve_data.as_slice() else {
        let found = format!("{} points", curve.curve_data.len());
        return Err(FieldError::new("curve.curveData", found, "two: whole response, none").into());
    };
    for (index, (point, y)) in [(full, WHOLE_PCT), (begins, 0.0)].into_iter().enumerate() {
        if point.y != y {
            let field = format!("curve.curveData[{index}].y");
            return Err(FieldError::new(field, point.y, y.to_string()).into());
        }
    }
    let deadband_uhz = deviation_uhz("curve.curveData[1].x", begins.x)?;
    let full_uhz = deviation_uhz("curve.curveData[0].x", full.x)?;
    if full_uhz <= deadband_uhz {
        let allowed = format!("below {}", begins.x);
        return Err(FieldError::new("curve.curveData[0].x", full.x, allowed).into());
    }
    settle(
        "droop [µHz]",
        &mut imported.droop_uhz,
        (deadband_uhz, full_uhz - deadband_uhz),
    )?;
    if let Some(response_time_s) = curve.response_time {
        let time_s = time_constant_s("curve.responseTime", response_time_s)?;
        settle("response time [s]", &mut imported.time_s, time_s)?;
    }
    let Some(hysteresis) = &curve.hysteresis else {
        return Ok(());
    };
    let default = EventEnd::DEFAULT;
    let low_hz = hysteresis.hysteresis_low.unwrap_or(NOMINAL_HZ);
    let release_s = match hysteresis.hysteresis_gradient {
        None => default.release_s,
        // A gradient is a quotient: to the nearest second.
        Some(gradient) => whole_s(
            "curve.hysteresis.hysteresisGradient",
            (WHOLE_PCT / gradient).round(),
        )?,
    };
    let end = EventEnd {
        recovered_uhz: -(deviation_uhz("curve.hysteresis.hysteresisLow", low_hz)? as i32),
        recovered_s: match hysteresis.hysteresis_delay {
            None => default.recovered_s,
            Some(delay_s) => whole_s("curve.hysteresis.hysteresisDelay", delay_s)?,
        },
        release_s,
    };
    settle("event's end", &mut imported.event_end, end)
}
