//! One state between the samples: a guard that permits an input only if the state stays in a band
//! over the whole period.
//!
//! The period is cut into pieces. At each cut the state is an affine function of the cell's centre,
//! with a radius for the cell, the error of the estimate and what the drive's variation has added
//! so far. Between two cuts
//!
//! - the part driven by the drive's middle is smooth; it leaves the chord by at most `h²/8
//!   max|x''|`, and the chord's ends are at the cuts. `x''` is bounded over the whole grid, all
//!   inputs and the whole period (`bend`);
//! - the cell's and the estimate's part is again the flow of a linear system from a point, covered
//!   by the same bound with the grid widened by the error;
//! - the drive's variation adds `r ∫₀ˢ |exp(A t) b| dt`, which only grows: its value at the later
//!   cut covers the piece.
//!
//! **Rounding.** Coefficients are intervals whose radii are multiplied by the largest value they
//! meet and added to the radius; sums run in f64 over at most D + 2 terms, each below 2^40, so
//! their rounding is below 2^-10 of a unit, which `SUM_SLACK` covers.

use super::affine::AffineInput;
use crate::abstraction::guard::Guard;
use model::flow::{Flow, absolute_integral, apply, product, tube};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Cuts of the period.
const PIECES: usize = 32;
/// Covers the rounding of the sums at run time \[plant units, which are micro-units for the
/// charger's plant\].
const SUM_SLACK: f64 = 0.01;

/// The state of one axis at one cut.
#[derive(Debug, Clone)]
struct Cut<const D: usize> {
    /// What index i on axis j adds to the state.
    tables: [Vec<f64>; D],
    /// Lowest and highest offset of each input: constant part, less and plus radius.
    offsets: Vec<(f64, f64)>,
}

/// Keeps one axis in a band between the samples.
#[derive(Debug, Clone)]
pub struct TubeGuard<const D: usize> {
    low: f64,
    high: f64,
    cuts: Vec<Cut<D>>,
}

impl<const D: usize> TubeGuard<D> {
    /// A guard for an axis and a band \[plant units\]; the inputs must share one mode (one A and
    /// b).
    pub fn new(
        shape: &GridShape<D>,
        inputs: &[AffineInput<D>],
        period_s: f64,
        measurement: [f64; D],
        axis: usize,
        (low, high): (f64, f64),
    ) -> Self {
        let (a, b) = (inputs[0].a, inputs[0].b);
        let h = period_s / PIECES as f64;
        let bend = bend(shape, inputs, measurement, axis, h) * h * h / 8.0;
        let mut cuts = Vec::with_capacity(PIECES + 1);
        for piece in 0..=PIECES {
            let time_s = h * piece as f64;
            let flow = if piece == 0 {
                Flow::identity()
            } else {
                Flow::over(&a, &b, time_s)
            };
            // The variation at the later cut covers the piece that begins here.
            let later_s = (h * (piece + 1).min(PIECES) as f64).next_up();
            let varied = absolute_integral(&a, &b, later_s)[axis];
            let row = flow.phi[axis];
            let mut radius = bend.next_up() + SUM_SLACK;
            let mut constant = Interval::ZERO;
            let tables = std::array::from_fn(|j| {
                let middle = Interval::point(shape.lower[j])
                    + Interval::point(0.5) * Interval::point(shape.width[j]);
                constant = constant + row[j] * middle;
                let reach = 0.5 * shape.width[j] + measurement[j];
                radius = (radius + (row[j].magnitude() * reach).next_up()).next_up();
                let slope = row[j] * Interval::point(shape.width[j]);
                let last = f64::from(shape.count[j]);
                radius = (radius + (slope.radius() * last).next_up()).next_up();
                (0..shape.count[j])
                    .map(|i| slope.mid() * f64::from(i))
                    .collect()
            });
            let offsets = inputs
                .iter()
                .map(|input| {
                    let driven = constant + flow.gamma[axis] * Interval::point(input.drive.mid());
                    let spread = radius + (varied * input.drive.radius()).next_up();
                    (
                        (driven.low - spread).next_down(),
                        (driven.high + spread).next_up(),
                    )
                })
                .collect();
            cuts.push(Cut { tables, offsets });
        }
        Self { low, high, cuts }
    }
}

/// Bound of `|x''|` on an axis over a period from anywhere in the grid widened by the error, for
/// inputs held at the middle of their drive: `x'' = A (A x + b v)`, with x enclosed piece by piece
/// by `exp(A [0, h]) x_i + Γ([0, h]) v`.
fn bend<const D: usize>(
    shape: &GridShape<D>,
    inputs: &[AffineInput<D>],
    measurement: [f64; D],
    axis: usize,
    h: f64,
) -> f64 {
    let start: [Interval; D] = std::array::from_fn(|d| {
        let low = Interval::point(shape.lower[d]);
        let count = Interval::point(f64::from(shape.count[d]));
        let high = low + Interval::point(shape.width[d]) * count;
        let error = Interval::point(measurement[d]);
        (low - error).join(high + error)
    });
    let (a, b) = (inputs[0].a, inputs[0].b);
    let square = product(&a, &a);
    let driven = apply(&a, &b)[axis];
    let within = tube(&a, h);
    let step = Flow::over(&a, &b, h);
    let unit = Interval { low: 0.0, high: h };
    let mut largest = 0.0f64;
    for input in inputs {
        let v = Interval::point(input.drive.mid());
        let mut state = start;
        for _ in 0..PIECES {
            let (free, forced) = (apply(&within, &state), apply(&within, &b));
            let mut second = driven * v;
            for d in 0..D {
                second = second + square[axis][d] * (free[d] + forced[d] * unit * v);
            }
            largest = largest.max(second.magnitude());
            let next = apply(&step.phi, &state);
            state = std::array::from_fn(|d| next[d] + step.gamma[d] * v);
        }
    }
    largest
}

impl<const D: usize> Guard<D> for TubeGuard<D> {
    fn permitted(&self, cell: [u32; D], inputs: u32) -> u32 {
        let mut permitted = inputs;
        for cut in &self.cuts {
            let mut sum = 0.0;
            for (table, index) in cut.tables.iter().zip(&cell) {
                sum += table[*index as usize];
            }
            let mut rest = permitted;
            while rest != 0 {
                let input = rest.trailing_zeros();
                rest &= rest - 1;
                let (low, high) = cut.offsets[input as usize];
                if sum + low < self.low || sum + high > self.high {
                    permitted &= !(1 << input);
                }
            }
            if permitted == 0 {
                break;
            }
        }
        permitted
    }
}
