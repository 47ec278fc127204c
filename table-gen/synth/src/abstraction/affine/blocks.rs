//! Blocks and groups of neighbouring cells of an affine abstraction, and the boxes that answer for
//! all their cells.
//!
//! Over a block the table sums move by at most their travel, so the successors of all its cells
//! under one input lie in the first cell's box widened by the travel (the *hull*), and what is left
//! of a box when the travel is taken off at both ends lies in every one of them (the *core*).

use super::block_tables::Travel;
use super::{AffineAbstraction, AffineAnchor, FRACTION_BITS, Mode, ONE};
use crate::abstraction::{BlockCore, BlockExtents, CellBox};

/// Most cells of a block with a core.
const BLOCK_CELLS_MAX: u32 = 64;
/// A block of fewer cells is grown on as long as any core is left, or else without one: asking for
/// the core and the hull of one or two cells costs as much as asking for their boxes.
const BLOCK_CELLS_MIN: u32 = 8;
/// Most cells of a group.
const GROUP_CELLS_MAX: u32 = 512;

impl<const D: usize> AffineAbstraction<D> {
    /// Chooses blocks and groups and prepares their boxes.
    pub(super) fn choose_blocks(&mut self) {
        for d in 0..D {
            let low = self.steps.iter().map(|step| step.offset[d]).min();
            let high = self.steps.iter().map(|s| s.offset[d] + s.span[d]).max();
            self.blocks.ends_of_all[d] = (low.unwrap_or(0), high.unwrap_or(0));
        }
        // All cells of a block share part of their boxes under every input, if possible half a
        // cell: a block whose shared part is not won needs no look at its cells.
        let mut block = [1; D];
        for (cells_max, least) in [(BLOCK_CELLS_MAX, 0.5), (BLOCK_CELLS_MIN, 0.0)] {
            block = self.grow(block, cells_max, |block| {
                let margin = self.core_margin(block);
                (margin >= least).then_some(-margin)
            });
        }
        block = self.grow(block, BLOCK_CELLS_MIN, |block| {
            Some(self.hull_volume(block))
        });
        let group = self.grow(block, GROUP_CELLS_MAX, |block| {
            Some(self.hull_of_all_volume(block))
        });
        for mode in &mut self.modes {
            mode.travel = mode.travel_over(block);
        }
        self.blocks.block = block;
        self.blocks.group = group;
        self.blocks.group_travel = self.modes[0].travel_over(group);
        self.blocks.extents = self.block_extents_of(group);
    }

    /// Doubles the block along the axis of least cost until it would hold more than so many cells
    /// or no axis has a cost.
    fn grow(
        &self,
        mut block: [u32; D],
        cells_max: u32,
        cost: impl Fn([u32; D]) -> Option<f64>,
    ) -> [u32; D] {
        loop {
            let mut best: Option<(f64, [u32; D])> = None;
            for axis in 0..D {
                let mut grown = block;
                grown[axis] *= 2;
                if grown[axis] > self.shape.count[axis].next_power_of_two()
                    || grown.iter().product::<u32>() > cells_max
                {
                    continue;
                }
                if let Some(cost) = cost(grown)
                    && best.is_none_or(|(other, _)| cost < other)
                {
                    best = Some((cost, grown));
                }
            }
            match best {
                Some((_, grown)) => block = grown,
                None => return block,
            }
        }
    }

    /// Sizes of the boxes of blocks (whose travel the modes hold) and of groups.
    fn block_extents_of(&self, group: [u32; D]) -> BlockExtents<D> {
        let mut core = [u32::MAX; D];
        let mut hull = [0u32; D];
        for step in &self.steps {
            for d in 0..D {
                let (down, up) = self.modes[step.mode].travel[d];
                let shared = step.span[d] - (up - down);
                core[d] = if shared < 0 {
                    0
                } else {
                    core[d].min((shared >> FRACTION_BITS) as u32 + 1)
                };
                let all = step.span[d] + (up - down);
                hull[d] = hull[d].max((all >> FRACTION_BITS) as u32 + 2);
            }
        }
        let count = self.shape.count;
        BlockExtents {
            core: core.iter().all(|n| *n > 0).then_some(core),
            hull: std::array::from_fn(|d| hull[d].min(count[d])),
            hull_of_all: self.size_of_all(&self.modes[0].travel),
            group: self.size_of_all(&self.modes[0].travel_over(group)),
        }
    }

