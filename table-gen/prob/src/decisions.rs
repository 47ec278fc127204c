//! What the firmware may decide on a set of states.
//!
//! A decision depends on the table's cell and on whether f lies in I1 and I2. The edges of both cut
//! the states into regions, and one state of a region stands for all of it: the firmware's own
//! phase machine is asked for that one. A region counts if the set may meet it: by the set's bounds
//! on each axis, and by its bounds along the coordinates of [`crate::modes`], which keep the
//! corners of the axes' box away.

use firmware::phase::{Decision, PhaseState};
use firmware::table::TableView;
use firmware::units::{AXIS_F, Band, MICRO, STATES, State};
use model::flow::{Vector, apply};
use model::interval::Interval;

use crate::flight::{Ball, along};
use crate::modes::Modes;

/// Directions in the plane of a pair.
const DIRECTIONS: u32 = 8;
/// Far above the rounding errors of a sum of four products of numbers below 1000.
const SLACK: f64 = 1e-9;

/// A direction along which sets and regions are compared.
#[derive(Debug, Clone)]
struct Probe {
    /// The direction in the coordinates of x.
    row: [f64; STATES],
    /// The same in those of m, with its lengths in each block.
    inner: Vector<STATES>,
    lengths: Vec<f64>,
}

/// The regions of a table.
#[derive(Debug, Clone)]
pub(crate) struct Regions {
    edges: [Vec<i32>; STATES],
    inner: Band,
    /// Bound of the estimate's error \[micro-units\].
    error: [f64; STATES],
    /// Rows of x = T m, with their lengths in each block.
    axes: Vec<(Vector<STATES>, Vec<f64>)>,
    probes: Vec<Probe>,
}

/// Whether f, as it is measured, is in I2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Inside {
    pub(crate) may: bool,
    pub(crate) may_not: bool,
}

/// A region along one axis: bounds \[micro-units\] and a representative.
#[derive(Debug, Clone, Copy)]
struct Slice {
    low: f64,
    high: f64,
    representative: i32,
}

impl Regions {
    /// The regions of a table, for an estimate within an error \[micro-units\].
    pub(crate) fn new(table: &TableView<'_>, modes: &Modes, error: [f64; STATES]) -> Self {
        let header = table.header();
        let grid = &header.grid;
        let mut edges: [Vec<i32>; STATES] = std::array::from_fn(|d| {
            let (lower, width) = (i64::from(grid.lower_edge()[d]), i64::from(grid.width()[d]));
            // The grid's constructor has checked that every edge fits i32.
            (0..=i64::from(grid.count()[d]))
                .map(|i| (lower + width * i) as i32)
                .collect()
        });
        // A stored frequency is in a band up to and including `high`: the next integer is the first
        // outside.
        for band in [&header.outer, &header.inner] {
            edges[AXIS_F].extend([band.low_uhz, band.high_uhz.saturating_add(1)]);
        }
        edges[AXIS_F].sort_unstable();
        edges[AXIS_F].dedup();
        let lengths = |row: &Vector<STATES>| -> Vec<f64> {
            modes
                .blocks
                .iter()
                .map(|block| Modes::length(row, *block))
                .collect()
        };
        let axes = modes.out.iter().map(|row| (*row, lengths(row))).collect();
        let mut probes = Vec::new();
        for block in &modes.blocks {
            let turns = if block.pair { DIRECTIONS } else { 1 };
            for turn in 0..turns {
                let angle = std::f64::consts::PI * f64::from(turn) / f64::from(turns);
                let (cos, sin) = (angle.cos(), angle.sin());
                let row: [f64; STATES] = std::array::from_fn(|d| {
                    let first = modes.into[block.first][d].mid() * cos;
                    if block.pair {
                        first + modes.into[block.first + 1][d].mid() * sin
                    } else {
                        first
                    }
                });
                // row · x = (row T) m.
                let transposed = std::array::from_fn(|j| std::array::from_fn(|i| modes.out[i][j]));
                let inner = apply(&transposed, &row.map(Interval::point));
                probes.push(Probe {
                    row,
                    lengths: lengths(&inner),
                    inner,
                });
            }
        }
        Self {
            edges,
            inner: header.inner,
            error,
            axes,
            probes,
        }
    }

