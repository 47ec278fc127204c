//! The tree encoding: a k-d tree over cells whose leaves name an input level or an affine piece.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | affine pieces, 0..=31 |
//! | 1 | 12 each | the pieces, see [`AffineFunction`] |
//! | | | the tree, see [`Node`] |
//!
//! A leaf below 32 is an input level, 32 + k the k-th affine piece. The tree answers for every
//! cell. Which cells lie in the law's domain is for the domain part to say.
//!
//! The tree is checked once, from front to back with a stack of fixed size; after that a lookup
//! visits at most [`TreeView::depth`] nodes and always ends at a leaf.

use super::affine::{AFFINE_LEN, AffineFunction};
use super::encoding::Encoding;
use super::error::BlockError;
use super::tree_node::{
    BYTE_ESCAPE, Children, DELTA_ESCAPE, DELTA_SHIFT, FLAG, LEAF_VALUES, Node, SHORT_SKIP,
};
use crate::grid::{Cell, Grid};
use crate::units::STATES;

/// Deepest tree that the reader accepts.
pub const TREE_DEPTH_MAX: u16 = 64;
/// Leaves from here on are affine pieces.
pub const LEAF_AFFINE: u8 = 32;
/// Most affine pieces of a tree.
pub const AFFINE_PIECES_MAX: u8 = 31;

/// A checked string of nodes; lookups end within [`Shape::depth`] nodes.
#[derive(Debug, Clone)]
pub(super) struct NodesView<'t> {
    nodes: &'t [u8],
}

/// What a tree has of nodes and leaves.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shape {
    /// Most nodes on the way to a leaf.
    pub(super) depth: u16,
    /// Leaves.
    pub(super) leaves: u32,
}

impl<'t> NodesView<'t> {
    /// Checks that the bytes are one tree, that every subtree ends where its parent says, and that
    /// `leaf` accepts all leaves.
    pub(super) fn parse(
        nodes: &'t [u8],
        leaf: &dyn Fn(u8) -> bool,
    ) -> Result<(Self, Shape), BlockError> {
        Ok((Self { nodes }, check(nodes, leaf)?))
    }

    /// Leaf of a cell. `None` does not occur in a tree that was checked.
    #[inline(never)]
    pub(super) fn leaf(&self, cell: Cell) -> Option<u8> {
        self.walk(cell, || {})
    }

    /// The nodes visited on the way to the leaf of a cell.
    pub(super) fn visits(&self, cell: Cell) -> u16 {
        let mut visits = 0;
        let _leaf = self.walk(cell, || visits += 1);
        visits
    }

    /// The same walk as over [`Node::read`] (a test compares them), without taking each node apart
    /// first: 26 to 33 instructions a node. Every turn shortens what is left of the nodes, so the
    /// walk ends.
    #[inline(always)]
    fn walk(&self, cell: Cell, mut visit: impl FnMut()) -> Option<u8> {
        // The cell relative to the lowest cell of the node's box.
        let [f, g, l, p] = cell.0;
        let mut rest: [u32; STATES] = [f.into(), g.into(), l.into(), p.into()];
        let mut nodes = self.nodes;
        while let [head, child, ref below @ ..] = *nodes {
            visit();
            let (delta, child, below) = match u16::from(head >> DELTA_SHIFT) {
                DELTA_ESCAPE => long_delta(child, below)?,
                delta => (delta, child, below),
            };
            let (delta, flag) = (u32::from(delta), head & FLAG != 0);
            let index = &mut rest[usize::from(head) % STATES];
            if *index < delta {
                // Left: with the flag a child below 64 is the right leaf, and the left child
                // follows.
                match (flag, child) {
                    (false, 0..LEAF_VALUES) => return Some(child),
                    (true, LEAF_VALUES..) => return Some(child - LEAF_VALUES),
                    (false, BYTE_ESCAPE) => nodes = below.get(3..)?,
                    _ => nodes = below,
                }
            } else {
                *index -= delta;
                match (flag, child) {
                    (false, 0..LEAF_VALUES) => nodes = below,
                    (true, 0..LEAF_VALUES) => return Some(child),
                    (true, _) => return below.first().copied(),
                    (false, BYTE_ESCAPE) => nodes = long_skip(below)?,
                    (false, _) => nodes = below.get(usize::from(child - SHORT_SKIP)..)?,
                }
            }
        }
        // A tree of one leaf.
        visit();
        nodes.first().copied()
    }

