//! Blocks of neighbouring cells, and which of their inputs are worth a look in a sweep.

use super::bitset::BitSet;
use super::inclusion::Inclusion;
use crate::abstraction::{Abstraction, BlockCore, Extents};
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
    /// The cells that did not change, for hulls of one input and of all; `None` when everything is dirty.
    unchanged: Option<[Inclusion<D>; 2]>,
}

impl<const D: usize> Dirty<D> {
    /// Everything is dirty: the first sweep.
    pub fn everything() -> Self {
        Self { unchanged: None }
    }

    /// What a sweep changed.
    pub fn after<A: Abstraction<D>>(abstraction: &A, changed: &BitSet) -> Self {
        let Some(extents) = abstraction.block_extents() else {
            return Self::everything();
        };
        let unchanged = changed.complement();
        let of_size = |size| {
            let sizes = Extents {
                min: size,
                max: size,
            };
            Inclusion::new(abstraction.shape(), &unchanged, Some(sizes))
        };
        Self {
            unchanged: Some([of_size(extents.hull), of_size(extents.hull_of_all)]),
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
        let core = abstraction
            .block_extents()
            .and_then(|extents| extents.core)
            .filter(|_| need_core)
            .map(|core| {
                let sizes = Extents {
                    min: core,
                    max: core,
                };
                Inclusion::new(abstraction.shape(), set, Some(sizes))
            });
        Self { dirty, core }
    }

    /// Bit mask of the inputs of the block that are worth a look.
    #[inline]
    pub fn inputs<A: Abstraction<D>>(&self, abstraction: &A, first: [u32; D]) -> u32 {
        let anchor = abstraction.anchor(first);
        if let Some([_, unchanged_of_all]) = &self.dirty.unchanged {
            match abstraction.block_hull(&anchor, None) {
                Some(hull) if !unchanged_of_all.includes(&hull) => {}
                _ => return 0,
            }
        }
        let mut mask = 0;
        for input in 0..abstraction.inputs() {
            // The core first: it fails most often.
            match (&self.core, abstraction.block_core(&anchor, input)) {
                (_, BlockCore::Leaves) => continue,
                (Some(set), BlockCore::Shared(core)) if !set.includes(&core) => continue,
                _ => {}
            }
            if let Some([unchanged, _]) = &self.dirty.unchanged {
                match abstraction.block_hull(&anchor, Some(input)) {
                    Some(hull) if !unchanged.includes(&hull) => {}
                    _ => continue,
                }
            }
            mask |= 1 << input;
        }
        mask
    }
}
