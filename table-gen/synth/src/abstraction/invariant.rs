//! Abstraction of a plant with a growth bound that does not care where it is along some axes: a
//! vehicle moves alike everywhere on its map.
//!
//! Along an *invariant* axis a shift of the state shifts the successor by as much. So how far a box
//! lies from its cell depends on the other axes' indices (the *pose*) and the input alone, and is a
//! whole number of cells:
//!
//! ```text
//! low_d = c_d + floor(1/2 + (m_d - r_d)/w_d)        high_d = c_d + floor(1/2 + (m_d + r_d)/w_d)
//! ```
//!
//! with m the enclosure of the move of the centre, r the bound of the radius and w the width of a
//! cell. There is one table entry for each pose and input, and the games add small integers.
//!
//! **Rounding.** Move and radius are intervals, evaluated on the interval that holds the exact
//! centre; the quotients are rounded outward. A box whose end falls on a cell's edge holds the
//! cells on both sides.

use super::{Abstraction, BlockCore, BlockExtents, CellBox, Extents};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Cells on each invariant axis of a block, and of a group.
const BLOCK: u32 = 2;
const GROUP: u32 = 8;

/// A sampled plant with a growth bound, invariant along some axes.
pub trait InvariantPlant<const D: usize>: Sync {
    /// Number of inputs, 1..=64.
    fn inputs(&self) -> usize;

    /// The axes along which a shift of the state shifts the successor by as much.
    fn invariant(&self) -> [bool; D];

    /// Encloses `x⁺ - x` after one period from x; it must not depend on the invariant axes.
    fn displacement(&self, x: [Interval; D], input: usize) -> [Interval; D];

    /// Bounds the distance of any successor of the box `x ± r` from that of x; it must not depend
    /// on x along the invariant axes.
    fn radius(&self, x: [Interval; D], r: [Interval; D], input: usize) -> [Interval; D];
}

/// Why such an abstraction cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvariantError {
    /// No input, or more than the masks hold.
    #[error("{found} inputs; the masks of this abstraction hold 1 to 64")]
    Inputs {
        /// Inputs found.
        found: usize,
    },
    /// A move that is not a number, or farther than any grid.
    #[error("input {input} moves the state by {cells:e} cells on axis {axis}: shorten the period")]
    Move {
        /// The input.
        input: usize,
        /// The axis.
        axis: usize,
        /// Distance in cells.
        cells: f64,
    },
}

/// Ends of a box, in cells from the cell that it is the successor of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Move<const D: usize> {
    low: [i32; D],
    high: [i32; D],
}

/// The abstraction.
#[derive(Debug, Clone)]
pub struct InvariantAbstraction<const D: usize> {
    shape: GridShape<D>,
    inputs: usize,
    /// Factor of each axis in the number of a pose; 0 on invariant axes.
    pose: [usize; D],
    /// Of pose p and input u at `p * inputs + u`.
    moves: Vec<Move<D>>,
    /// Over all inputs of each pose.
    hulls: Vec<Move<D>>,
    block: [u32; D],
    group: [u32; D],
    extents: Extents<D>,
    blocks: BlockExtents<D>,
}

