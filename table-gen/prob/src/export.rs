//! The chain as a Markov decision process, for outside model checkers: DRN (Storm) and PRISM's
//! explicit files.
//!
//! A step of the chain takes two steps there. First chance: a state has one action, whose outcomes
//! are the branches, each a state of its own for the branch's set. Then the adversary: the set's
//! state has one action for each member. Before both comes a start in which the adversary picks the
//! initial state. What the probabilities leave over leads to the failed state. So the bound over n
//! steps is
//!
//! ```text
//! 1 - Pmax=? [F<=2n+1 "failed"]
//! ```
//!
//! With the seconds that each state may bring, the upper bound of the expected ones is
//!
//! ```text
//! Rmax=? [C<=2n+1]
//! ```
//!
//! where no more than the horizon is ever brought: ours is cut there, and this is not.
//!
//! | numbers there | what |
//! |---|---|
//! | 0 | the start |
//! | 1 to N | the chain's states in their order: 1 is failed, 2 is safe |
//! | N + 1 on | the sets |

use std::io::{self, Write};

use crate::chain::{Chain, FAILED, SAFE};
use crate::reward::Reward;

/// Steps of the exported process that belong to steps of the chain.
pub const fn steps_there(steps: u32) -> u32 {
    2 * steps + 1
}

/// One action: its outcomes with their probabilities.
type Action = Vec<(f64, usize)>;

/// The actions of each exported state, in order.
fn actions(chain: &Chain) -> impl Iterator<Item = Vec<Action>> + '_ {
    let sure = |to: usize| vec![(1.0, to)];
    let start = chain
        .initial()
        .iter()
        .map(move |state| sure(*state as usize + 1));
    let first_set = chain.states() + 1;
    let of_state = move |state: usize| {
        let state = state as u32;
        if state == FAILED || state == SAFE {
            return vec![sure(state as usize + 1)];
        }
        vec![chance(chain, state, first_set)]
    };
    let of_set = move |set: usize| {
        let members = chain.members(set as u32).iter();
        members.map(|state| sure(*state as usize + 1)).collect()
    };
    std::iter::once(start.collect())
        .chain((0..chain.states()).map(of_state))
        .chain((0..chain.sets()).map(of_set))
}

/// The outcomes of a state, the rest failed; outcomes of one target are one.
fn chance(chain: &Chain, state: u32, first_set: usize) -> Action {
    let mut outcomes: Action = Vec::new();
    let mut sum = 0.0;
    for branch in chain.branches(state) {
        sum += branch.probability;
        let to = first_set + branch.set as usize;
        match outcomes.iter_mut().find(|(_, known)| *known == to) {
            Some((probability, _)) => *probability += branch.probability,
            None if branch.probability > 0.0 => outcomes.push((branch.probability, to)),
            None => {}
        }
    }
    let rest = 1.0 - sum;
    if rest > 0.0 {
        outcomes.push((rest, FAILED as usize + 1));
    }
    outcomes
}

/// Writes the DRN file. `note` is put on top as a comment; it has no line breaks. With a reward
/// there is a reward model `seconds`: what a state brings in its step, and what failing in it
/// counts as, times what its branches leave to that. The failed state brings nothing more.
///
/// # Errors
/// What writing gives.
pub fn drn(
    chain: &Chain,
    reward: Option<&Reward>,
    note: &str,
    out: &mut impl Write,
) -> io::Result<()> {
    let (states, choices) = sizes(chain);
    let seconds = |state: usize| -> String {
        let Some(reward) = reward else {
            return String::new();
        };
        // The start is the first state there.
        let of_chain = state.checked_sub(1).filter(|own| *own < chain.states());
        let brings = of_chain.map_or(0.0, |own| {
            let failing = failing(chain, own as u32);
            reward.seconds[own] + failing * reward.failed_s
        });
        format!(" [{brings:?}]")
    };
    let name = reward.map_or("", |_| "seconds");
    writeln!(out, "// {note}")?;
    writeln!(out, "@type: MDP\n@parameters\n\n@reward_models\n{name}")?;
    writeln!(out, "@nr_states\n{states}\n@nr_choices\n{choices}\n@model")?;
    for (state, actions) in actions(chain).enumerate() {
        let label = match state {
            0 => " init",
            1 => " failed",
            2 => " safe",
            _ => "",
        };
        writeln!(out, "state {state}{}{label}", seconds(state))?;
        for (index, outcomes) in actions.iter().enumerate() {
            writeln!(out, "\taction {index}")?;
            let mut outcomes = outcomes.clone();
            outcomes.sort_unstable_by_key(|(_, to)| *to);
            for (probability, to) in outcomes {
                writeln!(out, "\t\t{to} : {probability:?}")?;
            }
        }
    }
    Ok(())
}

