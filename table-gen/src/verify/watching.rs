//! No control: tight sets from the event to the first decision, for tables that then go on for ever in whole cells.

use std::collections::BTreeMap;

use firmware::phase::{PhaseState, Step};
use firmware::table::TableView;

use super::event;
use super::model::Model;
use super::path::{PathStep, Traces};
use super::regions::Regions;
use super::tally::{Tally, Violation};
use super::zonotope::Zonotope;

/// Longest time in No control that is followed \[s\].
const WATCHED_S_MAX: f64 = 600.0;

/// Where No control can end.
pub(super) struct Watched {
    /// The cells of the first decision, each with the trace that leads there.
    pub(super) seeds: BTreeMap<u32, u32>,
    pub(super) traces: Traces,
    /// Last tick, from the first after the event, at which the first decision may come.
    pub(super) last_tick: u32,
}

/// Follows No control until no state is left in it.
pub(super) fn watch(
    table: &TableView<'_>,
    model: &Model,
    regions: &Regions,
    tally: &mut Tally,
) -> Watched {
    let state = PhaseState::INITIAL;
    let mut out = Watched {
        seeds: BTreeMap::new(),
        traces: Traces::default(),
        last_tick: 0,
    };
    let drive = model.drives[usize::from(state.level)];
    let range = model.tick.frequency(&model.initial, drive);
    let root = out.traces.push(None, PathStep::event(range));
    tally.flown(model, range, root, &out.traces);
    let mut sets: Vec<(u32, Zonotope)> = event::first_tick(model)
        .into_iter()
        .map(|set| (root, set))
        .collect();
    let mut tick = 0;
    while !sets.is_empty() {
        if f64::from(tick) * model.tick_s > WATCHED_S_MAX {
            tally.limit = Some(format!(
                "No control may last longer than {WATCHED_S_MAX} s: no closed set was found for it"
            ));
            break;
        }
        let mut staying = Vec::new();
        for (parent, set) in sets {
            for part in regions.by_band(&set, state.phase) {
                let (next, _) = state.step(table, part.representative);
                if next == state {
                    let step = PathStep {
                        tick,
                        phase: state.phase,
                        level: state.level,
                        cell: None,
                        set: part.set.hull_f(),
                    };
                    let trace = out.traces.push(Some(parent), step);
                    let range = model.tick.frequency(&part.set, drive);
                    tally.flown(model, range, trace, &out.traces);
                    staying.push((trace, part.set.after(&model.tick, drive)));
                } else {
                    out.last_tick = tick;
                    decide(table, regions, &part.set, (parent, tick), tally, &mut out);
                }
            }
        }
        sets = staying;
        tick += 1;
    }
    out
}

/// The cells of the first decision.
fn decide(
    table: &TableView<'_>,
    regions: &Regions,
    set: &Zonotope,
    (parent, tick): (u32, u32),
    tally: &mut Tally,
    out: &mut Watched,
) {
    let grid = &table.header().grid;
    for part in regions.by_cell(set) {
        let cell = grid.quantise(part.representative);
        let (next, step) = PhaseState::INITIAL.step(table, part.representative);
        let at = PathStep {
            tick,
            phase: next.phase,
            level: next.level,
            cell: cell.map(|cell| cell.0),
            set: part.set.hull_f(),
        };
        let trace = out.traces.push(Some(parent), at);
        match (cell.and_then(|cell| grid.index(cell)), step) {
            (Some(index), Step::Level(_)) => {
                out.seeds.entry(index).or_insert(trace);
            }
            _ => {
                let what = "no law has an entry for the state in which No control ends";
                tally.violate(Violation::Uncovered, what, trace, &out.traces);
            }
        }
    }
}