    /// Bounds of an axis as it may be measured, before it is floored \[micro-units\].
    fn measured(&self, axis: usize, ball: &Ball) -> Interval {
        let (row, lengths) = &self.axes[axis];
        let micro = along(row, lengths, ball) * Interval::point(f64::from(MICRO));
        micro + Interval::hull(-self.error[axis], self.error[axis])
    }

    /// Largest magnitude that may be measured on each axis \[micro-units\].
    pub(crate) fn magnitude(&self, ball: &Ball) -> [f64; STATES] {
        std::array::from_fn(|axis| self.measured(axis, ball).magnitude())
    }

    /// Where a measured f may be.
    pub(crate) fn inside(&self, ball: &Ball) -> Inside {
        let f = self.measured(AXIS_F, ball);
        let (low, high) = (f.low.floor(), f.high.floor());
        let band = [
            f64::from(self.inner.low_uhz),
            f64::from(self.inner.high_uhz),
        ];
        Inside {
            may: high >= band[0] && low <= band[1],
            may_not: low < band[0] || high > band[1],
        }
    }

    fn slices(&self, axis: usize, ball: &Ball) -> Vec<Slice> {
        let (edges, range) = (&self.edges[axis], self.measured(axis, ball));
        let first = edges.partition_point(|edge| f64::from(*edge) <= range.low.floor());
        let last = edges.partition_point(|edge| f64::from(*edge) <= range.high);
        // Slice i lies between the edges i-1 and i.
        let slice = |i: usize| {
            let below = i.checked_sub(1).map(|below| edges[below]);
            Slice {
                low: below.map_or(f64::NEG_INFINITY, f64::from),
                high: edges.get(i).map_or(f64::INFINITY, |edge| f64::from(*edge)),
                representative: below.unwrap_or_else(|| edges[0].saturating_sub(1)),
            }
        };
        (first..=last).map(slice).collect()
    }

    /// All that the phase machine may decide; each outcome once.
    pub(crate) fn outcomes(
        &self,
        table: &TableView<'_>,
        state: PhaseState,
        ball: &Ball,
    ) -> Vec<(PhaseState, Decision)> {
        let mut out: Vec<(PhaseState, Decision)> = Vec::new();
        self.each_region(ball, &mut |measured| {
            let outcome = state.step(table, measured);
            if !out.contains(&outcome) {
                out.push(outcome);
            }
        });
        out
    }

    /// One state of each region that the set may meet.
    pub(crate) fn each_region(&self, ball: &Ball, told: &mut dyn FnMut(State)) {
        let slices: [Vec<Slice>; STATES] = std::array::from_fn(|axis| self.slices(axis, ball));
        let bounds: Vec<Interval> = self
            .probes
            .iter()
            .map(|probe| along(&probe.inner, &probe.lengths, ball))
            .collect();
        for f in &slices[0] {
            for g in &slices[1] {
                for l in &slices[2] {
                    for p in &slices[3] {
                        let region = [f, g, l, p];
                        if self.may_meet(&region, &bounds) {
                            told(State(region.map(|slice| slice.representative)));
                        }
                    }
                }
            }
        }
    }

    /// Whether the bounds along every direction meet those of the region.
    fn may_meet(&self, region: &[&Slice; STATES], bounds: &[Interval]) -> bool {
        if region
            .iter()
            .any(|slice| slice.low.is_infinite() || slice.high.is_infinite())
        {
            return true;
        }
        let mut centre = [0.0; STATES];
        let mut half = [0.0; STATES];
        for d in 0..STATES {
            centre[d] = 0.5e-6 * (region[d].low + region[d].high);
            half[d] = 0.5e-6 * (region[d].high - region[d].low) + 1e-6 * self.error[d];
        }
        self.probes.iter().zip(bounds).all(|(probe, bound)| {
            let (mut at, mut reach) = (0.0, SLACK);
            for d in 0..STATES {
                at += probe.row[d] * centre[d];
                reach += probe.row[d].abs() * half[d];
            }
            bound.low - reach <= at && at <= bound.high + reach
        })
    }
}
