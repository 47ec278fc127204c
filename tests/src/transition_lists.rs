//! Abstraction and games in the way of the tools that store every transition: boxes from a
//! Runge-Kutta integration in plain floating point, a list of predecessors for each cell and input,
//! and a counter for each pair. An independent oracle for the engine's yardsticks, and the
//! reference that its speed is compared with in the same run.
//!
//! As in SCOTS 0.2 (after Reissig, Weber and Rungger, IEEE TAC 62(4), 2017), cells and boxes are
//! widened by 1e-10 of a cell in the place of outward rounding, a pair whose box leaves the grid
//! has no transition, and cells to avoid have none.

use std::collections::VecDeque;

/// One axis: centre of the first cell, width, cells.
pub type Axis = (f64, f64, usize);

/// A sampled plant on a uniform grid.
pub struct Sampled<'p> {
    /// The axes, first fastest.
    pub axes: Vec<Axis>,
    /// Number of inputs.
    pub inputs: usize,
    /// Successor of a point under an input, in place.
    pub post: &'p dyn Fn(&mut [f64], usize),
    /// Radius of the successor of a cell, from that of the cell, in place.
    pub radius: &'p dyn Fn(&mut [f64], usize),
}

/// All transitions.
pub struct Transitions {
    cells: usize,
    inputs: usize,
    /// Cells that a pair may lead to; 0 where the pair is not allowed.
    posts: Vec<u32>,
    /// End of the predecessors of a pair of successor and input.
    ends: Vec<usize>,
    predecessors: Vec<u32>,
}

/// Integrates `x' = f(x)` over a time in some steps by the classical Runge-Kutta method.
pub fn runge_kutta(f: impl Fn(&[f64], &mut [f64]), x: &mut [f64], time: f64, steps: u32) {
    let n = x.len();
    let h = time / f64::from(steps);
    let mut k = vec![vec![0.0; n]; 4];
    let mut at = vec![0.0; n];
    for _ in 0..steps {
        for (stage, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            for d in 0..n {
                let slope = if stage == 0 { 0.0 } else { k[stage - 1][d] };
                at[d] = x[d] + part * h * slope;
            }
            f(&at, &mut k[stage]);
        }
        for d in 0..n {
            x[d] += h / 6.0 * (k[0][d] + 2.0 * k[1][d] + 2.0 * k[2][d] + k[3][d]);
        }
    }
}

