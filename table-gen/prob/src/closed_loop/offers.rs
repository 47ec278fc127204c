//! The chain with alternatives: at some places of the table every level is offered.
//!
//! A *place* is a cell of a law. What the table says there is one choice; an open place offers all
//! levels, and so does one without an entry that is open. A node's groups are the decisions that
//! the phase machine may come to on its set, each with its place; which of them the firmware is
//! asked for is the adversary's choice, and which level an open one gives is the controller's.

use std::collections::HashSet;

use firmware::grid::Cell;
use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::Law;
use firmware::units::{STATES, State};
use rayon::prelude::*;

use super::known::Known;
use super::{Branches, ClosedLoopError, Ends, Key, Loop, Settings};
use crate::chain::{Branch, SAFE};
use crate::choices::Choices;

/// Nodes that are expanded between two looks at the clock.
const TOGETHER: usize = 1024;

/// A cell of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// The law.
    pub law: Law,
    /// Index of the cell on each axis.
    pub cell: [u16; STATES],
}

/// The chain with its alternatives, and what they stand for.
#[derive(Debug, Clone)]
pub(crate) struct Offered {
    pub(crate) choices: Choices,
    /// Of each group; none where no law decides.
    pub(crate) places: Vec<Vec<Place>>,
    /// Of each state: the level that it stands for, at a place.
    pub(crate) levels: Vec<Option<u8>>,
    pub(crate) steps: u32,
    /// Nodes that were not followed and count as failed.
    pub(crate) unfollowed: usize,
}

/// A group of a node: its places, and its choices with their levels.
struct Group {
    places: Vec<Place>,
    choices: Vec<(Option<u8>, Branches)>,
}

impl Loop<'_> {
    /// Where an entry decides, or would decide if there were one.
    fn place(&self, next: PhaseState, measured: State) -> Option<Place> {
        let header = self.table.header();
        let in_second = self.table.law(Law::C2).is_some() && header.outer.contains(measured);
        let law = match next.phase {
            Phase::C1 => Law::C1,
            Phase::C2 => Law::C2,
            Phase::Fallback if in_second => Law::C2,
            Phase::Fallback => Law::C1,
            _ => return None,
        };
        let Cell(cell) = header.grid.quantise(measured)?;
        Some(Place { law, cell })
    }

    /// The groups of a node.
    fn groups(&self, key: &Key, open: &HashSet<Place>) -> Vec<Group> {
        let ball = self.cover.ball(key.cell, key.left);
        let state = key.state();
        // Open places, and the others by what they decide.
        let mut offered: Vec<(Place, PhaseState)> = Vec::new();
        let mut settled: Vec<(PhaseState, Decision, Vec<Place>)> = Vec::new();
        self.regions.each_region(&ball, &mut |measured| {
            let (next, decision) = state.step(self.table, measured);
            // The band was left: a part of the set that is still inside is followed elsewhere.
            if key.left && next == state {
                return;
            }
            let place = self.place(next, measured);
            if let Some(place) = place.filter(|place| open.contains(place)) {
                if !offered.contains(&(place, next)) {
                    offered.push((place, next));
                }
                return;
            }
            let found = settled
                .iter()
                .position(|(known, decided, _)| (*known, *decided) == (next, decision));
            let at = found.unwrap_or_else(|| {
                settled.push((next, decision, Vec::new()));
                settled.len() - 1
            });
            let places = &mut settled[at].2;
            if let Some(place) = place.filter(|place| !places.contains(place)) {
                places.push(place);
            }
        });
        let of_settled = settled.into_iter().map(|(next, decision, places)| {
            let level = match decision {
                Decision::Level(level) if !places.is_empty() => Some(level),
                _ => None,
            };
            let choices = vec![(level, self.decided(key, &ball, next, decision).branches)];
            Group { places, choices }
        });
        let of_offered = offered.into_iter().map(|(place, next)| {
            let phase = match place.law {
                Law::C2 => Phase::C2,
                _ => Phase::C1,
            };
            let choices = (0..self.table.header().levels).map(|level| {
                let next = PhaseState {
                    phase,
                    level,
                    ticks_left: next.ticks_left,
                };
                let decided = self.decided(key, &ball, next, Decision::Level(level));
                (Some(level), decided.branches)
            });
            Group {
                places: vec![place],
                choices: choices.collect(),
            }
        });
        of_settled.chain(of_offered).collect()
    }

    /// Expands all nodes that are reached under any choice.
    pub(super) fn offer(
        &self,
        start: &[Ends],
        steps: u32,
        settings: &Settings,
        open: &HashSet<Place>,
        go_on: &dyn Fn(usize, usize) -> bool,
    ) -> Result<Offered, ClosedLoopError> {
        let mut known = Known::default();
        let initial: Vec<u32> = start.iter().map(|ends| known.set(ends)).collect();
        let (mut rows, mut branches) = (vec![0usize; 3], Vec::new());
        // FAILED and SAFE have no places and no levels.
        let (mut groups, mut places) = (vec![0usize, 1, 2], vec![Vec::new(); 2]);
        let mut levels = vec![None; 2];
        // Where the groups of each node begin.
        let mut first = Vec::new();
        let (mut expanded, mut depth, mut layer_end) = (0, 0, known.keys.len());
        let mut unfollowed = 0;
        while expanded < known.keys.len() {
            if expanded == layer_end {
                depth += 1;
                layer_end = known.keys.len();
                // With no step to go every node is worth 1.
                if depth >= steps {
                    break;
                }
            }
            if known.keys.len() > settings.nodes_max {
                unfollowed = known.keys.len() - expanded;
                break;
            }
            let end = layer_end.min(expanded + TOGETHER);
            let part: Vec<Vec<Group>> = known.keys[expanded..end]
                .par_iter()
                .map(|key| self.groups(key, open))
                .collect();
            for node in part {
                first.push(places.len());
                for group in node {
                    places.push(group.places);
                    for (level, ends) in group.choices {
                        levels.push(level);
                        for (probability, ends) in ends {
                            let set = known.set(&ends);
                            branches.push(Branch { probability, set });
                        }
                        rows.push(branches.len());
                    }
                    groups.push(rows.len() - 1);
                }
            }
            expanded = end;
            if !go_on(expanded, known.keys.len()) {
                return Err(ClosedLoopError::Interrupted);
            }
        }
        first.push(places.len());
        // A group that fails at its first step stands for all nodes that are not followed.
        let beyond = if unfollowed > 0 {
            let (set, probability) = (known.set(&Ends::Failed), 1.0);
            branches.push(Branch { probability, set });
            rows.push(branches.len());
            groups.push(rows.len() - 1);
            places.push(Vec::new());
            levels.push(None);
            (places.len() - 1) as u32
        } else {
            SAFE
        };
        let chain = known.chain(initial, rows, branches, &first, expanded, beyond);
        Ok(Offered {
            choices: Choices { chain, groups },
            places,
            levels,
            steps,
            unfollowed,
        })
    }
}
