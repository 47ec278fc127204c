//! The preferred law: what the fleet should do where the proof leaves a choice, or always.

use serde::{Deserialize, Serialize};

/// The law that is preferred: droop about a set-point, and an answer to the slope that is let go
/// again. Its equations are those of [`firmware::response`], with powers in GW.
///
/// ```text
/// r(t) = (f(t) - f(t - slope_window)) / slope_window
/// m(t) = max(m(t - tick) - slope_release tick,
///            clamp(slope_gain (-r - slope_threshold), 0, slope_most))
/// u(t) = clamp((droop (setpoint - f) + m) / P, 0, 1)
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PreferenceSpec {
    /// Whether the law itself is the table: a response. Then no games are played. Otherwise the
    /// laws come from games.
    ///
    /// Unit: -. Allowed: true or false. Default: false.
    pub always_on: bool,
    /// Power for each Hz below the set-point.
    ///
    /// Unit: GW/Hz. Allowed: a number from 0 to 1000. Default: 6.
    pub droop_gw_per_hz: f64,
    /// Deviation at which the droop term is zero.
    ///
    /// Unit: Hz. Allowed: a number from -5 to 5. Default: -0.05.
    pub setpoint_hz: f64,
    /// Power for each Hz/s by which f falls faster than the threshold.
    ///
    /// Unit: GW s/Hz. Allowed: a number from 0 to 1000. Default: 2.
    pub slope_gain_gw_s_per_hz: f64,
    /// Fall of f without an answer to the slope.
    ///
    /// Unit: Hz/s. Allowed: a number from 0 to 100. Default: 0.03.
    pub slope_threshold_hz_per_s: f64,
    /// Time over which the slope is taken; a whole number of `sampling.watch_s`, at most 32.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 6.4. Default: 0.5.
    pub slope_window_s: f64,
    /// Largest answer to the slope; at most the fleet's power.
    ///
    /// Unit: GW. Allowed: a number from 0 to 1000. Default: 0.9.
    pub slope_most_gw: f64,
    /// How fast the answer to the slope is let go.
    ///
    /// Unit: GW/s. Allowed: a number from 0 to 1000. Default: 0.05.
    pub slope_release_gw_per_s: f64,
    /// Smallest change of a charger's participation, and the distance of its levels.
    ///
    /// Unit: 1. Allowed: a number from 0.001 to 1. Default: 0.05.
    pub smallest_change: f64,
    /// Laws by games: how fast f should go to the middle of I2 where the game leaves it free. Then
    /// every cell takes the allowed input that is nearest to this, and bytes come last; absent: the
    /// inputs that make the smallest table. For `table.domain = "winning"`.
    ///
    /// Unit: 1/s. Allowed: a number from 0 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery_per_s: Option<f64>,
}

impl Default for PreferenceSpec {
    fn default() -> Self {
        Self {
            always_on: false,
            droop_gw_per_hz: 6.0,
            setpoint_hz: -0.05,
            slope_gain_gw_s_per_hz: 2.0,
            slope_threshold_hz_per_s: 0.03,
            slope_window_s: 0.5,
            slope_most_gw: 0.9,
            slope_release_gw_per_s: 0.05,
            smallest_change: 0.05,
            recovery_per_s: None,
        }
    }
}
