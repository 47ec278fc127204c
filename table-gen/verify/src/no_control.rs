//! No control: tight sets from the event to the first decision, for tables that then go on for ever
//! in whole cells.
//!
//! Where the frequency may stay above I1 for ever, the sets are closed by a box: a box R with "R
//! after a round lies in R" holds at the beginning of every later round, so the sets of one round
//! from R speak for all later times.

use std::collections::BTreeMap;

use firmware::grid::Cell;
use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::TableView;
use firmware::units::{AXIS_F, State};

use super::cellset::CellSet;
use super::closed_loop::Model;
use super::first_tick;
use super::held_input::Linear;
use super::outcome::{Outcome, Violation};
use super::path::{PathStep, Traces};
use super::regions::Regions;
use super::successor::{Cells, index};
use super::zonotope::Zonotope;
use model::interval::Interval;
use model::plant::STATES;

/// Time in No control that is followed from the event, and length of a round \[s\]; long against
/// the plant's slowest mode (13 s for the paper's), so that a round contracts.
const ROUND_S: f64 = 60.0;
/// Rounds in which a box that closes must be found.
const ROUNDS_MAX: u32 = 8;
/// By how much a box that did not close is widened \[share of its width\].
const WIDEN: f64 = 0.05;

/// Cells up to which a set is cut cell by cell; past that the box around it is taken, which is
/// cheaper and looser.
const TIGHT_CELLS_MAX: u64 = 4096;

/// Where No control can end.
pub(super) struct Watched {
    /// The cells of the first decision, each with the trace that leads there.
    pub(super) seeds: BTreeMap<u32, u32>,
    /// The same cells as bits: most cells are met many times.
    seen: CellSet,
    pub(super) traces: Traces,
    /// Last tick, from the first after the event, at which the first decision may come; `None` if
    /// there is no last.
    pub(super) last_tick: Option<u32>,
}

/// The exploration of No control.
pub(super) struct NoControl<'a> {
    pub(super) table: &'a TableView<'a>,
    pub(super) model: &'a Model,
    /// The real states by what is measured of them.
    pub(super) regions: &'a Regions,
    /// The states at the trigger, carried over the delay, by what the first decision goes by.
    pub(super) first: &'a Regions,
}

