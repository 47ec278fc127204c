//! The scorecard: a table beside the droop, no response and the ideal one, at many losses and
//! plants.
//!
//! | controller | how it responds |
//! |---|---|
//! | none | not at all |
//! | droop | a fleet of chargers, each with the spec's droop |
//! | table | the same fleet, each with the firmware's control loop on the table |
//! | limit | everything, at once and for good, when f passes a trigger: hardly to be beaten |
//!
//! | module | holds |
//! |---|---|
//! | [`chargers`] | the fleet: own clocks, own meters, own delays |
//! | [`course`] | the grid in time, and what is measured on the way |
//! | [`grids`] | the plants: the spec's own, other inertias, the corners of its bands |
//! | [`quiet`] | how often a charger's command changed |
//! | [`views`] | what is shown of it |
//! | [`verdict`] | where the table loses to the droop |

pub mod chargers;
pub mod course;
pub mod grids;
mod outcome;
pub mod quiet;
pub mod verdict;
pub mod views;

use firmware::table::TableView;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use chargers::{ChargersConfig, Kind};
use course::Course;
use grids::Grids;
use model::plant::Plant;
use model::spec::Spec;
pub use outcome::Outcome;

/// Losses of the scorecard unless asked otherwise: first, last and step, in tenths of a GW.
pub const LOSSES_TENTHS: (u32, u32) = (3, 28);
/// Chargers of the fleet unless asked otherwise.
pub const CHARGERS: usize = 60;
/// Most chargers: their control loops are kept for every run under way.
pub const CHARGERS_MAX: usize = 100_000;
/// Deviation at which the limit responds \[Hz\].
pub const TRIGGER_HZ: f64 = -0.1;
/// Length of a run \[s\].
pub const DURATION_S: f64 = 300.0;

/// Who controls the chargers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Controller {
    /// Nobody: the chargers do not respond.
    None,
    /// The spec's droop.
    Droop,
    /// The firmware with the table.
    Table,
    /// Full response at the trigger, without delay.
    Limit,
}

impl Controller {
    /// All of them, as the scorecard lists them.
    pub const ALL: [Self; 4] = [Self::None, Self::Droop, Self::Table, Self::Limit];

    /// The controller's name, as people and JSON read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Droop => "droop",
            Self::Table => "table",
            Self::Limit => "limit",
        }
    }
}

/// What is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareConfig {
    /// Lost infeeds \[GW\].
    pub losses_gw: Vec<f64>,
    /// Plants.
    pub grids: Grids,
    /// Deviation at which the limit responds \[Hz\].
    pub trigger_hz: f64,
    /// Length of a run \[s\].
    pub duration_s: f64,
    /// The fleet of droop and table.
    pub chargers: ChargersConfig,
}

impl CompareConfig {
    /// The scorecard of a spec on its own plant and at the corners of its bands: 0.3 to 2.8 GW by
    /// 0.1, 60 chargers, 300 s.
    pub fn of(spec: &Spec) -> Self {
        let (first, last) = LOSSES_TENTHS;
        Self {
            losses_gw: (first..=last).map(|n| f64::from(n) / 10.0).collect(),
            grids: Grids::of(spec),
            trigger_hz: TRIGGER_HZ,
            duration_s: DURATION_S,
            chargers: ChargersConfig::of(spec, CHARGERS),
        }
    }
}

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Lost infeed \[GW\].
    pub loss_gw: f64,
    /// H \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
    /// The plant's name.
    pub plant: String,
    /// Who controls.
    pub controller: Controller,
    /// What came of it.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// All runs: by plant, then loss, then controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scorecard {
    /// The runs.
    pub rows: Vec<Row>,
}

impl Scorecard {
    /// The runs of one loss: by plant, then controller.
    pub fn of_loss(&self, loss_gw: f64) -> Vec<Row> {
        let rows = self.rows.iter().filter(|row| row.loss_gw == loss_gw);
        rows.cloned().collect()
    }

    /// The scorecard of all these losses, each with the runs of so many plants.
    pub fn joined(by_loss: &[Vec<Row>], grids: usize) -> Self {
        let of = |at: usize| {
            let runs = by_loss
                .iter()
                .map(|rows| rows.chunks(Controller::ALL.len()));
            runs.filter_map(move |mut runs| runs.nth(at)).flatten()
        };
        Self {
            rows: (0..grids).flat_map(of).cloned().collect(),
        }
    }
}

/// Why there is no scorecard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// The table's plant has a time constant that the observer cannot follow at its tick.
    #[error("the observer cannot be made: {0:?}")]
    Observer(firmware::observer::ObserverError),
    /// The caller said to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Runs every controller at every loss on every plant. `go_on` is asked before each run.
///
/// # Errors
/// A table whose plant the observer cannot follow, or an interruption.
pub fn compare(
    spec: &Spec,
    table: &TableView<'_>,
    config: &CompareConfig,
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<Scorecard, CompareError> {
    let mut runs = Vec::new();
    for grid in config.grids.all() {
        for loss in &config.losses_gw {
            runs.extend(Controller::ALL.map(|controller| (grid, *loss, controller)));
        }
    }
    let rows: Result<Vec<Row>, CompareError> = runs
        .into_par_iter()
        .map(|(grid, loss_gw, controller)| {
            if !go_on() {
                return Err(CompareError::Interrupted);
            }
            Ok(Row {
                loss_gw,
                inertia_gw_s_per_hz: grid.plant.inertia,
                plant: grid.name.clone(),
                controller,
                outcome: run(spec, table, config, &grid.plant, (loss_gw, controller))?,
            })
        })
        .collect();
    Ok(Scorecard { rows: rows? })
}

/// One run.
fn run(
    spec: &Spec,
    table: &TableView<'_>,
    config: &CompareConfig,
    plant: &Plant,
    (loss_gw, controller): (f64, Controller),
) -> Result<Outcome, CompareError> {
    let tick_ms = table.header().tick_ms;
    let course = || Course::new(spec, plant, tick_ms, config.duration_s, loss_gw);
    let kind = match controller {
        Controller::None => return Ok(course().without()),
        Controller::Limit => return Ok(course().limit(config.trigger_hz)),
        Controller::Droop => Kind::Droop(spec),
        Controller::Table => Kind::Table(table),
    };
    let chargers = chargers::Chargers::new(&kind, &config.chargers, tick_ms)
        .map_err(CompareError::Observer)?;
    Ok(course().with(chargers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_taken_apart_join_into_the_same_scorecard() {
        let outcome = |at: f64| Outcome {
            nadir_hz: at,
            nadir_time_s: 0.0,
            final_hz: 50.0,
            seconds_below_49_5: 0.0,
            participation_gw_s: 0.0,
            changes_per_charger: 0.0,
            changes_most: 0,
            ripple_hz: 0.0,
        };
        // One inertia twice, as a person may ask.
        let (inertias, losses) = ([2.0, 4.0, 4.0], [0.3, 0.4]);
        let mut rows = Vec::new();
        for inertia in inertias {
            for loss in losses {
                for controller in Controller::ALL {
                    rows.push(Row {
                        loss_gw: loss,
                        inertia_gw_s_per_hz: inertia,
                        plant: format!("H = {inertia}"),
                        controller,
                        outcome: outcome(rows.len() as f64),
                    });
                }
            }
        }
        let whole = Scorecard { rows };
        let apart = losses.map(|loss| whole.of_loss(loss));
        assert_eq!(apart[0].len(), inertias.len() * Controller::ALL.len());
        assert_eq!(Scorecard::joined(&apart, inertias.len()), whole);
    }
}
