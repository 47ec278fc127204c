//! What is uncertain, what is to be proved, and what the table covers.

use serde::{Deserialize, Serialize};

use super::DelayRange;
use super::grid::to_micro;

/// How the lost infeed moves inside its band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossProfile {
    /// As an adversary likes, at all times.
    Band,
    /// It steps to one value of the band and stays there.
    Constant,
    /// It steps upwards, at any times.
    NonDecreasing,
}

impl LossProfile {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["band", "constant", "non-decreasing"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Band => "band",
            Self::Constant => "constant",
            Self::NonDecreasing => "non-decreasing",
        }
    }
}

/// Bounds on what is not known exactly. Every bound holds at all times, for an adversary that may
/// vary it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintySpec {
    /// Band [low, high] of the lost infeed w. The paper treats 2 GW as exact.
    ///
    /// Unit: GW. Allowed: 2 numbers, each from -100 to 100. Default: [2, 2].
    pub loss_gw: [f64; 2],
    /// How w moves inside its band. What holds for "band" holds for the others too.
    ///
    /// Unit: -. Allowed: "band" or "constant" or "non-decreasing". Default: "band".
    pub loss_profile: LossProfile,
    /// Relative error of participation: the fleet delivers u (1 +- this), at most 1. The paper
    /// simulates 0.1.
    ///
    /// Unit: 1. Allowed: a number from 0 to below 1. Default: 0.
    pub participation: f64,
    /// Error of participation beside the relative one, as a share of the fleet.
    ///
    /// Unit: 1. Allowed: a number from 0 to below 1. Default: 0.
    pub participation_absolute: f64,
    /// Probability with which [`Self::participation`] and [`Self::participation_absolute`] must
    /// cover the mean of chargers that err independently, over `requirements.horizon_s`
    /// ([`crate::independence`]). Absent: nothing is asked, the errors are a hypothesis.
    ///
    /// Unit: 1. Allowed: a number from 0.5 to 0.999999999999, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub participation_confidence: Option<f64>,
    /// Share of the chargers that does as it likes from the event on: the opposite, nothing, or
    /// whatever harms most. Before it the grid is at rest with them. Absent: none.
    ///
    /// Unit: 1. Allowed: a number from 0 to 1, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hostile_share: Option<f64>,
    /// By how much the share of the fleet whose levels' offsets lie on an arc may differ from the
    /// arc's length, for every arc of the circle \[0, 1): how evenly `preference.smallest_change`
    /// shifts the chargers against each other. N chargers with independent offsets are within
    /// `sqrt(2 ln(2 / p) / N)` but for a probability p, consecutive serial numbers far within. The
    /// fleet is those who respond, hostile ones included, each counted by its power. Absent:
    /// offsets as an adversary likes.
    ///
    /// Unit: 1. Allowed: a number from 0 to 1, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_discrepancy: Option<f64>,
    /// Bound on the error of the state estimate, per state (f, g, l, p).
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from 0 to 10. Default: [0, 0, 0, 0].
    pub measurement: [f64; 4],
    /// Time from a decision to its power: one number for the fleet, or `[least, most]` where each
    /// charger has its own anywhere between, changing as it likes.
    ///
    /// Unit: s. Allowed: a number from 0 to 60, or 2 such numbers. Default: 0.
    pub actuation_delay_s: DelayRange,
    /// H anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: GW s/Hz. Allowed: 2 numbers, each from 0.001 to 10000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia_gw_s_per_hz: Option<[f64; 2]>,
    /// H that goes with each GW of the loss, at most: after it H is lower by anything from nothing
    /// to this times what was lost. Absent: none goes.
    ///
    /// Unit: s/Hz. Allowed: a number from 0 to 10, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia_lost_s_per_hz: Option<f64>,
    /// 1/R_eq anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: GW/Hz. Allowed: 2 numbers, each from -100 to below 0, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub governor_gain_gw_per_hz: Option<[f64; 2]>,
    /// D anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: GW/Hz. Allowed: 2 numbers, each from 0 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_gw_per_hz: Option<[f64; 2]>,
    /// T_G anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0.001 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub governor_time_s: Option<[f64; 2]>,
    /// T_t anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0.001 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turbine_time_s: Option<[f64; 2]>,
    /// T_1 anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lead_time_s: Option<[f64; 2]>,
    /// T_2 anywhere in this, constant, unknown to the charger; absent: the plant's.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0.001 to 1000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_time_s: Option<[f64; 2]>,
    /// Whether each charger decides at moments of its own, on readings of its own.
    ///
    /// Unit: -. Allowed: true or false. Default: false.
    pub own_clocks: bool,
    /// States in which the event may find the grid; must lie inside the grid.
    pub initial: InitialBox,
}

impl UncertaintySpec {
    /// Share of the chargers that does as it likes; 0 where the key is absent.
    #[must_use]
    pub fn hostile(&self) -> f64 {
        self.hostile_share.unwrap_or(0.0)
    }

    /// How far commands may be from their targets on average over a fleet without hostile chargers,
    /// as a share of `smallest_change`: 1 where nothing is known of their levels.
    #[must_use]
    pub fn mean_step_share(&self) -> f64 {
        self.level_discrepancy
            .map_or(1.0, |discrepancy| (0.5 + discrepancy).min(1.0))
    }
}

