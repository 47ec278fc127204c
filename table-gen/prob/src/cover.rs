//! Overlapping cells whose sets are closed under a step.
//!
//! In the coordinates of [`crate::modes`] a grid of points is laid, and each point stands for the
//! set around it with the radius R of its block. A step maps such a set to one with radius `ρ R +
//! d`: ρ is the contraction, d what a bin of the drive adds. The nearest point is at most half a
//! cell's diagonal h away, so the image lies in the set of that point if
//!
//! ```text
//! ρ R + d + h/2 <= R
//! ```
//!
//! Every image then has *one* successor, whatever its size: nothing is cut and nothing branches but
//! the firmware's decisions. An image that does not fit is not hidden: [`Cover::cell`] says so, and
//! it counts as failed.
//!
//! A set that is left in the middle of a period has not contracted yet. It gets finer points and a
//! radius of its own.

use firmware::units::STATES;

use crate::flight::{Ball, Flights};
use crate::modes::{Block, Modes};

/// Cell width per reach of a bin, in the block that contracts least: cells cost states with their
/// square, bins with their number, and the radius `(0.9 h + d)/(1 - ρ)` is bought cheapest with
/// `0.9 h = 2 d`.
const CELL_PER_BIN: f64 = 2.3;
/// How far the other blocks may reach, in widths of the table's cells, beside the block that
/// contracts least.
const SHARE: f64 = 0.3;
/// Points for sets that are left within a period are so much finer.
const FINER: f64 = 4.0;
/// Rounds in which radii must settle: each removes a factor of at most 0.99 of what is missing.
const ROUNDS: u32 = 5000;
/// Slack of a radius: coupling between blocks and rounding are far below.
const SLACK: f64 = 1e-9;

/// The cover.
#[derive(Debug, Clone)]
pub(crate) struct Cover {
    blocks: Vec<Block>,
    /// Cell width of each block.
    width: Vec<f64>,
    /// Radius of each block, after a period.
    radius: Vec<f64>,
    /// The same for sets that are left within a period.
    radius_left: Vec<f64>,
}

/// Half the diagonal of a cell.
fn half_diagonal(block: Block, width: f64) -> f64 {
    if block.pair {
        0.5 * width * std::f64::consts::SQRT_2
    } else {
        0.5 * width
    }
}

impl Cover {
    /// The cover for bins of this half-width of the drive and a loss that moves by so much \[GW\],
    /// for a table with cells of these widths \[Hz, GW\]; `beside` is what else a step may add, by
    /// block. Nothing if the radii do not settle.
    pub(crate) fn new(
        modes: &Modes,
        flights: &Flights,
        ticks: u32,
        ([bin_gw, moving_gw], beside): ([f64; 2], &[f64]),
        cells: [f64; STATES],
    ) -> Option<Self> {
        let blocks = modes.blocks.clone();
        let added = |block: usize, ticks: u32| {
            let (_, reach, moving) = flights.of_block(block, ticks);
            let beside = beside.get(block).copied().unwrap_or(0.0);
            reach * bin_gw + moving * moving_gw + beside
        };
        // Effect of a unit of a block, in cells of the table.
        let effect = |block: Block| {
            let rows = modes.out.iter().zip(cells);
            rows.map(|(row, cell)| Modes::length(row, block) / cell)
                .fold(0.0, f64::max)
        };
        let contraction = |block: usize| flights.of_block(block, ticks).0;
        let slowest =
            (0..blocks.len()).max_by(|a, b| contraction(*a).total_cmp(&contraction(*b)))?;
        let mut cover = Self {
            width: vec![0.0; blocks.len()],
            radius: vec![0.0; blocks.len()],
            radius_left: vec![0.0; blocks.len()],
            blocks: blocks.clone(),
        };
        cover.width[slowest] = CELL_PER_BIN * added(slowest, ticks);
        cover.settle(flights, slowest, ticks, &added)?;
        let most = SHARE * effect(blocks[slowest]) * cover.radius[slowest];
        for (index, block) in blocks.iter().enumerate() {
            if index == slowest {
                continue;
            }
            let (rho, add) = (contraction(index), added(index, ticks));
            let room = (most / effect(*block) * (1.0 - rho) - add) / (1.0 + rho / FINER);
            let width = room / half_diagonal(*block, 1.0);
            cover.width[index] = width.max(CELL_PER_BIN * add);
            cover.settle(flights, index, ticks, &added)?;
        }
        Some(cover)
    }

