//! The finite abstraction: a uniform grid, a finite input set, and for every (cell, input) a box of cells that contains
//! every real successor.
//!
//! The games know nothing else of the plant. [`affine`] is the abstraction of (switched) affine systems, exact but for
//! rounding; [`growth`] that of any system with a growth bound. A pair whose box leaves the grid is not allowed.

pub mod affine;
pub mod growth;
pub mod tube;

use crate::grid_shape::GridShape;

/// A box of cells, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBox<const D: usize> {
    /// Lowest cell on each axis.
    pub low: [u32; D],
    /// Highest cell on each axis.
    pub high: [u32; D],
}

/// What a block of cells may reach under one input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockReach<const D: usize> {
    /// Cells that lie in the successor box of *every* cell of the block; `None` if no such cell is known.
    pub core: Option<CellBox<D>>,
    /// A box that contains every successor of every cell of the block, clipped to the grid.
    pub hull: CellBox<D>,
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

    /// The grid.
    fn shape(&self) -> &GridShape<D>;

    /// Number of inputs, 1..=32.
    fn inputs(&self) -> usize;

    /// Prepares a cell for [`Abstraction::successor`].
    fn anchor(&self, cell: [u32; D]) -> Self::Anchor;

    /// The box of cells that contains every successor of the anchored cell under an input, or `None` if that box leaves
    /// the grid.
    fn successor(&self, anchor: &Self::Anchor, input: usize) -> Option<CellBox<D>>;

    /// Sizes that the boxes can have, if there are few enough to prepare for each.
    fn extents(&self) -> Option<Extents<D>> {
        None
    }

    /// Cells on each axis of the blocks for which [`Abstraction::block_reach`] answers.
    fn block(&self) -> [u32; D] {
        [1; D]
    }

    /// What the block that starts at a cell may reach under an input; `None` if every pair of the block leaves the grid.
    /// The default knows only the grid.
    fn block_reach(&self, first: [u32; D], input: usize) -> Option<BlockReach<D>> {
        let _ = (first, input);
        let shape = self.shape();
        let hull = CellBox {
            low: [0; D],
            high: shape.count.map(|n| n - 1),
        };
        Some(BlockReach { core: None, hull })
    }

    /// Fixed sizes of core and hull, if [`Abstraction::block_reach`] answers with boxes of one size.
    fn block_extents(&self) -> Option<(Option<[u32; D]>, [u32; D])> {
        None
    }
}
