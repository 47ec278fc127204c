//! `replay TRACE.csv SPEC`: the firmware on a recorded frequency.

use std::path::PathBuf;

use firmware::table::TableView;
use serde::Serialize;

use super::files::write_one;
use super::record::RecordArgs;
use super::{Failure, OutputArgs, output, plot, run_tables};
use lab::replay::{FaultCount, REACTION_STEP_MAX_S, Replay, replay};
use lab::simulation::trajectory::PhaseSpan;

/// Arguments of `replay`.
#[derive(Debug, clap::Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Write time, frequency and participation of every tick as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the charger's telemetry, a frame a tick: a recording for monitor
    #[arg(long, value_name = "FILE")]
    telemetry: Option<PathBuf>,
    /// Draw the recorded frequency in the terminal
    #[arg(long)]
    plot: bool,
}

#[derive(Debug, Serialize)]
struct ReplayReport<'r> {
    spec: &'r str,
    start: &'r str,
    samples: usize,
    step_s: f64,
    skipped_rows: usize,
    filled_s: f64,
    onset_s: Option<f64>,
    first_response_s: Option<f64>,
    reaction_s: Option<f64>,
    false_triggers: usize,
    max_participation: f64,
    faults: &'r [FaultCount],
    phases: &'r [PhaseSpan],
}

/// Runs the command.
pub(super) fn run(args: &ReplayArgs) -> Result<(), Failure> {
    let spec = args.record.spec()?;
    let (record, bytes) = args.record.load(&spec)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let result = replay(&table, &record)
        .map_err(|error| Failure::BadInput(format!("the charger rejects the table: {error:?}")))?;
    if let Some(path) = &args.csv {
        write_csv(path, &result)?;
    }
    if let Some(path) = &args.telemetry {
        write_one(path, &result.telemetry)?;
    }
    let reaction_s = result.reaction_s();
    let report = ReplayReport {
        spec: &spec.name,
        start: &record.start,
        samples: record.samples.len(),
        step_s: record.step_s,
        skipped_rows: record.skipped.len(),
        filled_s: record.filled_s,
        onset_s: result.onset_s,
        first_response_s: result.first_response_s,
        reaction_s,
        false_triggers: result.false_triggers,
        max_participation: result.max_participation,
        faults: &result.faults,
        phases: &result.phases,
    };
    if args.output.json {
        return output::json(&report);
    }
    output::line(format_args!(
        "{} samples from {}, {} s apart",
        report.samples, report.start, report.step_s
    ));
    if record.step_s > REACTION_STEP_MAX_S {
        output::line(format_args!(
            "samples more than {REACTION_STEP_MAX_S} s apart do not show when an event began: no onset, \
             no reaction time"
        ));
    }
    let mut rows = output::table(&["event", "value"]);
    rows.add_row(["onset", &format!("{} s", output::seconds(report.onset_s))]);
    rows.add_row([
        "first response",
        &format!("{} s", output::seconds(report.first_response_s)),
    ]);
    rows.add_row([
        "reaction after onset",
        &reaction_s.map_or_else(
            || "-".to_owned(),
            |reaction_s| format!("{reaction_s:.2} s, {} s less at most", report.step_s),
        ),
    ]);
    rows.add_row([
        "responses before the onset",
        &report.false_triggers.to_string(),
    ]);
    rows.add_row([
        "largest participation",
        &format!("{:.3}", report.max_participation),
    ]);
    for count in report.faults {
        rows.add_row([
            &format!("ticks with the fault {}", count.fault),
            &count.ticks.to_string(),
        ]);
    }
    output::line(rows);
    run_tables::phases(&result.phases);
    if args.plot {
        let points: Vec<(f64, f64)> = record
            .samples
            .iter()
            .map(|sample| (sample.time_s, sample.frequency_hz))
            .collect();
        output::line(plot::frequency(&points, &run_tables::levels_hz(&spec)));
    }
    Ok(())
}

fn write_csv(path: &std::path::Path, result: &Replay) -> Result<(), Failure> {
    let fail =
        |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(|e| fail(&e))?;
    let columns = ["time_s", "frequency_hz", "participation"];
    writer.write_record(columns).map_err(|e| fail(&e))?;
    for sample in &result.samples {
        let row = [sample.time_s, sample.frequency_hz, sample.participation];
        writer.serialize(row).map_err(|e| fail(&e))?;
    }
    writer.flush().map_err(|e| fail(&e))
}
