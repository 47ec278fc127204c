//! `report SPEC`: one HTML file, and its figures.

use std::path::PathBuf;

use firmware::table::TableView;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::counterfactual::GridArgs;
use super::files::write_all;
use super::record::RecordOptions;
use super::{Failure, OutputArgs, SpecArgs, compare, output, prob, progress};
use lab::compare::CompareConfig;
use lab::counterfactual::{self, Question};
use lab::fleet::{self, FleetConfig, INSTANCES_MAX};
use lab::record::Record;
use lab::replay;
use lab::report::section::Section;
use lab::report::study::Study;
use lab::report::{self, FLEET_CHARGERS, Findings, FleetFinding, ROBUSTNESS_RUNS};
use lab::simulation::monitor::Summary;
use lab::simulation::monte_carlo::{RUNS_MAX, Statistics};
use lab::simulation::scenario::Scenario;
use model::spec::Spec;
use synth::pipeline;

/// Arguments of `report`.
#[derive(Debug, clap::Args)]
pub(super) struct ReportArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Folder for report.html and the figures as .svg and .csv; verdict.json and budget.json are
    /// taken from there
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Table of the spec, instead of synthesising one
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Specs to show beside it, synthesised; default: the same with the other direction of
    /// charging, if it is shipped
    #[arg(long, value_name = "SPEC")]
    beside: Vec<String>,
    /// Show no other spec
    #[arg(long, conflicts_with = "beside")]
    alone: bool,
    /// Recorded frequency to replay and to answer what chargers would have changed
    #[arg(long, value_name = "TRACE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    record: RecordOptions,
    #[command(flatten)]
    grid: GridArgs,
    /// With chance.participation in the spec: relative errors for which the section on how likely
    /// the promise is kept examines each band of losses beside the spec's
    #[arg(long, value_name = "E,E,...", value_delimiter = ',')]
    errors: Vec<f64>,
    /// Instances of the firmware in the section of the fleet
    #[arg(long, value_name = "N", default_value_t = FLEET_CHARGERS)]
    fleet: usize,
    /// Runs of the robustness section
    #[arg(long, value_name = "N", default_value_t = ROBUSTNESS_RUNS)]
    runs: usize,
}

#[derive(Debug, Serialize)]
struct StudyReport<'r> {
    spec: &'r str,
    baseline: &'r Summary,
    symbolic: &'r Summary,
    uncertain: &'r Summary,
    robustness: &'r Statistics,
}

#[derive(Debug, Serialize)]
struct ReportReport<'r> {
    studies: Vec<StudyReport<'r>>,
    files: Vec<String>,
}

/// Runs the command.
pub(super) fn run(args: &ReportArgs) -> Result<(), Failure> {
    if !(1..=RUNS_MAX).contains(&args.runs) {
        return Err(Failure::BadInput(format!(
            "--runs = {} is out of range: 1 to {RUNS_MAX}",
            args.runs
        )));
    }
    if !(1..=INSTANCES_MAX).contains(&args.fleet) {
        return Err(Failure::BadInput(format!(
            "--fleet = {} is out of range: 1 to {INSTANCES_MAX}",
            args.fleet
        )));
    }
    if let Some(wrong) = args.errors.iter().find(|e| !(**e > 0.0 && **e <= 1.0)) {
        return Err(Failure::BadInput(format!(
            "--errors = {wrong}: above 0 and at most 1 is allowed"
        )));
    }
    let spec = args.spec.load()?;
    let record = match &args.trace {
        Some(path) => Some(args.record.read(path)?),
        None => None,
    };
    let mut specs = vec![(spec.clone(), args.table.as_deref())];
    for name in companions(args, &spec) {
        specs.push((args.spec.overrides.load(&name)?, None));
    }
    let mut findings = Findings {
        verdict: finding(args, "verdict.json")?,
        budget: finding(args, "budget.json")?,
        ..Findings::default()
    };
    progress::catch_interrupts();
    let mut studies = Vec::new();
    for (spec, table) in &specs {
        let bytes = pipeline::table_bytes(spec, *table, &progress::watch)?;
        studies.push(Study::new(spec, &bytes, args.runs).map_err(Failure::bad)?);
    }
    let mut more = Vec::new();
    if let Some(study) = studies.first() {
        let config = CompareConfig::of(&study.spec);
        let table = view(&study.table)?;
        let found = compare::scorecard_of(&study.spec, &table, &config)?;
        findings.scorecard = Some((config, found));
        findings.fleet = Some(fleet_of(&study.spec, &table, args.fleet)?);
        more.extend(prob::section(&study.spec, &table, &args.errors)?);
        if let Some(record) = &record {
            more.extend(recorded(study, record, &args.grid)?);
        }
    }
    let rendered = report::render_studies(&studies, &findings, more).map_err(Failure::bad)?;
    let files = rendered.files();
    let named: Vec<(&str, &[u8])> = files
        .iter()
        .map(|(name, bytes)| (name.as_str(), bytes.as_bytes()))
        .collect();
    write_all(&args.out, &named)?;
    let names: Vec<String> = files.iter().map(|(name, _)| name.clone()).collect();
    if args.output.json {
        let studies = studies
            .iter()
            .map(|study| StudyReport {
                spec: &study.spec.name,
                baseline: &study.baseline.summary,
                symbolic: &study.symbolic.summary,
                uncertain: &study.uncertain.summary,
                robustness: &study.robustness,
            })
            .collect();
        return output::json(&ReportReport {
            studies,
            files: names,
        });
    }
    output::line(format_args!(
        "wrote {} and {} figures into {}",
        names.first().map_or("", String::as_str),
        rendered.figures.len(),
        args.out.display()
    ));
    Ok(())
}