impl<const D: usize> InvariantAbstraction<D> {
    /// The abstraction of a plant on a grid.
    ///
    /// # Errors
    /// Too many inputs, or a move past any grid.
    pub fn new(
        shape: GridShape<D>,
        plant: &impl InvariantPlant<D>,
    ) -> Result<Self, InvariantError> {
        let inputs = plant.inputs();
        if inputs == 0 || inputs > 64 {
            return Err(InvariantError::Inputs { found: inputs });
        }
        let invariant = plant.invariant();
        let mut pose = [0; D];
        let mut poses = 1;
        for d in (0..D).filter(|d| !invariant[*d]) {
            pose[d] = poses;
            poses *= shape.count[d] as usize;
        }
        let mut moves = Vec::with_capacity(poses * inputs);
        for number in 0..poses {
            // Invariant axes: any cell will do.
            let cell = std::array::from_fn(|d| match pose[d] {
                0 => 0,
                factor => (number / factor % shape.count[d] as usize) as u32,
            });
            for input in 0..inputs {
                moves.push(move_of(&shape, plant, cell, input)?);
            }
        }
        let hulls = moves.chunks(inputs).map(hull).collect();
        let side = |size: u32| std::array::from_fn(|d| if invariant[d] { size } else { 1 });
        let mut abstraction = Self {
            shape,
            inputs,
            pose,
            moves,
            hulls,
            block: side(BLOCK),
            group: side(GROUP),
            extents: Extents {
                min: [u32::MAX; D],
                max: [0; D],
            },
            blocks: BlockExtents {
                core: None,
                hull: [0; D],
                hull_of_all: [0; D],
                group: [0; D],
            },
        };
        abstraction.measure();
        Ok(abstraction)
    }

    /// Sizes of the boxes, cores and hulls.
    fn measure(&mut self) {
        let size = |m: &Move<D>, d: usize| (m.high[d] - m.low[d] + 1) as u32;
        let most =
            |moves: &[Move<D>], d: usize| moves.iter().map(|m| size(m, d)).max().unwrap_or(1);
        for d in 0..D {
            self.extents.min[d] = self.moves.iter().map(|m| size(m, d)).min().unwrap_or(1);
            self.extents.max[d] = most(&self.moves, d);
            let count = self.shape.count[d];
            let all = most(&self.hulls, d);
            self.blocks.hull[d] = (self.extents.max[d] + self.block[d] - 1).min(count);
            self.blocks.hull_of_all[d] = (all + self.block[d] - 1).min(count);
            self.blocks.group[d] = (all + self.group[d] - 1).min(count);
        }
        let shared: [u32; D] =
            std::array::from_fn(|d| (self.extents.min[d] + 1).saturating_sub(self.block[d]));
        self.blocks.core = shared.iter().all(|cells| *cells > 0).then_some(shared);
    }

    /// Cells from `low` to `high`, widened to a fixed size and moved into the grid; `None` if they
    /// miss it.
    fn clipped(
        &self,
        first: [u32; D],
        m: &Move<D>,
        side: [u32; D],
        size: [u32; D],
    ) -> Option<CellBox<D>> {
        let (mut low, mut high) = ([0; D], [0; D]);
        for d in 0..D {
            let count = i64::from(self.shape.count[d]);
            let from = i64::from(first[d]) + i64::from(m.low[d]);
            let to = i64::from(first[d]) + i64::from(side[d]) - 1 + i64::from(m.high[d]);
            if to < 0 || from >= count {
                return None;
            }
            low[d] = from.clamp(0, count - i64::from(size[d])) as u32;
            high[d] = low[d] + size[d] - 1;
        }
        Some(CellBox { low, high })
    }
}

fn move_of<const D: usize>(
    shape: &GridShape<D>,
    plant: &impl InvariantPlant<D>,
    cell: [u32; D],
    input: usize,
) -> Result<Move<D>, InvariantError> {
    let half = Interval::point(0.5);
    let width = shape.width.map(Interval::point);
    let centre = std::array::from_fn(|d| {
        Interval::point(shape.lower[d]) + width[d] * (Interval::point(f64::from(cell[d])) + half)
    });
    let moved = plant.displacement(centre, input);
    let radius = plant.radius(centre, width.map(|w| half * w), input);
    let (mut low, mut high) = ([0; D], [0; D]);
    for axis in 0..D {
        let from = half + (moved[axis] - radius[axis]) / width[axis];
        let to = half + (moved[axis] + radius[axis]) / width[axis];
        let cells = from.magnitude().max(to.magnitude());
        if cells.is_nan() || cells > f64::from(u16::MAX) {
            return Err(InvariantError::Move { input, axis, cells });
        }
        low[axis] = from.low.floor() as i32;
        high[axis] = to.high.floor() as i32;
    }
    Ok(Move { low, high })
}

