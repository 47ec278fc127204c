//! Blocks of neighbouring cells, groups of blocks, and which of them and of their inputs are worth
//! a look in a sweep.

use std::sync::atomic::{AtomicU16, Ordering::Relaxed};

use rayon::prelude::*;

use super::bitset::BitSet;
use super::inclusion::Inclusion;
use super::inputs::InputSet;
use crate::abstraction::{Abstraction, BlockCore, Extents};
use model::grid_shape::GridShape;

/// Cells that one task of a sweep handles, more or less.
const CELLS_PER_TASK: usize = 16_384;

/// The grid cut into blocks, and those into groups, of the abstraction's shapes.
#[derive(Debug, Clone, Copy)]
pub struct Blocks<const D: usize> {
    shape: GridShape<D>,
    block: [u32; D],
    count: [u32; D],
    /// Blocks of a group on each axis.
    group: [u32; D],
    groups: [u32; D],
}

impl<const D: usize> Blocks<D> {
    /// The blocks of an abstraction.
    pub fn new<A: Abstraction<D>>(abstraction: &A) -> Self {
        let shape = *abstraction.shape();
        let block = abstraction.block();
        let whole = abstraction.group();
        let count: [u32; D] = std::array::from_fn(|d| shape.count[d].div_ceil(block[d]));
        let group: [u32; D] = std::array::from_fn(|d| whole[d] / block[d]);
        Self {
            shape,
            block,
            count,
            group,
            groups: std::array::from_fn(|d| count[d].div_ceil(group[d])),
        }
    }

    /// Number of blocks.
    pub fn total(&self) -> usize {
        product(self.count)
    }

    /// Runs over all groups in parallel: `enter` is told the first cell of a group and says whether
    /// to look at its blocks; `visit` is told a block's index and first cell. Every task collects
    /// in a value of its own; they come in the order of the groups.
    pub fn sweep<T: Default + Send>(
        &self,
        enter: impl Fn([u32; D]) -> bool + Sync,
        visit: impl Fn(usize, [u32; D], &mut T) + Sync,
    ) -> Vec<T> {
        let cells = product(self.group) * product(self.block);
        let per_task = (CELLS_PER_TASK / cells).max(1);
        let total = product(self.groups);
        (0..total.div_ceil(per_task))
            .into_par_iter()
            .map(|task| {
                let mut out = T::default();
                for group in task * per_task..((task + 1) * per_task).min(total) {
                    self.each_block(group, &enter, |block, first| visit(block, first, &mut out));
                }
                out
            })
            .collect()
    }

    /// Calls for every block of a group that `enter` lets in.
    fn each_block(
        &self,
        mut group: usize,
        enter: impl Fn([u32; D]) -> bool,
        mut call: impl FnMut(usize, [u32; D]),
    ) {
        let mut from = [0; D];
        for d in 0..D {
            from[d] = (group % self.groups[d] as usize) as u32 * self.group[d];
            group /= self.groups[d] as usize;
        }
        if !enter(std::array::from_fn(|d| from[d] * self.block[d])) {
            return;
        }
        each_in(self.count, from, self.group, |block, index| {
            call(index, std::array::from_fn(|d| block[d] * self.block[d]));
        });
    }

    /// Calls for every cell of the block that starts at `first`, with the cell and its dense index.
    #[inline]
    pub fn each_cell(&self, first: [u32; D], call: impl FnMut([u32; D], usize)) {
        each_in(self.shape.count, first, self.block, call);
    }

    /// Cells of each block for which the predicate holds.
    pub fn count_cells(&self, holds: impl Fn(usize) -> bool + Sync) -> Vec<AtomicU16> {
        let mut counts = Vec::new();
        counts.resize_with(self.total(), AtomicU16::default);
        self.sweep(
            |_| true,
            |block, first, (): &mut ()| {
                let mut count = 0u16;
                self.each_cell(first, |_, index| count += u16::from(holds(index)));
                counts[block].store(count, Relaxed);
            },
        );
        counts
    }
}

fn product<const D: usize>(counts: [u32; D]) -> usize {
    counts.iter().map(|n| *n as usize).product()
}

/// Calls for every position of a box that starts at `first` within a grid of `count`, with its
/// dense index; what sticks out of the grid is left out.
#[inline]
fn each_in<const D: usize>(
    count: [u32; D],
    first: [u32; D],
    size: [u32; D],
    mut call: impl FnMut([u32; D], usize),
) {
    let mut strides = [1usize; D];
    for d in 1..D {
        strides[d] = strides[d - 1] * count[d - 1] as usize;
    }
    let end: [u32; D] = std::array::from_fn(|d| (first[d] + size[d]).min(count[d]));
    let mut at = first;
    let mut index = (0..D).map(|d| first[d] as usize * strides[d]).sum();
    loop {
        call(at, index);
        let mut d = 0;
        loop {
            if d == D {
                return;
            }
            at[d] += 1;
            index += strides[d];
            if at[d] < end[d] {
                break;
            }
            index -= strides[d] * (at[d] - first[d]) as usize;
            at[d] = first[d];
            d += 1;
        }
    }
}

