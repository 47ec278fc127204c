//! Processes with additive noise on cells: held against what is known exactly, against the same
//! process as a chain of choices, and against runs.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::interval::Interval;
use prob::chain::ChainBuilder;
use prob::choices::{Choices, Goal};
use prob::grid::{Cells, Field, Kind, Process};
use prob::normal;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// `x+ = w` on one axis, inside [-1, 1] for ever: known.
struct Forgets;

impl Process<1> for Forgets {
    fn inputs(&self) -> usize {
        1
    }
    fn mean(&self, _from: &[Interval; 1], _input: usize) -> [Interval; 1] {
        [Interval::ZERO]
    }
    fn sigma(&self) -> [f64; 1] {
        [0.5]
    }
    fn kind(&self, _cell: [usize; 1]) -> Kind {
        Kind::Ordinary
    }
}

#[test]
fn a_process_without_memory_is_known() {
    let cells = Cells {
        lower: [-1.0],
        width: [0.25],
        count: [8],
    };
    let (values, steps) = Field::new(&Forgets, cells).values(Goal::Safe, 10, 0.0);
    assert_eq!(steps, 10);
    // Φ(2) - Φ(-2) = 0.954499736103642 each step.
    let known = 0.954_499_736_103_642f64.powi(10);
    for value in values {
        // Φ is a series of at most 200 terms of a few roundings each, 1e-13 at most: 16 ends of
        // bins, ten steps. The known number has 15 digits, ten times.
        assert!(value <= known + 1e-14, "{value} {known}");
        assert!(value > known - 160.0 * 1e-13, "{value} {known}");
    }
}

/// `x+ = A x + u + w` on two axes: three inputs, a target and a cell to avoid.
struct Small;

const A: [[f64; 2]; 2] = [[0.8, 0.1], [-0.2, 0.7]];
const INPUTS: [[f64; 2]; 3] = [[0.0, 0.0], [0.5, 0.25], [-0.4, 0.3]];
const SIGMA: [f64; 2] = [0.3, 0.2];

impl Process<2> for Small {
    fn inputs(&self) -> usize {
        INPUTS.len()
    }
    fn mean(&self, from: &[Interval; 2], input: usize) -> [Interval; 2] {
        std::array::from_fn(|i| {
            let moved = Interval::point(A[i][0]) * from[0] + Interval::point(A[i][1]) * from[1];
            moved + Interval::point(INPUTS[input][i])
        })
    }
    fn sigma(&self) -> [f64; 2] {
        SIGMA
    }
    fn kind(&self, cell: [usize; 2]) -> Kind {
        match cell {
            [4..=5, 3..=4] => Kind::Target,
            [2, 1] => Kind::Avoid,
            _ => Kind::Ordinary,
        }
    }
}

const CELLS: Cells<2> = Cells {
    lower: [-1.5, -1.5],
    width: [0.5, 0.5],
    count: [6, 6],
};

/// The same process as a chain of choices whose sets are listed, with bins that are found here.
fn listed() -> Choices {
    let mut chain = ChainBuilder::new();
    let mut groups = vec![0usize, 1, 2];
    // Groups: failed, safe (the target), then all cells in order. What is no ordinary cell has one
    // state that leads to where it belongs.
    let group = |cell: [usize; 2]| (2 + CELLS.index(cell)) as u32;
    for index in 0..CELLS.cells() {
        let cell = CELLS.cell(index);
        let states: Vec<Vec<(f64, Vec<u32>)>> = match Small.kind(cell) {
            Kind::Target => vec![vec![(1.0, vec![1])]],
            Kind::Avoid => vec![vec![(1.0, vec![0])]],
            Kind::Ordinary => (0..INPUTS.len())
                .map(|input| branches(cell, input, &group))
                .collect(),
        };
        for branches in &states {
            chain.state(branches).unwrap();
        }
        groups.push(groups[groups.len() - 1] + states.len());
    }
    Choices::new(chain.finish(&[2]).unwrap(), groups).unwrap()
}