    /// The tree's shape, counted anew.
    pub(super) fn shape(&self) -> Shape {
        check(self.nodes, &|_| true).unwrap_or_default()
    }
}

/// The shape of the tree in these bytes, if they are one tree, every subtree ends where its parent
/// says, and `leaf` accepts all leaves.
#[inline(never)]
fn check(nodes: &[u8], leaf: &dyn Fn(u8) -> bool) -> Result<Shape, BlockError> {
    let known = |ok| {
        if ok {
            Ok(())
        } else {
            Err(BlockError::BadLevel)
        }
    };
    if let [only] = nodes {
        known(leaf(*only))?;
        return Ok(Shape {
            depth: 1,
            leaves: 1,
        });
    }
    // Where the right children of the path's nodes begin, and their depth.
    let mut begins = [0usize; TREE_DEPTH_MAX as usize];
    let mut depths = [0u8; TREE_DEPTH_MAX as usize];
    let mut waiting = 0;
    let (mut at, mut depth) = (0usize, 1u8);
    let mut shape = Shape::default();
    // Every turn consumes a node, so the loop ends.
    loop {
        if u16::from(depth) > TREE_DEPTH_MAX {
            return Err(BlockError::TooManyVisits);
        }
        shape.depth = shape.depth.max(depth.into());
        let (node, len) = Node::read(nodes, at).ok_or(BlockError::BadNode)?;
        at += len;
        match node.children {
            Children::LeftLeaf(value) | Children::RightLeaf(value) => {
                known(leaf(value))?;
                shape.leaves += 1;
            }
            Children::Nodes { skip } => {
                // At most one entry for each node of the path: there is room.
                if let (Some(begin), Some(below)) =
                    (begins.get_mut(waiting), depths.get_mut(waiting))
                {
                    (*begin, *below) = (at + skip as usize, depth + 1);
                }
                waiting += 1;
            }
            Children::Leaves(left, right) => {
                known(leaf(left) && leaf(right))?;
                shape.leaves += 2;
                if waiting == 0 {
                    break;
                }
                waiting -= 1;
                if begins.get(waiting) != Some(&at) {
                    return Err(BlockError::BadNode);
                }
                depth = depths.get(waiting).copied().unwrap_or_default();
                continue;
            }
        }
        depth += 1;
    }
    if at == nodes.len() {
        Ok(shape)
    } else {
        Err(BlockError::BadShape)
    }
}

/// Delta, child byte and what follows of a node whose delta does not fit the head.
#[cold]
fn long_delta(more: u8, rest: &[u8]) -> Option<(u16, u8, &[u8])> {
    match (more, rest) {
        (BYTE_ESCAPE, [low, high, child, below @ ..]) => {
            Some((u16::from_le_bytes([*low, *high]), *child, below))
        }
        (BYTE_ESCAPE, _) => None,
        (_, [child, below @ ..]) => Some((DELTA_ESCAPE + u16::from(more), *child, below)),
        (_, []) => None,
    }
}

/// The right child of a node whose skip takes three bytes.
#[cold]
fn long_skip(below: &[u8]) -> Option<&[u8]> {
    let ([a, b, c], below) = below.split_first_chunk()?;
    below.get(u32::from_le_bytes([*a, *b, *c, 0]) as usize..)
}

/// Reader of the tree encoding.
#[derive(Debug, Clone)]
pub struct TreeView<'t> {
    pieces: &'t [u8],
    levels: u8,
    nodes: NodesView<'t>,
}

