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
//! **Changeover.** Where a period begins with a changeover of length w
//! ([`crate::changeover`]), it is cut at w, too. Until then the drive is that of the changeover,
//! with its own middle. From w on the drive's middle is the input's, and the state at w, wherever
//! in its set it is, is again the start of a smooth flow: the chord holds for it, and `x''` is
//! bounded from the set widened by what has varied until w. At a cut s >= w
//!
//! - the middle's part is `Γ(s) m_u + (Γ(s) - Γ(s-w)) (m - m_u)`, m the changeover's middle;
//! - what varied in the changeover adds `r ∫ |exp(A t) b| dt` over `[s-w, s]`;
//! - what has varied since adds `r_u ∫ |exp(A t) b| dt` over `[0, s-w]`, taken at the later cut.
//!
//! **Rounding.** Coefficients are intervals whose radii are multiplied by the largest value they
//! meet and added to the radius; sums run in f64 over at most D + 2 terms, each below 2^40, so
//! their rounding is below 2^-10 of a unit, which `SUM_SLACK` covers. So does it what the cuts, as
//! rounded times, may miss of the changeover's or the period's end: a few 1e-16 s.

use super::affine::AffineInput;
use crate::abstraction::guard::Guard;
use crate::changeover::Changeover;
use model::flow::{
    Flow, Matrix, Vector, absolute_integral, absolute_integral_between, apply, product, tube,
};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Cuts of the period; of a changeover as many as its share of the period, and one at least.
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

/// The period, cut.
#[derive(Debug, Clone, Copy)]
struct Course<'a> {
    changeover: Option<&'a Changeover>,
    /// Pieces of the changeover, and their length \[s\].
    early: (usize, f64),
    /// Pieces of the rest, and their length \[s\].
    late: (usize, f64),
}

impl<'a> Course<'a> {
    fn new(period_s: f64, changeover: Option<&'a Changeover>) -> Self {
        let Some(change) = changeover else {
            return Self {
                changeover,
                early: (0, 0.0),
                late: (PIECES, period_s / PIECES as f64),
            };
        };
        let share = (change.length_s / period_s * PIECES as f64).ceil();
        let early = (share as usize).clamp(1, PIECES);
        let late = if change.rest_s > 0.0 { PIECES } else { 0 };
        Self {
            changeover,
            early: (early, change.length_s / early as f64),
            late: (late, change.rest_s / late.max(1) as f64),
        }
    }

    /// Length of the changeover \[s\].
    fn changed_s(&self) -> f64 {
        self.changeover.map_or(0.0, |change| change.length_s)
    }

    /// What an input's drive adds to a state on an axis at a cut \[s\], as centre and radius; the
    /// radius holds until the later cut.
    fn driven<const D: usize>(
        &self,
        (a, b): (&Matrix<D>, &Vector<D>),
        axis: usize,
        (time_s, later_s): (f64, f64),
    ) -> Driven {
        let flow = |time_s: f64| {
            if time_s == 0.0 {
                Flow::identity()
            } else {
                Flow::over(a, b, time_s)
            }
        };
        let whole = flow(time_s).gamma[axis];
        let changed_s = self.changed_s();
        let Some(change) = self.changeover else {
            let own_varied = absolute_integral(a, b, later_s.next_up())[axis];
            return Driven {
                changed: (Interval::ZERO, Interval::ZERO),
                varied: 0.0,
                own: whole,
                own_varied,
            };
        };
        let middle = Interval::point(change.drive.mid());
        // The rounded difference must not fall short.
        let since_s = (time_s - changed_s).max(0.0);
        if time_s < changed_s {
            return Driven {
                changed: (whole * middle, whole),
                varied: up(absolute_integral(a, b, later_s.next_up())[axis] * change.drive.radius()),
                own: whole,
                own_varied: 0.0,
            };
        }
        let kept = whole - flow(since_s).gamma[axis];
        let varied = absolute_integral_between(a, b, (since_s, time_s.next_up()))[axis];
        let later_s = (later_s - changed_s).max(0.0).next_up();
        Driven {
            changed: (kept * middle, kept),
            varied: up(varied * change.drive.radius()),
            own: whole,
            own_varied: absolute_integral(a, b, later_s)[axis],
        }
    }

    /// The cuts \[s\], each with the one after it; the last with itself.
    fn cuts(&self) -> Vec<(f64, f64)> {
        let mut cuts = Vec::with_capacity(self.early.0 + self.late.0 + 1);
        let (early, h) = self.early;
        let changed_s = self.changed_s();
        for piece in 0..early {
            let later_s = if piece + 1 == early {
                changed_s
            } else {
                h * (piece + 1) as f64
            };
            cuts.push((h * piece as f64, later_s));
        }
        let (late, h) = self.late;
        let at = |piece: usize| changed_s + h * piece as f64;
        cuts.extend((0..=late).map(|piece| (at(piece), at((piece + 1).min(late)))));
        cuts
    }
}

