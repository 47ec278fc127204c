//! A set of cells as bits, f fastest, that several threads may add to.

use std::sync::atomic::{AtomicU64, Ordering};

use firmware::grid::Grid;

use super::successor::Cells;
use model::plant::STATES;

/// A set of cells of a grid.
#[derive(Debug)]
pub(super) struct CellSet {
    words: Vec<AtomicU64>,
    strides: [u32; STATES],
}

impl CellSet {
    /// The empty set.
    pub(super) fn new(grid: &Grid) -> Self {
        let mut strides = [1u32; STATES];
        for d in 1..STATES {
            strides[d] = strides[d - 1] * u32::from(grid.count()[d - 1]);
        }
        let words = (0..=grid.cells() / 64).map(|_| AtomicU64::new(0)).collect();
        Self { words, strides }
    }

    /// Whether a cell is in the set.
    pub(super) fn contains(&self, index: u32) -> bool {
        let word = self.words[(index / 64) as usize].load(Ordering::Relaxed);
        word >> (index % 64) & 1 == 1
    }

    /// Adds a cell; whether it is new.
    pub(super) fn insert(&self, index: u32) -> bool {
        let bit = 1u64 << (index % 64);
        let before = self.words[(index / 64) as usize].fetch_or(bit, Ordering::Relaxed);
        before & bit == 0
    }

    /// Adds a box of cells; the new ones are appended.
    pub(super) fn insert_box(&self, cells: &Cells, new: &mut Vec<u32>) {
        self.rows(cells, |start, len| {
            for (word, mask) in masks(start, len) {
                let slot = &self.words[word as usize];
                // Mostly there is nothing to add: a plain load is cheaper than an exchange.
                if slot.load(Ordering::Relaxed) & mask == mask {
                    continue;
                }
                let mut fresh = mask & !slot.fetch_or(mask, Ordering::Relaxed);
                while fresh != 0 {
                    new.push(word * 64 + fresh.trailing_zeros());
                    fresh &= fresh - 1;
                }
            }
            true
        });
    }

    /// A cell of the box that is not in the set, if there is one.
    pub(super) fn missing(&self, cells: &Cells) -> Option<u32> {
        let mut found = None;
        self.rows(cells, |start, len| {
            for (word, mask) in masks(start, len) {
                let absent = mask & !self.words[word as usize].load(Ordering::Relaxed);
                if absent != 0 {
                    found = Some(word * 64 + absent.trailing_zeros());
                    return false;
                }
            }
            true
        });
        found
    }

    /// Calls for every row of a box (first cell, number of cells) until told to stop.
    fn rows(&self, cells: &Cells, mut call: impl FnMut(u32, u32) -> bool) {
        let len = u32::from(cells.high[0] - cells.low[0]) + 1;
        for p in cells.low[3]..=cells.high[3] {
            for l in cells.low[2]..=cells.high[2] {
                for g in cells.low[1]..=cells.high[1] {
                    let start = u32::from(cells.low[0])
                        + u32::from(g) * self.strides[1]
                        + u32::from(l) * self.strides[2]
                        + u32::from(p) * self.strides[3];
                    if !call(start, len) {
                        return;
                    }
                }
            }
        }
    }
}

/// The words and masks of a run of bits.
fn masks(start: u32, len: u32) -> impl Iterator<Item = (u32, u64)> {
    let end = start + len;
    (start / 64..=(end - 1) / 64).map(move |word| {
        let from = start.max(word * 64) - word * 64;
        let to = end.min(word * 64 + 64) - word * 64;
        (word, (u64::MAX >> (64 - (to - from))) << from)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_added_once_and_then_contained() {
        let grid = Grid::new([0; 4], [1; 4], [70, 3, 2, 2]).unwrap();
        let set = CellSet::new(&grid);
        let cells = Cells {
            low: [60, 1, 0, 1],
            high: [69, 2, 1, 1],
        };
        let mut new = Vec::new();
        assert_eq!(set.missing(&cells), Some(60 + 70 + 70 * 3 * 2));
        set.insert_box(&cells, &mut new);
        assert_eq!(new.len(), 10 * 2 * 2);
        assert_eq!(set.missing(&cells), None);
        let before = new.len();
        set.insert_box(&cells, &mut new);
        assert_eq!(new.len(), before);
        let wider = Cells {
            low: [59, 1, 0, 1],
            ..cells
        };
        assert_eq!(set.missing(&wider), Some(59 + 70 + 70 * 3 * 2));
        assert!(set.contains(60 + 70 + 420) && !set.contains(0));
    }

    #[test]
    fn a_run_of_bits_may_cross_words() {
        let all: Vec<_> = masks(60, 70).collect();
        assert_eq!(all, vec![(0, 0xF << 60), (1, u64::MAX), (2, 3)]);
    }
}
