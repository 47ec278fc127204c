//! Nodes of the tree encoding: reader and writer of one node.
//!
//! A tree is a string of nodes in pre-order. A node compares one axis of the cell with a threshold
//! that is relative to the box of cells the node is responsible for (`delta` cells above its
//! lowest), so most thresholds fit five bits.
//!
//! | part | bytes | content |
//! |---|---:|---|
//! | head | 1 | bits 0-1 axis; bit 2 flag F; bits 3-7 delta 1..=30, or 31: more follows |
//! | more | 0, 1 or 3 | a byte e: delta is 31 + e; or 255 and then delta as u16 |
//! | child | 1 | with F it says which children are leaves, see below |
//! | | 0, 1 or 3 | the right leaf (two leaves), or the skip as 24 bits (child is 255) |
//!
//! | F | child | children |
//! |---:|---|---|
//! | 0 | 0..=63 | the left one is the leaf `child`; the right one follows |
//! | 1 | 0..=63 | the right one is the leaf `child`; the left one follows |
//! | 1 | 64..=127 | both are leaves: left is `child - 64`, right is the next byte (0..=63) |
//! | 0 | 64..=255 | neither is a leaf: the left one follows, the right one `skip` bytes later |
//!
//! `skip` counts from where the left one begins. It is `child - 61`, or the next three bytes if the
//! child is 255.
//!
//! A node costs 2 bytes, 3 if both children are leaves: between 2 and 2.5 bytes a leaf. A tree that
//! is one leaf is that one byte.

use super::bytes::{array_at, u16_at};
use crate::units::STATES;

/// Leaf values are below this.
pub const LEAF_VALUES: u8 = 64;
/// Most bytes of a node: head 4, child 4.
pub const NODE_LEN_MAX: usize = 8;
/// Fewest bytes of a subtree that is not a leaf: a node with two leaves.
const SUBTREE_LEN_MIN: u32 = 3;
/// Longest left subtree of a node, in bytes.
pub const SKIP_MAX: u32 = (1 << 24) - 1;

pub(super) const FLAG: u8 = 4;
pub(super) const DELTA_SHIFT: u32 = 3;
pub(super) const DELTA_ESCAPE: u16 = 31;
pub(super) const BYTE_ESCAPE: u8 = 255;
/// What a one-byte skip has been raised by.
pub(super) const SHORT_SKIP: u8 = LEAF_VALUES - SUBTREE_LEN_MIN as u8;

/// What hangs below a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Children {
    /// Two leaves: left, right.
    Leaves(u8, u8),
    /// The left child is a leaf, the right one follows.
    LeftLeaf(u8),
    /// The right child is a leaf, the left one follows.
    RightLeaf(u8),
    /// The left child follows, the right one begins `skip` bytes after it.
    Nodes {
        /// Bytes of the left subtree.
        skip: u32,
    },
}

/// A node: cells less than `delta` above the lowest cell of the node's box on `axis` go left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    /// Axis, 0..4.
    pub axis: u8,
    /// Threshold above the lowest cell of the node's box; not zero.
    pub delta: u16,
    /// Leaves or subtrees.
    pub children: Children,
}

impl Node {
    /// Reads the node at an offset; with its length in bytes. `None` if there is no node there.
    pub fn read(bytes: &[u8], at: usize) -> Option<(Self, usize)> {
        let head = *bytes.get(at)?;
        let mut next = at + 1;
        let mut delta = u16::from(head >> DELTA_SHIFT);
        if delta == DELTA_ESCAPE {
            let more = *bytes.get(next)?;
            next += 1;
            if more == BYTE_ESCAPE {
                array_at::<2>(bytes, next)?;
                delta = u16_at(bytes, next);
                next += 2;
            } else {
                delta += u16::from(more);
            }
        }
        if delta == 0 {
            return None;
        }
        let child = *bytes.get(next)?;
        next += 1;
        let children = match (head & FLAG != 0, child) {
            (false, 0..LEAF_VALUES) => Children::LeftLeaf(child),
            (true, 0..LEAF_VALUES) => Children::RightLeaf(child),
            (true, _) => {
                let right = *bytes.get(next)?;
                next += 1;
                if child >= 2 * LEAF_VALUES || right >= LEAF_VALUES {
                    return None;
                }
                Children::Leaves(child - LEAF_VALUES, right)
            }
            (false, BYTE_ESCAPE) => {
                let [a, b, c] = array_at::<3>(bytes, next)?;
                next += 3;
                let skip = u32::from_le_bytes([a, b, c, 0]);
                Children::Nodes { skip }
            }
            (false, _) => Children::Nodes {
                skip: u32::from(child - LEAF_VALUES) + SUBTREE_LEN_MIN,
            },
        };
        let node = Self {
            axis: head & (STATES as u8 - 1),
            delta,
            children,
        };
        Some((node, next - at))
    }

