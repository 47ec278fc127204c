//! Nodes and sets of nodes that are known while a chain is explored.

use std::collections::HashMap;

use super::{Ends, Key};

/// Sets of nodes by their numbers.
pub(super) enum NodeSet {
    Failed,
    Nodes(Vec<u32>),
}

/// Nodes and sets that are known, each once.
#[derive(Default)]
pub(super) struct Known {
    pub(super) keys: Vec<Key>,
    numbers: HashMap<Key, u32>,
    pub(super) sets: Vec<NodeSet>,
    positions: HashMap<Vec<u32>, u32>,
    failed: Option<u32>,
}

impl Known {
    fn node(&mut self, key: Key) -> u32 {
        let next = self.keys.len() as u32;
        *self.numbers.entry(key).or_insert_with(|| {
            self.keys.push(key);
            next
        })
    }

    /// The number of a set; its nodes become known.
    pub(super) fn set(&mut self, ends: &Ends) -> u32 {
        let next = self.sets.len() as u32;
        match ends {
            Ends::Failed => {
                if self.failed.is_none() {
                    self.sets.push(NodeSet::Failed);
                }
                *self.failed.get_or_insert(next)
            }
            Ends::In(keys) => {
                let nodes: Vec<u32> = keys.iter().map(|key| self.node(*key)).collect();
                if let Some(known) = self.positions.get(&nodes) {
                    return *known;
                }
                self.positions.insert(nodes.clone(), next);
                self.sets.push(NodeSet::Nodes(nodes));
                next
            }
        }
    }
}
