//! `cargo test-all`: everything that must hold before a change lands, in one command.
//!
//! Runs the steps of [`steps::STEPS`] in order and stops at the first that fails. Then it prints
//! each step's time beside its budget, and one last line `N passed, N failed, N skipped` that
//! counts steps; skipped are the steps that did not run and the tests that did not. `cargo test-all
//! --list` names the steps and `cargo test-all STEP...` runs only those named. Exit codes: 0 all
//! passed, 1 a step failed, 2 bad arguments.

mod comments;
mod process;
mod python;
mod steps;
mod summary;
mod tools;
mod workspace;

use std::fmt::Write as _;
use std::process::ExitCode;
use std::time::Instant;

use steps::{STEPS, Step};
use summary::Summary;

const USAGE: &str = "usage: cargo test-all [--list | STEP...]";

/// What the command line asks for.
#[derive(Debug, PartialEq)]
enum Request {
    Help,
    List,
    /// Positions in [`STEPS`], ascending, each once.
    Run(Vec<usize>),
}

/// An argument that is neither an option nor the name of a step.
#[derive(Debug, PartialEq)]
struct UnknownArgument(String);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|argument| argument.to_string_lossy().into_owned())
        .collect();
    match parse(&arguments) {
        Ok(Request::Help) => {
            println!("{USAGE}\n\nsteps, in order:\n{}", list());
            ExitCode::SUCCESS
        }
        Ok(Request::List) => {
            print!("{}", list());
            ExitCode::SUCCESS
        }
        Ok(Request::Run(positions)) => run(&positions),
        Err(UnknownArgument(argument)) => {
            eprintln!("test-all: '{argument}' is not a step; {USAGE}\n\nsteps, in order:");
            eprint!("{}", list());
            ExitCode::from(2)
        }
    }
}

/// Reads the whole command line before anything runs, so that a misspelt step costs no time.
fn parse(arguments: &[String]) -> Result<Request, UnknownArgument> {
    let mut positions = Vec::new();
    let (mut help, mut list) = (false, false);
    for argument in arguments {
        match argument.as_str() {
            "--help" | "-h" => help = true,
            "--list" => list = true,
            name => match STEPS.iter().position(|step| step.name == name) {
                Some(position) => positions.push(position),
                None => return Err(UnknownArgument(argument.clone())),
            },
        }
    }
    if help {
        return Ok(Request::Help);
    }
    if list {
        return Ok(Request::List);
    }
    if positions.is_empty() {
        positions.extend(0..STEPS.len());
    }
    positions.sort_unstable();
    positions.dedup();
    Ok(Request::Run(positions))
}

/// One line per step: its name and what it checks.
fn list() -> String {
    let width = STEPS.iter().map(|step| step.name.len()).max().unwrap_or(0);
    STEPS.iter().fold(String::new(), |mut lines, step| {
        let _ = writeln!(lines, "  {:width$}  {}", step.name, step.about);
        lines
    })
}

/// Runs the steps at `positions` up to the first failure, prints the time of each, and the summary
/// as the last line.
fn run(positions: &[usize]) -> ExitCode {
    let mut summary = Summary::default();
    let mut failure = None;
    for (index, &position) in positions.iter().enumerate() {
        let step = &STEPS[position];
        println!(
            "\n==> {}/{} {}: {}",
            index + 1,
            positions.len(),
            step.name,
            step.about
        );
        let started = Instant::now();
        let outcome = step.run();
        let time = started.elapsed();
        println!("    {}", summary.note(step, time, outcome.as_ref().ok()));
        if let Err(error) = outcome {
            summary.not_run = positions.len() - index - 1;
            failure = Some((step, error));
            break;
        }
    }
    print!("\n{}", summary.times());
    if let Some((Step { name, .. }, error)) = &failure {
        println!("step '{name}' failed: {error}\nto run it alone: cargo test-all {name}");
    }
    println!("{}", summary.last_line());
    if failure.is_some() {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(arguments: &[&str]) -> Result<Request, UnknownArgument> {
        let owned: Vec<String> = arguments.iter().map(ToString::to_string).collect();
        parse(&owned)
    }

    #[test]
    fn no_argument_means_every_step() {
        assert_eq!(
            parsed(&[]),
            Ok(Request::Run((0..STEPS.len()).collect::<Vec<_>>()))
        );
    }

    #[test]
    fn named_steps_run_once_and_in_order() {
        let (first, last) = (STEPS[0].name, STEPS[STEPS.len() - 1].name);
        assert_eq!(
            parsed(&[last, first, last]),
            Ok(Request::Run(vec![0, STEPS.len() - 1]))
        );
    }

    #[test]
    fn an_unknown_argument_is_named() {
        for bad in ["formatt", "--lst", "", "format "] {
            assert_eq!(
                parsed(&["format", bad]),
                Err(UnknownArgument(bad.to_string()))
            );
        }
    }

    #[test]
    fn the_list_names_every_step() {
        assert_eq!(parsed(&["--list"]), Ok(Request::List));
        assert_eq!(list().lines().count(), STEPS.len());
        assert!(STEPS.iter().all(|step| list().contains(step.name)));
    }
}
