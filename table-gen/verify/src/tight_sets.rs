//! Forward exploration in time with tight sets, over a horizon.
//!
//! A node is a tick, the phase machine's state and a tight set. At a tick the set is cut into the
//! regions on which the machine decides alike; each part then flies for as long as the input is
//! held: a tick in No control and Fixed, a period in C1, C2 and Hold. Nothing is rounded to cells.
//! Where a layer grows past a limit, parts of one region and one decision are merged into a box.
//!
//! Where commands act with a delay, a set after the trigger is that of the real states in which the
//! tick's command begins to act: at the trigger the set flies over the delay with nothing acting,
//! and from then on what is decided on lies within the prediction's error of it
//! ([`super::estimate_error`]). Where the delay is a range, that moment is the earliest; the set
//! then flies under the old and the new command first ([`super::changeover`]).

use std::collections::{BTreeMap, HashMap, HashSet};

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::TableView;
use firmware::units::State;

use super::changeover::mixed;
use super::closed_loop::Model;
use super::drive::Drive;
use super::first_tick;
use super::held_input::Linear;
use super::outcome::{Outcome, Violation, missed_handover};
use super::path::{PathStep, Traces};
use super::regions::{Part, Regions};
use super::zonotope::Zonotope;
use model::interval::Interval;
use model::plant::STATES;

/// Most parts of a layer before they are merged.
const LAYER_MAX: usize = 4096;
/// Most nodes of an exploration: a bound on time and memory.
const NODES_MAX: usize = 4_000_000;

/// How long the present excursion lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Age {
    /// Tick before the one at which I1 (or, from Fixed, I2) was found left; `None` outside an
    /// excursion.
    since: Option<u32>,
    /// Whether I2 has not been reached since the event.
    first: bool,
    c1_run: u32,
    c2_run: u32,
}

/// A set of states at a tick, before the tick's decision.
#[derive(Debug, Clone)]
struct Node {
    trace: u32,
    state: PhaseState,
    age: Age,
    set: Zonotope,
}

/// A part of a node with what the phase machine decided for it.
struct Decided {
    trace: u32,
    was: PhaseState,
    age: Age,
    part: Part,
    next: PhaseState,
    step: Decision,
}

/// The exploration.
pub(super) struct TightSets<'a> {
    table: &'a TableView<'a>,
    model: &'a Model,
    /// The real states by what is measured of them: No control.
    watched: &'a Regions,
    /// The real states in which a command begins to act by what is decided on.
    regions: &'a Regions,
    traces: Traces,
    tally: Outcome,
    cells: HashSet<(Phase, u32)>,
    layers: BTreeMap<u32, Vec<Node>>,
    settle_ticks: u32,
}

/// What an exploration found.
pub(super) struct Explored {
    pub(super) tally: Outcome,
    /// Distinct (phase, cell) pairs in which a decision was made.
    pub(super) cells: u64,
    /// Nodes explored.
    pub(super) nodes: u64,
    /// Most ticks that an excursion lasted which the horizon cut short.
    pub(super) open_ticks: u32,
}