/// Writes PRISM's explicit files: transitions (`.tra`) and labels (`.lab`).
///
/// # Errors
/// What writing gives.
pub fn prism(chain: &Chain, tra: &mut impl Write, lab: &mut impl Write) -> io::Result<()> {
    let (states, choices) = sizes(chain);
    let transitions: usize = actions(chain)
        .flatten()
        .map(|outcomes| outcomes.len())
        .sum();
    writeln!(tra, "{states} {choices} {transitions}")?;
    for (state, actions) in actions(chain).enumerate() {
        for (choice, outcomes) in actions.iter().enumerate() {
            for (probability, to) in outcomes {
                writeln!(tra, "{state} {choice} {to} {probability:?}")?;
            }
        }
    }
    writeln!(lab, "0=\"init\" 1=\"deadlock\" 2=\"failed\" 3=\"safe\"")?;
    writeln!(lab, "0: 0\n1: 2\n2: 3")
}

/// The probability that a state fails in its step: what is left over, and branches that have failed
/// for certain.
fn failing(chain: &Chain, state: u32) -> f64 {
    if state == FAILED || state == SAFE {
        return 0.0;
    }
    let certain = |set: u32| chain.members(set) == [FAILED];
    let goes_on = chain.branches(state).iter();
    let goes_on: f64 = goes_on
        .filter(|branch| !certain(branch.set))
        .map(|branch| branch.probability)
        .sum();
    (1.0 - goes_on).max(0.0)
}

/// States and choices.
fn sizes(chain: &Chain) -> (usize, usize) {
    let states = 1 + chain.states() + chain.sets();
    let choices = chain.initial().len() + chain.states() + chain.members.len();
    (states, choices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::ChainBuilder;

    fn small() -> Chain {
        let mut chain = ChainBuilder::new();
        chain
            .state(&[(0.5, vec![SAFE, 2]), (0.25, vec![SAFE])])
            .unwrap();
        chain.finish(&[2]).unwrap()
    }

    #[test]
    fn a_small_chain_in_drn() {
        let mut out = Vec::new();
        drn(&small(), None, "small", &mut out).unwrap();
        let expected = "// small\n@type: MDP\n@parameters\n\n@reward_models\n\n@nr_states\n6\n@nr_choices\n7\n@model\n\
            state 0 init\n\taction 0\n\t\t3 : 1.0\n\
            state 1 failed\n\taction 0\n\t\t1 : 1.0\n\
            state 2 safe\n\taction 0\n\t\t2 : 1.0\n\
            state 3\n\taction 0\n\t\t1 : 0.25\n\t\t4 : 0.5\n\t\t5 : 0.25\n\
            state 4\n\taction 0\n\t\t2 : 1.0\n\taction 1\n\t\t3 : 1.0\n\
            state 5\n\taction 0\n\t\t2 : 1.0\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn the_seconds_of_a_small_chain() {
        let reward = Reward {
            seconds: vec![0.0, 0.0, 2.0],
            failed_s: 8.0,
        };
        let mut out = Vec::new();
        drn(&small(), Some(&reward), "small", &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        // A quarter is left over: 2 + 8/4.
        assert!(text.contains("@reward_models\nseconds\n@nr_states"));
        assert!(text.contains("state 0 [0.0] init\n") && text.contains("state 1 [0.0] failed\n"));
        assert!(text.contains("state 3 [4.0]\n") && text.contains("state 4 [0.0]\n"));
    }

    #[test]
    fn a_small_chain_in_prisms_files() {
        let (mut tra, mut lab) = (Vec::new(), Vec::new());
        prism(&small(), &mut tra, &mut lab).unwrap();
        let expected = "6 7 9\n0 0 3 1.0\n1 0 1 1.0\n2 0 2 1.0\n3 0 4 0.5\n3 0 5 0.25\n3 0 1 0.25\n4 0 2 1.0\n\
            4 1 3 1.0\n5 0 2 1.0\n";
        assert_eq!(String::from_utf8(tra).unwrap(), expected);
        assert!(String::from_utf8(lab).unwrap().contains("1: 2"));
    }
}
