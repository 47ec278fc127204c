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

/// The bytes of a subtree whose box begins at `low`. Recursion is as deep as the tree, which `build` bounds.
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
