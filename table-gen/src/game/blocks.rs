//! Blocks of neighbouring cells, and which of their inputs are worth a look in a sweep.

use super::bitset::BitSet;
use super::inclusion::Inclusion;
use crate::abstraction::{Abstraction, Extents};
use crate::grid_shape::GridShape;

/// The grid cut into blocks of the abstraction's shape.
#[derive(Debug, Clone, Copy)]
pub struct Blocks<const D: usize> {
    shape: GridShape<D>,
    block: [u32; D],
    count: [u32; D],
}

impl<const D: usize> Blocks<D> {
    /// The blocks of an abstraction.
    pub fn new<A: Abstraction<D>>(abstraction: &A) -> Self {
        let shape = *abstraction.shape();
        let block = abstraction.block();
        let count = std::array::from_fn(|d| shape.count[d].div_ceil(block[d]));
        Self {
            shape,
            block,
            count,
        }
    }

    /// Number of blocks.
    pub fn total(&self) -> usize {
        self.count.iter().map(|n| *n as usize).product()
    }

    /// First cell of a block.
    pub fn first(&self, mut index: usize) -> [u32; D] {
        let mut first = [0; D];
        for d in 0..D {
            first[d] = (index % self.count[d] as usize) as u32 * self.block[d];
            index /= self.count[d] as usize;
        }
        first
    }

    /// Calls for every cell of the block that starts at `first`, with the cell and its dense index.
    #[inline]
    pub fn each_cell(&self, first: [u32; D], mut call: impl FnMut([u32; D], usize)) {
        let strides = self.shape.strides();
        let end: [u32; D] =
            std::array::from_fn(|d| (first[d] + self.block[d]).min(self.shape.count[d]));
        let mut cell = first;
        let mut index = self.shape.index(first);
        loop {
            call(cell, index);
            let mut d = 0;
            loop {
                if d == D {
                    return;
                }
                cell[d] += 1;
                index += strides[d];
                if cell[d] < end[d] {
                    break;
                }
                index -= strides[d] * (cell[d] - first[d]) as usize;
                cell[d] = first[d];
                d += 1;
            }
        }
    }
}

/// Inputs of a block that may have changed their answer since the last sweep.
#[derive(Debug)]
pub struct Dirty<const D: usize> {
    /// The cells that did not change, for hulls; `None` when everything is dirty.
    unchanged: Option<Inclusion<D>>,
}

impl<const D: usize> Dirty<D> {
    /// Everything is dirty: the first sweep.
    pub fn everything() -> Self {
        Self { unchanged: None }
    }

    /// What a sweep changed.
    pub fn after<A: Abstraction<D>>(abstraction: &A, changed: &BitSet) -> Self {
        let Some((_, hull)) = abstraction.block_extents() else {
            return Self::everything();
        };
        let sizes = Extents {
            min: hull,
            max: hull,
        };
        let unchanged = Inclusion::new(abstraction.shape(), &changed.complement(), Some(sizes));
        Self {
            unchanged: Some(unchanged),
        }
    }
}

/// Both filters of a sweep.
#[derive(Debug)]
pub struct Filter<const D: usize> {
    dirty: Dirty<D>,
    core: Option<Inclusion<D>>,
}

impl<const D: usize> Filter<D> {
    /// A filter for a sweep against `set`. With `need_core` an input is passed over if the shared part of the block's
    /// boxes is not in the set: right where a cell needs the whole box (reach), and where a cell keeps an input only
    /// while the whole box is in (safety asks the opposite question and does without).
    pub fn new<A: Abstraction<D>>(
        abstraction: &A,
        set: &BitSet,
        dirty: Dirty<D>,
        need_core: bool,
    ) -> Self {
        let core = match abstraction.block_extents() {
            Some((Some(core), _)) if need_core => {
                let sizes = Extents {
                    min: core,
                    max: core,
                };
                Some(Inclusion::new(abstraction.shape(), set, Some(sizes)))
            }
            _ => None,
        };
        Self { dirty, core }
    }

    /// Bit mask of the inputs of the block that are worth a look.
    #[inline]
    pub fn inputs<A: Abstraction<D>>(&self, abstraction: &A, first: [u32; D]) -> u32 {
        let mut mask = 0;
        for input in 0..abstraction.inputs() {
            let Some(reach) = abstraction.block_reach(first, input) else {
                continue;
            };
            if let Some(unchanged) = &self.dirty.unchanged
                && unchanged.includes(&reach.hull)
            {
                continue;
            }
            if let (Some(set), Some(core)) = (&self.core, &reach.core)
                && !set.includes(core)
            {
                continue;
            }
            mask |= 1 << input;
        }
        mask
    }
}
