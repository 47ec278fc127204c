//! Single runs of the process that [`crate::closed_loop`] bounds, in plain numbers: what the bound
//! is held against.

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::TableView;
use firmware::units::{MICRO, STATES, State};
use model::flow::Flow;
use model::plant::Plant;
use model::spec::Spec;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

use crate::kept::Kept;
pub use crate::kept::Run;
use crate::participation::Participation;
use crate::under_way::{Draw, UnderWay};
use crate::unit::unit;

/// Samples of f in a tick.
const SAMPLES: u32 = 5;
/// Most runs.
pub const RUNS_MAX: u32 = 100_000_000;

/// What many runs have in common.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Runs {
    /// Runs.
    pub runs: u32,
    /// Of these kept the promise.
    pub kept: u32,
    /// Their share.
    pub share: f64,
    /// Interval of Clopper and Pearson at 95 %.
    pub interval_95: [f64; 2],
    /// The same at 1 - 1e-6.
    pub interval_1e6: [f64; 2],
    /// Lowest frequency of all runs \[Hz\].
    pub lowest_hz: f64,
    /// Seed of the run with the lowest frequency, of those that broke the promise if there are any.
    pub worst_seed: u64,
}

/// The closed loop in plain numbers.
pub struct Sampled<'a> {
    table: &'a TableView<'a>,
    spec: &'a Spec,
    participation: Participation,
    fleet_gw: f64,
    /// A fifth of a tick.
    step: ([[f64; STATES]; STATES], [f64; STATES]),
    ticks: u32,
}

impl<'a> Sampled<'a> {
    /// The closed loop of a table of laws by games, over a horizon \[s\].
    pub fn new(
        table: &'a TableView<'a>,
        spec: &'a Spec,
        participation: Participation,
        horizon_s: f64,
    ) -> Self {
        let plant = Plant::new(spec);
        let (a, b) = plant.matrices();
        let tick_s = f64::from(table.header().tick_ms) / 1000.0;
        let flow = Flow::over(&a, &b, tick_s / f64::from(SAMPLES));
        Self {
            table,
            spec,
            participation,
            fleet_gw: plant.fleet,
            step: (
                flow.phi.map(|row| row.map(model::interval::Interval::mid)),
                flow.gamma.map(model::interval::Interval::mid),
            ),
            ticks: (horizon_s / tick_s).ceil() as u32,
        }
    }

    /// The run of a seed. Uniform are the moment of the event, the loss in its band (constant) and
    /// the initial state; the estimate's error is uniform and anew at each tick.
    pub fn run(&self, seed: u64) -> Run {
        let mut random = Pcg64::seed_from_u64(seed);
        let header = self.table.header();
        let uncertainty = &self.spec.uncertainty;
        let between = |random: &mut Pcg64, [low, high]: [f64; 2]| low + (high - low) * unit(random);
        let loss = between(&mut random, uncertainty.loss_gw);
        let initial = &uncertainty.initial;
        let mut x: [f64; STATES] =
            std::array::from_fn(|d| between(&mut random, [initial.lower[d], initial.upper[d]]));
        let mut kept = Kept::new(self.table, self.spec);
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let mut fleet = UnderWay::new(self.table, self.spec, tick_s / f64::from(SAMPLES));
        let (mut state, mut clock) = (PhaseState::INITIAL, 0u32);
        kept.see(x[0]);
        // The event comes between two ticks: whole fifths of a tick here.
        let offset = (unit(&mut random) * f64::from(SAMPLES)) as u32;
        for _ in 0..offset {
            self.fly(&mut x, -loss);
            kept.see(x[0]);
        }
        for _ in 0..self.ticks {
            let error: [f64; STATES] = std::array::from_fn(|d| {
                between(
                    &mut random,
                    [-uncertainty.measurement[d], uncertainty.measurement[d]],
                )
            });
            let measured = State(std::array::from_fn(|d| {
                ((x[d] + error[d]) * f64::from(MICRO)).floor() as i32
            }));
            let was = state;
            let ahead = || fleet.ahead(self.table, measured);
            let (next, decision) = state.step_ahead(self.table, measured, ahead);
            state = next;
            kept.decided(next.phase, decision);
            let Decision::Level(level) = decision else {
                return kept.run();
            };
            let redrawn = match next.phase {
                Phase::NoControl | Phase::Fallback | Phase::Response => false,
                Phase::Fixed => was.phase != Phase::Fixed || clock == 0,
                Phase::C1 | Phase::C2 | Phase::Hold => was.ticks_left == 0,
            };
            let draw = redrawn.then(|| {
                let command = f64::from(header.participation(level).ppm()) / f64::from(MICRO);
                clock = u32::from(header.period_ticks);
                Draw {
                    delivered: self.draw(&mut random, command),
                    changes: next.level != was.level,
                }
            });
            fleet.tick(level, draw);
            for _ in 0..SAMPLES {
                let delivered = fleet.delivered(&mut random);
                self.fly(&mut x, self.fleet_gw * delivered - loss);
                kept.see(x[0]);
            }
            kept.tick();
            if !kept.holds {
                return kept.run();
            }
            clock = clock.saturating_sub(1);
        }
        kept.run()
    }