/// What the drives add at a cut.
struct Driven {
    /// Of the changeover's middle, and how much of an input's own middle it takes the place of.
    changed: (Interval, Interval),
    /// Radius of what varied in the changeover.
    varied: f64,
    /// Γ(s): times an input's middle.
    own: Interval,
    /// Times an input's radius.
    own_varied: f64,
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
        band: (f64, f64),
    ) -> Self {
        Self::with_changeover(shape, inputs, (period_s, None), measurement, axis, band)
    }

    /// The same for a period that begins with a changeover from any input.
    pub fn with_changeover(
        shape: &GridShape<D>,
        inputs: &[AffineInput<D>],
        (period_s, changeover): (f64, Option<&Changeover>),
        measurement: [f64; D],
        axis: usize,
        (low, high): (f64, f64),
    ) -> Self {
        let (a, b) = (inputs[0].a, inputs[0].b);
        let course = Course::new(period_s, changeover);
        let bend = bend(shape, inputs, measurement, axis, &course);
        let mut cuts = Vec::with_capacity(2 * PIECES + 1);
        for (time_s, later_s) in course.cuts() {
            let flow = if time_s == 0.0 {
                Flow::identity()
            } else {
                Flow::over(&a, &b, time_s)
            };
            let driven = course.driven((&a, &b), axis, (time_s, later_s));
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
                    let middle = Interval::point(input.drive.mid());
                    let mut centre = constant + driven.own * middle;
                    let mut spread = radius + (driven.own_varied * input.drive.radius()).next_up();
                    if course.changeover.is_some() {
                        let (changed, instead) = driven.changed;
                        centre = centre + (changed - instead * middle);
                        spread = up(spread + driven.varied);
                    }
                    (
                        (centre.low - spread).next_down(),
                        (centre.high + spread).next_up(),
                    )
                })
                .collect();
            cuts.push(Cut { tables, offsets });
        }
        Self { low, high, cuts }
    }
}

/// Bound of `h²/8 |x''|` on an axis over a period from anywhere in the grid widened by the error,
/// for drives held at their middles: `x'' = A (A x + b v)`, with x enclosed piece by piece by
/// `exp(A [0, h]) x_i + Γ([0, h]) v`.
fn bend<const D: usize>(
    shape: &GridShape<D>,
    inputs: &[AffineInput<D>],
    measurement: [f64; D],
    axis: usize,
    course: &Course<'_>,
) -> f64 {
    let start: [Interval; D] = std::array::from_fn(|d| {
        let low = Interval::point(shape.lower[d]);
        let count = Interval::point(f64::from(shape.count[d]));
        let high = low + Interval::point(shape.width[d]) * count;
        let error = Interval::point(measurement[d]);
        (low - error).join(high + error)
    });
    let (a, b) = (inputs[0].a, inputs[0].b);
    let (pieces, h) = course.late;
    let rest = Stretch::new((&a, &b), axis, h);
    let Some(change) = course.changeover else {
        let bends = inputs
            .iter()
            .map(|input| rest.bend(start, input.drive.mid(), pieces).0);
        return bends.fold(0.0, f64::max) * h * h / 8.0;
    };
    let (early, early_h) = course.early;
    let changing = Stretch::new((&a, &b), axis, early_h);
    let (first, at_end) = changing.bend(start, change.drive.mid(), early);
    let varied = absolute_integral(&a, &b, change.length_s.next_up());
    let from = std::array::from_fn(|d| {
        let varied = up(varied[d] * change.drive.radius());
        at_end[d] + Interval::point(varied).symmetric()
    });
    let later = inputs
        .iter()
        .map(|input| rest.bend(from, input.drive.mid(), pieces).0)
        .fold(0.0, f64::max);
    // Pieces are as long as their number says but for roundings.
    let eighth = |h: f64| h * h / 8.0 * (1.0 + 1e-9);
    up(first * eighth(early_h)).max(up(later * eighth(h)))
}

/// Pieces of one length, for [`bend`].
struct Stretch<const D: usize> {
    axis: usize,
    a: Matrix<D>,
    b: Vector<D>,
    h: f64,
    step: Flow<D>,
}

impl<const D: usize> Stretch<D> {
    fn new((a, b): (&Matrix<D>, &Vector<D>), axis: usize, h: f64) -> Self {
        Self {
            axis,
            a: *a,
            b: *b,
            h,
            step: Flow::over(a, b, h),
        }
    }

    /// Bound of `|x''|` over so many pieces from a box under a constant drive, and the box at the
    /// end.
    fn bend(&self, start: [Interval; D], drive: f64, pieces: usize) -> (f64, [Interval; D]) {
        let square = product(&self.a, &self.a);
        let driven = apply(&self.a, &self.b)[self.axis];
        let within = tube(&self.a, self.h);
        let unit = Interval {
            low: 0.0,
            high: self.h,
        };
        let v = Interval::point(drive);
        let mut largest = 0.0f64;
        let mut state = start;
        for _ in 0..pieces {
            let (free, forced) = (apply(&within, &state), apply(&within, &self.b));
            let mut second = driven * v;
            for d in 0..D {
                second = second + square[self.axis][d] * (free[d] + forced[d] * unit * v);
            }
            largest = largest.max(second.magnitude());
            let next = apply(&self.step.phi, &state);
            state = std::array::from_fn(|d| next[d] + self.step.gamma[d] * v);
        }
        (largest, state)
    }
}

fn up(value: f64) -> f64 {
    value.next_up()
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
