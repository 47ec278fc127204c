//! `formula FORMULA SPEC`: requirements in temporal logic.

use std::path::PathBuf;

use serde::Serialize;

use super::record::RecordOptions;
use super::{Failure, OutputArgs, SpecArgs, output};
use lab::robustness::{Sample, robustness};
use model::logic;
use model::spec::{self, Compiled};

/// Arguments of `formula`.
#[derive(Debug, clap::Args)]
pub(super) struct FormulaArgs {
    /// The formula, e.g. 'G(f >= -0.8) & G(!(f in I1) -> F[<=60s] f in I1)'; f is the deviation
    /// from nominal
    #[arg(value_name = "FORMULA")]
    formula: String,
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Instead of compiling to games: the formula's robustness on a recorded frequency (CSV as for
    /// `replay`)
    #[arg(long, value_name = "TRACE.csv")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    record: RecordOptions,
}

#[derive(Debug, Serialize)]
struct FormulaReport {
    formula: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    games: Option<Compiled>,
    #[serde(skip_serializing_if = "Option::is_none")]
    robustness: Option<f64>,
}

/// Runs the command.
pub(super) fn run(args: &FormulaArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    let formula = logic::parse(&args.formula).map_err(Failure::bad)?;
    let mut report = FormulaReport {
        formula: formula.to_string(),
        games: None,
        robustness: None,
    };
    if let Some(path) = &args.trace {
        let record = args.record.read(path)?;
        let samples: Vec<Sample> = record
            .deviations()
            .map(|(time_s, f_hz)| Sample {
                time_s,
                f_hz,
                loss_gw: f64::NAN,
            })
            .collect();
        let named = [
            ("I1", spec.requirements.outer_hz),
            ("I2", spec.requirements.inner_hz),
        ];
        let value = robustness(&formula, &samples, &named).map_err(Failure::bad)?;
        report.robustness = Some(value);
    } else {
        let compiled =
            spec::compile(&formula, &spec).map_err(|error| Failure::No(error.to_string()))?;
        compiled.applied(&spec).validate("the formula's spec")?;
        report.games = Some(compiled);
    }
    show(args, &report)?;
    match report.robustness {
        Some(value) if value < 0.0 => {
            Err(Failure::No("the formula is false on the trace".to_owned()))
        }
        _ => Ok(()),
    }
}

fn show(args: &FormulaArgs, report: &FormulaReport) -> Result<(), Failure> {
    if args.output.json {
        return output::json(report);
    }
    output::line(&report.formula);
    if let Some(value) = report.robustness {
        output::line(format_args!("robustness {value:.4}"));
    }
    if let Some(games) = &report.games {
        let text = serde_json::to_string_pretty(games).map_err(Failure::bad)?;
        output::line(text);
    }
    Ok(())
}
