//! The domain part of a law: does the law have an entry for a cell?
//!
//! | kind | part |
//! |---:|---|
//! | 0 | empty: the inputs part answers itself (dense) |
//! | 1 | pieces: a union of convex pieces, each cut by half-spaces |
//! | 2 | tree: a string of nodes ([`super::Node`]) with the leaves 0 (outside) and 1 (inside) |
//!
//! Pieces:
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | pieces, 1..=255 |
//! | 1 | 1 each | half-spaces of the piece, 1..=255 |
//! | | 12 each | the half-spaces, piece by piece, see [`AffineFunction`]: a cell is inside where the value is not negative |

use super::BlockError;
use super::affine::{AFFINE_LEN, AffineFunction};
use super::tree::NodesView;
use crate::grid::{Cell, Grid};

/// How membership is stored, by its number in the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum DomainKind {
    /// The inputs part answers membership itself.
    InInputs = 0,
    /// A union of convex pieces.
    Pieces = 1,
    /// A tree of membership.
    Tree = 2,
}

/// Reader of a domain part.
#[derive(Debug, Clone)]
pub(super) enum DomainView<'t> {
    InInputs,
    Pieces { sizes: &'t [u8], spaces: &'t [u8] },
    Tree(NodesView<'t>),
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
        if kind == DomainKind::Tree as u8 {
            return NodesView::parse(part, |leaf| leaf <= 1).map(Self::Tree);
        }
        if kind != DomainKind::Pieces as u8 {
            return Err(BlockError::UnknownEncoding { found: kind });
        }
        let (pieces, rest) = part.split_first().ok_or(BlockError::BadShape)?;
        let (sizes, spaces) = rest
            .split_at_checked(usize::from(*pieces))
            .ok_or(BlockError::BadShape)?;
        let total: usize = sizes.iter().map(|n| usize::from(*n)).sum();
        if sizes.is_empty() || sizes.contains(&0) || spaces.len() != total * AFFINE_LEN {
            return Err(BlockError::BadShape);
        }
        let fits = |space: &[u8]| AffineFunction::read(space).fits(grid);
        if spaces.chunks_exact(AFFINE_LEN).all(fits) {
            Ok(Self::Pieces { sizes, spaces })
        } else {
            Err(BlockError::Overflow)
        }
    }

    /// Whether a cell of the grid is covered, and how many half-spaces or nodes were visited.
    pub(super) fn contains(&self, cell: Cell) -> (bool, u16) {
        match self {
            Self::InInputs => (true, 0),
            Self::Tree(nodes) => match nodes.leaf(cell) {
                Some((leaf, visits)) => (leaf == 1, visits),
                None => (false, 0),
            },
            Self::Pieces { sizes, spaces } => {
                let mut visits = 0u16;
                let mut rest = *spaces;
                for size in *sizes {
                    let (piece, after) = rest
                        .split_at_checked(usize::from(*size) * AFFINE_LEN)
                        .unwrap_or((&[], &[]));
                    rest = after;
                    let mut inside = !piece.is_empty();
                    for space in piece.chunks_exact(AFFINE_LEN) {
                        visits += 1;
                        if AffineFunction::read(space).value(cell) < 0 {
                            inside = false;
                            break;
                        }
                    }
                    if inside {
                        return (true, visits);
                    }
                }
                (false, visits)
            }
        }
    }

    /// Most half-spaces or nodes that a question visits.
    pub(super) fn worst_visits(&self) -> u16 {
        match self {
            Self::InInputs => 0,
            Self::Tree(nodes) => nodes.depth(),
            // At most 255 pieces of 255 half-spaces: fits.
            Self::Pieces { sizes, .. } => sizes.iter().map(|n| u16::from(*n)).sum(),
        }
    }

    /// Leaves or half-spaces stored.
    pub(super) fn entries(&self) -> u32 {
        match self {
            Self::InInputs => 0,
            Self::Tree(nodes) => nodes.leaves(),
            Self::Pieces { .. } => u32::from(self.worst_visits()),
        }
    }
}
