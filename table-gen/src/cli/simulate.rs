//! `simulate SPEC`: one run of the grid, or many.

use std::path::PathBuf;

use clap::ValueEnum;
use firmware::table::TableView;
use serde::Serialize;

use super::band::Band;
use super::chances::Chances;
use super::{Failure, OutputArgs, SpecArgs, monte_carlo, output, plot, progress, run_tables};
use lab::report::limits::symbolic_under;
use lab::simulation::beyond::Disturbances;
use lab::simulation::beyond::file::ScenarioFile;
use lab::simulation::closed_loop::{ClosedLoop, Estimator};
use lab::simulation::monitor::Summary;
use lab::simulation::monte_carlo::draws::Draws;
use lab::simulation::recorder::History;
use lab::simulation::scenario::Scenario;
use lab::simulation::trajectory::{PhaseSpan, Run};
use lab::simulation::{ControllerKind, NOMINAL_HZ, baseline};
use model::plant::Plant;
use model::spec::Spec;
use synth::pipeline;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ControllerArg {
    /// The chargers do not respond
    None,
    /// The paper's droop
    Baseline,
    /// The firmware with a table
    Symbolic,
}

/// Arguments of `simulate`.
#[derive(Debug, clap::Args)]
pub(super) struct SimulateArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    chances: Chances,
    /// Who controls the chargers
    #[arg(long, value_enum, default_value = "symbolic")]
    controller: ControllerArg,
    /// Dead band of the baseline [Hz]; default: the spec's
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    deadband_hz: Option<f64>,
    /// Length of a run [s]; default 300, with --runs the spec's horizon or 120
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration_s: Option<f64>,
    /// Seed of what is drawn; with --runs that of the first run, the next has the next seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Many runs, each drawn from the spec's uncertainty as changed by the options
    #[arg(long, value_name = "N")]
    runs: Option<usize>,
    /// What happens to the grid, and limits of its plant: gb-2019, second-loss, tired-governors, or
    /// a TOML file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["runs", "loss_gw"])]
    scenario: Option<String>,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Let the firmware reconstruct the state from frequency alone; with --runs and a plant in
    /// bands it always does
    #[arg(long)]
    observer: bool,
    /// Draw the frequency in the terminal
    #[arg(long)]
    plot: bool,
    /// Write time, frequency, participation and delivered participation of every sample as CSV
    #[arg(long, value_name = "FILE", conflicts_with = "runs")]
    csv: Option<PathBuf>,
}

impl SimulateArgs {
    /// How the firmware is to know the state.
    fn estimator(&self, draws: Option<&Draws>) -> Estimator {
        match draws {
            _ if self.observer => Estimator::Observer,
            Some(draws) => draws.estimator(),
            None => Estimator::FullState,
        }
    }

    /// The spec with the options that change it.
    fn load(&self) -> Result<Spec, Failure> {
        let mut set = self.spec.clone();
        if let Some(hz) = self.deadband_hz {
            set.overrides
                .set
                .push(format!("baseline.deadband_hz={hz:?}"));
        }
        set.load()
    }

    /// The scenario of one run.
    fn scenario(&self, spec: &Spec, file: Option<&ScenarioFile>) -> Result<Scenario, Failure> {
        let single = |option: &str, band: Option<Band>, default: f64| match band.map(Band::single) {
            None => Ok(default),
            Some(Some(value)) => Ok(value),
            Some(None) => Err(Failure::BadInput(format!(
                "{option}: a band is for --runs; allowed: one number"
            ))),
        };
        let mut scenario = Scenario::of(spec);
        if let Some(file) = file {
            file.apply(&mut scenario);
        }
        let chances = &self.chances;
        scenario.loss_gw = single("--loss-gw", chances.loss_gw, scenario.loss_gw)?;
        scenario.delay_s = single("--delay-s", chances.delay_s, scenario.delay_s)?;
        scenario.duration_s = self.duration_s.unwrap_or(scenario.duration_s);
        if let Some(error) = chances.participation_error {
            scenario.participation_error = error;
        }
        if let Some(bounds) = chances.measurement_error {
            scenario.measurement = bounds.0;
        }
        scenario.seed = self.seed;
        scenario.check().map_err(Failure::bad)?;
        Ok(scenario)
    }
}

#[derive(Debug, Serialize)]
struct SimulateReport<'r> {
    spec: &'r str,
    controller: ControllerKind,
    #[serde(skip_serializing_if = "Option::is_none")]
    scenario: Option<&'r str>,
    loss_gw: f64,
    delay_s: f64,
    duration_s: f64,
    /// What was drawn of a plant in bands.
    #[serde(skip_serializing_if = "Option::is_none")]
    plant: Option<&'r str>,
    #[serde(flatten)]
    summary: &'r Summary,
    phases: &'r [PhaseSpan],
    /// What the proof does not cover; absent without a scenario file.
    #[serde(skip_serializing_if = "Option::is_none")]
    outside_proof: Option<&'r [String]>,
}

