//! The section beyond the paper's plant: the shipped scenarios, and what of them is outside the
//! proof.

use firmware::table::TableView;

use super::responses::summaries;
use super::section::Section;
use super::study::{Study, StudyError};
use crate::simulation::baseline;
use crate::simulation::beyond::Disturbances;
use crate::simulation::beyond::file::{ScenarioFile, ScenarioFileError};
use crate::simulation::beyond::plant::BeyondPlant;
use crate::simulation::beyond::system::BeyondSystem;
use crate::simulation::closed_loop::{ClosedLoop, Estimator, LoopError};
use crate::simulation::monitor::Summary;
use crate::simulation::recorder::Recorder;
use crate::simulation::scenario::Scenario;
use model::plant::Plant;
use model::spec::Spec;

/// The firmware under disturbances.
///
/// # Errors
/// A plant that the observer cannot follow, if it is asked for.
pub fn symbolic_under(
    spec: &Spec,
    table: &TableView<'_>,
    disturbances: &Disturbances,
    scenario: &Scenario,
    estimator: Estimator,
    recorder: &mut impl Recorder,
) -> Result<Summary, LoopError> {
    let mut closed_loop = ClosedLoop::new(spec, table, estimator)?;
    let (grid, seed) = (Plant::new(spec), scenario.seed);
    let plant = BeyondPlant::new(grid, disturbances, scenario.duration_s + 1.0, seed);
    let (_, parts) = closed_loop.parts(scenario);
    let mut grid = BeyondSystem::new(plant, parts, scenario.initial);
    Ok(closed_loop.run_on(&mut grid, scenario, recorder))
}

/// Every shipped scenario under the firmware and the baseline.
///
/// # Errors
/// A table that cannot be run. A shipped scenario that does not go with the spec (too little
/// inertia) is left out, and the section says so.
pub fn beyond(study: &Study) -> Result<Section, StudyError> {
    let (spec, name) = (&study.spec, study.spec.name.as_str());
    let mut section = Section::new(format!("Where the model is wrong: {name}")).say(
        "Simulation only. Each scenario lists what of it the proof does not cover; for the rest the proof holds.",
    );
    let table = TableView::parse(&study.table).map_err(StudyError::Table)?;
    for file in ScenarioFile::shipped() {
        match scenario(spec, &table, file) {
            Ok((runs, outside, title)) => {
                let rows: Vec<(&str, &Summary)> =
                    vec![("firmware", &runs[0]), ("baseline", &runs[1])];
                let caption = format!("simulate {name} --scenario {title}");
                section.tables.push(summaries(caption, &rows));
                section.words.push(format!(
                    "{title}: outside the proof: {}.",
                    outside.join("; ")
                ));
            }
            Err(Refusal::Loop(error)) => return Err(error.into()),
            Err(Refusal::File(error)) => section.words.push(format!("Left out: {error}.")),
        }
    }
    Ok(section)
}

enum Refusal {
    File(ScenarioFileError),
    Loop(LoopError),
}

type Runs = ([Summary; 2], Vec<String>, String);

fn scenario(
    spec: &Spec,
    table: &TableView<'_>,
    file: Result<ScenarioFile, ScenarioFileError>,
) -> Result<Runs, Refusal> {
    let file = file.map_err(Refusal::File)?;
    let disturbances = file.disturbances(spec).map_err(Refusal::File)?;
    let mut scenario = Scenario::of(spec);
    file.apply(&mut scenario);
    let full = Estimator::FullState;
    let symbolic = symbolic_under(spec, table, &disturbances, &scenario, full, &mut ())
        .map_err(Refusal::Loop)?;
    let baseline = baseline::simulate_under(spec, &disturbances, &scenario, true).summary;
    let outside = disturbances.outside_proof(spec);
    Ok(([symbolic, baseline], outside, file.name))
}
