//! No control: tight sets from the event to the first decision, for tables that then go on for ever in whole cells.
//!
//! Where the frequency may stay above I1 for ever, the sets are closed by a box: a box R with "R after a round lies in
//! R" holds at the beginning of every later round, so the sets of one round from R speak for all later times.

use std::collections::BTreeMap;

use firmware::phase::{PhaseState, Step};
use firmware::table::TableView;

use super::event;
use super::model::Model;
use super::path::{PathStep, Traces};
use super::regions::Regions;
use super::tally::{Tally, Violation};
use super::zonotope::Zonotope;
use crate::interval::Interval;
use crate::plant::STATES;

/// Time in No control that is followed from the event, and length of a round \[s\]; long against the plant's slowest
/// mode (13 s for the paper's), so that a round contracts.
const ROUND_S: f64 = 60.0;
/// Rounds in which a box that closes must be found.
const ROUNDS_MAX: u32 = 8;
/// By how much a box that did not close is widened \[share of its width\].
const WIDEN: f64 = 0.05;

/// Where No control can end.
pub(super) struct Watched {
    /// The cells of the first decision, each with the trace that leads there.
    pub(super) seeds: BTreeMap<u32, u32>,
    pub(super) traces: Traces,
    /// Last tick, from the first after the event, at which the first decision may come; `None` if there is no last.
    pub(super) last_tick: Option<u32>,
}

/// The exploration of No control.
pub(super) struct Watching<'a> {
    pub(super) table: &'a TableView<'a>,
    pub(super) model: &'a Model,
    pub(super) regions: &'a Regions,
}

impl Watching<'_> {
    /// Follows No control until no state is left in it, or until it is closed.
    pub(super) fn watch(&self, tally: &mut Tally) -> Watched {
        let mut out = Watched {
            seeds: BTreeMap::new(),
            traces: Traces::default(),
            last_tick: Some(0),
        };
        let drive = self.model.drives[usize::from(PhaseState::INITIAL.level)];
        let range = self.model.tick.frequency(&self.model.initial, drive);
        let root = out.traces.push(None, PathStep::event(range));
        tally.flown(self.model, range, root, &out.traces);
        let sets = event::first_tick(self.model)
            .into_iter()
            .map(|set| (root, set))
            .collect();
        let ticks = (ROUND_S / self.model.tick_s).ceil() as u32;
        let left = self.round(0, ticks, sets, tally, &mut out);
        let Some((trace, mut closing)) = hull(&left) else {
            return out;
        };
        out.last_tick = None;
        for round in 1..=ROUNDS_MAX {
            let sets = vec![(trace, Zonotope::of_box(&closing))];
            let left = self.round(round * ticks, ticks, sets, tally, &mut out);
            let Some((_, after)) = hull(&left) else {
                return out;
            };
            let inside =
                |d: usize| closing[d].low <= after[d].low && after[d].high <= closing[d].high;
            if (0..STATES).all(inside) {
                return out;
            }
            closing = std::array::from_fn(|d| widened(closing[d].join(after[d])));
        }
        tally.limit = Some("no closed set was found for No control".to_owned());
        out
    }

    /// Follows sets for a number of ticks; returns those that are still in No control.
    fn round(
        &self,
        first: u32,
        ticks: u32,
        mut sets: Vec<(u32, Zonotope)>,
        tally: &mut Tally,
        out: &mut Watched,
    ) -> Vec<(u32, Zonotope)> {
        let state = PhaseState::INITIAL;
        let drive = self.model.drives[usize::from(state.level)];
        for tick in first..first + ticks {
            let mut staying = Vec::new();
            for (parent, set) in sets {
                for part in self.regions.by_band(&set, state.phase) {
                    let (next, _) = state.step(self.table, part.representative);
                    if next != state {
                        out.last_tick = out.last_tick.map(|last| last.max(tick));
                        self.decide(&part.set, (parent, tick), tally, out);
                        continue;
                    }
                    let step = PathStep {
                        tick,
                        phase: state.phase,
                        level: state.level,
                        cell: None,
                        set: part.set.hull_f(),
                    };
                    let trace = out.traces.push(Some(parent), step);
                    let range = self.model.tick.frequency(&part.set, drive);
                    tally.flown(self.model, range, trace, &out.traces);
                    staying.push((trace, part.set.after(&self.model.tick, drive)));
                }
            }
            sets = staying;
        }
        sets
    }

    /// The cells of the first decision.
    fn decide(
        &self,
        set: &Zonotope,
        (parent, tick): (u32, u32),
        tally: &mut Tally,
        out: &mut Watched,
    ) {
        let grid = &self.table.header().grid;
        for part in self.regions.by_cell(set) {
            let cell = grid.quantise(part.representative);
            let index = cell.and_then(|cell| grid.index(cell));
            let (next, step) = PhaseState::INITIAL.step(self.table, part.representative);
            if let (Some(index), Step::Level(_)) = (index, step)
                && out.seeds.contains_key(&index)
            {
                continue;
            }
            let at = PathStep {
                tick,
                phase: next.phase,
                level: next.level,
                cell: cell.map(|cell| cell.0),
                set: part.set.hull_f(),
            };
            let trace = out.traces.push(Some(parent), at);
            match (index, step) {
                (Some(index), Step::Level(_)) => {
                    out.seeds.insert(index, trace);
                }
                _ => {
                    let what = "no law has an entry for the state in which No control ends";
                    tally.violate(Violation::Uncovered, what, trace, &out.traces);
                }
            }
        }
    }
}

/// The box around all sets, and a trace that leads to one of them.
fn hull(sets: &[(u32, Zonotope)]) -> Option<(u32, [Interval; STATES])> {
    let (trace, first) = sets.first()?;
    let all = sets.iter().fold(first.hull(), |all, (_, set)| {
        let hull = set.hull();
        std::array::from_fn(|d| all[d].join(hull[d]))
    });
    Some((*trace, all.map(widened)))
}

/// A little wider, and never less than a micro-unit to either side.
fn widened(axis: Interval) -> Interval {
    let by = ((axis.high - axis.low) * WIDEN).max(1.0);
    Interval {
        low: axis.low - by,
        high: axis.high + by,
    }
}
