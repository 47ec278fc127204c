//! Many runs of the closed loop, each from its own seed.
//!
//! Run i of N has the seed `first + i`, and everything in a run follows from its seed. So the
//! result does not depend on the number of threads, and any run can be looked at again: `simulate
//! SPEC --runs 1 --seed S`.

pub mod draws;
pub mod statistics;

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::closed_loop::ClosedLoop;
use super::monitor::Summary;
use draws::Draws;
use statistics::{Quantiles, Share};

/// Most runs that are kept in memory at once.
pub const RUNS_MAX: usize = 10_000_000;

/// What is kept of each run.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    nadir_hz: f64,
    entered_outer_s: Option<f64>,
    entered_inner_s: Option<f64>,
    satisfies_psi: bool,
    breached: bool,
    stayed: bool,
    fallback: bool,
}

impl Outcome {
    fn of(summary: &Summary) -> Self {
        Self {
            nadir_hz: summary.nadir_hz,
            entered_outer_s: summary.entered_outer_s,
            entered_inner_s: summary.entered_inner_s,
            satisfies_psi: summary.satisfies_psi,
            breached: summary.containment_breached == Some(true),
            stayed: summary.stayed_in_inner,
            fallback: summary.fallback_s > 0.0,
        }
    }

    /// Order of badness: ψ missed first, then the deeper nadir.
    fn badness(&self) -> (bool, f64) {
        (!self.satisfies_psi, -self.nadir_hz)
    }
}

/// One run, by its seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeptRun {
    /// Replay it with `--runs 1 --seed` this.
    pub seed: u64,
    /// What was drawn of the plant: `H = 3.1, D = 0.7`; empty where the spec knows it.
    pub plant: String,
    /// What it is judged by.
    #[serde(flatten)]
    pub summary: Summary,
}

/// What many runs have in common.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistics {
    /// Runs.
    pub runs: usize,
    /// Seed of the first.
    pub seed: u64,
    /// Runs that satisfy ψ.
    pub psi: Share,
    /// Runs that fell below the containment.
    pub breached: Share,
    /// Runs in which f stayed in I2 once it was back.
    pub stayed_in_inner: Share,
    /// Runs in which the firmware fell back to the droop for some time.
    pub fallback: Share,
    /// Lowest frequency \[Hz\].
    pub nadir_hz: Quantiles,
    /// Time back into I1 \[s\].
    pub entered_outer_s: Quantiles,
    /// Time back into I2 \[s\].
    pub entered_inner_s: Quantiles,
    /// A run that misses ψ if there is one, of these the one with the lowest nadir.
    pub worst: KeptRun,
}

/// Runs the loop `runs` times, at least once, with the seeds from `seed` on. `done` is told of each
/// run and answers whether to go on; `None` if it said no.
pub fn run(
    closed_loop: &ClosedLoop<'_>,
    draws: &Draws,
    runs: usize,
    seed: u64,
    done: &(dyn Fn() -> bool + Sync),
) -> Option<Statistics> {
    let runs = runs.max(1);
    let stopped = AtomicBool::new(false);
    let one = |closed_loop: &mut ClosedLoop<'_>, index: usize| {
        if stopped.load(Ordering::Relaxed) {
            return None;
        }
        let summary = run_one(closed_loop, draws, seed.wrapping_add(index as u64));
        if !done() {
            stopped.store(true, Ordering::Relaxed);
        }
        Some(Outcome::of(&summary))
    };
    let outcomes: Vec<Outcome> = (0..runs)
        .into_par_iter()
        .with_min_len(32)
        .map_init(|| closed_loop.clone(), one)
        .collect::<Option<_>>()?;
    let count = |has: fn(&Outcome) -> bool| {
        let count = outcomes.iter().filter(|outcome| has(outcome)).count();
        Share::of(count, runs)
    };
    let worst = outcomes
        .iter()
        .enumerate()
        .max_by(|(i, a), (j, b)| {
            let ((missed_a, depth_a), (missed_b, depth_b)) = (a.badness(), b.badness());
            let order = missed_a.cmp(&missed_b).then(depth_a.total_cmp(&depth_b));
            // Of equals the first.
            order.then(j.cmp(i))
        })
        .map_or(0, |(index, _)| index);
    let worst_seed = seed.wrapping_add(worst as u64);
    let summary = run_one(&mut closed_loop.clone(), draws, worst_seed);
    let plant = draws.plant(worst_seed);
    let plant = plant.map_or_else(String::new, |plant| draws.plant.told(plant));
    Some(Statistics {
        runs,
        seed,
        psi: count(|o| o.satisfies_psi),
        breached: count(|o| o.breached),
        stayed_in_inner: count(|o| o.stayed),
        fallback: count(|o| o.fallback),
        nadir_hz: Quantiles::of(outcomes.iter().map(|o| Some(o.nadir_hz))),
        entered_outer_s: Quantiles::of(outcomes.iter().map(|o| o.entered_outer_s)),
        entered_inner_s: Quantiles::of(outcomes.iter().map(|o| o.entered_inner_s)),
        worst: KeptRun {
            seed: worst_seed,
            plant,
            summary,
        },
    })
}

/// The run of a seed.
fn run_one(closed_loop: &mut ClosedLoop<'_>, draws: &Draws, seed: u64) -> Summary {
    if let Some(plant) = draws.plant(seed) {
        closed_loop.set_plant(plant);
    }
    closed_loop.run(&draws.scenario(seed), &mut ())
}
