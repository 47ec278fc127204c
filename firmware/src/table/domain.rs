//! The domain part of a law: does the law have an entry for a cell?
//!
//! | kind | part |
//! |---:|---|
//! | 0 | empty: the inputs part answers itself (dense) |
//! | 1 | a tree whose leaves answer, or name half-spaces and look-aheads that do |
//!
//! The tree's part:
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | half-spaces n, 0..=56 |
//! | 1 | 1 | the first m of them are the hull, m <= n |
//! | 2 | 1 | look-aheads, 0..=4 |
//! | 3 | 12 each | the half-spaces, see [`AffineFunction`]: inside is 0 and above |
//! | | 72 each | the look-aheads, see [`super::LookAhead`] |
//! | | | the tree, see [`super::Node`] |
//!
//! | leaf | the cell is covered |
//! |---:|---|
//! | 0 | never |
//! | 1 | always |
//! | 2 + k | if it lies in half-space k |
//! | 58 + k | if look-ahead k says so |
//! | 63 | if it lies in every half-space of the hull |

use super::affine::{AFFINE_LEN, AffineFunction};
use super::error::BlockError;
use super::look_ahead::{LOOK_AHEAD_LEN, LookAhead, covers};
use super::tree::NodesView;
use super::tree_node::LEAF_VALUES;
use crate::grid::{Cell, Grid};
use crate::units::STATES;

/// How membership is stored, by its number in the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum DomainKind {
    /// The inputs part answers membership itself.
    InInputs = 0,
    /// A tree with half-spaces and look-aheads.
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
/// Leaves of a membership tree from here on: the look-ahead of this number decides.
pub const LEAF_LOOK_AHEAD: u8 = 58;
/// Most half-spaces of a membership tree.
pub const HALF_SPACES_MAX: u8 = LEAF_LOOK_AHEAD - LEAF_HALF_SPACE;
/// Most look-aheads of a membership tree.
pub const LOOK_AHEADS_MAX: u8 = 4;

/// Bytes before the half-spaces.
const SIZES_LEN: usize = 3;

/// Reader of a domain part.
#[derive(Debug, Clone)]
pub(super) enum DomainView<'t> {
    InInputs,
    Tree {
        spaces: &'t [u8],
        hull: u8,
        aheads: &'t [[u8; LOOK_AHEAD_LEN]],
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
        let ([count, hull, ahead], rest) = part
            .split_first_chunk::<SIZES_LEN>()
            .ok_or(BlockError::BadShape)?;
        if *count > HALF_SPACES_MAX || hull > count || *ahead > LOOK_AHEADS_MAX {
            return Err(BlockError::BadShape);
        }
        let (spaces, rest) = rest
            .split_at_checked(usize::from(*count) * AFFINE_LEN)
            .ok_or(BlockError::BadShape)?;
        let (aheads, nodes) = rest
            .split_at_checked(usize::from(*ahead) * LOOK_AHEAD_LEN)
            .ok_or(BlockError::BadShape)?;
        let (aheads, _) = aheads.as_chunks();
        for ahead in aheads {
            let ahead = LookAhead::read(ahead).ok_or(BlockError::BadShape)?;
            if !ahead.fits(grid) {
                return Err(BlockError::Overflow);
            }
        }
        let fits = |space: &[u8]| AffineFunction::read(space).fits(grid);
        if !spaces.chunks_exact(AFFINE_LEN).all(fits) {
            return Err(BlockError::Overflow);
        }
        let exists = |leaf: u8| match leaf {
            LEAF_OUTSIDE | LEAF_INSIDE => true,
            LEAF_HULL => *hull > 0,
            LEAF_LOOK_AHEAD.. => leaf - LEAF_LOOK_AHEAD < *ahead,
            _ => leaf - LEAF_HALF_SPACE < *count,
        };
        let (nodes, _) = NodesView::parse(nodes, &exists)?;
        Ok(Self::Tree {
            spaces,
            hull: *hull,
            aheads,
            nodes,
        })
    }

    /// Nodes, half-spaces and steps that the question whether a cell is covered visits.
    pub(super) fn visits(&self, cell: Cell, count: [u16; STATES]) -> u16 {
        match self {
            Self::InInputs => 0,
            Self::Tree { nodes, .. } => nodes.visits(cell) + self.contains(cell, count).1,
        }
    }

    /// Whether a cell of the grid with `count` cells is covered, and how many half-spaces and steps
    /// were visited.
    #[inline]
    pub(super) fn contains(&self, cell: Cell, count: [u16; STATES]) -> (bool, u16) {
        let Self::Tree {
            spaces,
            hull,
            aheads,
            nodes,
        } = self
        else {
            return (true, 0);
        };
        let Some(leaf) = nodes.leaf(cell) else {
            return (false, 0);
        };
        let (first, asked) = match leaf {
            LEAF_OUTSIDE => return (false, 0),
            LEAF_INSIDE => return (true, 0),
            LEAF_HULL => (0, *hull),
            LEAF_LOOK_AHEAD.. => {
                let ahead = aheads.get(usize::from(leaf - LEAF_LOOK_AHEAD));
                return ahead.map_or((false, 0), |ahead| covers(ahead, cell, count));
            }
            space => (space - LEAF_HALF_SPACE, 1),
        };
        let asked = spaces
            .chunks_exact(AFFINE_LEN)
            .skip(first.into())
            .take(asked.into());
        let mut visits = 0;
        for space in asked {
            visits += 1;
            if AffineFunction::read(space).value(cell) < 0 {
                return (false, visits);
            }
        }
        (true, visits)
    }

    /// Most nodes, half-spaces and steps that a question visits.
    pub(super) fn worst_visits(&self) -> u16 {
        match self {
            Self::InInputs => 0,
            Self::Tree {
                spaces,
                hull,
                aheads,
                nodes,
            } => {
                let steps = aheads.iter().map(|[_, steps, ..]| u16::from(*steps)).max();
                let asked = u16::from(*hull).max(u16::from(!spaces.is_empty()));
                nodes.shape().depth + asked.max(steps.unwrap_or(0))
            }
        }
    }

    /// Leaves, half-spaces and look-aheads stored.
    pub(super) fn entries(&self) -> u32 {
        match self {
            Self::InInputs => 0,
            Self::Tree {
                spaces,
                aheads,
                nodes,
                ..
            } => nodes.shape().leaves + (spaces.len() / AFFINE_LEN + aheads.len()) as u32,
        }
    }
}
