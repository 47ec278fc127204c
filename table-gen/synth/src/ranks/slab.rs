//! The abstraction as one rank sees it: a window of the grid along its last axis.

use std::ops::Range;

use model::grid_shape::GridShape;

use super::Part;
use crate::abstraction::guard::Guard;
use crate::abstraction::{Abstraction, BlockCore, BlockExtents, CellBox, Extents};
use crate::game::blocks::Blocks;

/// A window of an abstraction, with cells of its own in it. Boxes are those of the whole grid; a
/// box of an own cell always lies in the window.
#[derive(Debug, Clone)]
pub struct Slab<'a, A, const D: usize> {
    whole: &'a A,
    /// The window, with its own count and lower edge on the last axis.
    shape: GridShape<D>,
    /// Layers of the whole grid that this rank owns, and that its window holds.
    own: Range<u32>,
    window: Range<u32>,
    /// Of the blocks, cut to the window.
    blocks: Option<BlockExtents<D>>,
}

impl<'a, const D: usize, A: Abstraction<D>> Slab<'a, A, D> {
    /// The slab of one of some ranks.
    pub fn new(whole: &'a A, rank: usize, ranks: usize) -> Self {
        let shape = *whole.shape();
        let layers = u64::from(shape.count[D - 1]);
        let cut = |rank: usize| (layers * rank as u64 / ranks as u64) as u32;
        let own = cut(rank)..cut(rank + 1);
        let window = window_of(whole, &own);
        let mut cut_shape = shape;
        cut_shape.count[D - 1] = window.end - window.start;
        cut_shape.lower[D - 1] = shape.interval(D - 1, window.start).0;
        let fits = |mut size: [u32; D]| {
            size[D - 1] = size[D - 1].min(cut_shape.count[D - 1]);
            size
        };
        let blocks = whole.block_extents().map(|extents| BlockExtents {
            core: extents.core,
            hull: fits(extents.hull),
            hull_of_all: fits(extents.hull_of_all),
            group: fits(extents.group),
        });
        Self {
            whole,
            shape: cut_shape,
            own,
            window,
            blocks,
        }
    }

    /// The cells that the rank owns and holds.
    pub fn part(&self) -> Part {
        let layer = self.shape.strides()[D - 1];
        let cells =
            |layers: &Range<u32>| layers.start as usize * layer..layers.end as usize * layer;
        Part {
            own: cells(&self.own),
            window: cells(&self.window),
        }
    }

    /// A cell of the window as one of the whole grid.
    fn out(&self, mut cell: [u32; D]) -> [u32; D] {
        cell[D - 1] += self.window.start;
        cell
    }

    /// A hull of the whole grid, cut to the window and moved to a fixed size; `None` if it misses
    /// the window.
    fn cut(&self, hull: CellBox<D>, size: u32) -> Option<CellBox<D>> {
        let d = D - 1;
        if hull.high[d] < self.window.start || hull.low[d] >= self.window.end {
            return None;
        }
        let mut cut = hull;
        let low = hull.low[d].saturating_sub(self.window.start);
        cut.low[d] = low.min(self.shape.count[d] - size);
        cut.high[d] = cut.low[d] + size - 1;
        Some(cut)
    }
}

/// Layers that own cells and their successors lie in.
fn window_of<const D: usize, A: Abstraction<D>>(whole: &A, own: &Range<u32>) -> Range<u32> {
    let last = D - 1;
    let block = whole.block()[last];
    let found = Blocks::new(whole).sweep(
        |_| true,
        |_, first, seen: &mut Option<(u32, u32)>| {
            if first[last] >= own.end || first[last] + block <= own.start {
                return;
            }
            let Some(hull) = whole.block_hull(&whole.anchor(first), None) else {
                return;
            };
            let (low, high) = (hull.low[last], hull.high[last]);
            *seen = Some(seen.map_or((low, high), |(a, b)| (a.min(low), b.max(high))));
        },
    );
    let mut window = own.clone();
    for (low, high) in found.into_iter().flatten() {
        window.start = window.start.min(low);
        window.end = window.end.max(high + 1);
    }
    window
}

impl<const D: usize, A: Abstraction<D>> Abstraction<D> for Slab<'_, A, D> {
    type Anchor = A::Anchor;
    type Inputs = A::Inputs;

    fn shape(&self) -> &GridShape<D> {
        &self.shape
    }

    fn inputs(&self) -> usize {
        self.whole.inputs()
    }

    fn anchor(&self, cell: [u32; D]) -> A::Anchor {
        self.whole.anchor(self.out(cell))
    }

    #[inline]
    fn successor(&self, anchor: &A::Anchor, input: usize) -> Option<CellBox<D>> {
        let mut cells = self.whole.successor(anchor, input)?;
        let d = D - 1;
        // Only the box of a cell of the halo sticks out of the window, and nobody asks for that.
        if cells.low[d] < self.window.start || cells.high[d] >= self.window.end {
            return None;
        }
        cells.low[d] -= self.window.start;
        cells.high[d] -= self.window.start;
        Some(cells)
    }

    fn extents(&self) -> Option<Extents<D>> {
        self.whole.extents()
    }

    fn block(&self) -> [u32; D] {
        self.whole.block()
    }

    fn group(&self) -> [u32; D] {
        self.whole.group()
    }

    fn block_extents(&self) -> Option<BlockExtents<D>> {
        self.blocks
    }

    #[inline]
    fn block_core(&self, first: &A::Anchor, input: usize) -> BlockCore<D> {
        match self.whole.block_core(first, input) {
            BlockCore::Shared(mut core) => {
                let d = D - 1;
                // What all boxes of a block share lies in the window if one of its cells is an own
                // cell whose box is allowed.
                if core.low[d] < self.window.start || core.high[d] >= self.window.end {
                    return BlockCore::Leaves;
                }
                core.low[d] -= self.window.start;
                core.high[d] -= self.window.start;
                BlockCore::Shared(core)
            }
            other => other,
        }
    }

    #[inline]
    fn block_hull(&self, first: &A::Anchor, input: Option<usize>) -> Option<CellBox<D>> {
        let hull = self.whole.block_hull(first, input)?;
        let size = match (&self.blocks, input) {
            (Some(extents), Some(_)) => extents.hull[D - 1],
            (Some(extents), None) => extents.hull_of_all[D - 1],
            (None, _) => self.shape.count[D - 1],
        };
        self.cut(hull, size)
    }

    #[inline]
    fn group_hull(&self, first: &A::Anchor) -> Option<CellBox<D>> {
        let hull = self.whole.group_hull(first)?;
        let size = self
            .blocks
            .as_ref()
            .map_or(self.shape.count[D - 1], |extents| extents.group[D - 1]);
        self.cut(hull, size)
    }
}

/// A guard of the whole grid, asked about cells of a window.
#[derive(Debug, Clone, Copy)]
pub struct WindowGuard<'g, G> {
    guard: &'g G,
    from: u32,
}

impl<'g, G> WindowGuard<'g, G> {
    /// For the window of a slab.
    pub fn new<A, const D: usize>(guard: &'g G, slab: &Slab<'_, A, D>) -> Self {
        let from = slab.window.start;
        Self { guard, from }
    }
}

impl<const D: usize, M, G: Guard<D, M>> Guard<D, M> for WindowGuard<'_, G> {
    fn permitted(&self, mut cell: [u32; D], inputs: M) -> M {
        cell[D - 1] += self.from;
        self.guard.permitted(cell, inputs)
    }
}
