//! Benchmarks of the field on the engine of `prob`: `cargo run --release --example field --
//! robot|vehicle|building [FINER]`.
//!
//! | case | question | IMPaCT's example |
//! |---|---|---|
//! | `robot` | reach a square and avoid another, 2 states | `ex_2Drobot-RA-U` |
//! | `vehicle` | reach a region and avoid a wall, 3 states | `ex_3Dvehicle-RA` |
//! | `building` | two rooms stay warm, 4 states | `ex_4DBAS-S` |
//!
//! Dynamics, regions, deviations and points are those of IMPaCT's files, but for the points of the
//! vehicle: they are as many as in the published table. The building is the 4-dimensional one of
//! ARCH-COMP's stochastic category. A point stands for the cell
//! around it, as it does there. FINER cuts each cell into so many on each axis.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "an example"
)]

use std::time::Instant;

use model::interval::Interval;
use prob::grid::{Cells, Field, Goal, Kind, Process};
use synth::trigonometry::{sin_cos, tan};

/// Steps after which a reach question ends; it ends before where nothing grows by more than
/// `SETTLED`.
const STEPS: u32 = 1000;
/// Smaller changes of a value end a reach question.
const SETTLED: f64 = 1e-7;

/// Cells around points from `low` to `high`, `eta` apart, cut into `finer` on each axis.
fn around<const D: usize>(low: [f64; D], high: [f64; D], eta: [f64; D], finer: usize) -> Cells<D> {
    let part = finer as f64;
    Cells {
        lower: std::array::from_fn(|d| low[d] - 0.5 * eta[d]),
        width: eta.map(|eta| eta / part),
        count: std::array::from_fn(|d| {
            ((high[d] - low[d]) / eta[d]).round() as usize * finer + finer
        }),
    }
}

/// The point that a cell belongs to, on each axis.
fn point<const D: usize>(low: [f64; D], eta: [f64; D], cell: [usize; D], finer: usize) -> [f64; D] {
    std::array::from_fn(|d| low[d] + eta[d] * (cell[d] / finer) as f64)
}

/// Whether a point is in a box; points are multiples of a tenth, edges too.
fn within<const D: usize>(x: &[f64; D], low: [f64; D], high: [f64; D]) -> bool {
    (0..D).all(|d| x[d] >= low[d] - 1e-9 && x[d] <= high[d] + 1e-9)
}

/// Inputs from `low` to `high`, `eta` apart: all pairs.
fn pairs(low: [f64; 2], high: [f64; 2], eta: [f64; 2]) -> Vec<[f64; 2]> {
    let along = |d: usize| {
        let last = ((high[d] - low[d]) / eta[d]).round() as usize;
        (0..=last).map(move |i| low[d] + eta[d] * i as f64)
    };
    along(0)
        .flat_map(|a| along(1).map(move |b| [a, b]))
        .collect()
}

/// Enclosures of sine and cosine over an interval: those of its middle, and the mean value
/// theorem.
fn sine_and_cosine(x: Interval) -> (Interval, Interval) {
    let (sine, cosine) = sin_cos(Interval::point(x.mid()));
    let radius = x.radius();
    let around = |value: Interval, slope: Interval| {
        let slope = (slope.magnitude() + radius).next_up().min(1.0);
        let reach = (slope * radius).next_up();
        let most = Interval::hull(-1.0, 1.0);
        let wide = value + Interval::hull(-reach, reach);
        Interval {
            low: wide.low.max(most.low),
            high: wide.high.min(most.high),
        }
    };
    (around(sine, cosine), around(cosine, sine))
}

struct Robot {
    inputs: Vec<[f64; 2]>,
    finer: usize,
}

const ROBOT: ([f64; 2], [f64; 2], [f64; 2]) = ([-10.0; 2], [10.0; 2], [0.5; 2]);

impl Process<2> for Robot {
    fn inputs(&self) -> usize {
        self.inputs.len()
    }