    /// The node's bytes and how many of them count. Leaf values must be below [`LEAF_VALUES`], the
    /// delta not zero and the skip within [`SKIP_MAX`]; `None` otherwise.
    pub fn write(&self) -> Option<([u8; NODE_LEN_MAX], usize)> {
        let mut out = [0u8; NODE_LEN_MAX];
        let mut len = 0;
        let mut put = |byte: u8| {
            if let Some(slot) = out.get_mut(len) {
                *slot = byte;
            }
            len += 1;
        };
        let flag = match self.children {
            Children::Leaves(..) | Children::RightLeaf(_) => FLAG,
            Children::LeftLeaf(_) | Children::Nodes { .. } => 0,
        };
        if self.delta == 0 || usize::from(self.axis) >= STATES {
            return None;
        }
        let short = self.delta.min(DELTA_ESCAPE) as u8;
        put(self.axis | flag | (short << DELTA_SHIFT));
        if self.delta >= DELTA_ESCAPE {
            match u8::try_from(self.delta - DELTA_ESCAPE) {
                Ok(more) if more < BYTE_ESCAPE => put(more),
                _ => {
                    put(BYTE_ESCAPE);
                    self.delta.to_le_bytes().into_iter().for_each(&mut put);
                }
            }
        }
        match self.children {
            Children::Leaves(left, right) => {
                if left.max(right) >= LEAF_VALUES {
                    return None;
                }
                put(left + LEAF_VALUES);
                put(right);
            }
            Children::LeftLeaf(leaf) | Children::RightLeaf(leaf) => {
                if leaf >= LEAF_VALUES {
                    return None;
                }
                put(leaf);
            }
            Children::Nodes { skip } => {
                if skip > SKIP_MAX {
                    return None;
                }
                let short = skip
                    .checked_sub(SUBTREE_LEN_MIN)
                    .and_then(|over| u8::try_from(over).ok())
                    .and_then(|over| over.checked_add(LEAF_VALUES))
                    .filter(|byte| *byte < BYTE_ESCAPE);
                match short {
                    Some(byte) => put(byte),
                    None => {
                        put(BYTE_ESCAPE);
                        skip.to_le_bytes()[..3].iter().copied().for_each(&mut put);
                    }
                }
            }
        }
        Some((out, len))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_nodes_read_and_write() {
        let cases: &[(&[u8], Node)] = &[
            // Axis 2, delta 5, both leaves: head 5 << 3 | 4 | 2.
            (&[0x2E, 0x43, 0x14], node(2, 5, Children::Leaves(3, 20))),
            (&[0x09, 0x07], node(1, 1, Children::LeftLeaf(7))),
            (&[0xF4, 0x3F], node(0, 30, Children::RightLeaf(63))),
            (&[0x2B, 0x40], node(3, 5, Children::Nodes { skip: 3 })),
            (&[0x2B, 0xFE], node(3, 5, Children::Nodes { skip: 193 })),
            (
                &[0x2B, 0xFF, 0xC2, 0x00, 0x00],
                node(3, 5, Children::Nodes { skip: 194 }),
            ),
            (&[0xF8, 0x00, 0x07], node(0, 31, Children::LeftLeaf(7))),
            (&[0xF8, 0xFE, 0x07], node(0, 285, Children::LeftLeaf(7))),
            (
                &[0xF8, 0xFF, 0x1E, 0x01, 0x07],
                node(0, 286, Children::LeftLeaf(7)),
            ),
            (
                &[0xF8, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF],
                node(0, 65535, Children::Nodes { skip: SKIP_MAX }),
            ),
        ];
        for (bytes, node) in cases {
            let (written, len) = node.write().unwrap();
            assert_eq!(&written[..len], *bytes, "{node:?}");
            assert_eq!(Node::read(bytes, 0), Some((*node, bytes.len())));
            for cut in 0..bytes.len() {
                assert_eq!(Node::read(&bytes[..cut], 0), None, "{node:?} cut at {cut}");
            }
        }
    }

    #[test]
    fn what_is_no_node_is_refused() {
        assert_eq!(Node::read(&[0x00, 0x07], 0), None, "delta 0");
        assert_eq!(
            Node::read(&[0xF8, 0xFF, 0, 0, 7], 0),
            None,
            "delta 0, long form"
        );
        assert_eq!(
            Node::read(&[0x2E, 0x80, 0x00], 0),
            None,
            "left leaf past 63"
        );
        assert_eq!(
            Node::read(&[0x2E, 0x40, 0x40], 0),
            None,
            "right leaf past 63"
        );
        assert_eq!(node(0, 0, Children::LeftLeaf(0)).write(), None);
        assert_eq!(node(4, 1, Children::LeftLeaf(0)).write(), None);
        assert_eq!(node(0, 1, Children::LeftLeaf(64)).write(), None);
        assert_eq!(node(0, 1, Children::Leaves(0, 64)).write(), None);
        let far = Children::Nodes { skip: SKIP_MAX + 1 };
        assert_eq!(node(0, 1, far).write(), None);
    }

    fn node(axis: u8, delta: u16, children: Children) -> Node {
        Node {
            axis,
            delta,
            children,
        }
    }

    fn any_node() -> impl Strategy<Value = Node> {
        let leaf = 0..LEAF_VALUES;
        let children = prop_oneof![
            (leaf.clone(), leaf.clone()).prop_map(|(l, r)| Children::Leaves(l, r)),
            leaf.clone().prop_map(Children::LeftLeaf),
            leaf.prop_map(Children::RightLeaf),
            (SUBTREE_LEN_MIN..=SKIP_MAX).prop_map(|skip| Children::Nodes { skip }),
        ];
        (0u8..4, 1u16.., children).prop_map(|(axis, delta, children)| node(axis, delta, children))
    }

    proptest! {
        #[test]
        fn every_node_survives_the_trip(node in any_node(), tail in any::<u8>()) {
            let (mut bytes, len) = node.write().unwrap();
            prop_assert_eq!(Node::read(&bytes[..len], 0), Some((node, len)));
            if len < NODE_LEN_MAX { bytes[len] = tail; }
            prop_assert_eq!(Node::read(&bytes, 0), Some((node, len)));
        }

        #[test]
        fn arbitrary_bytes_are_read_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..12), at in 0usize..14) {
            if let Some((_, len)) = Node::read(&bytes, at) {
                prop_assert!(at + len <= bytes.len());
            }
        }
    }
}