/// Runs the command.
pub(super) fn run(args: &SimulateArgs) -> Result<(), Failure> {
    let spec = args.load()?;
    if args.runs.is_some() && args.controller != ControllerArg::Symbolic {
        return Err(Failure::BadInput(
            "--runs: only with --controller symbolic; the others take no errors".to_owned(),
        ));
    }
    if args.runs == Some(0) {
        return Err(Failure::BadInput(
            "--runs = 0 is out of range: at least 1".to_owned(),
        ));
    }
    let file = match &args.scenario {
        Some(name) => Some(ScenarioFile::load(name).map_err(Failure::bad)?),
        None => None,
    };
    let draws = match args.runs {
        None => None,
        Some(_) => Some(args.chances.draws(&spec, args.duration_s)?),
    };
    let scenario = match &draws {
        None => args.scenario(&spec, file.as_ref())?,
        Some(draws) => draws.scenario(args.seed),
    };
    let disturbances = match &file {
        Some(file) => file.disturbances(&spec).map_err(Failure::bad)?,
        None => Disturbances::of(&spec, scenario.loss_gw),
    };
    let drawn = draws.as_ref().and_then(|draws| draws.plant(args.seed));
    let under = |respond| baseline::simulate_under(&spec, &disturbances, &scenario, respond);
    let (controller, run) = match args.controller {
        ControllerArg::None => (ControllerKind::None, under(false)),
        ControllerArg::Baseline => (ControllerKind::Baseline, under(true)),
        ControllerArg::Symbolic => {
            progress::catch_interrupts();
            let bytes = pipeline::table_bytes(&spec, args.table.as_deref(), &progress::watch)?;
            let table = TableView::parse(&bytes)
                .map_err(|error| Failure::BadInput(format!("{error:?}")))?;
            let estimator = args.estimator(draws.as_ref());
            if let (Some(runs @ 2..), Some(draws)) = (args.runs, &draws) {
                let closed_loop =
                    ClosedLoop::new(&spec, &table, estimator).map_err(Failure::bad)?;
                return monte_carlo::run(
                    &closed_loop,
                    &spec.name,
                    draws,
                    (runs, args.seed),
                    &args.output,
                );
            }
            let beyond = file.as_ref().map(|_| &disturbances);
            let run = symbolic(&spec, &table, &scenario, (beyond, drawn), estimator)?;
            (ControllerKind::Symbolic, run)
        }
    };
    let outside = file.as_ref().map(|_| disturbances.outside_proof(&spec));
    let told = draws.as_ref().zip(drawn);
    let told = told.map(|(draws, plant)| draws.plant.told(plant));
    let report = SimulateReport {
        spec: &spec.name,
        controller,
        scenario: file.as_ref().map(|file| file.name.as_str()),
        loss_gw: disturbances.losses.iter().map(|loss| loss.power_gw).sum(),
        delay_s: scenario.delay_s,
        duration_s: scenario.duration_s,
        plant: told.as_deref(),
        summary: &run.summary,
        phases: &run.phases,
        outside_proof: outside.as_deref(),
    };
    if let Some(path) = &args.csv {
        write_csv(path, &run)?;
    }
    if args.output.json {
        return output::json(&report);
    }
    run_tables::summary(report.summary);
    run_tables::phases(&run.phases);
    if let Some(told) = &told {
        output::line(format_args!("drawn: {told}"));
    }
    for sentence in outside.iter().flatten() {
        output::line(format_args!("outside the proof: {sentence}"));
    }
    if args.plot {
        let points = run_tables::frequency(&run);
        output::line(plot::frequency(&points, &run_tables::levels_hz(&spec)));
    }
    Ok(())
}

/// One run of the firmware, on the spec's plant, one that was drawn, or beyond both.
fn symbolic(
    spec: &Spec,
    table: &TableView<'_>,
    scenario: &Scenario,
    (beyond, drawn): (Option<&Disturbances>, Option<Plant>),
    estimator: Estimator,
) -> Result<Run, Failure> {
    let mut history = History::default();
    let summary = match beyond {
        None => ClosedLoop::new(spec, table, estimator).map(|mut closed_loop| {
            if let Some(plant) = drawn {
                closed_loop.set_plant(plant);
            }
            closed_loop.run(scenario, &mut history)
        }),
        Some(beyond) => symbolic_under(spec, table, beyond, scenario, estimator, &mut history),
    };
    let summary = summary.map_err(Failure::bad)?;
    Ok(Run {
        samples: history.samples,
        phases: history.phases,
        summary,
    })
}

fn write_csv(path: &std::path::Path, run: &Run) -> Result<(), Failure> {
    let fail =
        |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(|e| fail(&e))?;
    let columns = ["time_s", "frequency_hz", "participation", "delivered"];
    writer.write_record(columns).map_err(|e| fail(&e))?;
    for sample in &run.samples {
        let f = NOMINAL_HZ + sample.state[0];
        let row = [sample.time_s, f, sample.participation, sample.delivered];
        writer.serialize(row).map_err(|e| fail(&e))?;
    }
    writer.flush().map_err(|e| fail(&e))
}
