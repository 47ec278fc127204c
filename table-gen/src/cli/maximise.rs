//! `maximise TABLE --spec SPEC`: other levels where that makes the bound of `prob` larger.

use std::path::PathBuf;

use ::prob::closed_loop::{self, Settings};
use ::prob::maximise::{self, Place};
use ::prob::participation::Participation;
use ::prob::value;
use firmware::table::Law;
use firmware::units::STATES;
use model::spec::Spec;
use serde::Serialize;
use synth::chosen::Chosen;
use synth::problem::Problem;

use super::chain_args::{ChainArgs, view};
use super::files::write_one;
use super::first_levels::{Asked, First};
use super::{Failure, output, progress};

/// Arguments of `maximise`.
#[derive(Debug, clap::Args)]
pub(super) struct MaximiseArgs {
    #[command(flatten)]
    chain: ChainArgs,
    /// The first levels: `table`, those of TABLE, which may be one of another spec on the same
    /// cells; a participation that every cell asks for; or `search`, the best of those in runs
    #[arg(long, value_name = "WHAT", default_value = "table")]
    first: First,
    /// Steps before a possible failure at which levels may change
    #[arg(long, value_name = "N", default_value_t = 2)]
    back: u32,
    /// Most rounds of changes; 0: the first levels are only bounded and written
    #[arg(long, value_name = "N", default_value_t = 4)]
    rounds: u32,
    /// The new table
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// A round of changes.
#[derive(Debug, Serialize)]
struct Round {
    /// Bound of the levels before it.
    lower_bound: f64,
    /// Value with a level for each set.
    at_most: f64,
    opened: usize,
    states: usize,
    unfollowed: usize,
    changes: usize,
}

#[derive(Debug, Serialize)]
struct MaximiseReport<'r> {
    spec: &'r str,
    participation: String,
    horizon_s: f64,
    /// Bound of the levels of TABLE, where they are the first.
    before: Option<f64>,
    /// The participation that all first levels ask for, if they do.
    first: Option<f64>,
    lower_bound: f64,
    states: usize,
    rounds: &'r [Round],
    changed_cells: usize,
    asked_cells: usize,
    table_bytes: usize,
    table: String,
}

