//! From a tree to the bytes of an inputs part or of a membership tree.

use firmware::table::{AffineFunction, Children, Node};

use super::CompressError;
use super::tree::Tree;
use model::plant::STATES;

/// The bytes of a tree's nodes, as `firmware::table` reads them.
///
/// # Errors
/// A leaf value, threshold or subtree that the format cannot hold.
pub fn encode_nodes(tree: &Tree) -> Result<Vec<u8>, CompressError> {
    encode_below(tree, [0; STATES])
}

/// The bytes of an inputs part: the affine laws, then the tree.
///
/// # Errors
/// As [`encode_nodes`].
pub fn encode_inputs(tree: &Tree, laws: &[AffineFunction]) -> Result<Vec<u8>, CompressError> {
    let mut out = vec![laws.len() as u8];
    for law in laws {
        out.extend(law.write());
    }
    out.extend(encode_nodes(tree)?);
    Ok(out)
}

/// The bytes of a subtree whose box begins at `low`. Recursion is as deep as the tree, which
/// `build` bounds.
fn encode_below(tree: &Tree, low: [u16; STATES]) -> Result<Vec<u8>, CompressError> {
    let (plane, left, right) = match tree {
        Tree::Leaf(value) => return Ok(vec![*value]),
        Tree::Split { plane, left, right } => (plane, left.as_ref(), right.as_ref()),
    };
    let mut beyond = low;
    beyond[plane.axis] = plane.threshold;
    let mut below = Vec::new();
    let children = match (left, right) {
        (Tree::Leaf(left), Tree::Leaf(right)) => Children::Leaves(*left, *right),
        (Tree::Leaf(left), right) => {
            below = encode_below(right, beyond)?;
            Children::LeftLeaf(*left)
        }
        (left, Tree::Leaf(right)) => {
            below = encode_below(left, low)?;
            Children::RightLeaf(*right)
        }
        (left, right) => {
            below = encode_below(left, low)?;
            let skip = u32::try_from(below.len()).map_err(|_| CompressError::TooLarge)?;
            below.extend(encode_below(right, beyond)?);
            Children::Nodes { skip }
        }
    };
    let node = Node {
        axis: plane.axis as u8,
        delta: plane.threshold.saturating_sub(low[plane.axis]),
        children,
    };
    let (bytes, len) = node.write().ok_or(CompressError::TooLarge)?;
    let mut out = bytes[..len].to_vec();
    out.extend(below);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compress::best_plane::Plane;

    fn split(axis: usize, threshold: u16, left: Tree, right: Tree) -> Tree {
        Tree::Split {
            plane: Plane { axis, threshold },
            left: Box::new(left),
            right: Box::new(right),
        }
    }

    #[test]
    fn the_tree_of_the_formats_own_test_has_its_bytes() {
        // f below 2 gives level 1; else g below 1 gives level 2, else the first law. The same bytes
        // stand in firmware/tests/table_format.rs, written by hand.
        let tree = split(
            0,
            2,
            Tree::Leaf(1),
            split(1, 1, Tree::Leaf(2), Tree::Leaf(32)),
        );
        let law = AffineFunction {
            factors: [1024, 0, 0, 0],
            constant: -1024,
        };
        let bytes = [
            0x01, // one law
            0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // factors
            0x00, 0xFC, 0xFF, 0xFF, // constant
            0x10, 0x01, // f, delta 2; left leaf 1, right node follows
            0x0D, 0x42, 0x20, // g, delta 1; leaves 2 and law 0
        ];
        assert_eq!(encode_inputs(&tree, &[law]).unwrap(), bytes);
        assert_eq!(encode_nodes(&Tree::Leaf(7)).unwrap(), [7]);
    }

    #[test]
    fn a_threshold_counts_from_its_boxs_lower_edge() {
        let leaves = || (Tree::Leaf(1), Tree::Leaf(2));
        let (left, right) = leaves();
        let inner = split(0, 12, left, right);
        let nested = encode_nodes(&split(0, 10, Tree::Leaf(0), inner)).unwrap();
        let (left, right) = leaves();
        let alone = encode_nodes(&split(0, 2, left, right)).unwrap();
        assert!(nested.ends_with(&alone), "{nested:x?} {alone:x?}");
    }
}