    /// One sample.
    fn fly(&self, x: &mut [f64; STATES], v: f64) {
        *x = std::array::from_fn(|i| {
            let free: f64 = (0..STATES).map(|j| self.step.0[i][j] * x[j]).sum();
            free + self.step.1[i] * v
        });
    }

    fn draw(&self, random: &mut Pcg64, u: f64) -> f64 {
        let error = match self.participation {
            Participation::Exact => 0.0,
            Participation::Uniform { bound } => bound * (2.0 * unit(random) - 1.0),
            Participation::Gaussian { sigma, .. } => sigma * normal(random),
            Participation::Truncated { sigma, bound } => loop {
                let error = sigma * normal(random);
                if error.abs() <= bound {
                    break error;
                }
            },
            Participation::Bernoulli { chargers } => {
                let hits = (0..chargers).filter(|_| unit(random) < u).count();
                return hits as f64 / f64::from(chargers);
            }
        };
        (u * (1.0 + error)).clamp(0.0, 1.0)
    }

    /// Many runs, with the seeds from `seed` on. Nothing if `go_on` ended them.
    pub fn many(&self, runs: u32, seed: u64, go_on: &(dyn Fn() -> bool + Sync)) -> Option<Runs> {
        let one = |index: u32| {
            let seed = seed.wrapping_add(u64::from(index));
            (!index.is_multiple_of(64) || go_on()).then(|| (seed, self.run(seed)))
        };
        let all: Vec<(u64, Run)> = (0..runs.clamp(1, RUNS_MAX))
            .into_par_iter()
            .map(one)
            .collect::<Option<_>>()?;
        let kept = all.iter().filter(|(_, run)| run.kept).count() as u32;
        let (worst_seed, _) = *all.iter().min_by(|(_, a), (_, b)| {
            a.kept
                .cmp(&b.kept)
                .then(a.lowest_hz.total_cmp(&b.lowest_hz))
        })?;
        let runs = all.len() as u32;
        Some(Runs {
            runs,
            kept,
            share: f64::from(kept) / f64::from(runs),
            interval_95: clopper_pearson(kept, runs, 0.05),
            interval_1e6: clopper_pearson(kept, runs, 1e-6),
            lowest_hz: all
                .iter()
                .map(|(_, run)| run.lowest_hz)
                .fold(f64::INFINITY, f64::min),
            worst_seed,
        })
    }
}

/// A normal number, by the method of Box and Muller.
fn normal(random: &mut Pcg64) -> f64 {
    let (radius, angle) = (1.0 - unit(random), std::f64::consts::TAU * unit(random));
    (-2.0 * radius.ln()).sqrt() * angle.cos()
}

/// The interval of Clopper and Pearson: it misses the true share with probability at most `miss`.
fn clopper_pearson(kept: u32, runs: u32, miss: f64) -> [f64; 2] {
    let (k, n) = (f64::from(kept), f64::from(runs));
    let quantile =
        |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = match kept {
        0 => 0.0,
        // The power in closed form: the quantile of a Beta law with the shapes n and 1.
        kept if kept == runs => (0.5 * miss).powf(1.0 / n),
        _ => quantile(k, n - k + 1.0, 0.5 * miss),
    };
    let high = match kept {
        kept if kept == runs => 1.0,
        0 => 1.0 - (0.5 * miss).powf(1.0 / n),
        _ => quantile(k + 1.0, n - k, 1.0 - 0.5 * miss),
    };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_clopper_and_pearson_are_known() {
        // 8 of 10 at 95 %: 0.4439 to 0.9748, from tables.
        let [low, high] = clopper_pearson(8, 10, 0.05);
        assert!((low - 0.4439).abs() < 1e-4 && (high - 0.9748).abs() < 1e-4);
        // The rule of three: none of 1000 broke, so at most 3.7 in a thousand do.
        let [low, high] = clopper_pearson(1000, 1000, 0.05);
        assert!((low - (1.0 - 3.68e-3)).abs() < 1e-5 && high == 1.0);
    }

    #[test]
    fn a_seed_gives_the_same_run() {
        let bytes = include_bytes!("../../../firmware/tables/paper-bi.bin");
        let table = TableView::parse(bytes).unwrap();
        let spec = Spec::load("paper-bi", &[]).unwrap();
        let exact = Sampled::new(&table, &spec, Participation::Exact, 120.0);
        let run = exact.run(7);
        assert_eq!(run, exact.run(7));
        // docs/guarantees.md: paper-bi with its tree never falls below -0.417 Hz.
        assert!(run.kept && run.lowest_hz >= -0.417 && run.lowest_hz < -0.3);
    }
}
