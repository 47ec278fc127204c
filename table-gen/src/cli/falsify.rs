//! `falsify TABLE --spec SPEC`: adversaries against the bytes.

use std::path::PathBuf;

use super::{Failure, OutputArgs, Overrides, output};
use lab::falsify;

/// Most runs of one command: a day of two cores.
const RUNS_MAX: u64 = 1_000_000_000;

/// Arguments of `falsify`.
#[derive(Debug, clap::Args)]
pub(super) struct FalsifyArgs {
    /// The table to attack
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// Name of a shipped spec, or path of a TOML file
    #[arg(long, value_name = "SPEC")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: OutputArgs,
    /// Control steps (ticks) to simulate
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    steps: u64,
    /// Instead of searching for the worst, draw so many fleets, plants, losses and states from the
    /// spec's bands and run each once
    #[arg(long, value_name = "N", conflicts_with = "steps")]
    runs: Option<u64>,
    /// Seed of the search; the same seed gives the same search
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
}

/// Runs the command.
pub(super) fn run(args: &FalsifyArgs) -> Result<(), Failure> {
    let spec = args.overrides.load(&args.spec)?;
    let bytes = std::fs::read(&args.table)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", args.table.display())))?;
    let found = match args.runs {
        Some(runs @ 1..=RUNS_MAX) => falsify::sample(&bytes, &spec, runs, args.seed),
        Some(runs) => {
            return Err(Failure::BadInput(format!(
                "--runs = {runs} is out of range: 1 to {RUNS_MAX}"
            )));
        }
        None => falsify::falsify(&bytes, &spec, args.steps, args.seed),
    };
    let found = found
        .map_err(|error| Failure::BadInput(format!("the firmware rejects the table: {error:?}")))?;
    if args.output.json {
        output::json(&found)?;
    } else {
        output::line(format_args!(
            "{} control steps in {} trajectories; smallest margin {:.4} Hz",
            output::grouped(found.steps as usize),
            output::grouped(found.trajectories as usize),
            found.smallest_margin_hz
        ));
    }
    match found.violation {
        None => Ok(()),
        Some(real) => Err(Failure::No(format!(
            "{} {:.2} s after the event ({})",
            real.what, real.breach_s, real.adversary
        ))),
    }
}
