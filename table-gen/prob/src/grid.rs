//! Controlled processes on a grid, with normal noise that is independent on each axis: the
//! iteration of [`crate::choices`] with sets that are boxes of cells, which are never stored.
//!
//! `x+ = mean(x, u) + w`. For all x of a cell the mean lies in a box. On each axis the noise is cut
//! into bins so that box plus bin lies in a run of whole cells:
//!
//! ```text
//! bin i = [e_i - low, min(e_(i+1) - low, e_(i+span) - high))     cells i to i + span - 1
//! ```
//!
//! `low` and `high` are the box's ends and e the cells' edges; span is the least number of cells
//! for which the bins leave next to nothing out. What they leave out, and what lies past the grid,
//! has failed. Where in the run the state comes to lie is the adversary's choice:
//!
//! ```text
//! V_{t+1}(cell) = max over u of sum over bins of (product of p) min over the box of V_t
//! ```
//!
//! Each V_t is a lower bound of the probability for every state of the cell: not to fail within t
//! steps ([`Goal::Safe`]), or to reach the target within t steps ([`Goal::Reach`]).
//!
//! # Rounding
//! Bins have lower bounds of their probabilities. Sums are plain ones of non-negative terms: with k
//! roundings on the way to a term, each at most 2^-53 of it, the exact sum is at least `(1 - k
//! 2^-52)` times the one found, less one double. Values below 1e-200 are taken as 0, so no product
//! is subnormal.

use std::collections::HashMap;

use model::interval::Interval;
use rayon::prelude::*;

pub use crate::choices::Goal;
use crate::normal;

/// Deviations past which noise has failed: less than 1e-13 of it lies there.
const FAR: f64 = 7.5;
/// Bins that are less likely are left to failure.
const LEAST: f64 = 1e-18;
/// Share of a cell by which a box may be wider than whole cells: the bins are narrower instead.
const GRACE: f64 = 1e-6;
/// Values below this are taken as 0.
const NOTHING: f64 = 1e-200;

/// A process.
pub trait Process<const D: usize>: Sync {
    /// Number of inputs.
    fn inputs(&self) -> usize;
    /// Enclosure of the mean of the next state, for all states of a box.
    fn mean(&self, from: &[Interval; D], input: usize) -> [Interval; D];
    /// Standard deviation of the noise on each axis.
    fn sigma(&self) -> [f64; D];
    /// What a cell is, by its index on each axis.
    fn kind(&self, cell: [usize; D]) -> Kind;
}

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The process goes on there.
    Ordinary,
    /// Where [`Goal::Reach`] ends.
    Target,
    /// Where it has failed.
    Avoid,
}

/// A uniform grid; cells are half-open, the first axis is the fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cells<const D: usize> {
    /// Lower end on each axis.
    pub lower: [f64; D],
    /// Width of a cell on each axis.
    pub width: [f64; D],
    /// Cells on each axis.
    pub count: [usize; D],
}

impl<const D: usize> Cells<D> {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.count.iter().product()
    }

    /// Index of a cell on each axis.
    pub fn cell(&self, index: usize) -> [usize; D] {
        let mut rest = index;
        std::array::from_fn(|d| {
            let at = rest % self.count[d];
            rest /= self.count[d];
            at
        })
    }

    /// Number of a cell.
    pub fn index(&self, cell: [usize; D]) -> usize {
        (0..D).rev().fold(0, |sum, d| sum * self.count[d] + cell[d])
    }

    /// The edge below a cell. Edges are these doubles, exactly.
    pub fn edge(&self, axis: usize, i: usize) -> f64 {
        self.lower[axis] + self.width[axis] * i as f64
    }
}

/// The bins on one axis, in order: lower bounds of their probabilities, and where the first one's
/// cells begin.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    first: usize,
    span: usize,
    p: Vec<f64>,
}

/// Cells that share an input and the row of the last axis, and the spans of their boxes.
#[derive(Debug, Clone)]
struct Batch<const D: usize> {
    input: usize,
    spans: usize,
    last: u32,
    /// Cells with their rows.
    cells: Vec<(u32, [u32; D])>,
}

/// The process, cut into bins.
#[derive(Debug, Clone)]
pub struct Field<const D: usize> {
    cells: Cells<D>,
    kinds: Vec<Kind>,
    rows: Vec<Row>,
    spans: Vec<[usize; D]>,
    batches: Vec<Batch<D>>,
}

