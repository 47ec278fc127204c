//! Building a small tree over labelled cells.

use firmware::grid::Cell;

use super::best_plane::{Plane, best_plane, widest_plane};
use super::cells::{LabelledCell, bounds};
use model::plant::STATES;

/// Cells from which on the two sides of a plane are built in parallel.
const PARALLEL_CELLS: usize = 2_000;

/// A k-d tree over cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Tree {
    /// Every cell of the box gets this leaf value.
    Leaf(u8),
    /// A plane and what lies on its sides.
    Split {
        /// The plane.
        plane: Plane,
        /// Cells below the threshold.
        left: Box<Tree>,
        /// The others.
        right: Box<Tree>,
    },
}

impl Tree {
    /// Leaf value at a cell.
    pub fn leaf(&self, cell: Cell) -> u8 {
        let mut tree = self;
        loop {
            match tree {
                Self::Leaf(value) => return *value,
                Self::Split { plane, left, right } => {
                    let below = cell.0[plane.axis] < plane.threshold;
                    tree = if below { left } else { right };
                }
            }
        }
    }

    /// Leaves.
    pub fn leaves(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Split { left, right, .. } => left.leaves() + right.leaves(),
        }
    }

    /// Leaf values that occur, as bits.
    pub fn values(&self) -> u64 {
        match self {
            Self::Leaf(value) => 1 << value,
            Self::Split { left, right, .. } => left.values() | right.values(),
        }
    }

    /// The same tree with other leaf values.
    #[must_use]
    pub fn renumbered(&self, to: &[u8; 64]) -> Self {
        match self {
            Self::Leaf(value) => Self::Leaf(to[usize::from(*value)]),
            Self::Split { plane, left, right } => Self::Split {
                plane: *plane,
                left: Box::new(left.renumbered(to)),
                right: Box::new(right.renumbered(to)),
            },
        }
    }

    /// Most nodes that a lookup visits; a tree that is one leaf counts as one.
    pub fn depth(&self) -> u16 {
        self.inner_depth().max(1)
    }

    fn inner_depth(&self) -> u16 {
        match self {
            Self::Leaf(_) => 0,
            Self::Split { left, right, .. } => 1 + left.inner_depth().max(right.inner_depth()),
        }
    }
}

/// Which of the leaf values that fit all cells of a box it gets: the labels in common (not zero),
/// and the cells.
pub type ChooseLeaf<'c> = dyn Fn(u64, &[LabelledCell]) -> u8 + Sync + 'c;

/// Builds a tree of at most `depth_max` nodes on any path that gives every cell one of its labels.
/// Planes are chosen greedily ([`best_plane`] says what `balance` does); where the depth runs out
/// boxes are halved, so the depth must be at least the sum of the axes' bits.
///
/// The order of the cells is lost. The result does not depend on it, nor on the number of threads.
pub fn build(
    cells: &mut [LabelledCell],
    depth_max: u32,
    balance: f64,
    choose: &ChooseLeaf<'_>,
) -> Tree {
    let common = cells.iter().fold(u64::MAX, |all, cell| all & cell.labels);
    if common != 0 {
        return Tree::Leaf(choose(common, cells));
    }
    let plane = if depth_max <= depth_by_halving(cells) {
        widest_plane(cells)
    } else {
        best_plane(cells, balance)
    };
    // One cell alone has its own labels in common: there is a plane.
    let Some(plane) = plane else {
        return Tree::Leaf(0);
    };
    let (left, right) = cut(cells, plane);
    let below = depth_max.saturating_sub(1);
    let (left, right) = if left.len() + right.len() >= PARALLEL_CELLS {
        rayon::join(
            || build(left, below, balance, choose),
            || build(right, below, balance, choose),
        )
    } else {
        (
            build(left, below, balance, choose),
            build(right, below, balance, choose),
        )
    };
    Tree::Split {
        plane,
        left: Box::new(left),
        right: Box::new(right),
    }
}

/// Depth after which halving the widest axis has told all cells apart.
pub(super) fn depth_by_halving(cells: &[LabelledCell]) -> u32 {
    let (low, high) = bounds(cells);
    (0..STATES)
        .map(|d| u16::BITS - high[d].saturating_sub(low[d]).leading_zeros())
        .sum()
}

/// Parts the cells by a plane.
pub(super) fn cut(
    cells: &mut [LabelledCell],
    plane: Plane,
) -> (&mut [LabelledCell], &mut [LabelledCell]) {
    let mut below = 0;
    for at in 0..cells.len() {
        if cells[at].cell[plane.axis] < plane.threshold {
            cells.swap(below, at);
            below += 1;
        }
    }
    cells.split_at_mut(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lowest(common: u64, _: &[LabelledCell]) -> u8 {
        common.trailing_zeros() as u8
    }

    fn cell(f: u16, g: u16, labels: u64) -> LabelledCell {
        LabelledCell {
            cell: [f, g, 0, 0],
            labels,
        }
    }

    #[test]
    fn a_label_in_common_is_one_leaf() {
        let mut cells = [cell(0, 0, 0b011), cell(5, 0, 0b110), cell(9, 3, 0b010)];
        assert_eq!(build(&mut cells, 20, 0.0, &lowest), Tree::Leaf(1));
    }

    #[test]
    fn two_halves_are_one_split() {
        let mut cells: Vec<_> = (0..8)
            .map(|f| cell(f, 0, if f < 3 { 1 } else { 2 }))
            .collect();
        let Tree::Split { plane, left, right } = build(&mut cells, 20, 0.0, &lowest) else {
            panic!("one leaf does not fit");
        };
        assert_eq!((plane.axis, plane.threshold), (0, 3));
        assert_eq!((*left, *right), (Tree::Leaf(0), Tree::Leaf(1)));
    }

    proptest! {
        #[test]
        fn every_cell_gets_a_label_of_its_own_within_the_depth(
            labels in proptest::collection::vec(1u64..16, 5 * 6 * 4), depth in 8u32..30,
            balance in 0.0..4.0,
        ) {
            let mut cells: Vec<_> = labels.iter().enumerate().map(|(i, labels)| {
                let i = i as u16;
                LabelledCell { cell: [i % 5, i / 5 % 6, i / 30, 0], labels: *labels }
            }).collect();
            let original = cells.clone();
            let tree = build(&mut cells, depth, balance, &lowest);
            for cell in original {
                prop_assert!(cell.labels >> tree.leaf(cell.cell()) & 1 == 1);
            }
            // 5, 6 and 4 cells take 3 + 3 + 2 halvings.
            prop_assert!(u32::from(tree.depth()) <= depth);
        }
    }
}
