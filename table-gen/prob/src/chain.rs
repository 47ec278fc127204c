//! A finite Markov chain whose branches lead to sets of states.
//!
//! State q takes branch k with a probability of at least p_k. Which member of the branch's set
//! comes next is an adversary's choice. What the probabilities of a state leave over leads to
//! [`FAILED`], so lower bounds of probabilities make a valid chain. [`FAILED`] and [`SAFE`] are
//! never left.

use std::collections::HashMap;

use rayon::prelude::*;

/// Sets and states in one piece of work.
pub(crate) const TOGETHER: usize = 2048;

/// The state in which the claim is broken.
pub const FAILED: u32 = 0;
/// The state from which it cannot be broken any more.
pub const SAFE: u32 = 1;

/// By how much the probabilities of a state may exceed 1 when they are added as doubles.
const SUM_SLACK: f64 = 1e-9;

/// One branch: its probability and its set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branch {
    /// Lower bound of its probability.
    pub probability: f64,
    /// Position of its set.
    pub set: u32,
}

/// The chain. Sets are shared: equal sets have one position.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub(crate) initial: Vec<u32>,
    pub(crate) rows: Vec<usize>,
    pub(crate) branches: Vec<Branch>,
    pub(crate) set_rows: Vec<usize>,
    pub(crate) members: Vec<u32>,
}

/// Why a chain cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChainError {
    /// A probability is no number in \[0, 1\].
    #[error("state {state}: a branch has the probability {found}, allowed is 0 to 1")]
    Probability {
        /// The state.
        state: u32,
        /// What was found.
        found: f64,
    },
    /// The probabilities of a state are more than 1 together.
    #[error("state {state}: the probabilities add up to {found}, allowed is at most 1")]
    Sum {
        /// The state.
        state: u32,
        /// What was found.
        found: f64,
    },
    /// A branch leads nowhere.
    #[error("state {state}: a branch has no successor; name FAILED where the claim is broken")]
    Empty {
        /// The state.
        state: u32,
    },
    /// A successor or an initial state does not exist.
    #[error("state {found} is named and does not exist; the chain has {states} states")]
    Unknown {
        /// What was named.
        found: u32,
        /// States of the chain.
        states: u32,
    },
    /// No initial state.
    #[error("the chain has no initial state")]
    NoInitial,
}

/// Builds a chain state by state.
#[derive(Debug)]
pub struct ChainBuilder {
    chain: Chain,
    sets: HashMap<Vec<u32>, u32>,
}

impl Default for ChainBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl ChainBuilder {
    /// A chain of [`FAILED`] and [`SAFE`].
    pub fn new() -> Self {
        let chain = Chain {
            initial: Vec::new(),
            rows: vec![0, 0, 0],
            branches: Vec::new(),
            set_rows: vec![0],
            members: Vec::new(),
        };
        Self {
            chain,
            sets: HashMap::new(),
        }
    }

    /// Adds the next state with its branches; returns its number. Successors may be states that
    /// come later.
    ///
    /// # Errors
    /// Probabilities that are none, or a branch without a successor.
    pub fn state(&mut self, branches: &[(f64, Vec<u32>)]) -> Result<u32, ChainError> {
        let state = (self.chain.rows.len() - 1) as u32;
        let mut sum = 0.0;
        for (probability, members) in branches {
            if !(0.0..=1.0).contains(probability) {
                let found = *probability;
                return Err(ChainError::Probability { state, found });
            }
            if members.is_empty() {
                return Err(ChainError::Empty { state });
            }
            sum += probability;
            let set = self.set(members);
            let probability = *probability;
            self.chain.branches.push(Branch { probability, set });
        }
        if sum > 1.0 + SUM_SLACK {
            return Err(ChainError::Sum { state, found: sum });
        }
        self.chain.rows.push(self.chain.branches.len());
        Ok(state)
    }