impl NoControl<'_> {
    /// Follows No control until no state is left in it, or until it is closed.
    pub(super) fn watch(&self, tally: &mut Outcome) -> Watched {
        let mut out = Watched {
            seeds: BTreeMap::new(),
            seen: CellSet::new(&self.table.header().grid),
            traces: Traces::default(),
            last_tick: Some(0),
        };
        let drive = self.model.drives[usize::from(PhaseState::INITIAL.level)];
        let range = self.model.tick.frequency(&self.model.initial, drive);
        let root = out.traces.push(None, PathStep::event(range));
        tally.flown(self.model, range, root, &out.traces);
        let sets = first_tick::first_tick(self.model)
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
        tally: &mut Outcome,
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

    /// The cells of the first decision: tightly if they are few, else those of the box around the
    /// set.
    fn decide(
        &self,
        set: &Zonotope,
        (parent, tick): (u32, u32),
        tally: &mut Outcome,
        out: &mut Watched,
    ) {
        let grid = &self.table.header().grid;
        let from = (parent, tick);
        let Some(ahead) = self.ahead(set, from, tally, out) else {
            return;
        };
        let set = &ahead;
        match self.box_of(set) {
            Some(cells) if count(&cells) > TIGHT_CELLS_MAX => {
                each(&cells, |cell| {
                    let index = grid.index(cell);
                    if index.is_some_and(|index| out.seen.contains(index)) {
                        return;
                    }
                    let Some(bounds) = grid.bounds(cell) else {
                        return;
                    };
                    for (state, f) in self.first.within(&bounds) {
                        self.seed(state, f, from, tally, out);
                    }
                });
            }
            _ => {
                for part in self.first.by_cell(set) {
                    let f = part.set.hull_f();
                    self.seed(part.representative, f, from, tally, out);
                }
            }
        }
    }

    /// A set at the trigger as the device expects it when its first command begins to act: the set
    /// itself without a delay. Until then nothing acts, and f is bounded.
    fn ahead(
        &self,
        set: &Zonotope,
        (parent, tick): (u32, u32),
        tally: &mut Outcome,
        out: &mut Watched,
    ) -> Option<Zonotope> {
        let Some(delay) = &self.model.known.delay else {
            return Some(set.clone());
        };
        let step = PathStep {
            tick,
            phase: Phase::NoControl,
            level: PhaseState::INITIAL.level,
            cell: None,
            set: set.hull_f(),
        };
        let trace = out.traces.push(Some(parent), step);
        let magnitude = set.magnitude();
        if (0..STATES).any(|d| magnitude[d] > delay.reach[d]) {
            let what =
                "the state in which No control ends is too far outside the grid to predict from";
            tally.violate(Violation::Uncovered, what, trace, &out.traces);
            return None;
        }
        let none = self.model.drives[usize::from(PhaseState::INITIAL.level)];
        let range = delay.segment.frequency(set, none);
        tally.flown(self.model, range, trace, &out.traces);
        Some(set.after(&delay.segment, delay.expected))
    }

    /// What the machine decides at the trigger on a state of the first decision.
    fn ask(&self, state: State) -> (PhaseState, Decision) {
        if self.model.known.delay.is_none() {
            return PhaseState::INITIAL.step(self.table, state);
        }
        // What was measured lies below I1; where, does not matter.
        let mut below = State::default();
        below.0[AXIS_F] = self.table.header().outer.low_uhz.saturating_sub(1);
        PhaseState::INITIAL.step_ahead(self.table, below, || state)
    }

    /// The box of cells in which the measurement may lie; `None` if some lie outside the grid.
    fn box_of(&self, set: &Zonotope) -> Option<Cells> {
        let mut cells = Cells {
            low: [0; STATES],
            high: [0; STATES],
        };
        for d in 0..STATES {
            let bounds = set.bounds(d);
            let error = self.model.known.first[d];
            let grid = &self.table.header().grid;
            cells.low[d] = index(grid, d, (bounds.low - error).next_down())?;
            cells.high[d] = index(grid, d, (bounds.high + error).next_up())?;
        }
        Some(cells)
    }

    /// Notes a cell of the first decision by a measured state in it.
    fn seed(
        &self,
        measured: State,
        f: Interval,
        (parent, tick): (u32, u32),
        tally: &mut Outcome,
        out: &mut Watched,
    ) {
        let grid = &self.table.header().grid;
        let cell = grid.quantise(measured);
        let index = cell.and_then(|cell| grid.index(cell));
        let (next, step) = self.ask(measured);
        let known = index.is_some_and(|index| out.seen.contains(index));
        if next == PhaseState::INITIAL || (known && step != Decision::Outside) {
            return;
        }
        let at = PathStep {
            tick,
            phase: next.phase,
            level: next.level,
            cell: cell.map(|cell| cell.0),
            set: f,
        };
        let trace = out.traces.push(Some(parent), at);
        match (index, step) {
            (Some(index), Decision::Level(_)) => {
                out.seen.insert(index);
                out.seeds.insert(index, trace);
            }
            _ => {
                let what = "no law has an entry for the state in which No control ends";
                tally.violate(Violation::Uncovered, what, trace, &out.traces);
            }
        }
    }
}

fn count(cells: &Cells) -> u64 {
    (0..STATES)
        .map(|d| u64::from(cells.high[d] - cells.low[d]) + 1)
        .product()
}

fn each(cells: &Cells, mut call: impl FnMut(Cell)) {
    for p in cells.low[3]..=cells.high[3] {
        for l in cells.low[2]..=cells.high[2] {
            for g in cells.low[1]..=cells.high[1] {
                for f in cells.low[0]..=cells.high[0] {
                    call(Cell([f, g, l, p]));
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
