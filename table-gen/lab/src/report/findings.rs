//! Results of other commands that the report shows if they are there.

use crate::compare::{CompareConfig, Scorecard};
use crate::fleet::{FleetConfig, FleetRun};
use model::budget::Budget;
use model::verdict::Verdict;

/// Results of other commands that the report shows if they are there.
#[derive(Debug, Clone, Default)]
pub struct Findings {
    /// Of `verify`.
    pub verdict: Option<Verdict>,
    /// Of `budget`.
    pub budget: Option<Budget>,
    /// Of `compare`.
    pub scorecard: Option<(CompareConfig, Scorecard)>,
    /// Of `fleet`.
    pub fleet: Option<FleetFinding>,
}

/// A run of the fleet, and how it was made.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetFinding {
    /// The fleet.
    pub config: FleetConfig,
    /// Lost infeed \[GW\].
    pub loss_gw: f64,
    /// Length of the run \[s\].
    pub duration_s: f64,
    /// What came of it.
    pub run: FleetRun,
}
