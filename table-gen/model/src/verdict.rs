//! The answer: what was proven, of which bytes, for which spec.
//!
//! The verifier writes it, commands and report read it; `verdict.json` is this value, both ways.

use std::borrow::Cow;
use std::fmt;

use firmware::phase::Phase;
use serde::{Deserialize, Serialize};

/// The verdict on a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Whether every claim holds.
    pub verified: bool,
    /// Name of the spec.
    pub spec: String,
    /// The claims, each with the bound that was found.
    pub claims: Vec<Claim>,
    /// Distinct cells (with their phase, where sets were carried in time) in which a decision can
    /// be made.
    pub reachable_cells: u64,
    /// For a claim that does not hold: how it fails.
    pub counterexample: Option<Counterexample>,
    /// Share of the chargers that was assumed to do as it likes; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hostile_share: Option<f64>,
    /// What of the plant lies in bands, in words; empty where the spec knows it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plant: Vec<String>,
    /// Hash of the spec (as in the table's header), hexadecimal.
    pub spec_hash: String,
    /// Hash of the spec that the table was made for, hexadecimal.
    pub table_spec_hash: String,
    /// SHA-256 of the table's bytes, hexadecimal.
    pub table_sha256: String,
    /// Length of the table.
    pub table_bytes: usize,
    /// How the claims were examined.
    pub method: Method,
    /// Sizes of the exploration.
    pub counts: Counts,
    /// Version of the verifier.
    pub tool_version: String,
    /// The first failure of each kind by sets, most important first: candidates for
    /// [`Verdict::counterexample`], not part of the JSON.
    #[serde(skip)]
    pub failures: Vec<Counterexample>,
}

/// How claims are examined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// The verifier's bounds of what the device knows do not hold for this table.
    #[serde(rename = "not explored")]
    NotExplored,
    /// Tables with Hold: whole cells, for ever.
    #[serde(rename = "closed set of cells")]
    ClosedSet,
    /// Tables without Hold: over the horizon.
    #[serde(rename = "tight sets in time")]
    TightSets,
    /// Tables that are a response: a whole fleet, for ever.
    #[serde(rename = "bounds of a whole fleet")]
    FleetBounds,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotExplored => "not explored",
            Self::ClosedSet => "closed set of cells",
            Self::TightSets => "tight sets in time",
            Self::FleetBounds => "bounds of a whole fleet",
        })
    }
}

/// What a verdict claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimName {
    /// The table's header says what the spec says.
    Header,
    /// f stays above its lowest allowed value.
    Containment,
    /// From outside I1, f comes back into I1.
    ReachOuter,
    /// From I1, f comes into I2.
    ReachInner,
    /// C1 hands over to C2 where it should.
    HandOver,
    /// I2 is reached in time.
    Settle,
    /// Once Hold is in force, f stays in I2.
    Stay,
    /// Every reachable state has an entry, and lookups are as short as stated.
    Table,
    /// The meter errs by no more than is assumed.
    Observer,
    /// Pilot, contactor and cars err by no more than is assumed.
    Dispatch,
    /// A product of this repository is what the table assumes.
    Image,
    /// The droop alone keeps f above 49.2 Hz.
    Fallback,
    /// A charger's command changes seldom.
    Quiet,
}

impl ClaimName {
    /// The name as people and JSON read it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Header => "header",
            Self::Containment => "containment",
            Self::ReachOuter => "reach-outer",
            Self::ReachInner => "reach-inner",
            Self::HandOver => "hand-over",
            Self::Settle => "settle",
            Self::Stay => "stay",
            Self::Table => "table",
            Self::Observer => "observer",
            Self::Dispatch => "dispatch",
            Self::Image => "image",
            Self::Fallback => "fallback",
            Self::Quiet => "quiet",
        }
    }
}

impl fmt::Display for ClaimName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// One claim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Which one.
    pub name: ClaimName,
    /// Whether it is proven.
    pub holds: bool,
    /// The bound that was found, in `unit`; absent if there is none.
    pub bound: Option<f64>,
    /// What the bound must not pass, if the spec says so.
    pub limit: Option<f64>,
    /// Unit of bound and limit.
    pub unit: Cow<'static, str>,
    /// The claim in words.
    pub statement: String,
    /// Why it does not hold.
    pub reason: Option<String>,
}