impl<const D: usize> Field<D> {
    /// Cuts a process into bins.
    pub fn new(process: &impl Process<D>, cells: Cells<D>) -> Self {
        let kinds: Vec<Kind> = (0..cells.cells())
            .map(|index| process.kind(cells.cell(index)))
            .collect();
        let sigma = process.sigma();
        let mut field = Self {
            cells,
            kinds,
            rows: Vec::new(),
            spans: Vec::new(),
            batches: Vec::new(),
        };
        let mut known: HashMap<(usize, u64, u64), u32> = HashMap::new();
        let mut spans: HashMap<[usize; D], usize> = HashMap::new();
        for input in 0..process.inputs() {
            let mut batches: HashMap<(usize, u32), Batch<D>> = HashMap::new();
            for index in 0..cells.cells() {
                if field.kinds[index] != Kind::Ordinary {
                    continue;
                }
                let cell = cells.cell(index);
                let from = std::array::from_fn(|d| Interval {
                    low: cells.edge(d, cell[d]),
                    high: cells.edge(d, cell[d] + 1),
                });
                let mean = process.mean(&from, input);
                let rows: [u32; D] = std::array::from_fn(|d| {
                    let key = (d, mean[d].low.to_bits(), mean[d].high.to_bits());
                    *known.entry(key).or_insert_with(|| {
                        field.rows.push(row(&cells, d, mean[d], sigma[d]));
                        (field.rows.len() - 1) as u32
                    })
                });
                // Where an axis has no bin nothing is kept.
                if rows
                    .iter()
                    .any(|row| field.rows[*row as usize].p.is_empty())
                {
                    continue;
                }
                let span = rows.map(|row| field.rows[row as usize].span);
                let next = spans.len();
                let span = *spans.entry(span).or_insert(next);
                let last = rows[D - 1];
                batches
                    .entry((span, last))
                    .or_insert_with(|| Batch {
                        input,
                        spans: span,
                        last,
                        cells: Vec::new(),
                    })
                    .cells
                    .push((index as u32, rows));
            }
            let mut batches: Vec<_> = batches.into_iter().collect();
            batches.sort_unstable_by_key(|(key, _)| *key);
            field
                .batches
                .extend(batches.into_iter().map(|(_, batch)| batch));
        }
        field.spans = vec![[0; D]; spans.len()];
        for (span, at) in spans {
            field.spans[at] = span;
        }
        field
    }

    /// Values of all cells with this many steps to go; fewer where no value changes by more than
    /// `settled` any more. Returns them and the steps that were made.
    pub fn values(&self, goal: Goal, steps: u32, settled: f64) -> (Vec<f64>, u32) {
        let first = match goal {
            Goal::Safe => 1.0,
            Goal::Reach => 0.0,
        };
        let mut value: Vec<f64> = self
            .kinds
            .iter()
            .map(|kind| match kind {
                Kind::Ordinary => first,
                Kind::Target => 1.0,
                Kind::Avoid => 0.0,
            })
            .collect();
        for step in 0..steps {
            let next = self.step(&value);
            let moved = next.iter().zip(&value).map(|(a, b)| (a - b).abs());
            let moved = moved.fold(0.0, f64::max);
            value = next;
            if moved <= settled && settled > 0.0 {
                return (value, step + 1);
            }
        }
        (value, steps)
    }