    /// Cells on each axis of a hull over all inputs. Modes differ in their tables: with more than
    /// one it is the grid.
    fn size_of_all(&self, travel: &Travel<D>) -> [u32; D] {
        let count = self.shape.count;
        if self.modes.len() > 1 {
            return count;
        }
        std::array::from_fn(|d| {
            let (low, high) = self.blocks.ends_of_all[d];
            let (down, up) = travel[d];
            (((high - low + up - down) >> FRACTION_BITS) as u32 + 2).min(count[d])
        })
    }

    /// Smallest extent, in cells, of the part that the boxes of a block of this shape share;
    /// negative if none.
    fn core_margin(&self, block: [u32; D]) -> f64 {
        let mut margin = f64::INFINITY;
        for step in &self.steps {
            let travel = self.modes[step.mode].travel_over(block);
            for d in 0..D {
                let (down, up) = travel[d];
                margin = margin.min((step.span[d] - (up - down)) as f64 / ONE);
            }
        }
        margin
    }

    /// Volume, in cells, of the largest hull of one input over a block of this shape.
    fn hull_volume(&self, block: [u32; D]) -> f64 {
        let volume = |step: &super::InputStep<D>| -> f64 {
            let travel = self.modes[step.mode].travel_over(block);
            (0..D)
                .map(|d| (step.span[d] + travel[d].1 - travel[d].0) as f64 / ONE + 1.0)
                .product()
        };
        self.steps.iter().map(volume).fold(0.0, f64::max)
    }

    /// Volume, in cells, of the hull over all inputs of a block of this shape in the first mode.
    fn hull_of_all_volume(&self, block: [u32; D]) -> f64 {
        let travel = self.modes[0].travel_over(block);
        (0..D)
            .map(|d| {
                let (low, high) = self.blocks.ends_of_all[d];
                (high - low + travel[d].1 - travel[d].0) as f64 / ONE + 1.0
            })
            .product()
    }

    /// A range of cells on an axis, moved into the grid and widened to a fixed size; `None` if it
    /// misses the grid.
    #[inline]
    fn clipped(&self, axis: usize, (lowest, highest): (i64, i64), size: u32) -> Option<(u32, u32)> {
        let count = i64::from(self.shape.count[axis]);
        if size == self.shape.count[axis] {
            return Some((0, size - 1));
        }
        if highest < 0 || lowest >= count {
            return None;
        }
        let low = lowest.clamp(0, count - i64::from(size)) as u32;
        Some((low, low + size - 1))
    }

    /// Hull of the boxes under an input over the block that starts at an anchored cell.
    #[inline]
    pub(super) fn hull_of_input(
        &self,
        first: &AffineAnchor<D>,
        input: usize,
    ) -> Option<CellBox<D>> {
        let step = &self.steps[input];
        let sums = self.sums_of(first, step.mode);
        let travel = &self.modes[step.mode].travel;
        self.hull(&sums, travel, &self.blocks.extents.hull, |d| {
            (step.offset[d], step.offset[d] + step.span[d])
        })
    }

    /// Hull of the boxes under all inputs over cells of some travel.
    #[inline]
    pub(super) fn hull_of_all(
        &self,
        first: &AffineAnchor<D>,
        travel: &Travel<D>,
        size: &[u32; D],
    ) -> Option<CellBox<D>> {
        self.hull(&first.sums, travel, size, |d| self.blocks.ends_of_all[d])
    }

    #[inline]
    fn hull(
        &self,
        sums: &[i64; D],
        travel: &Travel<D>,
        size: &[u32; D],
        ends: impl Fn(usize) -> (i64, i64),
    ) -> Option<CellBox<D>> {
        let (mut low, mut high) = ([0; D], [0; D]);
        for d in 0..D {
            let (from, to) = ends(d);
            let (down, up) = travel[d];
            let lowest = (sums[d] + from + down) >> FRACTION_BITS;
            let highest = (sums[d] + to + up) >> FRACTION_BITS;
            (low[d], high[d]) = self.clipped(d, (lowest, highest), size[d])?;
        }
        Some(CellBox { low, high })
    }

    /// What the boxes under an input share over the block that starts at an anchored cell.
    #[inline]
    pub(super) fn core_of_input(&self, first: &AffineAnchor<D>, input: usize) -> BlockCore<D> {
        let Some(extent) = &self.blocks.extents.core else {
            return BlockCore::Unknown;
        };
        let step = &self.steps[input];
        let sums = self.sums_of(first, step.mode);
        let (mut low, mut high) = ([0u32; D], [0u32; D]);
        let mut inside = true;
        for d in 0..D {
            // Every box of the block starts at or below the first's start plus the travel upwards,
            // and is that much longer than the core.
            let (_, up) = self.modes[step.mode].travel[d];
            let from = (sums[d] + step.offset[d] + up) >> FRACTION_BITS;
            let to = from + i64::from(extent[d]) - 1;
            inside &= from >= 0 && to < i64::from(self.shape.count[d]);
            low[d] = from as u32;
            high[d] = to as u32;
        }
        if inside {
            BlockCore::Shared(CellBox { low, high })
        } else {
            BlockCore::Leaves
        }
    }
}