/// Sizes of an exploration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Sets carried in time.
    pub sets: u64,
    /// Decisions looked up.
    pub lookups: u64,
    /// Cells in which No control can end (tables with Hold).
    pub first_cells: u64,
    /// Longest time from the event to I2 \[s\]; absent if not bounded.
    pub event_to_inner_s: Option<f64>,
    /// Lowest and highest deviation while Hold is in force \[Hz\].
    pub held_hz: Option<[f64; 2]>,
    /// Highest deviation at any time \[Hz\].
    pub highest_hz: Option<f64>,
}

/// How a claim fails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Counterexample {
    /// The claim.
    pub claim: ClaimName,
    /// What happens.
    pub what: String,
    /// The sets that lead there. They contain every real trajectory, so without a real one the
    /// claim is open.
    pub path: Vec<ShownStep>,
    /// A real trajectory that breaks the claim, with the firmware's control loop; absent if none
    /// was found, and the claim is then not proven rather than refuted.
    pub real: Option<RealPath>,
}

/// One step of a counterexample's path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownStep {
    /// Time from the first tick after the event \[s\].
    pub time_s: f64,
    /// Law in force from then on.
    #[serde(with = "phase_by_name")]
    pub phase: Phase,
    /// Input level from then on.
    pub level: u8,
    /// Cell of the measured state, where one was looked up.
    pub cell: Option<[u16; 4]>,
    /// Lowest deviation of the set \[Hz\].
    pub f_low_hz: f64,
    /// Highest deviation of the set \[Hz\].
    pub f_high_hz: f64,
}

/// A real trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealPath {
    /// How it breaks the claim.
    pub what: String,
    /// Time from the event to the breach \[s\].
    pub breach_s: f64,
    /// Time from the event to the first tick after it \[s\].
    pub first_tick_s: f64,
    /// State at the event: f \[Hz\], g, l, p \[GW\].
    pub initial: [f64; 4],
    /// Who chose the disturbances, with the seed where there is one.
    pub adversary: String,
    /// One point for every change of the law or the level, and the last one.
    pub points: Vec<RealPoint>,
    /// Time from the event \[s\] and f \[Hz\], at the event and at every tick.
    pub frequency: Vec<[f64; 2]>,
}

/// A point of a real trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealPoint {
    /// Time from the event \[s\].
    pub time_s: f64,
    /// Law in force from then on.
    #[serde(with = "phase_by_name")]
    pub phase: Phase,
    /// Input level from then on.
    pub level: u8,
    /// State: f \[Hz\], g, l, p \[GW\].
    pub state: [f64; 4],
}

impl Verdict {
    /// The claim of a name.
    pub fn claim(&self, name: ClaimName) -> Option<&Claim> {
        self.claims.iter().find(|claim| claim.name == name)
    }
}

/// Phases as [`Phase::name`] calls them.
mod phase_by_name {
    use firmware::phase::Phase;
    use serde::{Deserialize, Deserializer, Serializer, de};

    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "serde passes a reference"
    )]
    pub(super) fn serialize<S: Serializer>(phase: &Phase, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(phase.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Phase, D::Error> {
        let name = String::deserialize(from)?;
        let found = Phase::ALL.into_iter().find(|phase| phase.name() == name);
        found.ok_or_else(|| de::Error::custom(format_args!("{name} is no phase")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_in_json_and_for_people() {
        for claim in [ClaimName::ReachOuter, ClaimName::HandOver, ClaimName::Table] {
            let json = serde_json::to_string(&claim).unwrap();
            assert_eq!(json, format!("\"{claim}\""));
        }
        for method in [
            Method::NotExplored,
            Method::ClosedSet,
            Method::TightSets,
            Method::FleetBounds,
        ] {
            let json = serde_json::to_string(&method).unwrap();
            assert_eq!(json, format!("\"{method}\""));
        }
        for phase in Phase::ALL {
            let point = RealPoint {
                time_s: 0.5,
                phase,
                level: 3,
                state: [0.0; 4],
            };
            let json = serde_json::to_string(&point).unwrap();
            assert_eq!(serde_json::from_str::<RealPoint>(&json).unwrap(), point);
        }
    }
}