impl<'a> TightSets<'a> {
    /// An exploration from the event.
    pub(super) fn new(
        table: &'a TableView<'a>,
        model: &'a Model,
        [watched, regions]: [&'a Regions; 2],
        settle_ticks: u32,
    ) -> Self {
        Self {
            table,
            model,
            watched,
            regions,
            traces: Traces::default(),
            tally: Outcome::default(),
            cells: HashSet::new(),
            layers: BTreeMap::new(),
            settle_ticks,
        }
    }

    /// Explores every tick up to the horizon; `go_on` is asked after each layer.
    pub(super) fn run(
        mut self,
        horizon_ticks: u32,
        go_on: &dyn Fn(f64) -> bool,
    ) -> Option<Explored> {
        self.begin();
        let mut open_ticks = 0;
        while let Some((tick, nodes)) = self.layers.pop_first() {
            if tick > horizon_ticks {
                for node in &nodes {
                    let late = self.model.delay_ticks();
                    let ran = node
                        .age
                        .since
                        .map_or(0, |since| horizon_ticks - since + late);
                    open_ticks = open_ticks.max(ran);
                }
                continue;
            }
            if !go_on(f64::from(tick) / f64::from(horizon_ticks.max(1))) {
                return None;
            }
            self.layer(tick, nodes);
            if self.traces.len() > NODES_MAX {
                self.tally.limit = Some(format!(
                    "more than {NODES_MAX} sets after {:.1} s",
                    f64::from(tick) * self.model.tick_s
                ));
                break;
            }
        }
        Some(Explored {
            tally: self.tally,
            cells: self.cells.len() as u64,
            nodes: self.traces.len() as u64,
            open_ticks,
        })
    }

    /// From the event to the first tick.
    fn begin(&mut self) {
        let state = PhaseState::INITIAL;
        let drive = self.model.drives[usize::from(state.level)];
        let range = self.model.tick.frequency(&self.model.initial, drive);
        let trace = self.traces.push(None, PathStep::event(range));
        self.tally.flown(self.model, range, trace, &self.traces);
        let age = Age {
            since: None,
            first: true,
            c1_run: 0,
            c2_run: 0,
        };
        let nodes = first_tick::first_tick(self.model)
            .into_iter()
            .map(|set| Node {
                trace,
                state,
                age,
                set,
            })
            .collect();
        self.layers.insert(0, nodes);
    }

    fn layer(&mut self, tick: u32, nodes: Vec<Node>) {
        let mut decided = Vec::new();
        for node in nodes {
            self.decide(tick, &node, &mut decided);
        }
        if decided.len() > LAYER_MAX {
            decided = merged(decided);
        }
        for one in decided {
            self.fly(tick, one);
        }
    }

    /// Cuts a node into parts and asks the phase machine about each.
    fn decide(&mut self, tick: u32, node: &Node, out: &mut Vec<Decided>) {
        let table = self.table;
        let decided = |part: Part, (next, step)| Decided {
            trace: node.trace,
            was: node.state,
            age: node.age,
            part,
            next,
            step,
        };
        let ask = |part: Part| {
            let answer = node.state.step(table, part.representative);
            decided(part, answer)
        };
        if !matches!(node.state.phase, Phase::NoControl | Phase::Fixed) {
            out.extend(self.regions.by_cell(&node.set).into_iter().map(ask));
            return;
        }
        let watching = node.state.phase == Phase::NoControl;
        let regions = if watching { self.watched } else { self.regions };
        for part in regions.by_band(&node.set, node.state.phase) {
            let whole = ask(part.clone());
            if whole.next == node.state {
                out.push(whole);
                continue;
            }
            if !watching || self.model.known.delay.is_none() {
                out.extend(self.regions.by_cell(&part.set).into_iter().map(ask));
                continue;
            }
            let Some(ahead) = self.ahead(tick, node, &part.set) else {
                continue;
            };
            let measured = part.representative;
            out.extend(self.regions.by_cell(&ahead).into_iter().map(|part| {
                let state = part.representative;
                let answer = node.state.step_ahead(table, measured, || state);
                decided(part, answer)
            }));
        }
    }

    /// The states at the trigger a delay later; until then nothing acts, and f is bounded.
    fn ahead(&mut self, tick: u32, node: &Node, set: &Zonotope) -> Option<Zonotope> {
        let delay = self.model.known.delay.as_ref()?;
        let step = PathStep {
            tick,
            phase: node.state.phase,
            level: node.state.level,
            cell: None,
            set: set.hull_f(),
        };
        let trace = self.traces.push(Some(node.trace), step);
        let magnitude = set.magnitude();
        if (0..STATES).any(|d| magnitude[d] > delay.reach[d]) {
            let what =
                "the state in which No control ends is too far outside the grid to predict from";
            self.tally
                .violate(Violation::Uncovered, what, trace, &self.traces);
            return None;
        }
        let none = self.model.drives[usize::from(node.state.level)];
        let range = delay.segment.frequency(set, none);
        self.tally.flown(self.model, range, trace, &self.traces);
        Some(set.after(&delay.segment, none))
    }

    /// Follows a part for as long as its input is held.
    fn fly(&mut self, tick: u32, one: Decided) {
        let cell = self.table.header().grid.quantise(one.part.representative);
        let at = PathStep {
            tick,
            phase: one.next.phase,
            level: one.next.level,
            cell: cell.map(|cell| cell.0),
            set: one.part.set.hull_f(),
        };
        let trace = self.traces.push(Some(one.trace), at);
        let Decision::Level(level) = one.step else {
            let what = "no law has an entry for the state";
            self.tally
                .violate(Violation::Uncovered, what, trace, &self.traces);
            return;
        };
        let Some(drive) = self.model.drives.get(usize::from(level)).copied() else {
            let what = "an entry names a level that does not exist";
            self.tally
                .violate(Violation::Uncovered, what, trace, &self.traces);
            return;
        };
        if one.next != one.was
            && let Some(cell) = cell
            && let Some(index) = self.table.header().grid.index(cell)
        {
            self.cells.insert((one.next.phase, index));
            self.tally.looked_up(self.table, cell, trace, &self.traces);
        }
        if missed_handover(self.table, one.next.phase, one.part.representative) {
            let what = "C1 decides in I1: C2 has no entry where C1 hands over";
            self.tally
                .violate(Violation::Handover, what, trace, &self.traces);
        }
        let age = self.aged(tick, &one, trace);
        let (state, ticks) = run_out(self.table, one.next, one.part.representative);
        let (range, set) = self.flight(&one, ticks, drive);
        self.tally.flown(self.model, range, trace, &self.traces);
        let node = Node {
            trace,
            state,
            age,
            set,
        };
        self.layers.entry(tick + ticks).or_default().push(node);
    }

    /// The frequencies until a part is looked at again, and the set then. A change of the command
    /// that is held for a period begins with a changeover, if there is one.
    fn flight(&mut self, one: &Decided, ticks: u32, drive: Drive) -> (Interval, Zonotope) {
        let (set, model) = (&one.part.set, self.model);
        let before = model.drives.get(usize::from(one.was.level));
        if let (Some(changeover), Some(before)) = (&model.changeover, before)
            && one.was.level != one.next.level
        {
            if ticks != model.period_ticks {
                let what = "a command changes that is not held for a period".to_owned();
                self.tally.limit.get_or_insert(what);
            }
            return changeover.period(set, mixed(*before, drive), drive);
        }
        let segment = model.held(ticks);
        (segment.frequency(set, drive), set.after(segment, drive))
    }

    fn aged(&mut self, tick: u32, one: &Decided, trace: u32) -> Age {
        let mut age = one.age;
        match one.next.phase {
            Phase::C1 | Phase::C2 => {
                // The band was left at some moment of the tick before.
                age.since.get_or_insert(tick.saturating_sub(1));
                let first = one.next.phase == Phase::C1;
                age.c1_run = if first { age.c1_run + 1 } else { 0 };
                age.c2_run = if first { 0 } else { age.c2_run + 1 };
                self.tally.periods_c1 = self.tally.periods_c1.max(age.c1_run);
                self.tally.periods_c2 = self.tally.periods_c2.max(age.c2_run);
            }
            Phase::NoControl => return age,
            Phase::Fixed | Phase::Hold | Phase::Fallback | Phase::Response => {
                if age.first {
                    let ticks = tick + 1 + self.model.delay_ticks();
                    self.tally.event_ticks = self.tally.event_ticks.max(ticks);
                }
                age = Age {
                    since: None,
                    first: false,
                    c1_run: 0,
                    c2_run: 0,
                };
            }
        }
        if let Some(since) = one.age.since {
            // Reached when the tick's command begins to act.
            let ran = tick - since + self.model.delay_ticks();
            self.tally.settle_ticks = self.tally.settle_ticks.max(ran);
            if ran > self.settle_ticks {
                let what = "I2 is not reached in time";
                self.tally
                    .violate(Violation::Late, what, trace, &self.traces);
            }
        }
        age
    }
}

/// Lets the machine run until it next looks at the state: its state then, and the ticks until then.
pub(super) fn run_out(table: &TableView<'_>, state: PhaseState, any: State) -> (PhaseState, u32) {
    let (mut state, mut ticks) = (state, 1);
    while state.ticks_left > 0 {
        state = state.step(table, any).0;
        ticks += 1;
    }
    (state, ticks)
}

/// Merges the parts of one region and one decision into a box, with the worst of their ages.
fn merged(decided: Vec<Decided>) -> Vec<Decided> {
    let mut order: Vec<Decided> = Vec::new();
    let mut at: HashMap<(PhaseState, PhaseState, [i32; 4]), usize> = HashMap::new();
    for one in decided {
        let key = (one.was, one.next, one.part.representative.0);
        match at.get(&key) {
            None => {
                at.insert(key, order.len());
                order.push(one);
            }
            Some(index) => {
                let into = &mut order[*index];
                let hull = into.part.set.hull();
                let other = one.part.set.hull();
                let joined = std::array::from_fn(|d| hull[d].join(other[d]));
                into.part.set = Zonotope::of_box(&joined);
                into.age = Age {
                    since: match (into.age.since, one.age.since) {
                        (Some(a), Some(b)) => Some(a.min(b)),
                        (a, b) => a.or(b),
                    },
                    first: into.age.first || one.age.first,
                    c1_run: into.age.c1_run.max(one.age.c1_run),
                    c2_run: into.age.c2_run.max(one.age.c2_run),
                };
            }
        }
    }
    order
}
