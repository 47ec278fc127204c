//! `simulate SPEC --runs N`: many runs, and what they have in common.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget};
use serde::Serialize;

use super::{Failure, OutputArgs, output, progress, run_tables};
use lab::simulation::closed_loop::ClosedLoop;
use lab::simulation::monte_carlo::draws::Draws;
use lab::simulation::monte_carlo::statistics::{Quantiles, Share};
use lab::simulation::monte_carlo::{self, RUNS_MAX, Statistics};

/// Runs between two looks at the clock and at Ctrl-C.
const BATCH: usize = 1000;

#[derive(Debug, Serialize)]
struct MonteCarloReport<'r> {
    spec: &'r str,
    draws: &'r Draws,
    #[serde(flatten)]
    statistics: &'r Statistics,
}

/// Runs the loop many times with a progress bar.
pub(super) fn many(
    closed_loop: &ClosedLoop<'_>,
    draws: &Draws,
    runs: usize,
    seed: u64,
) -> Result<Statistics, Failure> {
    if !(1..=RUNS_MAX).contains(&runs) {
        return Err(Failure::BadInput(format!(
            "--runs = {runs} is out of range: 1 to {RUNS_MAX}"
        )));
    }
    let (start, count) = (Instant::now(), AtomicUsize::new(0));
    let bar = ProgressBar::with_draw_target(Some(runs as u64), ProgressDrawTarget::hidden());
    let done = || {
        let done = count.fetch_add(1, Ordering::Relaxed) + 1;
        if done % BATCH == 0 {
            if start.elapsed() > Duration::from_secs(1) {
                bar.set_draw_target(ProgressDrawTarget::stderr());
            }
            bar.set_position(done as u64);
            return !progress::interrupted();
        }
        true
    };
    let statistics = monte_carlo::run(closed_loop, draws, runs, seed, &done);
    bar.finish_and_clear();
    statistics.ok_or_else(|| Failure::No("interrupted".to_owned()))
}

/// Runs the command: N runs from a seed, and their table or JSON.
pub(super) fn run(
    closed_loop: &ClosedLoop<'_>,
    spec_name: &str,
    draws: &Draws,
    (runs, seed): (usize, u64),
    output_args: &OutputArgs,
) -> Result<(), Failure> {
    let start = Instant::now();
    let statistics = many(closed_loop, draws, runs, seed)?;
    let elapsed_s = start.elapsed().as_secs_f64();
    if output_args.json {
        return output::json(&MonteCarloReport {
            spec: spec_name,
            draws,
            statistics: &statistics,
        });
    }
    print(&statistics);
    output::line(format_args!(
        "{} runs of {} s in {elapsed_s:.2} s; worst of all: --runs 1 --seed {}",
        output::grouped(runs),
        draws.duration_s,
        statistics.worst.seed
    ));
    if !statistics.worst.plant.is_empty() {
        output::line(format_args!("that one drew {}", statistics.worst.plant));
    }
    run_tables::summary(&statistics.worst.summary);
    Ok(())
}

fn print(statistics: &Statistics) {
    let mut shares = output::table(&["runs that", "count", "share %", "95 % interval"]);
    let rows: [(&str, &Share); 4] = [
        ("satisfy psi", &statistics.psi),
        ("fall below the containment", &statistics.breached),
        ("stay in I2 once back", &statistics.stayed_in_inner),
        ("fall back to the droop", &statistics.fallback),
    ];
    for (name, share) in rows {
        shares.add_row(vec![
            name.to_owned(),
            output::grouped(share.count),
            format!("{:.3}", 100.0 * share.share),
            format!("{:.3} to {:.3}", 100.0 * share.low, 100.0 * share.high),
        ]);
    }
    output::line(shares);
    let header = [
        "measure", "never", "min", "1 %", "5 %", "50 %", "95 %", "99 %", "max",
    ];
    let mut quantiles = output::table(&header);
    let rows: [(&str, usize, &Quantiles); 3] = [
        ("nadir Hz", 4, &statistics.nadir_hz),
        ("back in I1 s", 2, &statistics.entered_outer_s),
        ("back in I2 s", 2, &statistics.entered_inner_s),
    ];
    for (name, digits, measure) in rows {
        let mut row = vec![name.to_owned(), output::grouped(measure.without)];
        let values = measure
            .at
            .map(|at| [at.min, at.p01, at.p05, at.p50, at.p95, at.p99, at.max]);
        for index in 0..7 {
            row.push(values.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$}", v[index])));
        }
        quantiles.add_row(row);
    }
    output::line(quantiles);
}
