//! Better levels for a table: value iteration over the levels that its cells may give, on the sets
//! of [`crate::closed_loop`].
//!
//! A round does this:
//!
//! 1. The chain of the table as it is. Where it may fail, and up to some steps before that, places
//!    are *opened*: these are the cells whose levels matter.
//! 2. The chain in which open places offer every level, and its value: chance, the adversary inside
//!    bins and sets, and the controller at open places.
//! 3. Each open place takes the level whose worst value is best, over all groups of that place: a
//!    cell has one level, while the value of step 2 may choose another for each set.
//!
//! Rounds need levels to begin with. Those of a game are steep, and where draws are large the chain
//! of steep levels has many states and little value. [`kept`] compares first levels by runs.
//!
//! Nothing rests on the choice being the best one. What is claimed of the new table is found from
//! its bytes, by the same chain as for any other table.

use std::collections::{HashMap, HashSet};

use firmware::table::TableView;
use model::spec::Spec;

use crate::chain::FAILED;
use crate::choices::{Goal, Values};
pub use crate::closed_loop::Place;
use crate::closed_loop::{self, ClosedLoopError, Offered, Settings};
use crate::participation::Participation;
use crate::sampled::Sampled;

/// A level for a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The cell and its law.
    pub place: Place,
    /// Its new level.
    pub level: u8,
}

/// What a round found.
#[derive(Debug, Clone, PartialEq)]
pub struct Improvement {
    /// Lower bound of the table as it is.
    pub before: f64,
    /// Value of the chain in which each set may have a level of its own: no table that differs at
    /// the open places alone has a bound above it, on these sets and if all were followed.
    pub at_most: f64,
    /// Places that were opened.
    pub opened: usize,
    /// States of the chain with its alternatives.
    pub states: usize,
    /// Nodes that were not followed.
    pub unfollowed: usize,
    /// What to change.
    pub changes: Vec<Change>,
    /// Places that the table as it is is asked for.
    pub asked_now: Vec<Place>,
}

/// Runs of each loss in [`kept`].
const RUNS: u32 = 24;
/// Losses of [`kept`] to either side of the spec's, and how far apart \[GW\]: what the adversary
/// inside the sets of a chain may do is like a loss of another size.
const BESIDE: i32 = 16;
const APART_GW: f64 = 0.0125;

/// How many runs of a table keep the promise, for losses up to 0.2 GW beside the spec's; nothing
/// where `go_on` ended them. A comparison, no bound.
pub fn kept(
    table: &TableView<'_>,
    spec: &Spec,
    participation: Participation,
    horizon_s: f64,
    go_on: &(dyn Fn() -> bool + Sync),
) -> Option<u32> {
    let runs = (-BESIDE..=BESIDE).map(|beside| {
        let beside = f64::from(beside) * APART_GW;
        let mut spec = spec.clone();
        let loss = &mut spec.uncertainty.loss_gw;
        *loss = loss.map(|loss| (loss + beside).max(0.0));
        let sampled = Sampled::new(table, &spec, participation, horizon_s);
        Some(sampled.many(RUNS, 0, go_on)?.kept)
    });
    runs.sum()
}

/// One round. Places are opened where the chain may fail, and `back` steps before it; without
/// `back` only the table's own bound is found.
///
/// # Errors
/// As [`closed_loop::build`].
pub fn improve(
    table: &TableView<'_>,
    spec: &Spec,
    participation: &Participation,
    settings: &Settings,
    back: Option<u32>,
    go_on: &dyn Fn(usize, usize) -> bool,
) -> Result<Improvement, ClosedLoopError> {
    let offered = |open: &HashSet<Place>| {
        closed_loop::offered(table, spec, participation, settings, open, go_on)
    };
    let values = |of: &Offered| of.choices.values(Goal::Safe, of.steps, 0.0);
    let plain = offered(&HashSet::new())?;
    let known = values(&plain);
    let before = plain.choices.of_initial(&known);
    let open = back.map_or_else(HashSet::new, |back| critical(&plain, back));
    let mut found = Improvement {
        before,
        at_most: before,
        opened: open.len(),
        states: plain.choices.chain().states(),
        unfollowed: plain.unfollowed,
        changes: Vec::new(),
        asked_now: asked(&plain),
    };
    if open.is_empty() {
        return Ok(found);
    }
    let wide = offered(&open)?;
    let best = values(&wide);
    found.at_most = wide.choices.of_initial(&best);
    found.states = wide.choices.chain().states();
    found.unfollowed = wide.unfollowed;
    found.changes = chosen(table, &wide, &best, &open);
    Ok(found)
}

/// Places that decide where the chain may fail, and up to so many steps before it.
fn critical(offered: &Offered, back: u32) -> HashSet<Place> {
    let choices = &offered.choices;
    let chain = choices.chain();
    let mut failing = vec![false; choices.groups()];
    failing[FAILED as usize] = true;
    let mut open = HashSet::new();
    for _ in 0..=back {
        let sets: Vec<bool> = (0..chain.sets() as u32)
            .map(|set| {
                chain
                    .members(set)
                    .iter()
                    .any(|group| failing[*group as usize])
            })
            .collect();
        let mut next = failing.clone();
        for group in 2..choices.groups() as u32 {
            let mut branches = choices
                .states_of(group)
                .flat_map(|state| chain.branches(state as u32));
            let may = branches.any(|branch| branch.probability > 0.0 && sets[branch.set as usize]);
            if may {
                next[group as usize] = true;
                open.extend(&offered.places[group as usize]);
            }
        }
        failing = next;
    }
    open
}

/// All places of a chain, each once, in their order.
fn asked(offered: &Offered) -> Vec<Place> {
    let mut places: Vec<Place> = offered.places.iter().flatten().copied().collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// For each open place the level whose worst value is best; of equals the one with the larger sum,
/// then what the table says already, then the lowest.
fn chosen(
    table: &TableView<'_>,
    offered: &Offered,
    values: &Values,
    open: &HashSet<Place>,
) -> Vec<Change> {
    let mut scores: HashMap<Place, Vec<(f64, f64)>> = HashMap::new();
    let levels = usize::from(table.header().levels);
    for (group, places) in offered.places.iter().enumerate() {
        // An open place is alone in its group.
        let Some(place) = places.iter().copied().find(|place| open.contains(place)) else {
            continue;
        };
        let score = scores
            .entry(place)
            .or_insert_with(|| vec![(1.0, 0.0); levels]);
        for state in offered.choices.states_of(group as u32) {
            if let Some(level) = offered.levels[state] {
                let (worst, sum) = &mut score[usize::from(level)];
                *worst = worst.min(values.states[state]);
                *sum += values.states[state];
            }
        }
    }
    let mut changes: Vec<Change> = scores
        .into_iter()
        .filter_map(|(place, score)| {
            let cell = firmware::grid::Cell(place.cell);
            let now = table.lookup(place.law, cell);
            let rank = |level: usize| (score[level], now == Some(level as u8));
            let better = |a: &usize, b: &usize| {
                let ((a_score, a_now), (b_score, b_now)) = (rank(*a), rank(*b));
                let by_worst = a_score.0.total_cmp(&b_score.0);
                let by_sum = a_score.1.total_cmp(&b_score.1);
                // The lowest of equals: the later one is the larger number.
                by_worst.then(by_sum).then(a_now.cmp(&b_now)).then(b.cmp(a))
            };
            let level = (0..levels).max_by(better)? as u8;
            (now != Some(level)).then_some(Change { place, level })
        })
        .collect();
    changes.sort_unstable_by_key(|change| change.place);
    changes
}