    fn step(&self, value: &[f64]) -> Vec<f64> {
        let worst: Vec<Vec<f64>> = self
            .spans
            .par_iter()
            .map(|span| least(&self.cells, value, span))
            .collect();
        let best = self
            .batches
            .par_iter()
            .fold(
                || vec![0.0f64; value.len()],
                |mut best, batch| {
                    self.batch(batch, &worst[batch.spans], &mut best);
                    best
                },
            )
            .reduce(
                || vec![0.0f64; value.len()],
                |mut a, b| {
                    a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b));
                    a
                },
            );
        let of = |(index, best): (usize, f64)| match self.kinds[index] {
            Kind::Ordinary if best >= NOTHING => best.min(1.0),
            Kind::Ordinary | Kind::Avoid => 0.0,
            Kind::Target => 1.0,
        };
        best.into_iter().enumerate().map(of).collect()
    }

    /// The values that a batch's input gives its cells.
    fn batch(&self, batch: &Batch<D>, worst: &[f64], best: &mut [f64]) {
        // Summed over the last axis once, for all other coordinates.
        let layer = worst.len() / self.cells.count[D - 1];
        let last = &self.rows[batch.last as usize];
        let mut summed = vec![0.0f64; layer];
        for (i, p) in last.p.iter().enumerate() {
            let from = &worst[(last.first + i) * layer..][..layer];
            summed.iter_mut().zip(from).for_each(|(s, w)| *s += p * w);
        }
        for (index, rows) in &batch.cells {
            let mut rows = rows.map(|row| &self.rows[row as usize]);
            // The last axis is done.
            let one = Row {
                first: 0,
                span: 1,
                p: vec![1.0],
            };
            rows[D - 1] = &one;
            let (sum, roundings) = self.sum(&rows, &summed);
            let roundings = (roundings + last.p.len() + 2 * D) as f64;
            let sum = (sum * (1.0 - roundings * f64::EPSILON))
                .next_down()
                .max(0.0);
            let best = &mut best[*index as usize];
            *best = best.max(sum);
        }
    }

    /// Sum over the bins of all axes, and how many roundings a term may have met.
    fn sum(&self, rows: &[&Row; D], values: &[f64]) -> (f64, usize) {
        let mut at = [0usize; D];
        let (mut sum, mut combinations) = (0.0f64, 0);
        loop {
            let (mut offset, mut stride, mut weight) = (0, 1, 1.0f64);
            for d in 0..D {
                offset += (rows[d].first + if d == 0 { 0 } else { at[d] }) * stride;
                stride *= self.cells.count[d];
                if d > 0 {
                    weight *= rows[d].p[at[d]];
                }
            }
            let run = &values[offset..offset + rows[0].p.len()];
            let dot: f64 = rows[0].p.iter().zip(run).map(|(p, v)| p * v).sum();
            sum += weight * dot;
            combinations += 1;
            // The next combination of the other axes.
            let mut axis = 1;
            while axis < D {
                at[axis] += 1;
                if at[axis] < rows[axis].p.len() {
                    break;
                }
                at[axis] = 0;
                axis += 1;
            }
            if axis >= D {
                return (sum, combinations + rows[0].p.len());
            }
        }
    }

    /// The input that is best for a cell, with these values after the step; nothing where none has
    /// a bin on every axis.
    pub fn best(&self, cell: usize, after: &[f64]) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for batch in &self.batches {
            let own = batch
                .cells
                .iter()
                .filter(|(index, _)| *index as usize == cell);
            for (index, rows) in own {
                let worst = least(&self.cells, after, &self.spans[batch.spans]);
                let one = Batch {
                    cells: vec![(*index, *rows)],
                    ..*batch
                };
                let mut value = vec![0.0; after.len()];
                self.batch(&one, &worst, &mut value);
                if best.is_none_or(|(known, _)| value[cell] > known) {
                    best = Some((value[cell], batch.input));
                }
            }
        }
        best.map(|(_, input)| input)
    }

    /// Batches of cells, rows of bins: what is stored.
    pub fn stored(&self) -> (usize, usize) {
        (self.batches.len(), self.rows.len())
    }
}

/// The bins on an axis for a mean in an interval.
fn row<const D: usize>(cells: &Cells<D>, axis: usize, mean: Interval, sigma: f64) -> Row {
    let (count, width) = (cells.count[axis], cells.width[axis]);
    let span = 1 + ((mean.high - mean.low) / width - GRACE).ceil().max(0.0) as usize;
    let deviations = |edge: f64, end: f64| {
        (Interval::point(edge) - Interval::point(end)) / Interval::point(sigma)
    };
    let (mut first, mut p) = (0, Vec::new());
    for i in 0..(count + 1).saturating_sub(span) {
        let from = deviations(cells.edge(axis, i), mean.low).high;
        let to = deviations(cells.edge(axis, i + 1), mean.low).low;
        let fits = deviations(cells.edge(axis, i + span), mean.high).low;
        let (from, to) = (from.max(-FAR), to.min(fits).min(FAR));
        // The double below the end: a state at the edge belongs to the next cell.
        let mass = normal::mass(from, to.next_down());
        if mass >= LEAST {
            if p.is_empty() {
                first = i;
            }
            p.push(mass);
        } else if !p.is_empty() {
            break;
        }
    }
    Row { first, span, p }
}

/// The least value of each box of this many cells, by its lowest cell; boxes that leave the grid
/// have 0.
fn least<const D: usize>(cells: &Cells<D>, value: &[f64], span: &[usize; D]) -> Vec<f64> {
    let mut out = value.to_vec();
    let mut stride = 1;
    for d in 0..D {
        let from = out.clone();
        for (index, out) in out.iter_mut().enumerate() {
            let at = index / stride % cells.count[d];
            *out = if at + span[d] > cells.count[d] {
                0.0
            } else {
                let run = (0..span[d]).map(|k| from[index + k * stride]);
                run.fold(1.0, f64::min)
            };
        }
        stride *= cells.count[d];
    }
    out
}
