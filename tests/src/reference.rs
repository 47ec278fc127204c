//! A slow, obvious solver: every box from plain floating point, every fixed point by the
//! definition. The oracle for the engine on small random games.

use nalgebra::{DMatrix, DVector};

/// A sampled affine plant on a uniform grid.
#[derive(Debug, Clone)]
pub struct SlowGame {
    /// A.
    pub a: DMatrix<f64>,
    /// Direction of the drive.
    pub b: DVector<f64>,
    /// Drive of each input: middle and radius.
    pub drives: Vec<(f64, f64)>,
    /// Lower edge, width and count of each axis.
    pub axes: Vec<(f64, f64, usize)>,
    /// Period.
    pub period: f64,
    /// Error of the estimate on each axis.
    pub measurement: Vec<f64>,
}

/// Boxes of successor cells: `boxes[cell][input]`, `None` if the box leaves the grid.
pub type Boxes = Vec<Vec<Option<Vec<(usize, usize)>>>>;

impl SlowGame {
    /// Cells in all.
    pub fn cells(&self) -> usize {
        self.axes.iter().map(|axis| axis.2).product()
    }

    /// Index on each axis of a cell, first axis fastest.
    pub fn cell(&self, mut index: usize) -> Vec<usize> {
        self.axes
            .iter()
            .map(|(_, _, count)| {
                let i = index % count;
                index /= count;
                i
            })
            .collect()
    }

    /// The boxes of all pairs by the textbook: centre by the matrix exponential, radius by its
    /// magnitudes, disturbance by a Riemann sum with many steps. The sum's error must be far below
    /// a cell's distance from a boundary, which random numbers provide.
    pub fn boxes(&self) -> Boxes {
        let n = self.axes.len();
        let phi = (&self.a * self.period).exp();
        let steps = 4000;
        let h = self.period / f64::from(steps);
        let half = (&self.a * (0.5 * h)).exp();
        let step = (&self.a * h).exp();
        let mut y = &half * &self.b;
        let (mut gamma, mut absolute) = (DVector::zeros(n), DVector::zeros(n));
        for _ in 0..steps {
            gamma += &y * h;
            absolute += y.abs() * h;
            y = &step * y;
        }
        let mut boxes = Vec::new();
        for index in 0..self.cells() {
            let cell = self.cell(index);
            let centre = DVector::from_fn(n, |d, _| {
                let (low, width, _) = self.axes[d];
                low + width * (cell[d] as f64 + 0.5)
            });
            let reach = DVector::from_fn(n, |d, _| 0.5 * self.axes[d].1 + self.measurement[d]);
            let radius = phi.abs() * reach;
            let row = self.drives.iter().map(|(middle, spread)| {
                let next = &phi * &centre + &gamma * *middle;
                let mut ranges = Vec::new();
                for d in 0..n {
                    let (low, width, count) = self.axes[d];
                    let r = radius[d] + absolute[d] * spread + self.measurement[d];
                    let first = ((next[d] - r - low) / width).floor();
                    let last = ((next[d] + r - low) / width).floor();
                    if first < 0.0 || last >= count as f64 {
                        return None;
                    }
                    ranges.push((first as usize, last as usize));
                }
                Some(ranges)
            });
            boxes.push(row.collect());
        }
        boxes
    }

    /// Whether a box lies in a set, cell by cell.
    fn included(&self, ranges: &[(usize, usize)], set: &[bool]) -> bool {
        let mut at: Vec<usize> = ranges.iter().map(|range| range.0).collect();
        loop {
            let mut index = 0;
            for d in (0..at.len()).rev() {
                index = index * self.axes[d].2 + at[d];
            }
            if !set[index] {
                return false;
            }
            let mut d = 0;
            while d < at.len() {
                at[d] += 1;
                if at[d] <= ranges[d].1 {
                    break;
                }
                at[d] = ranges[d].0;
                d += 1;
            }
            if d == at.len() {
                return true;
            }
        }
    }

    /// Inputs of a cell whose box lies in a set.
    pub fn mask(&self, boxes: &Boxes, cell: usize, set: &[bool]) -> u32 {
        let inputs = boxes[cell].iter().enumerate();
        inputs
            .filter(|(_, ranges)| ranges.as_ref().is_some_and(|r| self.included(r, set)))
            .fold(0, |mask, (u, _)| mask | 1 << u)
    }

    /// Reach-avoid by the definition: ranks (`None` if not won) and allowed inputs.
    pub fn reach(&self, boxes: &Boxes, target: &[bool], avoid: &[bool]) -> Vec<(Option<u16>, u32)> {
        let mut out: Vec<_> = target.iter().map(|t| (t.then_some(0), 0u32)).collect();
        for sweep in 1.. {
            let won: Vec<bool> = out.iter().map(|(rank, _)| rank.is_some()).collect();
            let mut changed = false;
            for cell in 0..self.cells() {
                if won[cell] || avoid[cell] {
                    continue;
                }
                let mask = self.mask(boxes, cell, &won);
                if mask != 0 {
                    out[cell] = (Some(sweep), mask);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        out
    }

    /// Safety by the definition: allowed inputs on the kernel, 0 elsewhere.
    pub fn safety(&self, boxes: &Boxes, safe: &[bool]) -> Vec<u32> {
        let mut kernel = safe.to_vec();
        loop {
            let masks: Vec<u32> = (0..self.cells())
                .map(|cell| {
                    if kernel[cell] {
                        self.mask(boxes, cell, &kernel)
                    } else {
                        0
                    }
                })
                .collect();
            let next: Vec<bool> = masks.iter().map(|mask| *mask != 0).collect();
            if next == kernel {
                return masks;
            }
            kernel = next;
        }
    }
}