    /// The position of a set; the members are sorted, and none counts twice.
    fn set(&mut self, members: &[u32]) -> u32 {
        let mut key = members.to_vec();
        key.sort_unstable();
        key.dedup();
        let next = (self.chain.set_rows.len() - 1) as u32;
        if let Some(known) = self.sets.get(&key) {
            return *known;
        }
        self.chain.members.extend(&key);
        self.chain.set_rows.push(self.chain.members.len());
        self.sets.insert(key, next);
        next
    }

    /// The chain, from these states: which of them is an adversary's choice.
    ///
    /// # Errors
    /// A successor or an initial state that does not exist, or no initial state.
    pub fn finish(mut self, initial: &[u32]) -> Result<Chain, ChainError> {
        let states = (self.chain.rows.len() - 1) as u32;
        if initial.is_empty() {
            return Err(ChainError::NoInitial);
        }
        self.chain.initial = initial.to_vec();
        self.chain.initial.sort_unstable();
        self.chain.initial.dedup();
        for named in self.chain.members.iter().chain(&self.chain.initial) {
            if *named >= states {
                let found = *named;
                return Err(ChainError::Unknown { found, states });
            }
        }
        Ok(self.chain)
    }
}

impl Chain {
    /// Of each set the value that `pick` takes among its members', from `neutral` on.
    pub(crate) fn over_sets(
        &self,
        values: &[f64],
        neutral: f64,
        pick: impl Fn(f64, f64) -> f64 + Sync,
        out: &mut [f64],
    ) {
        out.par_iter_mut()
            .with_min_len(TOGETHER)
            .enumerate()
            .for_each(|(set, out)| {
                let members = self.members(set as u32).iter();
                *out = members
                    .map(|state| values[*state as usize])
                    .fold(neutral, &pick);
            });
    }

    /// States, [`FAILED`] and [`SAFE`] among them.
    pub fn states(&self) -> usize {
        self.rows.len() - 1
    }

    /// Pairs of a branch and a member of its set.
    pub fn transitions(&self) -> usize {
        let size = |branch: &Branch| self.members(branch.set).len();
        self.branches.iter().map(size).sum()
    }

    /// Distinct sets.
    pub fn sets(&self) -> usize {
        self.set_rows.len() - 1
    }

    /// Initial states.
    pub fn initial(&self) -> &[u32] {
        &self.initial
    }

    /// Branches of a state.
    pub fn branches(&self, state: u32) -> &[Branch] {
        let state = state as usize;
        &self.branches[self.rows[state]..self.rows[state + 1]]
    }

    /// Members of a set.
    pub fn members(&self, set: u32) -> &[u32] {
        let set = set as usize;
        &self.members[self.set_rows[set]..self.set_rows[set + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_sets_are_kept_once() {
        let mut chain = ChainBuilder::new();
        let a = chain
            .state(&[(0.5, vec![SAFE, 2]), (0.5, vec![2, SAFE, 2])])
            .unwrap();
        let chain = chain.finish(&[a]).unwrap();
        assert_eq!(
            (chain.states(), chain.sets(), chain.transitions()),
            (3, 1, 4)
        );
    }

    #[test]
    fn what_is_no_chain_is_refused() {
        let mut chain = ChainBuilder::new();
        let sum = chain.state(&[(0.7, vec![SAFE]), (0.4, vec![SAFE])]);
        assert!(matches!(sum, Err(ChainError::Sum { .. })));
        let mut chain = ChainBuilder::new();
        let found = chain.state(&[(f64::NAN, vec![SAFE])]);
        assert!(matches!(found, Err(ChainError::Probability { .. })));
        let empty = chain.state(&[(0.1, vec![])]);
        assert!(matches!(empty, Err(ChainError::Empty { .. })));
        let mut chain = ChainBuilder::new();
        chain.state(&[(1.0, vec![7])]).unwrap();
        assert!(matches!(
            chain.finish(&[2]),
            Err(ChainError::Unknown { found: 7, .. })
        ));
        assert_eq!(ChainBuilder::new().finish(&[]), Err(ChainError::NoInitial));
    }
}
