//! A fallback to messages.
//!
//! | message | says | cannot say |
//! |---|---|---|
//! | `SetChargingProfile`, `LocalFrequency` | draw, droop, swing \[W, Hz\] | the event's end |
//! | `SetDERControl`, `FreqDroop` | droop, response time | the swing; "none to a rise" |
//! | `SetDERControl`, `EnterService` | the event's end | that it stands still while f is low |
//! | `SetDERControl`, `FreqWatt` with `hysteresis` | droop and event's end once more | the same |

use serde::Serialize;
use serde_json::{Value, json};

use crate::fallback::{Fallback, NOMINAL_HZ};
use crate::messages::{
    CurvePoint, DerCurve, EnterService, FreqDroop, FreqWattPoint, Hysteresis, SetChargingProfile,
    SetDerControl,
};

/// A frequency that no grid runs at \[Hz\]: the gate's upper end. The charger does not answer a
/// rise, and its way back has no upper bound.
pub(crate) const NEVER_HZ: f64 = 55.0;
/// EN 50160: 230 V and 10 % either way \[V\]. The charger itself does not look at the voltage.
const VOLTAGE_V: [f64; 2] = [207.0, 253.0];
/// Whole response \[%\].
pub(crate) const WHOLE_PCT: f64 = 100.0;

/// The messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Messages {
    /// The droop as a charging profile.
    pub profile: SetChargingProfile,
    /// The droop as a control of a distributed resource.
    pub freq_droop: SetDerControl,
    /// The event's end.
    pub enter_service: SetDerControl,
    /// Both as a curve.
    pub freq_watt: SetDerControl,
}

impl Messages {
    /// The messages of a fallback.
    pub fn of(fallback: &Fallback) -> Self {
        Self {
            profile: profile(fallback),
            freq_droop: freq_droop(fallback),
            enter_service: enter_service(fallback),
            freq_watt: freq_watt(fallback),
        }
    }

    /// The calls as OCPP-J sends them, with the names of their files.
    ///
    /// # Errors
    /// None for messages that [`Messages::of`] made.
    pub fn calls(&self) -> Result<Vec<(&'static str, Value)>, serde_json::Error> {
        let controls = [
            ("SetDERControl-FreqDroop", &self.freq_droop),
            ("SetDERControl-EnterService", &self.enter_service),
            ("SetDERControl-FreqWatt", &self.freq_watt),
        ];
        let profile = call("SetChargingProfile", "profile", &self.profile)?;
        let mut calls = vec![("SetChargingProfile", profile)];
        for (name, control) in controls {
            calls.push((name, call("SetDERControl", &control.control_id, control)?));
        }
        Ok(calls)
    }
}

/// A call as OCPP-J sends it: message type 2, its id, the action, the payload.
pub(crate) fn call(
    action: &str,
    id: &str,
    payload: &impl Serialize,
) -> Result<Value, serde_json::Error> {
    Ok(json!([2, id, action, serde_json::to_value(payload)?]))
}

fn profile(fallback: &Fallback) -> SetChargingProfile {
    let points = vec![
        FreqWattPoint {
            frequency: fallback.full_hz(),
            power: -fallback.swing_w,
        },
        FreqWattPoint {
            frequency: fallback.begins_hz(),
            power: 0.0,
        },
    ];
    SetChargingProfile::local_frequency(fallback.draw_w(), points)
}

/// Time to nine tenths of the response \[s\]: `T ln 10`.
fn response_time_s(fallback: &Fallback) -> f64 {
    fallback.time_s * std::f64::consts::LN_10
}

fn freq_droop(fallback: &Fallback) -> SetDerControl {
    let droop = f64::from(fallback.full_uhz) / 1e6 / NOMINAL_HZ;
    SetDerControl {
        freq_droop: Some(FreqDroop {
            priority: 0,
            over_freq: NEVER_HZ,
            under_freq: fallback.begins_hz(),
            over_droop: droop,
            under_droop: droop,
            response_time: response_time_s(fallback),
        }),
        ..SetDerControl::default_of("FreqDroop")
    }
}

fn recovered_hz(fallback: &Fallback) -> f64 {
    (NOMINAL_HZ * 1e6 + f64::from(fallback.event_end.recovered_uhz)) / 1e6
}

fn enter_service(fallback: &Fallback) -> SetDerControl {
    let [low_voltage, high_voltage] = VOLTAGE_V;
    SetDerControl {
        enter_service: Some(EnterService {
            priority: 0,
            high_voltage,
            low_voltage,
            high_freq: NEVER_HZ,
            low_freq: recovered_hz(fallback),
            delay: Some(fallback.event_end.recovered_s.into()),
            // The way back is a ramp that every charger takes: nothing steps, so nothing is spread.
            random_delay: Some(0.0),
            ramp_rate: Some(fallback.event_end.release_s.into()),
        }),
        ..SetDerControl::default_of("EnterService")
    }
}

fn freq_watt(fallback: &Fallback) -> SetDerControl {
    let curve_data = vec![
        CurvePoint {
            x: fallback.full_hz(),
            y: WHOLE_PCT,
        },
        CurvePoint {
            x: fallback.begins_hz(),
            y: 0.0,
        },
    ];
    let hysteresis = Hysteresis {
        hysteresis_high: Some(NEVER_HZ),
        hysteresis_low: Some(recovered_hz(fallback)),
        hysteresis_delay: Some(fallback.event_end.recovered_s.into()),
        hysteresis_gradient: Some(WHOLE_PCT / f64::from(fallback.event_end.release_s.max(1))),
    };
    SetDerControl {
        curve: Some(DerCurve {
            priority: 1,
            y_unit: "PctMaxW".to_owned(),
            curve_data,
            hysteresis: Some(hysteresis),
            response_time: Some(response_time_s(fallback)),
        }),
        ..SetDerControl::default_of("FreqWatt")
    }
}
