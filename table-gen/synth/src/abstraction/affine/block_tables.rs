//! Shapes of blocks and groups of cells, as numbers.

use crate::abstraction::BlockExtents;

/// Shapes of blocks and groups, and what their boxes are computed from.
#[derive(Debug, Clone)]
pub(super) struct BlockTables<const D: usize> {
    pub(super) block: [u32; D],
    pub(super) group: [u32; D],
    pub(super) extents: BlockExtents<D>,
    /// Travel over a group in the first mode.
    pub(super) group_travel: Travel<D>,
    /// Lowest offset and highest end (offset plus span) over all inputs; meaningful with one mode.
    pub(super) ends_of_all: [(i64, i64); D],
}

/// Lowest (not above zero) and highest (not below zero) change of the table sums on each axis.
pub(super) type Travel<const D: usize> = [(i64, i64); D];

impl<const D: usize> BlockTables<D> {
    /// Blocks and groups of one cell, until others are chosen.
    pub(super) fn single() -> Self {
        Self {
            block: [1; D],
            group: [1; D],
            extents: BlockExtents {
                core: None,
                hull: [1; D],
                hull_of_all: [1; D],
                group: [1; D],
            },
            group_travel: [(0, 0); D],
            ends_of_all: [(0, 0); D],
        }
    }
}
