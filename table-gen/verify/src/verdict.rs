//! The answer: what was proven, of which bytes, for which spec.

use serde::Serialize;

use super::path::ShownStep;

/// The verdict on a table; `verdict.json` is this value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether every claim holds.
    pub verified: bool,
    /// Name of the spec.
    pub spec: String,
    /// The claims, each with the bound that was found.
    pub claims: Vec<Claim>,
    /// Distinct cells (with their phase, where sets were carried in time) in which a decision can be made.
    pub reachable_cells: u64,
    /// For a claim that does not hold: how it fails.
    pub counterexample: Option<Counterexample>,
    /// Hash of the spec (as in the table's header), hexadecimal.
    pub spec_hash: String,
    /// Hash of the spec that the table was made for, hexadecimal.
    pub table_spec_hash: String,
    /// SHA-256 of the table's bytes, hexadecimal.
    pub table_sha256: String,
    /// Length of the table.
    pub table_bytes: usize,
    /// How the claims were examined.
    pub method: &'static str,
    /// Sizes of the exploration.
    pub counts: Counts,
    /// Version of this program.
    pub tool_version: &'static str,
}

/// One claim.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Short name: `header`, `containment`, `reach-outer`, `reach-inner`, `hand-over`, `settle`, `stay`, `table`.
    pub name: &'static str,
    /// Whether it is proven.
    pub holds: bool,
    /// The bound that was found, in `unit`; absent if there is none.
    pub bound: Option<f64>,
    /// What the bound must not pass, if the spec says so.
    pub limit: Option<f64>,
    /// Unit of bound and limit.
    pub unit: &'static str,
    /// The claim in words.
    pub statement: String,
    /// Why it does not hold.
    pub reason: Option<String>,
}

/// Sizes of an exploration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counterexample {
    /// The claim.
    pub claim: &'static str,
    /// What happens.
    pub what: String,
    /// The sets that lead there. They contain every real trajectory, so without a real one the claim is open.
    pub path: Vec<ShownStep>,
    /// A real trajectory that breaks the claim, replayed with the firmware's control loop; absent if none was found, and
    /// the claim is then not proven rather than refuted.
    pub real: Option<RealPath>,
}

/// A real trajectory.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RealPoint {
    /// Time from the event \[s\].
    pub time_s: f64,
    /// Law in force from then on.
    pub phase: &'static str,
    /// Input level from then on.
    pub level: u8,
    /// State: f \[Hz\], g, l, p \[GW\].
    pub state: [f64; 4],
}

impl Verdict {
    /// The claim of a name.
    pub fn claim(&self, name: &str) -> Option<&Claim> {
        self.claims.iter().find(|claim| claim.name == name)
    }
}