impl Default for UncertaintySpec {
    fn default() -> Self {
        Self {
            loss_gw: [2.0, 2.0],
            loss_profile: LossProfile::Band,
            participation: 0.0,
            participation_absolute: 0.0,
            participation_confidence: None,
            hostile_share: None,
            level_discrepancy: None,
            measurement: [0.0; 4],
            actuation_delay_s: DelayRange::exactly(0.0),
            inertia_gw_s_per_hz: None,
            inertia_lost_s_per_hz: None,
            governor_gain_gw_per_hz: None,
            damping_gw_per_hz: None,
            governor_time_s: None,
            turbine_time_s: None,
            lead_time_s: None,
            lag_time_s: None,
            own_clocks: false,
            initial: InitialBox::default(),
        }
    }
}

/// A box of states (f, g, l, p).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InitialBox {
    /// Lower corner.
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from -2000 to 2000. Default: [0, 0, 0, 0].
    pub lower: [f64; 4],
    /// Upper corner; may equal the lower one.
    ///
    /// Unit: Hz, GW, GW, GW. Allowed: 4 numbers, each from -2000 to 2000. Default: [0, 0, 0, 0].
    pub upper: [f64; 4],
}

/// The claims to be proved. Frequencies are deviations from 50 Hz.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RequirementsSpec {
    /// The requirements as one formula of temporal logic ([`crate::logic`]); it gives the keys
    /// below that it speaks of, and any that is given as well must agree. Absent: the keys alone.
    ///
    /// Unit: -. Allowed: a formula in the supported fragment, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formula: Option<String>,
    /// f stays at or above this, always; absent: no such claim. The paper's psi_1 has -0.8. Below
    /// `outer_hz`.
    ///
    /// Unit: Hz. Allowed: a number from -10 to 0, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub containment_hz: Option<f64>,
    /// The larger target I1 = [low, high]: C1 brings f back into it. Whole µHz, inside the grid.
    /// The paper's "Simulations with a Multi-phase Controller".
    ///
    /// Unit: Hz. Allowed: 2 numbers, each from -10 to 10. Default: [-0.3, 0].
    pub outer_hz: [f64; 2],
    /// The smaller target I2 = [low, high]: C2 brings f into it. Whole µHz, inside I1, which it may
    /// equal. The paper's "Simulations with a Multi-phase Controller".
    ///
    /// Unit: Hz. Allowed: 2 numbers, each from -10 to 10. Default: [-0.15, 0].
    pub inner_hz: [f64; 2],
    /// Time from leaving I1 within which f is in I2. The paper's psi_3.
    ///
    /// Unit: s. Allowed: a number above 0 to 86400. Default: 60.
    pub settle_within_s: f64,
    /// Whether f, once in I2, must stay there for ever (adds the law Hold).
    ///
    /// Unit: -. Allowed: true or false. Default: false.
    pub stay: bool,
    /// Time from the event over which the claims are made; absent: for ever.
    ///
    /// Unit: s. Allowed: a number above 0 to 86400, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub horizon_s: Option<f64>,
    /// Most changes of a charger's command, of 5 % of full scale and more, in any 300 s; absent: no
    /// such claim.
    ///
    /// Unit: 1. Allowed: a number from 0 to 1000000, or none. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes_per_300_s: Option<f64>,
}

impl Default for RequirementsSpec {
    fn default() -> Self {
        Self {
            formula: None,
            containment_hz: None,
            outer_hz: [-0.30, 0.0],
            inner_hz: [-0.15, 0.0],
            settle_within_s: 60.0,
            stay: false,
            horizon_s: None,
            changes_per_300_s: None,
        }
    }
}

impl RequirementsSpec {
    /// [`Self::outer_hz`] in µHz, as the device compares it.
    #[must_use]
    pub fn outer_micro(&self) -> [i32; 2] {
        micro(self.outer_hz)
    }

    /// [`Self::inner_hz`] in µHz, as the device compares it.
    #[must_use]
    pub fn inner_micro(&self) -> [i32; 2] {
        micro(self.inner_hz)
    }
}

fn micro(interval_hz: [f64; 2]) -> [i32; 2] {
    interval_hz.map(|f_hz| to_micro(f_hz).clamp(i32::MIN.into(), i32::MAX.into()) as i32)
}

/// Which cells the table answers for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Domain {
    /// Every winning cell.
    Winning,
    /// Only what the closed loop can reach from `uncertainty.initial`.
    Reachable,
}

impl Domain {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["winning", "reachable"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Winning => "winning",
            Self::Reachable => "reachable",
        }
    }
}

/// What the table covers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TableSpec {
    /// Which cells the table answers for.
    ///
    /// Unit: -. Allowed: "winning" or "reachable". Default: "winning".
    pub domain: Domain,
    /// Version of the table: one that replaces another has a larger number.
    ///
    /// Unit: 1. Allowed: a whole number from 0 to 4294967295. Default: 1.
    pub version: u32,
}

impl Default for TableSpec {
    fn default() -> Self {
        Self {
            domain: Domain::Winning,
            version: 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_exact_on_the_device() {
        let requirements = RequirementsSpec::default();
        assert_eq!(requirements.outer_micro(), [-300_000, 0]);
        assert_eq!(requirements.inner_micro(), [-150_000, 0]);
    }
}
