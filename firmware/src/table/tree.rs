//! The tree encoding: a k-d tree over cells whose leaves name an input level or an affine law.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | affine laws, 0..=31 |
//! | 1 | 12 each | the laws, see [`AffineFunction`] |
//! | | | the tree, see [`Node`] |
//!
//! A leaf below 32 is an input level, 32 + k the k-th affine law. The tree answers for every cell: what lies outside the
//! law's domain is the domain part's to say.
//!
//! The tree is checked once, from front to back with a stack of fixed size; after that a lookup visits at most
//! [`TreeView::depth`] nodes and always ends at a leaf.

use super::BlockError;
use super::affine::{AFFINE_LEN, AffineFunction};
use super::law::Encoding;
use super::tree_node::{Children, Node};
use crate::grid::{Cell, Grid};
use crate::units::STATES;

/// Deepest tree that the reader accepts.
pub const TREE_DEPTH_MAX: u16 = 64;
/// Leaves from here on are affine laws.
pub const LEAF_AFFINE: u8 = 32;
/// Most affine laws of a tree.
pub const AFFINE_LAWS_MAX: u8 = 31;

/// A checked string of nodes; lookups end within [`NodesView::depth`] nodes.
#[derive(Debug, Clone)]
pub(super) struct NodesView<'t> {
    nodes: &'t [u8],
    depth: u16,
    leaves: u32,
}

impl<'t> NodesView<'t> {
    /// Checks that the bytes are one tree, that every subtree ends where its parent says, and that `leaf` accepts all
    /// leaves.
    pub(super) fn parse(nodes: &'t [u8], leaf: impl Fn(u8) -> bool) -> Result<Self, BlockError> {
        if let [only] = nodes {
            return if leaf(*only) {
                Ok(Self {
                    nodes,
                    depth: 1,
                    leaves: 1,
                })
            } else {
                Err(BlockError::BadLevel)
            };
        }
        let check = |ok| {
            if ok {
                Ok(())
            } else {
                Err(BlockError::BadLevel)
            }
        };
        // Where the right children of the path's nodes begin, and their depth.
        let mut pending = [(0usize, 0u16); TREE_DEPTH_MAX as usize];
        let mut waiting = 0;
        let (mut at, mut depth) = (0usize, 1u16);
        let mut view = Self {
            nodes,
            depth: 1,
            leaves: 0,
        };
        // Every turn consumes a node, so the loop ends.
        loop {
            if depth > TREE_DEPTH_MAX {
                return Err(BlockError::TooManyVisits);
            }
            view.depth = view.depth.max(depth);
            let (node, len) = Node::read(nodes, at).ok_or(BlockError::BadNode)?;
            at += len;
            match node.children {
                Children::LeftLeaf(value) | Children::RightLeaf(value) => {
                    check(leaf(value))?;
                    view.leaves += 1;
                }
                Children::Nodes { skip } => {
                    // At most one entry for each node of the path: there is room.
                    if let Some(slot) = pending.get_mut(waiting) {
                        *slot = (at + skip as usize, depth + 1);
                    }
                    waiting += 1;
                }
                Children::Leaves(left, right) => {
                    check(leaf(left) && leaf(right))?;
                    view.leaves += 2;
                    if waiting == 0 {
                        break;
                    }
                    waiting -= 1;
                    let (expected, right_depth) = pending.get(waiting).copied().unwrap_or_default();
                    if expected != at {
                        return Err(BlockError::BadNode);
                    }
                    depth = right_depth;
                    continue;
                }
            }
            depth += 1;
        }
        if at == nodes.len() {
            Ok(view)
        } else {
            Err(BlockError::BadShape)
        }
    }

    /// Leaf of a cell, and the nodes visited. `None` does not occur in a tree that was checked.
    #[inline]
    pub(super) fn leaf(&self, cell: Cell) -> Option<(u8, u16)> {
        if let [only] = self.nodes {
            return Some((*only, 1));
        }
        // The cell relative to the lowest cell of the node's box.
        let mut rest = cell.0;
        let mut at = 0;
        for visits in 1..=self.depth {
            let (node, len) = Node::read(self.nodes, at)?;
            let index = &mut rest[usize::from(node.axis) % STATES];
            let left = *index < node.delta;
            if !left {
                *index -= node.delta;
            }
            at += len;
            match node.children {
                Children::Leaves(value, _) | Children::LeftLeaf(value) if left => {
                    return Some((value, visits));
                }
                Children::Leaves(_, value) | Children::RightLeaf(value) if !left => {
                    return Some((value, visits));
                }
                Children::Nodes { skip } if !left => at += skip as usize,
                _ => {}
            }
        }
        None
    }

    pub(super) fn depth(&self) -> u16 {
        self.depth
    }

    pub(super) fn leaves(&self) -> u32 {
        self.leaves
    }
}

/// Reader of the tree encoding.
#[derive(Debug, Clone)]
pub struct TreeView<'t> {
    laws: &'t [u8],
    levels: u8,
    nodes: NodesView<'t>,
}

impl<'t> TreeView<'t> {
    /// Checks the laws and the tree.
    ///
    /// # Errors
    /// A part that is cut short, a law that could overflow on the grid, a broken or too deep tree, or a leaf that names
    /// a level or law that does not exist.
    pub fn parse(block: &'t [u8], grid: &Grid, levels: u8) -> Result<Self, BlockError> {
        let (count, rest) = block.split_first().ok_or(BlockError::BadShape)?;
        if *count > AFFINE_LAWS_MAX {
            return Err(BlockError::BadShape);
        }
        let (laws, nodes) = rest
            .split_at_checked(usize::from(*count) * AFFINE_LEN)
            .ok_or(BlockError::BadShape)?;
        for law in laws.chunks_exact(AFFINE_LEN) {
            if !AffineFunction::read(law).fits(grid) {
                return Err(BlockError::Overflow);
            }
        }
        let exists = |leaf: u8| match leaf.checked_sub(LEAF_AFFINE) {
            None => leaf < levels,
            Some(law) => law < *count,
        };
        Ok(Self {
            laws,
            levels,
            nodes: NodesView::parse(nodes, exists)?,
        })
    }

    /// Most nodes that a lookup visits.
    pub fn depth(&self) -> u16 {
        self.nodes.depth()
    }
}

impl Encoding for TreeView<'_> {
    fn level(&self, cell: Cell) -> Option<u8> {
        let (leaf, _) = self.nodes.leaf(cell)?;
        match leaf.checked_sub(LEAF_AFFINE) {
            None => Some(leaf),
            Some(law) => {
                let law = self.laws.get(usize::from(law) * AFFINE_LEN..)?;
                Some(AffineFunction::read(law).level(cell, self.levels))
            }
        }
    }

    fn visits(&self, cell: Cell) -> u16 {
        self.nodes.leaf(cell).map_or(0, |(_, visits)| visits)
    }

    fn worst_visits(&self) -> u16 {
        self.nodes.depth()
    }

    fn entries(&self) -> u32 {
        self.nodes.leaves()
    }
}
