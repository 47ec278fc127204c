//! Nodes and sets of nodes that are known while a chain is explored.

use std::collections::HashMap;

use super::{Ends, Key};
use crate::chain::{Branch, Chain, FAILED, SAFE};

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

    /// The chain of what is known. `first` has where the states (groups) of each node begin, `rows`
    /// where the branches of each state begin; of the nodes from `expanded` on, `beyond` stands for
    /// each. Sets whose nodes decide nothing that counts, and an event of which nothing is decided
    /// in the horizon, are safe here.
    pub(super) fn chain(
        &self,
        initial: Vec<u32>,
        rows: Vec<usize>,
        branches: Vec<Branch>,
        first: &[usize],
        expanded: usize,
        beyond: u32,
    ) -> Chain {
        let mut chain = Chain {
            initial: Vec::new(),
            rows,
            branches,
            set_rows: vec![0],
            members: Vec::new(),
        };
        for set in &self.sets {
            match set {
                NodeSet::Failed => chain.members.push(FAILED),
                NodeSet::Nodes(nodes) => {
                    for node in nodes {
                        let node = *node as usize;
                        match (first.get(node), first.get(node + 1)) {
                            (Some(from), Some(to)) if node < expanded => {
                                chain.members.extend(*from as u32..*to as u32);
                            }
                            _ => chain.members.push(beyond),
                        }
                    }
                }
            }
            if chain.set_rows.last() == Some(&chain.members.len()) {
                chain.members.push(SAFE);
            }
            chain.set_rows.push(chain.members.len());
        }
        for set in initial {
            chain.initial.extend(chain.members(set).to_vec());
        }
        if chain.initial.is_empty() {
            chain.initial.push(SAFE);
        }
        chain.initial.sort_unstable();
        chain.initial.dedup();
        chain
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