/// Runs the command.
pub(super) fn run(args: &MaximiseArgs) -> Result<(), Failure> {
    let spec = args.chain.spec()?;
    let (kind, settings) = question(args, &spec)?;
    progress::catch_interrupts();
    let bytes = args.chain.bytes()?;
    let problem = Problem::new(&spec).map_err(Failure::bad)?;
    let asked = Asked {
        problem: &problem,
        spec: &spec,
        kind,
        settings,
    };
    let table = view(&bytes)?;
    let (first, even) = args.first.levels(&asked, &table)?;
    let own = Chosen::of(&problem, &table).map_err(Failure::bad)?;
    let go_on = |_: usize, _: usize| !progress::interrupted();
    let mut chosen = first.clone();
    let mut best: Option<(f64, Chosen, Vec<Place>)> = None;
    let mut rounds = Vec::new();
    let mut before = None;
    for round in 0..=args.rounds {
        let dense = chosen.dense(&problem).map_err(Failure::bad)?;
        let table = view(&dense)?;
        // After the last changes there is only their bound to be found.
        let back = (round < args.rounds).then_some(args.back);
        let found = maximise::improve(&table, &spec, &kind, &settings, back, &go_on);
        let found = found.map_err(|error| match error {
            closed_loop::ClosedLoopError::Interrupted => Failure::No(error.to_string()),
            _ => Failure::bad(error),
        })?;
        if round == 0 && args.first == First::Table {
            before = Some(found.before);
        }
        if best
            .as_ref()
            .is_none_or(|(bound, ..)| found.before > *bound)
        {
            best = Some((found.before, chosen.clone(), found.asked_now));
        }
        rounds.push(Round {
            lower_bound: found.before,
            at_most: found.at_most,
            opened: found.opened,
            states: found.states,
            unfollowed: found.unfollowed,
            changes: found.changes.len(),
        });
        if found.changes.is_empty() {
            break;
        }
        for change in &found.changes {
            let Place { law, cell } = change.place;
            chosen.set(&problem, law, cell, change.level);
        }
    }
    let known = before.unwrap_or(0.0);
    let Some((bound, chosen, asked)) = best.filter(|(bound, ..)| *bound > known) else {
        let at_most = rounds
            .iter()
            .map(|round| round.at_most)
            .fold(known, f64::max);
        return Err(Failure::No(format!(
            "no other levels with a larger bound than {known:.9} were found; with any levels in the cells that were open it is at most {at_most:.9} on these sets; --back and --rounds look farther, a smaller --bin-gw leaves the adversary less"
        )));
    };
    let asked: Vec<(Law, [u16; STATES])> =
        asked.iter().map(|place| (place.law, place.cell)).collect();
    let small = chosen.small(&problem, &asked).map_err(Failure::bad)?;
    // What is told is the bound of these very bytes.
    let built = closed_loop::build(&view(&small)?, &spec, &kind, &settings, &go_on);
    let built = built.map_err(Failure::bad)?;
    let lower_bound = value::bounds(&built.chain, built.steps)
        .last()
        .copied()
        .unwrap_or(0.0);
    write_one(&args.out, &small)?;
    let report = MaximiseReport {
        spec: &spec.name,
        participation: kind.to_string(),
        horizon_s: settings.horizon_s,
        before,
        first: even,
        lower_bound,
        states: built.chain.states(),
        rounds: &rounds,
        changed_cells: chosen.differences(&own),
        asked_cells: asked.len(),
        table_bytes: small.len(),
        table: args.out.display().to_string(),
    };
    if args.chain.output.json {
        return output::json(&report);
    }
    print(&report, bound);
    Ok(())
}

/// How the participation is drawn, and how finely the chain is built.
fn question(args: &MaximiseArgs, spec: &Spec) -> Result<(Participation, Settings), Failure> {
    let Some(kind) = args.chain.drawn(spec) else {
        return Err(Failure::BadInput(
            "--participation or the key chance.participation is needed: exact is one".to_owned(),
        ));
    };
    if args.rounds > 100 || args.back > 100 {
        return Err(Failure::BadInput("--rounds and 0 to 100".to_owned()));
    }
    let settings = args.chain.settings(spec)?;
    Ok((kind, settings))
}

/// The result for people.
fn print(report: &MaximiseReport<'_>, bound: f64) {
    let mut table = output::table(&[
        "round",
        "bound",
        "at most",
        "open cells",
        "states",
        "changes",
    ]);
    for (index, round) in report.rounds.iter().enumerate() {
        table.add_row(vec![
            index.to_string(),
            format!("{:.9}", round.lower_bound),
            format!("{:.9}", round.at_most),
            output::grouped(round.opened),
            output::grouped(round.states),
            output::grouped(round.changes),
        ]);
    }
    output::line(table);
    if let Some(u) = report.first {
        output::line(format_args!("first levels: {u} in every cell"));
    }
    let before = report
        .before
        .map_or(String::new(), |before| format!(", before {before:.9}"));
    output::line(format_args!(
        "{}: P(psi over {} s) >= {:.9}{}; {} cells have another level, {} are asked for",
        report.spec,
        report.horizon_s,
        report.lower_bound,
        before,
        output::grouped(report.changed_cells),
        output::grouped(report.asked_cells)
    ));
    if report.lower_bound < bound {
        output::line(format_args!(
            "the small table has less than the dense one ({bound:.9}): a cell past the horizon is not in it"
        ));
    }
    output::line(format_args!(
        "wrote {} ({} bytes); `prob` bounds it as any other table",
        report.table,
        output::grouped(report.table_bytes)
    ));
}
