//! What is in a table: levels, jumps between neighbours, visits, slices. Everything is asked of the
//! firmware's reader.

pub mod slice;

use firmware::grid::{Cell, Grid};
use firmware::table::{LEVELS_MAX, Law, TableView};
use rayon::prelude::*;
use serde::Serialize;

use model::plant::STATES;

/// What a law answers over the whole grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawSurvey {
    /// The law.
    pub law: &'static str,
    /// Cells that it covers.
    pub cells: u64,
    /// Covered cells by level.
    pub histogram: Vec<u64>,
    /// Largest difference of levels between covered cells that share a side.
    pub jump_max: u8,
    /// Mean of that difference.
    pub jump_mean: f64,
    /// Most visits that any lookup of the grid takes.
    pub visits_max: u16,
    /// Mean visits of the covered cells.
    pub visits_mean: f64,
}

/// Sums of a part of the grid.
#[derive(Debug, Clone)]
struct Sums {
    histogram: [u64; LEVELS_MAX as usize],
    pairs: u64,
    jumps: u64,
    jump_max: u8,
    visits: u64,
    visits_max: u16,
}

impl Sums {
    const NONE: Self = Self {
        histogram: [0; LEVELS_MAX as usize],
        pairs: 0,
        jumps: 0,
        jump_max: 0,
        visits: 0,
        visits_max: 0,
    };

    fn join(mut self, other: &Self) -> Self {
        for (mine, theirs) in self.histogram.iter_mut().zip(&other.histogram) {
            *mine += theirs;
        }
        self.pairs += other.pairs;
        self.jumps += other.jumps;
        self.jump_max = self.jump_max.max(other.jump_max);
        self.visits += other.visits;
        self.visits_max = self.visits_max.max(other.visits_max);
        self
    }
}

/// Surveys a law; `None` if the table has no such law.
pub fn survey(table: &TableView<'_>, law: Law) -> Option<LawSurvey> {
    let view = table.law(law)?;
    let grid = table.header().grid;
    let count = grid.count();
    // Slabs of constant p: each a task.
    let sums = (0..count[3])
        .into_par_iter()
        .map(|p| {
            let mut sums = Sums::NONE;
            for at in cells_of_slab(&grid, p) {
                let visits = view.visits(Cell(at));
                sums.visits_max = sums.visits_max.max(visits);
                let Some(level) = view.lookup(Cell(at)) else {
                    continue;
                };
                sums.visits += u64::from(visits);
                if let Some(cells) = sums.histogram.get_mut(usize::from(level)) {
                    *cells += 1;
                }
                for axis in 0..STATES {
                    let mut next = at;
                    next[axis] += 1;
                    if let Some(other) = view.lookup(Cell(next)) {
                        let jump = level.abs_diff(other);
                        sums.pairs += 1;
                        sums.jumps += u64::from(jump);
                        sums.jump_max = sums.jump_max.max(jump);
                    }
                }
            }
            sums
        })
        .reduce(|| Sums::NONE, |a, b| a.join(&b));
    let cells: u64 = sums.histogram.iter().sum();
    let mean = |sum: u64, of: u64| if of == 0 { 0.0 } else { sum as f64 / of as f64 };
    Some(LawSurvey {
        law: law.name(),
        cells,
        histogram: sums.histogram[..usize::from(table.header().levels)].to_vec(),
        jump_max: sums.jump_max,
        jump_mean: mean(sums.jumps, sums.pairs),
        visits_max: sums.visits_max,
        visits_mean: mean(sums.visits, cells),
    })
}

fn cells_of_slab(grid: &Grid, p: u16) -> impl Iterator<Item = [u16; STATES]> {
    let count = grid.count();
    (0..count[2]).flat_map(move |l| {
        (0..count[1]).flat_map(move |g| (0..count[0]).map(move |f| [f, g, l, p]))
    })
}