fn branches(
    cell: [usize; 2],
    input: usize,
    group: &dyn Fn([usize; 2]) -> u32,
) -> Vec<(f64, Vec<u32>)> {
    let from = std::array::from_fn(|d| Interval {
        low: CELLS.edge(d, cell[d]),
        high: CELLS.edge(d, cell[d] + 1),
    });
    let mean = Small.mean(&from, input);
    let axis = |d: usize| -> Vec<(usize, usize, f64)> {
        let span = 1 + ((mean[d].high - mean[d].low) / 0.5 - 1e-6).ceil() as usize;
        (0..=6 - span)
            .map(|i| {
                let from = (CELLS.edge(d, i) - mean[d].low) / SIGMA[d];
                let to = (CELLS.edge(d, i + 1) - mean[d].low) / SIGMA[d];
                let fits = (CELLS.edge(d, i + span) - mean[d].high) / SIGMA[d];
                (i, span, normal::mass(from, to.min(fits)))
            })
            .collect()
    };
    let mut out = Vec::new();
    for (i, wide, p) in axis(0) {
        for (j, high, q) in axis(1) {
            let mut members = Vec::new();
            for x in i..i + wide {
                members.extend((j..j + high).map(|y| group([x, y])));
            }
            out.push((p * q, members));
        }
    }
    out
}

/// Batches and sums over axes give what the listed sets give, but for roundings: at most 73 doubles
/// a step there (36 branches), bins that are off by some 1e-15 and cut at 7.5 deviations (6e-14).
#[test]
fn agrees_with_the_listed_sets() {
    let field = Field::new(&Small, CELLS);
    let choices = listed();
    let mut between = 0;
    for steps in [1, 2, 5, 20] {
        let (values, _) = field.values(Goal::Reach, steps, 0.0);
        // There a cell of the target takes a step to be where it counts.
        let known = choices.values(Goal::Reach, steps + 1, 0.0);
        for (index, value) in values.iter().enumerate() {
            let known = known.groups[2 + index];
            if Small.kind(CELLS.cell(index)) == Kind::Ordinary {
                assert!((value - known).abs() < 1e-11, "{value} {known}");
                between += u32::from(*value > 0.0 && *value < 1.0);
            }
        }
    }
    assert!(between > 50, "{between}");
}

/// The controller of the last step, played from points of a cell: its share is not below the bound.
#[test]
fn runs_are_not_below_the_bound() {
    let field = Field::new(&Small, CELLS);
    let (values, _) = field.values(Goal::Reach, 12, 0.0);
    let start = CELLS.index([1, 4]);
    let bound = values[start];
    assert!(bound > 0.05, "{bound}");
    // The best input of each cell, by the steps that are left after it.
    let best: Vec<Vec<Option<usize>>> = (0..12)
        .map(|left| {
            let after = field.values(Goal::Reach, left, 0.0).0;
            (0..CELLS.cells())
                .map(|cell| field.best(cell, &after))
                .collect()
        })
        .collect();
    let mut random = Pcg64::seed_from_u64(4);
    let mut unit = || (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
    let runs = 4000;
    let mut kept = 0;
    for _ in 0..runs {
        let cell = CELLS.cell(start);
        let mut x: [f64; 2] = std::array::from_fn(|d| CELLS.edge(d, cell[d]) + 0.5 * unit());
        let mut at = cell;
        for left in (0..12).rev() {
            let input = best[left][CELLS.index(at)].unwrap();
            let mean: [f64; 2] =
                std::array::from_fn(|i| A[i][0] * x[0] + A[i][1] * x[1] + INPUTS[input][i]);
            x = std::array::from_fn(|d| {
                let radius = (-2.0 * (1.0 - unit()).ln()).sqrt();
                mean[d] + SIGMA[d] * radius * (std::f64::consts::TAU * unit()).cos()
            });
            if x.iter().any(|x| !(-1.5..1.5).contains(x)) {
                break;
            }
            at = std::array::from_fn(|d| ((x[d] + 1.5) / 0.5).floor() as usize);
            match Small.kind(at) {
                Kind::Ordinary => {}
                Kind::Avoid => break,
                Kind::Target => {
                    kept += 1;
                    break;
                }
            }
        }
    }
    let share = f64::from(kept) / f64::from(runs);
    // Five deviations of a share of 4,000 runs are at most 0.04.
    assert!(share >= bound - 0.04, "{share} {bound}");
}