    fn mean(&self, from: &[Interval; 2], input: usize) -> [Interval; 2] {
        let [speed, angle] = self.inputs[input].map(Interval::point);
        let step = Interval::point(2.0) * speed;
        let (sine, cosine) = sin_cos(angle);
        [from[0] + step * cosine, from[1] + step * sine]
    }

    fn sigma(&self) -> [f64; 2] {
        [(1.0f64 / 1.3333).sqrt(); 2]
    }

    fn kind(&self, cell: [usize; 2]) -> Kind {
        let x = point(ROBOT.0, ROBOT.2, cell, self.finer);
        if within(&x, [5.0; 2], [8.0; 2]) {
            Kind::Target
        } else if within(&x, [-1.5; 2], [1.5; 2]) {
            Kind::Avoid
        } else {
            Kind::Ordinary
        }
    }
}

struct Vehicle {
    inputs: Vec<[f64; 2]>,
    finer: usize,
}

/// The published size: 21 · 21 · 35 points.
const VEHICLE: ([f64; 3], [f64; 3], [f64; 3]) =
    ([-5.0, -5.0, -3.4], [5.0, 5.0, 3.4], [0.5, 0.5, 0.2]);

impl Process<3> for Vehicle {
    fn inputs(&self) -> usize {
        self.inputs.len()
    }

    fn mean(&self, from: &[Interval; 3], input: usize) -> [Interval; 3] {
        // The slip angle is atan(tan(δ)/2): its sine and cosine from its tangent t.
        let [speed, angle] = self.inputs[input].map(Interval::point);
        let tangent = tan(angle);
        let t = tangent * Interval::point(0.5);
        let step = Interval::point(0.1) * speed;
        let (s, c) = sine_and_cosine(from[2]);
        // cos(slip + θ)/cos(slip) = cos θ - t sin θ, and the sine alike.
        [
            from[0] + step * (c - t * s),
            from[1] + step * (s + t * c),
            from[2] + step * tangent,
        ]
    }

    fn sigma(&self) -> [f64; 3] {
        [(1.0f64 / 1.5).sqrt(); 3]
    }

    fn kind(&self, cell: [usize; 3]) -> Kind {
        let x = point(VEHICLE.0, VEHICLE.2, cell, self.finer);
        if within(&x, [-5.75, -0.25, -3.45], [0.25, 5.75, 3.45]) {
            Kind::Target
        } else if within(&x, [-5.75, -0.75, -3.45], [0.25, -0.25, 3.45]) {
            Kind::Avoid
        } else {
            Kind::Ordinary
        }
    }
}

struct Building;

const BUILDING: ([f64; 4], [f64; 4], [f64; 4]) = (
    [19.0, 19.0, 30.0, 30.0],
    [21.0, 21.0, 36.0, 36.0],
    [0.5, 0.5, 1.0, 1.0],
);

impl Process<4> for Building {
    fn inputs(&self) -> usize {
        4
    }

    fn mean(&self, from: &[Interval; 4], input: usize) -> [Interval; 4] {
        const A: [[f64; 4]; 4] = [
            [0.6682, 0.0, 0.02632, 0.0],
            [0.0, 0.6830, 0.0, 0.02096],
            [1.0005, 0.0, -0.000499, 0.0],
            [0.0, 0.8004, 0.0, 0.1996],
        ];
        const B: [f64; 4] = [0.1320, 0.1402, 0.0, 0.0];
        const Q: [f64; 4] = [3.4378, 2.9272, 13.0207, 10.4166];
        let u = Interval::point(17.0 + input as f64);
        std::array::from_fn(|i| {
            let driven = Interval::point(B[i]) * u + Interval::point(Q[i]);
            (0..4).fold(driven, |sum, j| sum + Interval::point(A[i][j]) * from[j])
        })
    }