fn hull<const D: usize>(moves: &[Move<D>]) -> Move<D> {
    let mut hull = moves[0];
    for m in moves {
        for d in 0..D {
            hull.low[d] = hull.low[d].min(m.low[d]);
            hull.high[d] = hull.high[d].max(m.high[d]);
        }
    }
    hull
}

/// A cell and the number of its pose.
#[derive(Debug, Clone, Copy)]
pub struct PoseAnchor<const D: usize> {
    cell: [u32; D],
    pose: usize,
}

impl<const D: usize> Abstraction<D> for InvariantAbstraction<D> {
    type Anchor = PoseAnchor<D>;
    type Inputs = u64;

    fn shape(&self) -> &GridShape<D> {
        &self.shape
    }

    fn inputs(&self) -> usize {
        self.inputs
    }

    #[inline]
    fn anchor(&self, cell: [u32; D]) -> PoseAnchor<D> {
        let pose = (0..D).map(|d| cell[d] as usize * self.pose[d]).sum();
        PoseAnchor { cell, pose }
    }

    #[inline]
    fn successor(&self, anchor: &PoseAnchor<D>, input: usize) -> Option<CellBox<D>> {
        let m = &self.moves[anchor.pose * self.inputs + input];
        let (mut low, mut high) = ([0u32; D], [0u32; D]);
        let mut inside = true;
        for d in 0..D {
            // A move is at most 2^16 cells and an index below 2^31, so neither sum wraps past the
            // check.
            low[d] = anchor.cell[d].wrapping_add_signed(m.low[d]);
            high[d] = anchor.cell[d].wrapping_add_signed(m.high[d]);
            inside &= low[d] <= high[d] && high[d] < self.shape.count[d];
        }
        inside.then_some(CellBox { low, high })
    }

    fn extents(&self) -> Option<Extents<D>> {
        Some(self.extents)
    }

    fn block(&self) -> [u32; D] {
        self.block
    }

    fn group(&self) -> [u32; D] {
        self.group
    }

    fn block_extents(&self) -> Option<BlockExtents<D>> {
        Some(self.blocks)
    }

    #[inline]
    fn block_core(&self, first: &PoseAnchor<D>, input: usize) -> BlockCore<D> {
        let Some(extent) = self.blocks.core else {
            return BlockCore::Unknown;
        };
        let m = &self.moves[first.pose * self.inputs + input];
        let (mut low, mut high) = ([0u32; D], [0u32; D]);
        for d in 0..D {
            // Every box of the block starts at or below that of its last cell, and is longer than
            // the core by at least as much.
            let from =
                i64::from(first.cell[d]) + i64::from(self.block[d]) - 1 + i64::from(m.low[d]);
            let to = from + i64::from(extent[d]) - 1;
            if from < 0 || to >= i64::from(self.shape.count[d]) {
                return BlockCore::Leaves;
            }
            low[d] = from as u32;
            high[d] = to as u32;
        }
        BlockCore::Shared(CellBox { low, high })
    }

    #[inline]
    fn block_hull(&self, first: &PoseAnchor<D>, input: Option<usize>) -> Option<CellBox<D>> {
        match input {
            Some(input) => {
                let m = &self.moves[first.pose * self.inputs + input];
                self.clipped(first.cell, m, self.block, self.blocks.hull)
            }
            None => {
                let m = &self.hulls[first.pose];
                self.clipped(first.cell, m, self.block, self.blocks.hull_of_all)
            }
        }
    }

    #[inline]
    fn group_hull(&self, first: &PoseAnchor<D>) -> Option<CellBox<D>> {
        let m = &self.hulls[first.pose];
        self.clipped(first.cell, m, self.group, self.blocks.group)
    }
}