impl<'t> TreeView<'t> {
    /// Checks the pieces and the tree.
    ///
    /// # Errors
    /// A part that is cut short, a piece that could overflow on the grid, a broken or too deep
    /// tree, or a leaf that names a level or piece that does not exist.
    pub fn parse(block: &'t [u8], grid: &Grid, levels: u8) -> Result<Self, BlockError> {
        let (count, rest) = block.split_first().ok_or(BlockError::BadShape)?;
        if *count > AFFINE_PIECES_MAX {
            return Err(BlockError::BadShape);
        }
        let (pieces, nodes) = rest
            .split_at_checked(usize::from(*count) * AFFINE_LEN)
            .ok_or(BlockError::BadShape)?;
        for piece in pieces.chunks_exact(AFFINE_LEN) {
            if !AffineFunction::read(piece).fits(grid) {
                return Err(BlockError::Overflow);
            }
        }
        let exists = |leaf: u8| match leaf.checked_sub(LEAF_AFFINE) {
            None => leaf < levels,
            Some(piece) => piece < *count,
        };
        let (nodes, _) = NodesView::parse(nodes, &exists)?;
        Ok(Self {
            pieces,
            levels,
            nodes,
        })
    }

    /// Most nodes that a lookup visits.
    pub fn depth(&self) -> u16 {
        self.nodes.shape().depth
    }
}

impl Encoding for TreeView<'_> {
    fn level(&self, cell: Cell) -> Option<u8> {
        let leaf = self.nodes.leaf(cell)?;
        match leaf.checked_sub(LEAF_AFFINE) {
            None => Some(leaf),
            Some(piece) => {
                let piece = self.pieces.get(usize::from(piece) * AFFINE_LEN..)?;
                Some(AffineFunction::read(piece).level(cell, self.levels))
            }
        }
    }

    fn visits(&self, cell: Cell) -> u16 {
        self.nodes.visits(cell)
    }

    fn worst_visits(&self) -> u16 {
        self.depth()
    }

    fn entries(&self) -> u32 {
        self.nodes.shape().leaves
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// The leaf of a cell by taking every node apart.
    fn slowly(nodes: &[u8], cell: Cell) -> (u8, u16) {
        if let [only] = nodes {
            return (*only, 1);
        }
        let (mut rest, mut at, mut visits) = (cell.0, 0, 0);
        loop {
            let (node, len) = Node::read(nodes, at).unwrap();
            (at, visits) = (at + len, visits + 1);
            let index = &mut rest[usize::from(node.axis)];
            let left = *index < node.delta;
            if !left {
                *index -= node.delta;
            }
            match (node.children, left) {
                (Children::Leaves(leaf, _) | Children::LeftLeaf(leaf), true)
                | (Children::Leaves(_, leaf) | Children::RightLeaf(leaf), false) => {
                    return (leaf, visits);
                }
                (Children::Nodes { skip }, false) => at += skip as usize,
                _ => {}
            }
        }
    }

    /// A tree from a recipe: what is left of it, the depth left.
    fn grow(recipe: &mut impl Iterator<Item = (u8, u16, u8)>, depth: u32) -> Vec<u8> {
        let (axis, delta, leaf) = recipe.next().unwrap_or((0, 1, 0));
        let mut below = |inner: bool| {
            if inner && depth > 0 {
                grow(recipe, depth - 1)
            } else {
                std::vec![leaf]
            }
        };
        let (left, right) = (below(leaf % 3 != 0), below(leaf % 2 == 0));
        let children = match (left.as_slice(), right.as_slice()) {
            ([left], [right]) => Children::Leaves(*left, *right),
            ([left], _) => Children::LeftLeaf(*left),
            (_, [right]) => Children::RightLeaf(*right),
            _ => Children::Nodes {
                skip: left.len() as u32,
            },
        };
        let node = Node {
            axis,
            delta,
            children,
        };
        let (bytes, len) = node.write().unwrap();
        let mut out = bytes[..len].to_vec();
        for child in [left, right] {
            if child.len() > 1 {
                out.extend(child);
            }
        }
        out
    }

    proptest! {
        #[test]
        fn the_short_walk_is_the_long_one(
            recipe in proptest::collection::vec((0u8..4, prop_oneof![1u16..40, 1u16..2000], 0u8..64), 1..400),
            cells in proptest::collection::vec(proptest::array::uniform4(prop_oneof![0u16..40, 0u16..3000]), 40),
        ) {
            let nodes = grow(&mut recipe.into_iter(), 9);
            let (view, _) = NodesView::parse(&nodes, &|_| true).unwrap();
            for cell in cells {
                let (leaf, visits) = slowly(&nodes, Cell(cell));
                prop_assert_eq!(view.leaf(Cell(cell)), Some(leaf));
                prop_assert_eq!(view.visits(Cell(cell)), visits);
            }
        }
    }
}
