//! The domain of a law as bytes: exactly, as a tree of membership.

use firmware::table::DomainKind;

use super::CompressError;
use super::cells::{LabelledCell, labelled_cells};
use super::encode::encode_nodes;
use super::tree::build;
use crate::game::bitset::BitSet;
use crate::grid_shape::GridShape;
use crate::plant::STATES;

/// Labels of the two leaves.
const OUTSIDE: u64 = 1;
const INSIDE: u64 = 2;

/// A domain part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DomainPart {
    /// How membership is stored.
    pub kind: DomainKind,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// Most half-spaces or nodes that a question visits.
    pub worst_visits: u16,
}

/// A membership tree that answers exactly for every cell of the grid.
///
/// # Errors
/// A tree that the format cannot hold.
pub fn exact_tree(
    shape: &GridShape<STATES>,
    domain: &BitSet,
    depth_max: u32,
) -> Result<DomainPart, CompressError> {
    let mut cells: Vec<LabelledCell> = labelled_cells(shape, |index, _| {
        if domain.contains(index) {
            INSIDE
        } else {
            OUTSIDE
        }
    });
    let tree = build(&mut cells, depth_max, &|common, _| {
        common.trailing_zeros() as u8
    });
    Ok(DomainPart {
        kind: DomainKind::Tree,
        bytes: encode_nodes(&tree)?,
        worst_visits: tree.depth(),
    })
}