impl<const D: usize> Mode<D> {
    /// Range of the table sums over a block, relative to the block's first cell. A block that the
    /// grid cuts short moves less; the entries' own rounding is covered by two units an axis.
    fn travel_over(&self, block: [u32; D]) -> Travel<D> {
        let mut travel = [(0i64, 0i64); D];
        for d in 0..D {
            for j in 0..D {
                let table = &self.tables[d][j];
                let steps = i64::from(block[j] - 1).min(table.len() as i64 - 1);
                if steps == 0 {
                    continue;
                }
                // Entries are multiples of one slope, each rounded by half a unit and a little: the
                // change between any two differs from the slope's by less than two units.
                let change = table[steps as usize] - table[0];
                travel[d].0 += change.min(0) - 2;
                travel[d].1 += change.max(0) + 2;
            }
        }
        travel
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AffineInput, Growth};
    use super::*;
    use crate::abstraction::Abstraction;
    use crate::game::blocks::Blocks;
    use model::grid_shape::GridShape;
    use model::interval::Interval;
    use proptest::prelude::*;

    fn lies_in(inner: &CellBox<3>, outer: &CellBox<3>) -> bool {
        (0..3).all(|d| outer.low[d] <= inner.low[d] && inner.high[d] <= outer.high[d])
    }

    fn size(cells: &CellBox<3>) -> [u32; 3] {
        std::array::from_fn(|d| cells.high[d] - cells.low[d] + 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// Over every group and block of random plants, every pair's box lies in the hulls,
        /// contains the core, and the boxes have the sizes that the erosions are made for.
        #[test]
        fn hulls_enclose_and_cores_are_shared(
            a in proptest::array::uniform3(proptest::array::uniform3(-1.0f64..1.0)),
            b in proptest::array::uniform3(-2.0f64..2.0),
            count in proptest::array::uniform3(3u32..14),
            drives in proptest::collection::vec((-1.0f64..1.0, 0.0f64..0.6), 1..5),
            measurement in 0.0f64..0.2,
            period_s in 0.05f64..0.8,
        ) {
            let shape = GridShape { lower: [-1.0; 3], width: [0.3, 0.2, 0.25], count };
            let inputs: Vec<_> = drives
                .iter()
                .map(|(middle, radius)| AffineInput {
                    a: a.map(|row| row.map(Interval::point)),
                    b: b.map(Interval::point),
                    drive: Interval::hull(middle - radius, middle + radius),
                })
                .collect();
            let engine =
                AffineAbstraction::new(shape, &inputs, period_s, Growth::ExactLinear, [measurement; 3]).unwrap();
            let extents = engine.block_extents().unwrap();
            let (block, group) = (engine.block(), engine.group());
            for d in 0..3 {
                prop_assert_eq!(group[d] % block[d], 0);
            }
            let failures = Blocks::new(&engine).sweep(|_| true, |_, first, out: &mut Vec<String>| {
                let of_group = engine.anchor(std::array::from_fn(|d| first[d] / group[d] * group[d]));
                let of_block = engine.anchor(first);
                let hulls = [
                    (engine.group_hull(&of_group), extents.group),
                    (engine.block_hull(&of_block, None), extents.hull_of_all),
                ];
                Blocks::new(&engine).each_cell(first, |cell, _| {
                    let anchor = engine.anchor(cell);
                    for input in 0..inputs.len() {
                        let Some(boxed) = engine.successor(&anchor, input) else { continue };
                        let hull = (engine.block_hull(&of_block, Some(input)), extents.hull);
                        for (hull, cells) in hulls.into_iter().chain([hull]) {
                            if !hull.is_some_and(|hull| lies_in(&boxed, &hull) && size(&hull) == cells) {
                                out.push(format!("{cell:?} {input}: {boxed:?} in {hull:?} of {cells:?}"));
                            }
                        }
                        let shared = match engine.block_core(&of_block, input) {
                            BlockCore::Unknown => extents.core.is_none(),
                            BlockCore::Leaves => false,
                            BlockCore::Shared(core) => lies_in(&core, &boxed) && Some(size(&core)) == extents.core,
                        };
                        if !shared {
                            out.push(format!("{cell:?} {input}: core"));
                        }
                    }
                });
            });
            prop_assert_eq!(failures.concat(), Vec::<String>::new());
        }
    }
}
