//! What every encoding of a law's inputs can do.

use crate::grid::Cell;

/// What every encoding of a law's inputs can do.
pub trait Encoding {
    /// Input level at a cell, or `None` where the encoding has no entry. Total: any cell is
    /// allowed.
    fn level(&self, cell: Cell) -> Option<u8>;

    /// Entries or nodes that this lookup visits.
    fn visits(&self, cell: Cell) -> u16;

    /// The most that any lookup visits.
    fn worst_visits(&self) -> u16;

    /// Entries (dense) or leaves (tree) stored.
    fn entries(&self) -> u32;
}