impl Sampled<'_> {
    /// Cells in all.
    pub fn cells(&self) -> usize {
        self.axes.iter().map(|axis| axis.2).product()
    }

    /// Centre of a cell.
    pub fn centre(&self, mut index: usize) -> Vec<f64> {
        self.axes
            .iter()
            .map(|(first, width, count)| {
                let i = index % count;
                index /= count;
                first + i as f64 * width
            })
            .collect()
    }

    /// Range of successor cells on each axis, or `None` if the box leaves the grid.
    fn successors(&self, cell: usize, input: usize) -> Option<Vec<(usize, usize)>> {
        let mut x = self.centre(cell);
        let margin: Vec<f64> = self.axes.iter().map(|axis| axis.1 / 1e10).collect();
        let mut r: Vec<f64> = (0..x.len())
            .map(|d| 0.5 * self.axes[d].1 + margin[d])
            .collect();
        (self.radius)(&mut r, input);
        (self.post)(&mut x, input);
        let mut ranges = Vec::with_capacity(x.len());
        for (d, (first, width, count)) in self.axes.iter().enumerate() {
            let (low, high) = (x[d] - r[d] - margin[d], x[d] + r[d] + margin[d]);
            let edge = first - 0.5 * width;
            if low <= edge || high >= edge + *count as f64 * width {
                return None;
            }
            ranges.push((
                ((low - edge) / width) as usize,
                ((high - edge) / width) as usize,
            ));
        }
        Some(ranges)
    }

    /// Calls for every cell of a box.
    fn each(&self, ranges: &[(usize, usize)], mut call: impl FnMut(usize)) {
        let mut at: Vec<usize> = ranges.iter().map(|range| range.0).collect();
        loop {
            let index = (0..at.len())
                .rev()
                .fold(0, |index, d| index * self.axes[d].2 + at[d]);
            call(index);
            let mut d = 0;
            while d < at.len() && at[d] == ranges[d].1 {
                at[d] = ranges[d].0;
                d += 1;
            }
            if d == at.len() {
                return;
            }
            at[d] += 1;
        }
    }

    /// All transitions of the cells that need not be avoided: boxes once to count, once to fill.
    pub fn transitions(&self, avoid: &dyn Fn(&[f64]) -> bool) -> Transitions {
        let (cells, inputs) = (self.cells(), self.inputs);
        let mut posts = vec![0u32; cells * inputs];
        let mut ends = vec![0usize; cells * inputs];
        let avoided: Vec<bool> = (0..cells).map(|cell| avoid(&self.centre(cell))).collect();
        let mut boxes = Vec::with_capacity(cells * inputs);
        for cell in 0..cells {
            for input in 0..inputs {
                let ranges = (!avoided[cell])
                    .then(|| self.successors(cell, input))
                    .flatten();
                if let Some(ranges) = &ranges {
                    self.each(ranges, |next| {
                        posts[cell * inputs + input] += 1;
                        ends[next * inputs + input] += 1;
                    });
                }
                boxes.push(ranges.map(|ranges| {
                    ranges
                        .iter()
                        .map(|(low, high)| (*low as u32, *high as u32))
                        .collect::<Box<[_]>>()
                }));
            }
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        let mut predecessors = vec![0u32; sum];
        let mut from = ends.clone();
        for (pair, ranges) in boxes.into_iter().enumerate() {
            let Some(ranges) = ranges else { continue };
            let ranges: Vec<_> = ranges
                .iter()
                .map(|(low, high)| (*low as usize, *high as usize))
                .collect();
            let (cell, input) = (pair / inputs, pair % inputs);
            self.each(&ranges, |next| {
                let slot = &mut from[next * inputs + input];
                *slot -= 1;
                predecessors[*slot] = cell as u32;
            });
        }
        Transitions {
            cells,
            inputs,
            posts,
            ends,
            predecessors,
        }
    }
}

impl Transitions {
    /// Number of transitions.
    pub fn count(&self) -> usize {
        self.predecessors.len()
    }

    fn predecessors(&self, next: usize, input: usize) -> &[u32] {
        let pair = next * self.inputs + input;
        let from = if pair == 0 { 0 } else { self.ends[pair - 1] };
        &self.predecessors[from..self.ends[pair]]
    }

    /// Cells from which the target is reached for certain, the target not counted.
    pub fn reach(&self, target: &[bool]) -> Vec<bool> {
        let mut open = self.posts.clone();
        let mut reached = target.to_vec();
        let mut queue: VecDeque<usize> = (0..self.cells).filter(|cell| target[*cell]).collect();
        while let Some(next) = queue.pop_front() {
            for input in 0..self.inputs {
                for cell in self.predecessors(next, input) {
                    let cell = *cell as usize;
                    let left = &mut open[cell * self.inputs + input];
                    *left -= 1;
                    if *left == 0 && !reached[cell] {
                        reached[cell] = true;
                        queue.push_back(cell);
                    }
                }
            }
        }
        (0..self.cells)
            .map(|cell| reached[cell] && !target[cell])
            .collect()
    }

    /// Cells that can stay in the safe ones for ever.
    pub fn safety(&self, safe: &[bool]) -> Vec<bool> {
        let mut allowed: Vec<bool> = self.posts.iter().map(|posts| *posts > 0).collect();
        let left = |allowed: &[bool], cell: usize| {
            (0..self.inputs).any(|input| allowed[cell * self.inputs + input])
        };
        let mut alive: Vec<bool> = (0..self.cells)
            .map(|cell| safe[cell] && left(&allowed, cell))
            .collect();
        let mut queue: VecDeque<usize> = (0..self.cells).filter(|cell| !alive[*cell]).collect();
        while let Some(next) = queue.pop_front() {
            for input in 0..self.inputs {
                for cell in self.predecessors(next, input) {
                    let cell = *cell as usize;
                    allowed[cell * self.inputs + input] = false;
                    if alive[cell] && !left(&allowed, cell) {
                        alive[cell] = false;
                        queue.push_back(cell);
                    }
                }
            }
        }
        alive
    }
}