    fn sigma(&self) -> [f64; 4] {
        [0.0774f64, 0.0774, 0.3872, 0.3098].map(f64::sqrt)
    }

    fn kind(&self, _cell: [usize; 4]) -> Kind {
        Kind::Ordinary
    }
}

/// Peak memory of this process \[MB\].
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kb = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kb.unwrap_or(0.0) / 1024.0
}

/// Processor time of this process \[s\].
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks = |n: usize| -> f64 {
        let field = after.split_whitespace().nth(n);
        field.and_then(|text| text.parse().ok()).unwrap_or(0.0)
    };
    (ticks(11) + ticks(12)) / 100.0
}

/// Asks, and tells what came out. `shown` are points to be told.
fn ask<const D: usize>(
    name: &str,
    process: &impl Process<D>,
    cells: Cells<D>,
    (goal, steps): (Goal, u32),
    shown: &[[f64; D]],
) {
    let begun = Instant::now();
    let field = Field::new(process, cells);
    let cut = cpu_s();
    let (values, made) = field.values(goal, steps, if steps == STEPS { SETTLED } else { 0.0 });
    let ordinary: Vec<f64> = (0..cells.cells())
        .filter(|index| process.kind(cells.cell(*index)) == Kind::Ordinary)
        .map(|index| values[index])
        .collect();
    let mean = ordinary.iter().sum::<f64>() / ordinary.len() as f64;
    let most = ordinary.iter().copied().fold(0.0, f64::max);
    let least = ordinary.iter().copied().fold(1.0, f64::min);
    let (batches, rows) = field.stored();
    println!(
        "{name}: {} cells ({} ordinary), {} inputs, {made} steps: bound {least:.6} to {most:.6}, mean {mean:.6}",
        cells.cells(),
        ordinary.len(),
        process.inputs(),
    );
    for x in shown {
        let cell = std::array::from_fn(|d| ((x[d] - cells.lower[d]) / cells.width[d]) as usize);
        println!("  at {x:?}: {:.6}", values[cells.index(cell)]);
    }
    println!(
        "  {batches} batches, {rows} rows; cutting {cut:.1} s, all {:.1} s of processor time, {:.1} s by the clock; peak {:.0} MB",
        cpu_s(),
        begun.elapsed().as_secs_f64(),
        peak_mb()
    );
}

fn main() {
    let mut args = std::env::args().skip(1);
    let case = args.next().unwrap_or_default();
    let finer: usize = args.next().map_or(1, |text| text.parse().expect("FINER"));
    match case.as_str() {
        "robot" => {
            let inputs = pairs([-1.0; 2], [1.0; 2], [0.1; 2]);
            let cells = around(ROBOT.0, ROBOT.1, ROBOT.2, finer);
            let shown = [[-8.0, -8.0], [0.0, 5.0], [3.0, 3.0]];
            let robot = Robot { inputs, finer };
            ask("robot", &robot, cells, (Goal::Reach, STEPS), &shown);
        }
        "vehicle" => {
            let inputs = pairs([-1.0, -0.4], [4.0, 0.4], [0.5, 0.1]);
            let cells = around(VEHICLE.0, VEHICLE.1, VEHICLE.2, finer);
            let shown = [[4.0, 4.0, 3.0], [2.0, 3.0, 3.0]];
            let vehicle = Vehicle { inputs, finer };
            ask("vehicle", &vehicle, cells, (Goal::Reach, STEPS), &shown);
        }
        "building" => {
            let cells = around(BUILDING.0, BUILDING.1, BUILDING.2, finer);
            let shown = [[20.0, 20.0, 33.0, 33.0]];
            ask(
                "building, 6 steps",
                &Building,
                cells,
                (Goal::Safe, 6),
                &shown,
            );
            ask(
                "building, 10 steps",
                &Building,
                cells,
                (Goal::Safe, 10),
                &shown,
            );
        }
        other => panic!("{other:?}: robot, vehicle or building, and how much finer"),
    }
}
