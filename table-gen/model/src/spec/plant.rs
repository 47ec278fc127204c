//! The physical system: grid, fleet and droop baseline (the paper's Table I, "The GB Model",
//! "Baseline Controller").

use serde::{Deserialize, Serialize};

use super::GovernorSpec;

/// Grid frequency dynamics:
///
/// ```text
/// f' = (p + P u - w - D f) / 2H          g' = (K f - g) / T_G
/// l' = (g + T_1 g' - l) / T_2            p' = (l - p) / T_t
/// ```
///
/// f is the deviation from 50 Hz; g, l, p are powers in GW. With K < 0 <= D the matrix is never
/// singular (its determinant is proportional to D - K), so every held input has one equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantSpec {
    /// Governor gain K = 1/R_eq: power asked of the turbines per deviation; negative, as they
    /// oppose it. Table I.
    ///
    /// Unit: GW/Hz. Allowed: a number from -100 to below 0. Default: -5.
    pub governor_gain_gw_per_hz: f64,
    /// Governor time constant T_G. Table I.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 1000. Default: 2.5.
    pub governor_time_s: f64,
    /// Turbine time constant T_t. Table I.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 1000. Default: 0.5.
    pub turbine_time_s: f64,
    /// Lead time constant T_1 of the transient droop compensation; 0 makes it a plain lag. Table I.
    ///
    /// Unit: s. Allowed: a number from 0 to 1000. Default: 2.
    pub lead_time_s: f64,
    /// Lag time constant T_2 of the transient droop compensation. Table I.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 1000. Default: 12.
    pub lag_time_s: f64,
    /// Load damping D. Table I.
    ///
    /// Unit: GW/Hz. Allowed: a number from 0 to 1000. Default: 1.
    pub damping_gw_per_hz: f64,
    /// Inertia H; 2H multiplies f', so 4 means 200 GVA s of kinetic energy at 50 Hz. Table I.
    ///
    /// Unit: GW s/Hz. Allowed: a number from 0.001 to 10000. Default: 4.
    pub inertia_gw_s_per_hz: f64,
    /// What the governors cannot do; absent: the linear plant.
    #[serde(skip_serializing_if = "GovernorSpec::is_absent")]
    pub governor: GovernorSpec,
}

impl Default for PlantSpec {
    fn default() -> Self {
        Self {
            governor_gain_gw_per_hz: -5.0,
            governor_time_s: 2.5,
            turbine_time_s: 0.5,
            lead_time_s: 2.0,
            lag_time_s: 12.0,
            damping_gw_per_hz: 1.0,
            inertia_gw_s_per_hz: 4.0,
            governor: GovernorSpec::default(),
        }
    }
}

/// Which way a charger can move power.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Charging can be reduced, at most to nothing.
    Unidirectional,
    /// Charging can be reversed: the car feeds the grid.
    Bidirectional,
}

impl Direction {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["unidirectional", "bidirectional"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Unidirectional => "unidirectional",
            Self::Bidirectional => "bidirectional",
        }
    }
}

/// The fleet of chargers, seen from the grid as one power P u with P = `N_ev` `p_av` and u in [0,
/// 1].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FleetSpec {
    /// Number of chargers taking part, N_ev. Table I.
    ///
    /// Unit: 1. Allowed: a whole number from 1 to 100000000. Default: 25000.
    pub chargers: u32,
    /// Power by which one charger moves the balance at participation 1, p_av: 28 when charging
    /// merely stops, 56 when it reverses. Table I.
    ///
    /// Unit: kW. Allowed: a number from 0.1 to 1000. Default: 56.
    pub power_per_charger_kw: f64,
    /// Which way a charger can move power. Decides how the firmware dispatches; the plant sees only
    /// P.
    ///
    /// Unit: -. Allowed: "unidirectional" or "bidirectional". Default: "bidirectional".
    pub direction: Direction,
}

impl Default for FleetSpec {
    fn default() -> Self {
        Self {
            chargers: 25_000,
            power_per_charger_kw: 56.0,
            direction: Direction::Bidirectional,
        }
    }
}

/// The droop controller of the paper's comparison: e = max(-f - deadband, 0) / R_ev, T_ev q' = e -
/// D q, u = clamp(q, 0, 1), with the plant's D.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BaselineSpec {
    /// Deviation below 50 Hz that brings no response yet. Table II.
    ///
    /// Unit: Hz. Allowed: a number from 0 to 5. Default: 0.15.
    pub deadband_hz: f64,
    /// Deviation past the deadband that brings full participation, R_ev. Table I.
    ///
    /// Unit: Hz. Allowed: a number above 0 to 10. Default: 0.5.
    pub droop_hz: f64,
    /// Response time constant of a charger, T_ev. Table I.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 1000. Default: 0.035.
    pub time_s: f64,
}

impl Default for BaselineSpec {
    fn default() -> Self {
        Self {
            deadband_hz: 0.15,
            droop_hz: 0.5,
            time_s: 0.035,
        }
    }
}
