//! The domain part of a law: does the law have an entry for a cell?
//!
//! | kind | part |
//! |---:|---|
//! | 0 | empty: the inputs part answers itself (dense) |
//! | 1 | a tree whose leaves answer, or name half-spaces that do |
//!
//! The tree's part:
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | half-spaces n, 0..=61 |
//! | 1 | 1 | the first m of them are the hull, m <= n |
//! | 2 | 12 each | the half-spaces, see [`AffineFunction`]: a cell is inside where the value is not negative |
//! | | | the tree, see [`super::Node`] |
//!
//! | leaf | the cell is covered |
//! |---:|---|
//! | 0 | never |
//! | 1 | always |
//! | 2 + k | if it lies in half-space k |
//! | 63 | if it lies in every half-space of the hull |

use super::BlockError;
use super::affine::{AFFINE_LEN, AffineFunction};
use super::tree::NodesView;
use super::tree_node::LEAF_VALUES;
use crate::grid::{Cell, Grid};

/// How membership is stored, by its number in the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum DomainKind {
    /// The inputs part answers membership itself.
    InInputs = 0,
    /// A tree with half-spaces.
    Tree = 1,
}

/// Leaf of a membership tree: not covered.
pub const LEAF_OUTSIDE: u8 = 0;
/// Leaf of a membership tree: covered.
pub const LEAF_INSIDE: u8 = 1;
/// Leaves of a membership tree from here on: the half-space of this number decides.
pub const LEAF_HALF_SPACE: u8 = 2;
/// Leaf of a membership tree: all half-spaces of the hull decide.
pub const LEAF_HULL: u8 = LEAF_VALUES - 1;
/// Most half-spaces of a membership tree.
pub const HALF_SPACES_MAX: u8 = LEAF_HULL - LEAF_HALF_SPACE;

/// Bytes before the half-spaces.
const SIZES_LEN: usize = 2;

/// Reader of a domain part.
#[derive(Debug, Clone)]
pub(super) enum DomainView<'t> {
    InInputs,
    Tree {
        spaces: &'t [u8],
        hull: u8,
        nodes: NodesView<'t>,
    },
}

impl<'t> DomainView<'t> {
    /// Checks the part.
    pub(super) fn parse(kind: u8, part: &'t [u8], grid: &Grid) -> Result<Self, BlockError> {
        if kind == DomainKind::InInputs as u8 {
            return if part.is_empty() {
                Ok(Self::InInputs)
            } else {
                Err(BlockError::BadShape)
            };
        }
        if kind != DomainKind::Tree as u8 {
            return Err(BlockError::UnknownEncoding { found: kind });
        }
        let ([count, hull], rest) = part
            .split_first_chunk::<SIZES_LEN>()
            .ok_or(BlockError::BadShape)?;
        if *count > HALF_SPACES_MAX || hull > count {
            return Err(BlockError::BadShape);
        }
        let (spaces, nodes) = rest
            .split_at_checked(usize::from(*count) * AFFINE_LEN)
            .ok_or(BlockError::BadShape)?;
        let fits = |space: &[u8]| AffineFunction::read(space).fits(grid);
        if !spaces.chunks_exact(AFFINE_LEN).all(fits) {
            return Err(BlockError::Overflow);
        }
        let exists = |leaf: u8| match leaf.checked_sub(LEAF_HALF_SPACE) {
            None => true,
            Some(_) if leaf == LEAF_HULL => *hull > 0,
            Some(space) => space < *count,
        };
        Ok(Self::Tree {
            spaces,
            hull: *hull,
            nodes: NodesView::parse(nodes, exists)?,
        })
    }

    /// Whether a cell of the grid is covered, and how many nodes and half-spaces were visited.
    pub(super) fn contains(&self, cell: Cell) -> (bool, u16) {
        let Self::Tree {
            spaces,
            hull,
            nodes,
        } = self
        else {
            return (true, 0);
        };
        let Some((leaf, visits)) = nodes.leaf(cell) else {
            return (false, 0);
        };
        let (first, count) = match leaf {
            LEAF_OUTSIDE => return (false, visits),
            LEAF_INSIDE => return (true, visits),
            LEAF_HULL => (0, *hull),
            space => (space - LEAF_HALF_SPACE, 1),
        };
        let asked = spaces
            .chunks_exact(AFFINE_LEN)
            .skip(first.into())
            .take(count.into());
        let mut visits = visits;
        for space in asked {
            visits += 1;
            if AffineFunction::read(space).value(cell) < 0 {
                return (false, visits);
            }
        }
        (true, visits)
    }

    /// Most nodes and half-spaces that a question visits.
    pub(super) fn worst_visits(&self) -> u16 {
        match self {
            Self::InInputs => 0,
            Self::Tree {
                spaces,
                hull,
                nodes,
            } => nodes.depth() + u16::from(*hull).max(u16::from(!spaces.is_empty())),
        }
    }

    /// Leaves and half-spaces stored.
    pub(super) fn entries(&self) -> u32 {
        match self {
            Self::InInputs => 0,
            Self::Tree { spaces, nodes, .. } => nodes.leaves() + (spaces.len() / AFFINE_LEN) as u32,
        }
    }
}
