//! A game shared out between ranks: what the ranks tell one another after every sweep.
//!
//! Each rank plays the cells that it owns and holds the sets of a window around them, its own cells
//! and a *halo*: every cell that a successor of an own cell may lie in. After a sweep the ranks
//! exchange what changed in the halos, so every box is held against the same set as on one rank,
//! and the solution is the same, bit for bit.

use std::ops::Range;

use super::bitset::BitSet;

/// Tells the other ranks what changed.
pub trait Exchange {
    /// Adds to the changes of the own cells those that other ranks found in the halo.
    ///
    /// # Errors
    /// A rank that is gone.
    fn share(&self, changed: &mut BitSet) -> Result<(), Lost>;

    /// The sum over all ranks.
    ///
    /// # Errors
    /// A rank that is gone.
    fn sum(&self, count: usize) -> Result<usize, Lost>;

    /// Of so many cells of the window, those that this rank plays.
    fn owned(&self, cells: usize) -> Range<usize> {
        0..cells
    }
}

/// Another rank can no longer be reached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a rank is gone: {0}")]
pub struct Lost(pub String);

/// There is one rank.
#[derive(Debug, Clone, Copy)]
pub struct Alone;

impl Exchange for Alone {
    fn share(&self, _changed: &mut BitSet) -> Result<(), Lost> {
        Ok(())
    }

    fn sum(&self, count: usize) -> Result<usize, Lost> {
        Ok(count)
    }
}
