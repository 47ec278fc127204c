//! The uniform grid and its quantiser: the one implementation that device, abstraction and verifier
//! share.
//!
//! A cell is half-open on every axis, `[lower edge + i·width, lower edge + (i+1)·width)`, in
//! micro-units. Integer arithmetic makes quantisation exact: there is no tolerance and no state
//! that belongs to two cells.

use crate::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P, STATES, State};

/// Index of a cell on each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Cell(pub [u16; STATES]);

/// Why a grid cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GridError {
    /// The width of this axis is zero.
    ZeroWidth {
        /// Axis, 0..4 for f, g, l, p.
        axis: u8,
    },
    /// This axis has no cell.
    NoCells {
        /// Axis, 0..4 for f, g, l, p.
        axis: u8,
    },
    /// The upper edge of this axis does not fit 32 bits of micro-units.
    EdgeOutOfRange {
        /// Axis, 0..4 for f, g, l, p.
        axis: u8,
    },
    /// More than `u32::MAX` cells in all.
    TooManyCells,
}

/// A uniform grid over the four states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    lower_edge: [i32; STATES],
    width: [u32; STATES],
    count: [u16; STATES],
}

impl Grid {
    /// A grid from the lower edge of the first cell and the cell width \[micro-units\] and the
    /// cells of each axis.
    ///
    /// # Errors
    /// A zero width or count, an upper edge past `i32::MAX`, or more than `u32::MAX` cells.
    pub const fn new(
        lower_edge: [i32; STATES],
        width: [u32; STATES],
        count: [u16; STATES],
    ) -> Result<Self, GridError> {
        let mut axis = 0;
        let mut cells: u64 = 1;
        while axis < STATES {
            if width[axis] == 0 {
                return Err(GridError::ZeroWidth { axis: axis as u8 });
            }
            if count[axis] == 0 {
                return Err(GridError::NoCells { axis: axis as u8 });
            }
            let upper = lower_edge[axis] as i64 + width[axis] as i64 * count[axis] as i64;
            if upper > i32::MAX as i64 {
                return Err(GridError::EdgeOutOfRange { axis: axis as u8 });
            }
            // Each factor is below 2^16 and the product so far below 2^32: no overflow.
            cells *= count[axis] as u64;
            if cells > u32::MAX as u64 {
                return Err(GridError::TooManyCells);
            }
            axis += 1;
        }
        Ok(Self {
            lower_edge,
            width,
            count,
        })
    }

    /// Lower edge of the first cell of each axis \[micro-units\].
    pub const fn lower_edge(&self) -> [i32; STATES] {
        self.lower_edge
    }

    /// Cell width of each axis \[micro-units\].
    pub const fn width(&self) -> [u32; STATES] {
        self.width
    }

    /// Cells of each axis.
    pub const fn count(&self) -> [u16; STATES] {
        self.count
    }

    /// Cells in all.
    pub const fn cells(&self) -> u32 {
        let c = self.count;
        c[0] as u32 * c[1] as u32 * c[2] as u32 * c[3] as u32
    }

    /// The cell that holds a state, or `None` outside the grid.
    pub const fn quantise(&self, state: State) -> Option<Cell> {
        // Not a loop, which would go through memory.
        let Some(f) = self.index_on(AXIS_F, state) else {
            return None;
        };
        let Some(g) = self.index_on(AXIS_G, state) else {
            return None;
        };
        let Some(l) = self.index_on(AXIS_L, state) else {
            return None;
        };
        let Some(p) = self.index_on(AXIS_P, state) else {
            return None;
        };
        Some(Cell([f, g, l, p]))
    }

    #[inline(always)]
    const fn index_on(&self, axis: usize, state: State) -> Option<u16> {
        if state.0[axis] < self.lower_edge[axis] {
            return None;
        }
        // The difference of two i32 with a >= b fits u32.
        let above = state.0[axis].wrapping_sub(self.lower_edge[axis]) as u32;
        // The width is not zero; said so that no panic is compiled in.
        match above.checked_div(self.width[axis]) {
            Some(index) if index < self.count[axis] as u32 => Some(index as u16),
            _ => None,
        }
    }

    /// The half-open interval `[low, high)` of a cell on each axis \[micro-units\]. The cell must
    /// be of this grid (`None` otherwise).
    pub const fn bounds(&self, cell: Cell) -> Option<[(i32, i32); STATES]> {
        let mut bounds = [(0, 0); STATES];
        let mut axis = 0;
        while axis < STATES {
            if cell.0[axis] >= self.count[axis] {
                return None;
            }
            let low = self.lower_edge[axis] as i64 + self.width[axis] as i64 * cell.0[axis] as i64;
            bounds[axis] = (low as i32, (low + self.width[axis] as i64) as i32);
            axis += 1;
        }
        Some(bounds)
    }

    /// Position of a cell in a dense array, f fastest: `f + F·(g + G·(l + L·p))`. `None` for a cell
    /// of another grid.
    pub const fn index(&self, cell: Cell) -> Option<u32> {
        let mut index = 0u32;
        let mut axis = STATES;
        while axis > 0 {
            axis -= 1;
            if cell.0[axis] >= self.count[axis] {
                return None;
            }
            index = index * self.count[axis] as u32 + cell.0[axis] as u32;
        }
        Some(index)
    }

    /// The cell at a position of the dense array: the inverse of [`Grid::index`]. `None` past the
    /// last.
    pub const fn cell(&self, index: u32) -> Option<Cell> {
        if index >= self.cells() {
            return None;
        }
        let mut rest = index;
        let mut cell = [0; STATES];
        let mut axis = 0;
        while axis < STATES {
            // No count is zero, and a remainder is below the count, which fits 16 bits.
            let count = self.count[axis] as u32;
            cell[axis] = (rest % count) as u16;
            rest /= count;
            axis += 1;
        }
        Some(Cell(cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// 300 · 40 · 7 · 2 cells: every position is the index of its cell, and the last is the
        /// last.
        #[test]
        fn a_cell_is_the_inverse_of_its_index(index in 0u32..200_000) {
            let grid = Grid::new([-5, 0, 7, 0], [3, 1, 9, 2], [300, 40, 7, 2]).unwrap();
            let cell = grid.cell(index);
            prop_assert_eq!(cell.is_some(), index < grid.cells());
            if let Some(cell) = cell {
                prop_assert_eq!(grid.index(cell), Some(index));
            }
        }
    }
}
