//! "Does a box of cells lie in the set?", answered in a few instructions, millions of times a
//! sweep.
//!
//! The boxes of an abstraction come in few sizes (on a uniform grid a fixed radius covers k or k +
//! 1 cells of an axis). For each combination of sizes on the axes above the first, the set is
//! eroded once; a box is then included exactly when a run of bits along the first axis is all ones
//! in the eroded set. The first axis is not eroded, because its sizes vary most (the input acts
//! there first) and a run of bits costs no more than one bit.

use rayon::prelude::*;

use super::bitset::BitSet;
use crate::abstraction::{CellBox, Extents};
use model::grid_shape::GridShape;

/// Most combinations of sizes that are prepared; past that, rows are looked at one by one.
const SETS_MAX: usize = 128;

/// Inclusion queries against one set.
#[derive(Debug)]
pub struct Inclusion<const D: usize> {
    strides: [usize; D],
    /// Sizes prepared on each axis: `min..=max`; `None` if rows are looked at one by one.
    sizes: Option<Extents<D>>,
    /// Factor of each axis in the index of the eroded set.
    factors: [usize; D],
    sets: Vec<BitSet>,
}

impl<const D: usize> Inclusion<D> {
    /// Prepares queries for boxes of these sizes.
    pub fn new(shape: &GridShape<D>, set: &BitSet, extents: Option<Extents<D>>) -> Self {
        let mut factors = [0; D];
        let mut total = 1usize;
        if let Some(sizes) = extents {
            for d in 1..D {
                factors[d] = total;
                total = total.saturating_mul((sizes.max[d] - sizes.min[d] + 1) as usize);
            }
        }
        let sizes = extents.filter(|_| total <= SETS_MAX);
        let strides = shape.strides();
        let mut sets = vec![set.clone()];
        if let Some(sizes) = sizes {
            for d in 1..D {
                // Sets for the axes below d are complete; each becomes one set for every size on
                // axis d.
                let count = sizes.max[d] - sizes.min[d] + 1;
                sets = (0..count)
                    .into_par_iter()
                    .flat_map(|extra| {
                        sets.par_iter().map(move |set| {
                            let mut set = set.clone();
                            set.erode(strides[d], sizes.min[d] + extra);
                            set
                        })
                    })
                    .collect();
            }
        }
        Self {
            strides,
            sizes,
            factors,
            sets,
        }
    }

    /// Whether every cell of the box is in the set. The box must lie in the grid, its sizes among
    /// those prepared.
    #[inline]
    pub fn includes(&self, cells: &CellBox<D>) -> bool {
        let mut at = cells.low[0] as usize;
        let len = (cells.high[0] - cells.low[0]) as usize + 1;
        let Some(sizes) = &self.sizes else {
            return self.rows(cells, D - 1, 0);
        };
        let mut which = 0;
        for d in 1..D {
            at += cells.low[d] as usize * self.strides[d];
            if sizes.min[d] == sizes.max[d] {
                continue;
            }
            let size = cells.high[d] - cells.low[d] + 1;
            which += (size - sizes.min[d]) as usize * self.factors[d];
        }
        self.sets[which].all_ones(at, len)
    }

    /// The same row by row; recursion depth is the number of axes.
    fn rows(&self, cells: &CellBox<D>, axis: usize, base: usize) -> bool {
        if axis == 0 {
            let len = (cells.high[0] - cells.low[0]) as usize + 1;
            return self.sets[0].all_ones(base + cells.low[0] as usize, len);
        }
        (cells.low[axis]..=cells.high[axis])
            .all(|i| self.rows(cells, axis - 1, base + i as usize * self.strides[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn prepared_and_row_by_row_agree(seed in any::<u64>(), low in proptest::array::uniform3(0u32..5), size in proptest::array::uniform3(1u32..4)) {
            let shape = GridShape { lower: [0.0; 3], width: [1.0; 3], count: [7, 8, 9] };
            let mut set = BitSet::full(shape.cells());
            // A dozen holes spread by the seed.
            let mut state = seed | 1;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                set.remove((state >> 33) as usize % shape.cells());
            }
            let extents = Extents { min: [1; 3], max: [3; 3] };
            let fast = Inclusion::new(&shape, &set, Some(extents));
            let slow = Inclusion::new(&shape, &set, None);
            let cells = CellBox { low, high: std::array::from_fn(|d| low[d] + size[d] - 1) };
            prop_assert_eq!(fast.includes(&cells), slow.includes(&cells));
        }
    }
}
