//! `simulate SPEC`: one run of the grid.

use std::path::PathBuf;

use clap::ValueEnum;
use firmware::table::TableView;
use serde::Serialize;

use super::{Failure, OutputArgs, SpecArgs, output, progress};
use crate::pipeline;
use crate::simulation::closed_loop::{self, Estimator};
use crate::simulation::monitor::Summary;
use crate::simulation::scenario::Scenario;
use crate::simulation::trajectory::{PhaseSpan, Run};
use crate::simulation::{ControllerKind, baseline};
use crate::spec::Spec;

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
    /// Who controls the chargers
    #[arg(long, value_enum, default_value = "symbolic")]
    controller: ControllerArg,
    /// Lost infeed [GW]; default: the middle of the spec's band
    #[arg(long, value_name = "GW", allow_negative_numbers = true)]
    loss_gw: Option<f64>,
    /// Dead band of the baseline [Hz]; default: the spec's
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    deadband_hz: Option<f64>,
    /// Length of the run [s]; default 300
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration_s: Option<f64>,
    /// Relative error of the delivered participation, drawn each tick; default 0
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    participation_error: Option<f64>,
    /// Time from a command to its power [s]; default: the spec's
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    delay_s: Option<f64>,
    /// Seed of what is drawn
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Let the firmware reconstruct the state from frequency alone
    #[arg(long)]
    observer: bool,
}

#[derive(Debug, Serialize)]
struct SimulateReport<'r> {
    spec: &'r str,
    controller: ControllerKind,
    loss_gw: f64,
    duration_s: f64,
    #[serde(flatten)]
    summary: &'r Summary,
    phases: &'r [PhaseSpan],
}

/// Runs the command.
pub(super) fn run(args: &SimulateArgs) -> Result<(), Failure> {
    let mut set = args.spec.clone();
    if let Some(hz) = args.deadband_hz {
        set.overrides
            .set
            .push(format!("baseline.deadband_hz={hz:?}"));
    }
    let spec = set.load()?;
    let mut scenario = Scenario::of(&spec);
    let fields = [
        (&mut scenario.loss_gw, args.loss_gw),
        (&mut scenario.duration_s, args.duration_s),
        (&mut scenario.participation_error, args.participation_error),
        (&mut scenario.delay_s, args.delay_s),
    ];
    for (field, value) in fields {
        if let Some(value) = value {
            *field = value;
        }
    }
    scenario.seed = args.seed;
    scenario.check().map_err(Failure::bad)?;
    let (controller, run) = match args.controller {
        ControllerArg::None => (
            ControllerKind::None,
            baseline::simulate(&spec, &scenario, false),
        ),
        ControllerArg::Baseline => (
            ControllerKind::Baseline,
            baseline::simulate(&spec, &scenario, true),
        ),
        ControllerArg::Symbolic => {
            progress::catch_interrupts();
            (ControllerKind::Symbolic, symbolic(&spec, &scenario, args)?)
        }
    };
    let report = SimulateReport {
        spec: &spec.name,
        controller,
        loss_gw: scenario.loss_gw,
        duration_s: scenario.duration_s,
        summary: &run.summary,
        phases: &run.phases,
    };
    if args.output.json {
        output::json(&report)
    } else {
        print(&report, &run);
        Ok(())
    }
}

fn symbolic(spec: &Spec, scenario: &Scenario, args: &SimulateArgs) -> Result<Run, Failure> {
    let bytes = pipeline::table_bytes(spec, args.table.as_deref(), &progress::watch)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let estimator = if args.observer {
        Estimator::Observer
    } else {
        Estimator::FullState
    };
    closed_loop::simulate(spec, &table, scenario, estimator).map_err(Failure::bad)
}

fn print(report: &SimulateReport<'_>, run: &Run) {
    summary(report.summary);
    phases(&run.phases);
}

/// A summary as a table on stdout.
pub(super) fn summary(summary: &Summary) {
    let mut table = output::table(&["measure", "value"]);
    let yes = |flag: bool| if flag { "yes" } else { "no" }.to_owned();
    let rows = [
        (
            "nadir",
            format!(
                "{:.4} Hz at {:.2} s",
                summary.nadir_hz, summary.nadir_time_s
            ),
        ),
        ("final", format!("{:.4} Hz", summary.final_hz)),
        (
            "largest participation",
            format!("{:.3}", summary.max_participation),
        ),
        (
            "below 49.5 Hz",
            format!("{:.2} s", summary.seconds_below_49_5),
        ),
        (
            "containment breached",
            summary
                .containment_breached
                .map_or_else(|| "no limit stated".to_owned(), yes),
        ),
        (
            "back in I1 after",
            format!("{} s", output::seconds(summary.entered_outer_s)),
        ),
        (
            "back in I2 after",
            format!("{} s", output::seconds(summary.entered_inner_s)),
        ),
        ("stayed in I2", yes(summary.stayed_in_inner)),
    ];
    for (name, value) in rows {
        table.add_row(vec![name.to_owned(), value]);
    }
    output::line(table);
}

/// Phases as a table on stdout.
pub(super) fn phases(phases: &[PhaseSpan]) {
    if phases.is_empty() {
        return;
    }
    let mut table = output::table(&["phase", "from s", "to s"]);
    for span in phases {
        table.add_row(vec![
            span.phase.to_owned(),
            format!("{:.1}", span.start_s),
            format!("{:.1}", span.end_s),
        ]);
    }
    output::line(table);
}
