//! The messages' fields, by the published schemas of OCPP 2.1, edition 1.
//!
//! Fields that a spec has no use for are left out here and refused when they are read: a limit or a
//! set-point in the same period would change what the curve means. `customData` is read and
//! dropped, as the standard lets every receiver do.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// `SetChargingProfileRequest`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct SetChargingProfile {
    /// Charging point; 0 for all of a station.
    pub evse_id: u32,
    /// The profile.
    pub charging_profile: ChargingProfile,
    /// Read and dropped.
    #[serde(default, skip_serializing)]
    pub custom_data: Option<Value>,
}

/// `ChargingProfileType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ChargingProfile {
    /// Number of the profile.
    pub id: i64,
    /// Precedence; higher goes before lower.
    pub stack_level: u32,
    /// `TxDefaultProfile`, for one.
    pub charging_profile_purpose: String,
    /// `Relative`, for one.
    pub charging_profile_kind: String,
    /// Transaction, for a `TxProfile`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transaction_id: Option<String>,
    /// Begin of validity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_from: Option<String>,
    /// End of validity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_to: Option<String>,
    /// The schedules.
    pub charging_schedule: Vec<ChargingSchedule>,
    /// Read and dropped.
    #[serde(default, skip_serializing)]
    pub custom_data: Option<Value>,
}

/// `ChargingScheduleType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ChargingSchedule {
    /// Number of the schedule.
    pub id: i64,
    /// `W`; `A` has no curve.
    pub charging_rate_unit: String,
    /// Begin of an absolute schedule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_schedule: Option<String>,
    /// Length \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<i64>,
    /// The periods.
    pub charging_schedule_period: Vec<SchedulePeriod>,
    /// Read and dropped.
    #[serde(default, skip_serializing)]
    pub custom_data: Option<Value>,
}

/// `ChargingSchedulePeriodType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct SchedulePeriod {
    /// Begin \[s\].
    pub start_period: i64,
    /// `LocalFrequency`: the station goes by its own meter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operation_mode: Option<String>,
    /// Added to the curve \[W\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub v2x_baseline: Option<f64>,
    /// Power by frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub v2x_freq_watt_curve: Vec<FreqWattPoint>,
    /// Read and dropped.
    #[serde(default, skip_serializing)]
    pub custom_data: Option<Value>,
}

/// `V2XFreqWattPointType`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FreqWattPoint {
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Power drawn from the grid \[W\], negative when discharging.
    pub power: f64,
}

/// `SetDERControlRequest` with the kinds of control that a spec can say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct SetDerControl {
    /// Whether it holds until another is set.
    pub is_default: bool,
    /// Name of the control.
    pub control_id: String,
    /// `FreqDroop`, `EnterService` or `FreqWatt`.
    pub control_type: String,
    /// For `FreqDroop`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub freq_droop: Option<FreqDroop>,
    /// For `EnterService`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enter_service: Option<EnterService>,
    /// For `FreqWatt`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<DerCurve>,
    /// Read and dropped.
    #[serde(default, skip_serializing)]
    pub custom_data: Option<Value>,
}

/// `FreqDroopType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct FreqDroop {
    /// 0 is the highest.
    pub priority: u32,
    /// Where the response to a rise begins \[Hz\].
    pub over_freq: f64,
    /// Where the response to a fall begins \[Hz\].
    pub under_freq: f64,
    /// Relative change of frequency for the whole power, rising.
    pub over_droop: f64,
    /// Relative change of frequency for the whole power, falling.
    pub under_droop: f64,
    /// Time to nine tenths of the response \[s\].
    pub response_time: f64,
}

/// `EnterServiceType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct EnterService {
    /// 0 is the highest.
    pub priority: u32,
    /// Highest voltage for the return.
    pub high_voltage: f64,
    /// Lowest voltage for the return.
    pub low_voltage: f64,
    /// Highest frequency for the return \[Hz\].
    pub high_freq: f64,
    /// Lowest frequency for the return \[Hz\].
    pub low_freq: f64,
    /// Time for which the frequency must have been there \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<f64>,
    /// Most of a delay drawn at random \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub random_delay: Option<f64>,
    /// Time of the way back \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp_rate: Option<f64>,
}

/// `DERCurveType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct DerCurve {
    /// 0 is the highest.
    pub priority: u32,
    /// Unit of the curve's second axis.
    pub y_unit: String,
    /// The curve.
    pub curve_data: Vec<CurvePoint>,
    /// The return to ordinary operation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
    /// Time to nine tenths of the response \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response_time: Option<f64>,
}

/// `DERCurvePointsType`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurvePoint {
    /// Frequency \[Hz\].
    pub x: f64,
    /// Response, in the curve's unit.
    pub y: f64,
}

/// `HysteresisType`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct Hysteresis {
    /// Highest frequency for the return \[Hz\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_high: Option<f64>,
    /// Lowest frequency for the return \[Hz\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_low: Option<f64>,
    /// Time for which the frequency must have been there \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_delay: Option<f64>,
    /// Rate of the way back \[%/s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_gradient: Option<f64>,
}

impl SetChargingProfile {
    /// A profile for every transaction, with one schedule of one period that holds this curve.
    pub fn local_frequency(baseline_w: f64, points: Vec<FreqWattPoint>) -> Self {
        let period = SchedulePeriod {
            start_period: 0,
            operation_mode: Some("LocalFrequency".to_owned()),
            v2x_baseline: Some(baseline_w),
            v2x_freq_watt_curve: points,
            custom_data: None,
        };
        let schedule = ChargingSchedule {
            id: 1,
            charging_rate_unit: "W".to_owned(),
            start_schedule: None,
            duration: None,
            charging_schedule_period: vec![period],
            custom_data: None,
        };
        let charging_profile = ChargingProfile {
            id: 1,
            stack_level: 0,
            charging_profile_purpose: "TxDefaultProfile".to_owned(),
            charging_profile_kind: "Relative".to_owned(),
            transaction_id: None,
            valid_from: None,
            valid_to: None,
            charging_schedule: vec![schedule],
            custom_data: None,
        };
        Self {
            evse_id: 0,
            charging_profile,
            custom_data: None,
        }
    }
}

impl SetDerControl {
    /// A default control of a kind, without its settings.
    pub fn default_of(kind: &str) -> Self {
        Self {
            is_default: true,
            control_id: format!("holdfast-{}", kind.to_lowercase()),
            control_type: kind.to_owned(),
            freq_droop: None,
            enter_service: None,
            curve: None,
            custom_data: None,
        }
    }
}
