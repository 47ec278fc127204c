//! The finite abstraction: a uniform grid, a finite input set, and for every (cell, input) a box of
//! cells that contains every real successor.
//!
//! The games know nothing else of the plant. [`affine`] is the abstraction of (switched) affine
//! systems, exact but for rounding; [`growth`] that of any system with a growth bound, and
//! [`invariant`] the same for one that moves alike everywhere. A pair whose box leaves the grid is
//! not allowed.

pub mod affine;
pub mod growth;
pub mod guard;
pub mod invariant;
pub mod tube;

use crate::game::inputs::InputSet;
use model::grid_shape::GridShape;

/// A box of cells, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBox<const D: usize> {
    /// Lowest cell on each axis.
    pub low: [u32; D],
    /// Highest cell on each axis.
    pub high: [u32; D],
}

/// The cells that lie in the successor box of *every* cell of a block under one input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockCore<const D: usize> {
    /// Not known.
    Unknown,
    /// Part of it leaves the grid, so every pair of the block does.
    Leaves,
    /// These cells.
    Shared(CellBox<D>),
}

/// Cells on each axis of the boxes that answer for a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockExtents<const D: usize> {
    /// Of [`BlockCore::Shared`], if the blocks have one.
    pub core: Option<[u32; D]>,
    /// Of the hull of one input.
    pub hull: [u32; D],
    /// Of the hull over all inputs.
    pub hull_of_all: [u32; D],
    /// Of the hull of a group over all inputs.
    pub group: [u32; D],
}

/// How the successor boxes of an abstraction vary in size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extents<const D: usize> {
    /// Fewest cells of a box on each axis.
    pub min: [u32; D],
    /// Most cells of a box on each axis.
    pub max: [u32; D],
}

/// An abstraction of a plant on a uniform grid.
pub trait Abstraction<const D: usize>: Sync {
    /// What is computed once for a cell and shared by all its inputs.
    type Anchor;

    /// Sets of its inputs.
    type Inputs: InputSet;

    /// The grid.
    fn shape(&self) -> &GridShape<D>;

    /// Number of inputs, at least 1 and at most what [`Abstraction::Inputs`] holds.
    fn inputs(&self) -> usize;

    /// Prepares a cell for [`Abstraction::successor`].
    fn anchor(&self, cell: [u32; D]) -> Self::Anchor;

    /// The box of cells that contains every successor of the anchored cell under an input, or
    /// `None` if that box leaves the grid.
    fn successor(&self, anchor: &Self::Anchor, input: usize) -> Option<CellBox<D>>;

    /// Sizes that the boxes can have, if there are few enough to prepare for each.
    fn extents(&self) -> Option<Extents<D>> {
        None
    }

    /// Cells on each axis of the blocks for which [`Abstraction::block_core`] and the hulls answer.
    fn block(&self) -> [u32; D] {
        [1; D]
    }

    /// What all successor boxes of the block whose first cell is anchored share under an input.
    fn block_core(&self, first: &Self::Anchor, input: usize) -> BlockCore<D> {
        let _ = (first, input);
        BlockCore::Unknown
    }

    /// A box that contains every successor of the block under an input, or under all, clipped to
    /// the grid; `None` if there is none. The default knows only the grid.
    fn block_hull(&self, first: &Self::Anchor, input: Option<usize>) -> Option<CellBox<D>> {
        let _ = (first, input);
        let high = self.shape().count.map(|n| n - 1);
        Some(CellBox { low: [0; D], high })
    }

    /// Cells on each axis of the groups for which [`Abstraction::group_hull`] answers: a multiple
    /// of [`Abstraction::block`] on every axis.
    fn group(&self) -> [u32; D] {
        self.block()
    }

    /// As [`Abstraction::block_hull`] over all inputs, for a group.
    fn group_hull(&self, first: &Self::Anchor) -> Option<CellBox<D>> {
        self.block_hull(first, None)
    }

    /// Sizes of the boxes that [`Abstraction::block_core`] and the hulls answer with, if each has
    /// one size for all blocks and inputs.
    fn block_extents(&self) -> Option<BlockExtents<D>> {
        None
    }
}
