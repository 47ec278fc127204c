//! A second opinion: slow, simple, and written another way.
//!
//! Exact rational arithmetic is out of reach of exp, so this checker works with plain numbers and a
//! slack that is far larger than their rounding: cells are sampled by their corners (the flow is
//! affine, so corners are extreme), the disturbance's reach is a sum over fine steps, times within
//! the period are sampled densely. What it sees must be within what the verifier proved; and on a
//! small table it must find the same set of cells, up to those on the edge of its slack.

use std::collections::{BTreeSet, VecDeque};

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::TableView;
use firmware::units::State;

use model::plant::{Plant, STATES};
use model::spec::Spec;
use model::verdict::ClaimName;

use super::{SMALL_TABLE, judge, small};

/// Trajectories from the event to the first decision.
const SEEDS: u32 = 4000;
/// Fine steps of a period.
const FINE: usize = 400;

struct Checker {
    /// Flow matrices and responses to a unit of net power after each fine step.
    phi: Vec<[[f64; STATES]; STATES]>,
    gamma: Vec<[f64; STATES]>,
    /// Reach of a unit of varying power after each fine step.
    varied: Vec<[f64; STATES]>,
}

impl Checker {
    fn new(spec: &Spec) -> Self {
        let (a, b) = Plant::new(spec).matrices_f64();
        let h = spec.sampling.period_s / FINE as f64;
        let rate = |x: &[f64; STATES], v: f64| -> [f64; STATES] {
            std::array::from_fn(|i| (0..STATES).map(|j| a[i][j] * x[j]).sum::<f64>() + b[i] * v)
        };
        let step = |x: &[f64; STATES], v: f64| {
            let at = |k: &[f64; STATES], f: f64| std::array::from_fn(|d| x[d] + f * h * k[d]);
            let k1 = rate(x, v);
            let k2 = rate(&at(&k1, 0.5), v);
            let k3 = rate(&at(&k2, 0.5), v);
            let k4 = rate(&at(&k3, 1.0), v);
            std::array::from_fn::<f64, STATES, _>(|d| {
                x[d] + h / 6.0 * (k1[d] + 2.0 * k2[d] + 2.0 * k3[d] + k4[d])
            })
        };
        let mut columns: [[f64; STATES]; STATES] =
            std::array::from_fn(|j| std::array::from_fn(|i| f64::from(u8::from(i == j))));
        let (mut forced, mut impulse, mut reach) = ([0.0; STATES], b, [0.0; STATES]);
        let mut out = Self {
            phi: Vec::new(),
            gamma: Vec::new(),
            varied: Vec::new(),
        };
        for _ in 0..FINE {
            columns = columns.map(|column| step(&column, 0.0));
            forced = step(&forced, 1.0);
            let next = step(&impulse, 0.0);
            for d in 0..STATES {
                reach[d] += h * 0.5 * (impulse[d].abs() + next[d].abs());
            }
            impulse = next;
            out.phi.push(std::array::from_fn(|i| {
                std::array::from_fn(|j| columns[j][i])
            }));
            out.gamma.push(forced);
            out.varied.push(reach);
        }
        out
    }

    /// Box of the corners of a cell after a fine step.
    fn after(
        &self,
        step: usize,
        cell: &[(f64, f64); STATES],
        (mid, radius): (f64, f64),
    ) -> [(f64, f64); STATES] {
        std::array::from_fn(|d| {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for corner in 0..1u32 << STATES {
                let mut at = self.gamma[step][d] * mid;
                for j in 0..STATES {
                    let end = if corner >> j & 1 == 1 {
                        cell[j].1
                    } else {
                        cell[j].0
                    };
                    at += self.phi[step][d][j] * end;
                }
                (low, high) = (low.min(at), high.max(at));
            }
            let spread = self.varied[step][d] * radius;
            (low - spread, high + spread)
        })
    }
}

fn drive(spec: &Spec, level: u8) -> (f64, f64) {
    let u = f64::from(level) * spec.input.step;
    let e = spec.uncertainty.participation;
    let fleet = spec.fleet_power_gw() * 1e6;
    let low = fleet * u * (1.0 - e) - spec.uncertainty.loss_gw[1] * 1e6;
    let high = fleet * (u * (1.0 + e)).min(1.0) - spec.uncertainty.loss_gw[0] * 1e6;
    ((low + high) / 2.0, (high - low) / 2.0)
}