    /// The radii of a block that are closed under a step.
    fn settle(
        &mut self,
        flights: &Flights,
        block: usize,
        ticks: u32,
        added: &dyn Fn(usize, u32) -> f64,
    ) -> Option<()> {
        let half = half_diagonal(self.blocks[block], self.width[block]);
        let (mut radius, mut left) = (0.0f64, 0.0f64);
        for _ in 0..ROUNDS {
            let (before, rho) = (radius, flights.of_block(block, ticks).0);
            for tick in 1..=ticks {
                let rho = flights.of_block(block, tick).0;
                left = left.max(rho * radius + added(block, tick) + half / FINER + SLACK);
            }
            radius = radius.max(rho * left.max(radius) + added(block, ticks) + half + SLACK);
            if !radius.is_finite() || radius > 10.0 {
                return None;
            }
            if radius <= before * (1.0 + 1e-12) {
                // What is missing still is below a thousand times the last change. Both grow alike:
                // what one gains the other, contracted, needs less of.
                self.radius[block] = radius * (1.0 + 1e-9) + 10.0 * SLACK;
                self.radius_left[block] = left * (1.0 + 1e-9) + 10.0 * SLACK;
                return Some(());
            }
        }
        None
    }

    /// Radii of each block after a period.
    pub(crate) fn radius(&self) -> &[f64] {
        &self.radius
    }

    /// The set of a point.
    pub(crate) fn ball(&self, cell: [i32; STATES], left: bool) -> Ball {
        let mut centre = [0.0; STATES];
        for (index, block) in self.blocks.iter().enumerate() {
            for axis in block.axes() {
                centre[axis] = f64::from(cell[axis]) * self.step(index, left);
            }
        }
        let radius = if left {
            &self.radius_left
        } else {
            &self.radius
        };
        Ball {
            centre,
            radius: radius.clone(),
        }
    }

    /// The nearest point, if its set holds this one.
    pub(crate) fn cell(&self, ball: &Ball, left: bool) -> Option<[i32; STATES]> {
        let mut cell = [0; STATES];
        for (index, block) in self.blocks.iter().enumerate() {
            let step = self.step(index, left);
            let mut away = 0.0f64;
            for axis in block.axes() {
                cell[axis] = (ball.centre[axis] / step).round() as i32;
                // The centre of the point is this very product.
                let distance = (ball.centre[axis] - f64::from(cell[axis]) * step)
                    .abs()
                    .next_up();
                away = (away + (distance * distance).next_up()).next_up();
            }
            let reach = (away.sqrt().next_up() + ball.radius[index]).next_up();
            let radius = if left {
                &self.radius_left
            } else {
                &self.radius
            };
            if reach.is_nan() || reach > radius[index] {
                return None;
            }
        }
        Some(cell)
    }

    /// Points whose sets together hold this one: a single one where that is enough. Nothing where
    /// there are more than `most`.
    ///
    /// In each block a lattice of every n-th point is taken, n such that half a diagonal of it is
    /// below the radius: the nearest lattice point of any state then holds it. The hundredth that
    /// is left is far above the roundings.
    pub(crate) fn cells(&self, ball: &Ball, left: bool, most: usize) -> Option<Vec<[i32; STATES]>> {
        if let Some(cell) = self.cell(ball, left) {
            return Some(vec![cell]);
        }
        let radii = if left {
            &self.radius_left
        } else {
            &self.radius
        };
        let mut cells = vec![[0; STATES]];
        for (index, block) in self.blocks.iter().enumerate() {
            let step = self.step(index, left);
            let every = (0.99 * radii[index] / half_diagonal(*block, step))
                .floor()
                .max(1.0);
            let stride = every * step;
            for axis in block.axes() {
                let (centre, reach) = (ball.centre[axis], ball.radius[index]);
                let first = ((centre - reach) / stride).floor();
                let last = ((centre + reach) / stride).ceil();
                // Also where the quotients are no numbers.
                let few =
                    last - first < 1e4 && (last - first + 1.0) * cells.len() as f64 <= most as f64;
                if !few {
                    return None;
                }
                let along = (first as i32..=last as i32).map(|at| at * every as i32);
                let along: Vec<i32> = along.collect();
                cells = cells
                    .into_iter()
                    .flat_map(|cell| {
                        along.iter().map(move |at| {
                            let mut cell = cell;
                            cell[axis] = *at;
                            cell
                        })
                    })
                    .collect();
            }
        }
        Some(cells)
    }

    fn step(&self, block: usize, left: bool) -> f64 {
        if left {
            self.width[block] / FINER
        } else {
            self.width[block]
        }
    }
}
