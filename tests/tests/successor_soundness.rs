//! No real successor escapes its box, and no trajectory leaves the band that a guard promised.
//!
//! Millions of random samples: states at corners and inside of cells, every input, losses and
//! participation errors that jump between their extremes within a period, errors of the estimate
//! before and after. The reference steps are plain floating point (nalgebra's exponential); its
//! rounding is below 1e-6 micro-units, so a state is only counted as outside if it is by more than
//! that.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::plant::Plant;
use model::propagator::Propagator;
use model::spec::Spec;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use synth::abstraction::Abstraction;
use synth::abstraction::affine::AffineInput;
use synth::abstraction::guard::Guard;
use synth::abstraction::tube::TubeGuard;
use synth::problem::Problem;
use synth::synthesis;
use tests::testing::load;

/// Pieces of a period on which loss and participation are held.
const PIECES: usize = 5;
/// Rounding of the reference \[micro-units\].
const ROUNDING: f64 = 1e-6;

struct Random(Pcg64);

impl Random {
    fn new() -> Self {
        Self(Pcg64::seed_from_u64(1))
    }
    /// In `[0, 1)`.
    fn unit(&mut self) -> f64 {
        self.0.random_range(0.0..1.0)
    }
    /// In `[-1, 1]`, an end half of the time.
    fn extreme(&mut self) -> f64 {
        match self.below(4) {
            0 => -1.0,
            1 => 1.0,
            _ => 2.0 * self.unit() - 1.0,
        }
    }
    fn below(&mut self, n: u32) -> u32 {
        self.0.random_range(0..n)
    }
}

fn specs() -> Vec<Spec> {
    let robust = [
        "uncertainty.loss_gw=[1.8,2.2]",
        "uncertainty.participation=0.1",
        "uncertainty.measurement=[0.002,0.006,0.004,0.004]",
        "sampling.period_s=1.0",
        "method.successor=exact-linear",
        "grid.alignment=edges",
        "grid.width=[0.01,0.1,0.05,0.05]",
    ];
    vec![
        load("paper-bi", &[]),
        load("paper-bi", &["method.successor=exact-linear"]),
        load(
            "paper-uni",
            &[
                "uncertainty.participation=0.3",
                "uncertainty.loss_gw=[-1.0,3.0]",
            ],
        ),
        load(
            "paper-bi",
            &[
                "uncertainty.participation=0.1",
                "uncertainty.hostile_share=0.05",
            ],
        ),
        load("paper-bi", &robust),
    ]
}

/// A random real trajectory from a cell: the states at the ends of the pieces, in micro-units.
struct Trial<'t> {
    spec: &'t Spec,
    step: Propagator,
    error: [f64; 4],
    fleet: f64,
}

impl<'t> Trial<'t> {
    fn new(spec: &'t Spec, pieces: usize) -> Self {
        let plant = Plant::new(spec);
        Self {
            spec,
            step: Propagator::new(&plant, spec.sampling.period_s / pieces as f64),
            error: spec.uncertainty.measurement.map(|e| e * 1e6),
            fleet: spec.fleet_power_gw() * 1e6,
        }
    }

    fn start(&self, random: &mut Random, bounds: [(f64, f64); 4]) -> [f64; 4] {
        std::array::from_fn(|d| {
            let (low, high) = bounds[d];
            0.5 * (low + high)
                + 0.5 * (high - low) * random.extreme()
                + self.error[d] * random.extreme()
        })
    }

    fn net_power(&self, random: &mut Random, level: usize) -> f64 {
        let u = self.spec.input.value(level);
        let honest = u * (1.0 + self.spec.uncertainty.participation * random.extreme());
        // Hostile chargers give nothing, everything or anything between.
        let hostile = self.spec.uncertainty.hostile_share.unwrap_or(0.0);
        let given = 0.5 + 0.5 * random.extreme();
        let delivered = (1.0 - hostile) * honest + hostile * given;
        let [low, high] = self.spec.uncertainty.loss_gw.map(|w| w * 1e6);
        let loss = 0.5 * (low + high) + 0.5 * (high - low) * random.extreme();
        self.fleet * delivered.min(1.0) - loss
    }
}

#[test]
fn no_successor_escapes_its_box() {
    let mut random = Random::new();
    let mut checked = 0u32;
    for spec in specs() {
        let problem = Problem::new(&spec).unwrap();
        let abstraction = synthesis::abstraction(&problem).unwrap();
        let shape = *abstraction.shape();
        let trial = Trial::new(&spec, PIECES);
        for _ in 0..2_000_000 {
            let cell = shape.count.map(|n| random.below(n));
            let level = random.below(abstraction.inputs() as u32) as usize;
            let anchor = abstraction.anchor(cell);
            let Some(cells) = abstraction.successor(&anchor, level) else {
                continue;
            };
            let bounds = std::array::from_fn(|d| shape.interval(d, cell[d]));
            let mut x = trial.start(&mut random, bounds);
            for _ in 0..PIECES {
                let power = trial.net_power(&mut random, level);
                x = trial.step.step(&x, power);
            }
            checked += 1;
            for d in 0..4 {
                let estimate = x[d] + trial.error[d] * random.extreme();
                let (low, _) = shape.interval(d, cells.low[d]);
                let (_, high) = shape.interval(d, cells.high[d]);
                assert!(
                    estimate >= low - ROUNDING && estimate <= high + ROUNDING,
                    "{}: cell {cell:?}, level {level}, axis {d}: {estimate} outside [{low}, {high}]",
                    spec.name
                );
            }
        }
    }
    println!("{checked} successors checked");
    assert!(checked > 3_000_000);
}

#[test]
fn no_trajectory_leaves_the_band_of_a_guard() {
    // Finer than the guard's own cuts, so that its chords are tested between them.
    const FINE: usize = 150;
    let mut random = Random::new();
    let mut checked = 0u32;
    for spec in specs() {
        let shape = Problem::new(&spec).unwrap().shape;
        let (a, b) = Plant::new(&spec).matrices();
        let inputs: Vec<_> = (0..spec.input.levels())
            .map(|level| AffineInput {
                a,
                b,
                drive: synth::drives::net_power(&spec, level),
            })
            .collect();
        let trial = Trial::new(&spec, FINE);
        let band = (-400_000.0, -50_000.0);
        let guard = TubeGuard::new(
            &shape,
            &inputs,
            spec.sampling.period_s,
            trial.error,
            0,
            band,
        );
        for _ in 0..20_000 {
            let cell = shape.count.map(|n| random.below(n));
            let permitted = guard.permitted(cell, u32::MAX >> (32 - inputs.len()));
            if permitted == 0 {
                continue;
            }
            let level = (0..32)
                .filter(|u| permitted >> u & 1 == 1)
                .nth(random.below(permitted.count_ones()) as usize)
                .unwrap();
            let bounds = std::array::from_fn(|d| shape.interval(d, cell[d]));
            let mut x = trial.start(&mut random, bounds);
            // Hold each disturbance for a random stretch.
            let mut power = trial.net_power(&mut random, level);
            for _ in 0..FINE {
                if random.below(20) == 0 {
                    power = trial.net_power(&mut random, level);
                }
                assert!(
                    x[0] >= band.0 - ROUNDING && x[0] <= band.1 + ROUNDING,
                    "{}: cell {cell:?}, level {level}: f = {} µHz",
                    spec.name,
                    x[0]
                );
                x = trial.step.step(&x, power);
            }
            checked += 1;
        }
    }
    println!("{checked} trajectories checked");
    assert!(checked > 5_000, "{checked}");
}
