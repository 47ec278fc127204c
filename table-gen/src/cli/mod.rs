//! The commands of `table-gen`, one file each, and what they share.
//!
//! Exit codes: 0 done; 1 the answer is "no" (not verified, no controller exists, limit reached); 2
//! bad input.

mod arguments;
mod band;
mod budget;
mod build;
mod chain_args;
mod chances;
mod checkpoint;
mod compare;
mod counterfactual;
#[cfg(test)]
mod documented;
mod event;
mod failure;
mod falsify;
mod files;
mod first_levels;
mod fleet;
mod formula;
mod groups;
mod identify;
mod inspect;
mod keygen;
mod keys;
mod maximise;
mod monitor;
mod monte_carlo;
mod ocpp;
mod output;
mod plot;
mod prob;
mod prob_figure;
mod progress;
#[cfg(feature = "mpi")]
mod ranks;
mod record;
mod replay;
mod report;
mod run_tables;
mod service;
mod shares;
mod sign;
mod signing;
mod simulate;
mod size_front;
mod synth;
mod synth_report;
mod time_left;
mod update;
mod verify;

use std::process::ExitCode;

pub(crate) use arguments::{OutputArgs, Overrides, SpecArgs};
pub(crate) use failure::Failure;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

/// Version, the commit that it was built on, and whether the source was changed since.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("HOLDFAST_BUILD"), ")");

#[cfg(test)]
pub(crate) const fn version() -> &'static str {
    VERSION
}

/// Synthesises, compresses, verifies and simulates frequency-response tables for EV chargers.
#[derive(Debug, Parser)]
#[command(name = "table-gen", version = VERSION, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Synthesise, compress, check and simulate; writes the table and a report
    Build(build::BuildArgs),
    /// Solve the games alone: sizes, iterations, time, memory
    Synth(synth::SynthArgs),
    /// Run the grid with no response, the baseline droop or the firmware on a table
    Simulate(simulate::SimulateArgs),
    /// The scorecard: a table beside no response, the droop and full response at once, over losses
    /// and inertias
    Compare(compare::CompareArgs),
    /// A recorded event with the fleet responding: what the frequency would have been
    Counterfactual(counterfactual::CounterfactualArgs),
    /// Run every charger with its own firmware, meter, clock and faults
    Fleet(fleet::FleetArgs),
    /// One HTML page with the figures of the paper and more, and each figure as .svg and .csv
    Report(report::ReportArgs),
    /// The plant behind a recorded event: parameters with intervals, as a spec
    Identify(identify::IdentifyArgs),
    /// Run the firmware on a recorded frequency
    Replay(replay::ReplayArgs),
    /// Check the bytes of a table against a spec, independently of how they were made
    Verify(verify::VerifyArgs),
    /// How likely a table keeps its promise: a rigorous lower bound
    Prob(prob::ProbArgs),
    /// Change a table's levels where that makes its bound by `prob` larger
    Maximise(maximise::MaximiseArgs),
    /// Search for a real trajectory that breaks a table
    Falsify(falsify::FalsifyArgs),
    /// A requirement in temporal logic: as games of a spec, or as a monitor of a recorded frequency
    Formula(formula::FormulaArgs),
    /// Show chargers' telemetry, live or from recordings: as lines, or as a page
    Monitor(monitor::MonitorArgs),
    /// Read a charger over its telemetry line: identity, status, settings; change them with its key
    Service(service::ServiceArgs),
    /// The fallback droop and the event's end as messages of OCPP 2.1, and back
    Ocpp(ocpp::OcppArgs),
    /// A key pair for signing tables
    Keygen(keygen::KeygenArgs),
    /// A table in a signed container, for chargers of one kind
    Sign(sign::SignArgs),
    /// A signed container into the slots of a charger's flash, as the charger would do it
    Update(update::UpdateArgs),
    /// Bytes by part, visits of a lookup, free flash on a list of microcontrollers
    Budget(budget::BudgetArgs),
    /// What is in a table: header, levels, jumps between neighbours, slices
    Inspect(inspect::InspectArgs),
    /// Every key of a spec: unit, default, what is allowed
    Keys(keys::KeysArgs),
}

/// Runs the command line of this process.
pub(crate) fn run() -> ExitCode {
    let parsed = groups::grouped(Cli::command())
        .try_get_matches()
        .and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            // clap's own codes: 0 for help and version, 2 for bad usage.
            let code = error.exit_code();
            // Nothing is left to tell if the terminal is gone.
            let _ = error.print();
            return ExitCode::from(code as u8);
        }
    };
    let result = match cli.command {
        Command::Build(args) => build::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Counterfactual(args) => counterfactual::run(&args),
        Command::Fleet(args) => fleet::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Prob(args) => prob::run(&args),
        Command::Maximise(args) => maximise::run(&args),
        Command::Falsify(args) => falsify::run(&args),
        Command::Formula(args) => formula::run(&args),
        Command::Monitor(args) => monitor::run(&args),
        Command::Service(args) => service::run(&args),
        Command::Ocpp(args) => ocpp::run(&args),
        Command::Keygen(args) => keygen::run(&args),
        Command::Sign(args) => sign::run(&args),
        Command::Update(args) => update::run(&args),
        Command::Budget(args) => budget::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Keys(args) => keys::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::No(reason)) => {
            eprintln!("no: {reason}");
            ExitCode::from(1)
        }
        Err(Failure::BadInput(reason)) => {
            eprintln!("error: {reason}");
            ExitCode::from(2)
        }
    }
}
