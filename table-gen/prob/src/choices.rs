//! Chains in which a controller chooses too: set-valued value iteration over the inputs.
//!
//! Three choose in a step. An adversary picks the *group* (the real state is in one of the sets
//! that overlap, and which table cell decides there is his choice); the controller picks one of the
//! group's states, each an input; chance picks the branch, and the adversary a member of the
//! branch's set, which is a set of groups.
//!
//! ```text
//! W_t(G) = max over q in G of V_t(q)
//! V_{t+1}(q) = sum over k of p_k min over G in Post(q, k) of W_t(G)
//! ```
//!
//! With one state in each group this is [`crate::value`], and the same argument holds: V_t is a
//! lower bound of what the best controller that sees the group reaches, every rounding down.
//! [`Goal::Safe`] begins with 1 but for what failed, [`Goal::Reach`] with 0 but for the target:
//! there V_t is the probability to be there within t steps, so every t gives a lower bound.

use rayon::prelude::*;

use crate::chain::{Branch, Chain, FAILED, SAFE, TOGETHER};

/// What is asked of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// Not to fail within the steps.
    Safe,
    /// To be in [`SAFE`] within the steps, and not to fail before.
    Reach,
}

/// A chain whose states are gathered in groups. The members of its sets, and its initial states,
/// are groups. The first two groups are [`FAILED`] and [`SAFE`], each alone with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Choices {
    pub(crate) chain: Chain,
    pub(crate) groups: Vec<usize>,
}

/// Groups that do not fit the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "groups must begin with FAILED and SAFE alone, be rising, and end with the chain's states; \
     sets may name groups alone"
)]
pub struct GroupsError;

/// Values with some steps to go.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// Of each group.
    pub groups: Vec<f64>,
    /// Of each state.
    pub states: Vec<f64>,
    /// Steps that were made: fewer than asked for where nothing changed any more.
    pub steps: u32,
}

impl Choices {
    /// A chain, and where each group of its states begins; the last number is the end of the last.
    ///
    /// # Errors
    /// Groups that do not fit the chain.
    pub fn new(chain: Chain, groups: Vec<usize>) -> Result<Self, GroupsError> {
        let rising = groups.windows(2).all(|pair| pair[0] < pair[1]);
        let ends = groups.len() > 2 && groups[..3] == [0, 1, 2];
        let count = groups.len().saturating_sub(1) as u32;
        let named = chain.members.iter().chain(&chain.initial);
        let fits = rising
            && ends
            && groups.last() == Some(&chain.states())
            && named.copied().all(|group| group < count);
        if fits {
            Ok(Self { chain, groups })
        } else {
            Err(GroupsError)
        }
    }

    /// Groups.
    pub fn groups(&self) -> usize {
        self.groups.len() - 1
    }

    /// States of a group.
    pub fn states_of(&self, group: u32) -> std::ops::Range<usize> {
        let group = group as usize;
        self.groups[group]..self.groups[group + 1]
    }

    /// The chain whose states are the inputs of the groups.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Values with this many steps to go. The iteration ends early where no value changes by more
    /// than `settled`: for [`Goal::Reach`] each step is a lower bound, so that loses nothing of its
    /// rigour. 0 makes all steps.
    pub fn values(&self, goal: Goal, steps: u32, settled: f64) -> Values {
        let (first, good) = match goal {
            Goal::Safe => (1.0, 1.0),
            Goal::Reach => (0.0, 1.0),
        };
        let mut values = Values {
            groups: vec![first; self.groups()],
            states: vec![first; self.chain.states()],
            steps: 0,
        };
        values.groups[FAILED as usize] = 0.0;
        values.groups[SAFE as usize] = good;
        values.states[FAILED as usize] = 0.0;
        values.states[SAFE as usize] = good;
        let mut worst = vec![0.0; self.chain.sets()];
        while values.steps < steps {
            let moved = self.step(&mut worst, &mut values);
            values.steps += 1;
            if moved <= settled && settled > 0.0 {
                break;
            }
        }
        values
    }

    /// The value of the worst initial group.
    pub fn of_initial(&self, values: &Values) -> f64 {
        let initial = self.chain.initial.iter();
        initial
            .map(|group| values.groups[*group as usize])
            .fold(1.0, f64::min)
    }

    /// One step; the largest change of a group.
    fn step(&self, worst: &mut [f64], values: &mut Values) -> f64 {
        let (chain, groups) = (&self.chain, &values.groups);
        chain.over_sets(groups, 1.0, f64::min, worst);
        let worst = &*worst;
        values.states[2..]
            .par_iter_mut()
            .with_min_len(TOGETHER)
            .enumerate()
            .for_each(|(index, value)| *value = expected(chain.branches(index as u32 + 2), worst));
        let states = &values.states;
        values.groups[2..]
            .par_iter_mut()
            .with_min_len(TOGETHER)
            .enumerate()
            .map(|(index, value)| {
                let of_group = &states[self.groups[index + 2]..self.groups[index + 3]];
                let best = of_group.iter().copied().fold(0.0, f64::max);
                let moved = (best - *value).abs();
                *value = best;
                moved
            })
            .reduce(|| 0.0, f64::max)
    }
}

/// Lower bound of the sum over the branches.
fn expected(branches: &[Branch], worst: &[f64]) -> f64 {
    if let [only] = branches
        && only.probability == 1.0
    {
        return worst[only.set as usize];
    }
    let mut sum = 0.0f64;
    for branch in branches {
        let term = (branch.probability * worst[branch.set as usize]).next_down();
        sum = (sum + term.max(0.0)).next_down().max(0.0);
    }
    sum.min(1.0)
}