#[test]
fn a_second_checker_agrees_on_a_small_table() {
    let spec = small(&[]);
    let verdict = judge(&SMALL_TABLE, &spec);
    let table = TableView::parse(&SMALL_TABLE).unwrap();
    let grid = table.header().grid;
    let checker = Checker::new(&spec);
    // The cells of the first decision are those that real trajectories meet.
    let seeds: BTreeSet<_> = (0..SEEDS)
        .map(|n| first_decision(&spec, &table, n).unwrap())
        .collect();
    println!(
        "{} first cells, the verifier has {}",
        seeds.len(),
        verdict.counts.first_cells
    );
    assert!(seeds.len() as u64 <= verdict.counts.first_cells);
    let mut seen = seeds.clone();
    let mut queue: VecDeque<_> = seeds.into_iter().collect();
    let mut lowest = f64::INFINITY;
    while let Some(cell) = queue.pop_front() {
        let bounds = grid.bounds(firmware::grid::Cell(cell)).unwrap();
        let state = State(bounds.map(|(low, _)| low));
        let before = PhaseState {
            phase: Phase::C1,
            level: 0,
            ticks_left: 0,
        };
        let (next, step) = before.step(&table, state);
        let Decision::Level(level) = step else {
            panic!("{cell:?} has no entry");
        };
        let power = drive(&spec, level);
        let real = bounds.map(|(low, high)| (f64::from(low), f64::from(high)));
        for fine in 0..FINE {
            let (low, high) = checker.after(fine, &real, power)[0];
            lowest = lowest.min(low);
            if next.phase == Phase::Hold {
                assert!(
                    low >= -300_000.0 - 1.0 && high <= 100_000.0 + 1.0,
                    "{cell:?}"
                );
            }
        }
        let end = checker.after(FINE - 1, &real, power);
        // A thousandth of a micro-unit inside: plain numbers must not find more than the
        // outward-rounded ones.
        let index = |axis: usize, v: f64| {
            let offset = v - f64::from(grid.lower_edge()[axis]);
            (offset / f64::from(grid.width()[axis])).floor() as u16
        };
        let (low, high): ([u16; 4], [u16; 4]) = (
            std::array::from_fn(|d| index(d, end[d].0 + 1e-3)),
            std::array::from_fn(|d| index(d, end[d].1 - 1e-3)),
        );
        for f in low[0]..=high[0] {
            for g in low[1]..=high[1] {
                for l in low[2]..=high[2] {
                    for p in low[3]..=high[3] {
                        if seen.insert([f, g, l, p]) {
                            queue.push_back([f, g, l, p]);
                        }
                    }
                }
            }
        }
    }
    println!(
        "{} cells, the verifier has {}",
        seen.len(),
        verdict.reachable_cells
    );
    // Boxes that end within its slack of an edge may have a row of cells less.
    let (found, proven) = (seen.len() as f64, verdict.reachable_cells as f64);
    assert!(
        found <= proven && found > 0.99 * proven,
        "{found} of {proven}"
    );
    let bound = verdict
        .claim(ClaimName::Containment)
        .unwrap()
        .bound
        .unwrap();
    assert!(lowest / 1e6 >= bound - 1e-9, "{} < {bound}", lowest / 1e6);
}

/// The cell of the first decision of a trajectory with initial state, moment and loss drawn from
/// `n`.
fn first_decision(spec: &Spec, table: &TableView<'_>, n: u32) -> Option<[u16; 4]> {
    let plant = Plant::new(spec);
    let share = |k: u32| f64::from(n.wrapping_mul(2_654_435_761).rotate_left(k) % 1000) / 999.0;
    let initial = &spec.uncertainty.initial;
    let mut x: [f64; STATES] = std::array::from_fn(|d| {
        initial.lower[d] + share(5 * d as u32) * (initial.upper[d] - initial.lower[d])
    });
    let [low, high] = spec.uncertainty.loss_gw;
    let loss = low + share(23) * (high - low);
    let h = 0.001;
    let offset = (share(29) * 100.0) as u32;
    for millisecond in 0..20_000u32 {
        if millisecond >= offset && (millisecond - offset).is_multiple_of(100) {
            let measured = State(x.map(|v| (v * 1e6).floor() as i32));
            if PhaseState::INITIAL.step(table, measured).0.phase != Phase::NoControl {
                return table.header().grid.quantise(measured).map(|cell| cell.0);
            }
        }
        // Euler's error over 2 s is below a thousandth of a cell here, and only a sample is wanted.
        let k = plant.derivative(x, -loss);
        x = std::array::from_fn(|d| x[d] + h * k[d]);
    }
    None
}