/// Inclusion in the cells that a sweep did not change, for hulls of each kind.
#[derive(Debug)]
struct Unchanged<const D: usize> {
    of_input: Inclusion<D>,
    of_block: Inclusion<D>,
    of_group: Inclusion<D>,
}

/// Inputs of a block that may have changed their answer since the last sweep.
#[derive(Debug)]
pub struct Dirty<const D: usize> {
    /// The cells that did not change; `None` when everything is dirty.
    unchanged: Option<Unchanged<D>>,
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
        let (of_input, (of_block, of_group)) = rayon::join(
            || of_size(extents.hull),
            || rayon::join(|| of_size(extents.hull_of_all), || of_size(extents.group)),
        );
        Self {
            unchanged: Some(Unchanged {
                of_input,
                of_block,
                of_group,
            }),
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
    /// A filter for a sweep against `set`.
    ///
    /// The boxes of a block's cells share a core. With `need_core`, an input is skipped for the
    /// whole block if that core is not in the set. This is right in a reach game: there a cell
    /// needs its whole box. A safety game asks which cells lose an input, and does without.
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

    /// Whether something changed in the hull of the group that starts at a cell. No pair of a group
    /// whose hull misses the grid is allowed, so nothing ever changes there.
    #[inline]
    pub fn group<A: Abstraction<D>>(&self, abstraction: &A, first: [u32; D]) -> bool {
        let Some(unchanged) = &self.dirty.unchanged else {
            return true;
        };
        let anchor = abstraction.anchor(first);
        abstraction
            .group_hull(&anchor)
            .is_some_and(|hull| !unchanged.of_group.includes(&hull))
    }

    /// The inputs of the block that are worth a look.
    #[inline]
    pub fn inputs<A: Abstraction<D>>(&self, abstraction: &A, first: [u32; D]) -> A::Inputs {
        let anchor = abstraction.anchor(first);
        if let Some(unchanged) = &self.dirty.unchanged {
            match abstraction.block_hull(&anchor, None) {
                Some(hull) if !unchanged.of_block.includes(&hull) => {}
                _ => return A::Inputs::default(),
            }
        }
        let mut mask = A::Inputs::default();
        for input in 0..abstraction.inputs() {
            // The core first: it fails most often.
            match (&self.core, abstraction.block_core(&anchor, input)) {
                (_, BlockCore::Leaves) => continue,
                (Some(set), BlockCore::Shared(core)) if !set.includes(&core) => continue,
                _ => {}
            }
            if let Some(unchanged) = &self.dirty.unchanged {
                match abstraction.block_hull(&anchor, Some(input)) {
                    Some(hull) if !unchanged.of_input.includes(&hull) => {}
                    _ => continue,
                }
            }
            mask = mask | A::Inputs::only(input);
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An axis that neither block nor group divides, and one shorter than a group.
    #[test]
    fn a_sweep_visits_every_cell_once_and_only_groups_let_in() {
        let shape = GridShape {
            lower: [0.0; 3],
            width: [1.0; 3],
            count: [11, 3, 7],
        };
        let blocks = Blocks {
            shape,
            block: [2, 1, 2],
            count: [6, 3, 4],
            group: [2, 4, 2],
            groups: [3, 1, 2],
        };
        assert_eq!(blocks.total(), 72);
        let visits = |enter: fn([u32; 3]) -> bool| {
            let mut visits = vec![0; shape.cells()];
            let mut seen = vec![0; blocks.total()];
            let found = blocks.sweep(enter, |block, first, out: &mut Vec<_>| {
                blocks.each_cell(first, |cell, index| out.push((block, cell, index)));
            });
            for (block, cell, index) in found.into_iter().flatten() {
                assert_eq!(shape.index(cell), index);
                visits[index] += 1;
                seen[block] += 1;
            }
            assert!(
                seen.iter()
                    .zip(blocks.count_cells(|_| true))
                    .all(|(a, b)| *a == b.into_inner() || *a == 0)
            );
            visits
        };
        assert!(visits(|_| true).iter().all(|n| *n == 1));
        // Only the groups that start at 4 on the first axis: cells 4 to 7 there.
        let some = visits(|first| first[0] == 4);
        for (index, n) in some.iter().enumerate() {
            let inside = (4..8).contains(&shape.cell(index)[0]);
            assert_eq!(*n, u32::from(inside), "{index}");
        }
    }
}