fn view(table: &[u8]) -> Result<TableView<'_>, Failure> {
    TableView::parse(table).map_err(|error| Failure::BadInput(format!("{error:?}")))
}

/// The fleet at the largest loss of the spec, on the command `fleet`'s scenario.
pub(super) fn fleet_of(
    spec: &Spec,
    table: &TableView<'_>,
    instances: usize,
) -> Result<FleetFinding, Failure> {
    let config = FleetConfig::sound(spec, instances);
    let scenario = Scenario {
        duration_s: fleet::DURATION_S,
        loss_gw: spec.uncertainty.loss_gw[1],
        ..Scenario::of(spec)
    };
    let run = fleet::run(spec, table, &config, &scenario, &|| {
        !progress::interrupted()
    });
    Ok(FleetFinding {
        config,
        loss_gw: scenario.loss_gw,
        duration_s: scenario.duration_s,
        run: run.ok_or_else(|| Failure::No("interrupted".to_owned()))?,
    })
}

/// The sections of a recorded event.
fn recorded(study: &Study, record: &Record, grid: &GridArgs) -> Result<Vec<Section>, Failure> {
    let table = view(&study.table)?;
    let replay = replay::replay(&table, record)
        .map_err(|error| Failure::BadInput(format!("the charger rejects the table: {error:?}")))?;
    let question = Question {
        grid: grid.grid()?,
        ..Question::PAPER
    };
    let found = counterfactual::answer(&study.spec, &table, record, &question);
    let found = found.map_err(Failure::bad)?;
    let name = study.spec.name.as_str();
    Ok(vec![
        report::record::replay(name, record, &replay),
        report::record::counterfactual(name, &found),
    ])
}

/// Specs shown beside: what was asked for, else the shipped one with the other direction.
fn companions(args: &ReportArgs, spec: &Spec) -> Vec<String> {
    if args.alone || !args.beside.is_empty() {
        return args.beside.clone();
    }
    let other = match spec.name.rsplit_once('-') {
        Some((stem, "bi")) => format!("{stem}-uni"),
        Some((stem, "uni")) => format!("{stem}-bi"),
        _ => return Vec::new(),
    };
    // Only for a shipped spec: a file of its own has no twin.
    let shipped = Spec::shipped_names();
    let both = [args.spec.spec.as_str(), other.as_str()]
        .iter()
        .all(|name| shipped.contains(name));
    if both { vec![other] } else { Vec::new() }
}

/// A JSON file of the folder, if it is there.
fn finding<T: DeserializeOwned>(args: &ReportArgs, name: &str) -> Result<Option<T>, Failure> {
    let path = args.out.join(name);
    let bad =
        |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", path.display()));
    match std::fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|error| bad(&format_args!("{error}; build writes it anew"))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(bad(&error)),
    }
}
