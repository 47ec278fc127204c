//! The runs that a report shows of one spec: the same that `simulate` makes.

use firmware::table::TableView;

use crate::simulation::closed_loop::{self, ClosedLoop, Estimator, LoopError};
use crate::simulation::monte_carlo::draws::Draws;
use crate::simulation::monte_carlo::{self, Statistics};
use crate::simulation::scenario::Scenario;
use crate::simulation::trajectory::Run;
use crate::simulation::{NOMINAL_HZ, baseline};
use model::spec::Spec;

/// The paper's error of participation in its section on robustness.
pub const PAPER_ERROR: f64 = 0.1;
/// Chargers' swing when charging stops, and when it reverses \[kW\]: the paper's Table I.
pub const UNIDIRECTIONAL_KW: f64 = 28.0;
/// See [`UNIDIRECTIONAL_KW`].
pub const BIDIRECTIONAL_KW: f64 = 56.0;
/// Dead bands of the paper's Table II \[Hz\].
pub const DEADBANDS_HZ: [f64; 8] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35];

/// Why a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The table is not one.
    #[error("not a table: {0:?}")]
    Table(firmware::table::TableError),
    /// The loop cannot run.
    #[error(transparent)]
    Loop(#[from] LoopError),
}

/// A spec, its table and its runs.
#[derive(Debug, Clone)]
pub struct Study {
    /// The spec.
    pub spec: Spec,
    /// The table.
    pub table: Vec<u8>,
    /// `simulate SPEC --controller baseline`.
    pub baseline: Run,
    /// `simulate SPEC`.
    pub symbolic: Run,
    /// `simulate SPEC --participation-error 0.1`.
    pub uncertain: Run,
    /// `simulate SPEC --runs N --participation-error 0.1`.
    pub robustness: Statistics,
}

impl Study {
    /// Makes the runs; `runs` is the number of runs of [`Study::robustness`].
    ///
    /// # Errors
    /// Bytes that are no table, or a plant that the loop cannot follow.
    pub fn new(spec: &Spec, bytes: &[u8], runs: usize) -> Result<Self, StudyError> {
        let table = TableView::parse(bytes).map_err(StudyError::Table)?;
        let scenario = Scenario::of(spec);
        let uncertain = Scenario {
            participation_error: PAPER_ERROR,
            ..scenario.clone()
        };
        let full = Estimator::FullState;
        let draws = Draws {
            participation_error: PAPER_ERROR,
            ..Draws::of(spec)
        };
        let closed_loop = ClosedLoop::new(spec, &table, draws.estimator())?;
        // Nothing interrupts: the closure always says to go on.
        let robustness = loop {
            if let Some(statistics) = monte_carlo::run(&closed_loop, &draws, runs, 0, &|| true) {
                break statistics;
            }
        };
        Ok(Self {
            spec: spec.clone(),
            table: bytes.to_vec(),
            baseline: baseline::simulate(spec, &scenario, true),
            symbolic: closed_loop::simulate(spec, &table, &scenario, full)?,
            uncertain: closed_loop::simulate(spec, &table, &uncertain, full)?,
            robustness,
        })
    }
}

/// The event on a spec's plant with the paper's fleets and the baseline droop: none,
/// unidirectional, bidirectional.
#[derive(Debug, Clone)]
pub struct BaselineEvent {
    /// No response.
    pub none: Run,
    /// 28 kW a charger.
    pub unidirectional: Run,
    /// 56 kW a charger.
    pub bidirectional: Run,
}

/// A spec with another power a charger.
fn with_power(spec: &Spec, kw: f64) -> Spec {
    let mut spec = spec.clone();
    spec.fleet.power_per_charger_kw = kw;
    spec
}

impl BaselineEvent {
    /// The three runs.
    pub fn new(spec: &Spec) -> Self {
        let scenario = Scenario::of(spec);
        let run = |kw: f64| baseline::simulate(&with_power(spec, kw), &scenario, true);
        Self {
            none: baseline::simulate(spec, &scenario, false),
            unidirectional: run(UNIDIRECTIONAL_KW),
            bidirectional: run(BIDIRECTIONAL_KW),
        }
    }
}

/// Table II of the paper: the frequency at which the baseline settles, for each dead band.
pub fn steady_states(spec: &Spec) -> Vec<SteadyState> {
    use rayon::prelude::*;
    let scenario = Scenario::of(spec);
    DEADBANDS_HZ
        .par_iter()
        .map(|deadband_hz| {
            let settled = |kw: f64| {
                let mut spec = with_power(spec, kw);
                spec.baseline.deadband_hz = *deadband_hz;
                baseline::simulate(&spec, &scenario, true).summary.final_hz
            };
            SteadyState {
                deadband_hz: *deadband_hz,
                unidirectional_hz: settled(UNIDIRECTIONAL_KW),
                bidirectional_hz: settled(BIDIRECTIONAL_KW),
            }
        })
        .collect()
}

/// One row of Table II.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyState {
    /// Dead band \[Hz\].
    pub deadband_hz: f64,
    /// Where 28 kW a charger settle \[Hz\].
    pub unidirectional_hz: f64,
    /// Where 56 kW a charger settle \[Hz\].
    pub bidirectional_hz: f64,
}

/// Time and absolute frequency of a run.
pub fn frequency(run: &Run) -> impl Iterator<Item = (f64, f64)> + '_ {
    run.samples
        .iter()
        .map(|sample| (sample.time_s, NOMINAL_HZ + sample.state[0]))
}
