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
//! | numbers there | what |
//! |---|---|
//! | 0 | the start |
//! | 1 to N | the chain's states in their order: 1 is failed, 2 is safe |
//! | N + 1 on | the sets |

use std::io::{self, Write};

use crate::chain::{Chain, FAILED, SAFE};

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

/// Writes the DRN file. `note` is put on top as a comment; it has no line breaks.
///
/// # Errors
/// What writing gives.
pub fn drn(chain: &Chain, note: &str, out: &mut impl Write) -> io::Result<()> {
    let (states, choices) = sizes(chain);
    writeln!(out, "// {note}")?;
    writeln!(out, "@type: MDP\n@parameters\n\n@reward_models\n")?;
    writeln!(out, "@nr_states\n{states}\n@nr_choices\n{choices}\n@model")?;
    for (state, actions) in actions(chain).enumerate() {
        let label = match state {
            0 => " init",
            1 => " failed",
            2 => " safe",
            _ => "",
        };
        writeln!(out, "state {state}{label}")?;
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
        drn(&small(), "small", &mut out).unwrap();
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
    fn a_small_chain_in_prisms_files() {
        let (mut tra, mut lab) = (Vec::new(), Vec::new());
        prism(&small(), &mut tra, &mut lab).unwrap();
        let expected = "6 7 9\n0 0 3 1.0\n1 0 1 1.0\n2 0 2 1.0\n3 0 4 0.5\n3 0 5 0.25\n3 0 1 0.25\n4 0 2 1.0\n\
            4 1 3 1.0\n5 0 2 1.0\n";
        assert_eq!(String::from_utf8(tra).unwrap(), expected);
        assert!(String::from_utf8(lab).unwrap().contains("1: 2"));
    }
}
