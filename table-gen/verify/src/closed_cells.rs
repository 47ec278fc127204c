//! For ever: a closed set of whole cells.
//!
//! Under C1, C2 and Hold a decision depends on the cell alone, so the cells that can be reached at
//! decisions form a graph: from each cell, under the table's own entry, the estimate comes to lie
//! in some box of cells a period later. Where commands act with a delay the cells are those of the
//! prediction, and the bounds of f are those of the period in which the command acts
//! ([`super::estimate_error`]). The graph is explored from the cells in which No control can end.
//! Being closed, it speaks for all times:
//!
//! - every cell has an entry, no box leaves the grid;
//! - within each period the frequency keeps to its bounds ([`super::held_input`]);
//! - Hold leads to Hold only;
//! - and the longest path of C1 and C2 cells is the worst number of periods until Hold
//!   ([`longest_path`]).

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::table::TableView;
use rayon::prelude::*;

use super::cellset::CellSet;
use super::closed_loop::Model;
use super::longest_path::{Edge, Graph};
use super::outcome::{Found, Outcome, Violation, missed_handover, visits};
use super::path::PathStep;
use super::regions::Regions;
use super::successor::successor;
use model::interval::Interval;
use model::plant::STATES;

/// Cells that one task expands.
const TASK_CELLS: usize = 1024;
/// Cells of a layer between two questions whether to go on.
const CHUNK_CELLS: usize = 1 << 18;

/// What expanding some cells found.
#[derive(Default)]
struct Batch {
    new: Vec<u32>,
    edges: Vec<Edge>,
    lookups: u64,
    worst_visits: u16,
    range: Option<Interval>,
    held: Option<Interval>,
    violations: Vec<(Violation, u32, String)>,
}

/// The exploration of cells.
pub(super) struct ClosedCells<'a> {
    pub(super) table: &'a TableView<'a>,
    pub(super) model: &'a Model,
    /// Cells and the real states in which a command that is decided there begins to act.
    pub(super) real: &'a Regions,
    /// Cells and the states from which the way to the next decision is computed.
    pub(super) from: &'a Regions,
    /// I2 \[µHz\]: what Hold must keep to.
    pub(super) inner: Interval,
}

impl ClosedCells<'_> {
    /// Explores from the cells in which No control ends. `seed_path` gives the path of sets to such
    /// a cell.
    pub(super) fn run(
        &self,
        seeds: Vec<u32>,
        seed_path: &dyn Fn(u32) -> Vec<PathStep>,
        tally: &mut Outcome,
        go_on: &dyn Fn(f64) -> bool,
    ) -> Option<u64> {
        let grid = &self.table.header().grid;
        let visited = CellSet::new(grid);
        for seed in &seeds {
            visited.insert(*seed);
        }
        let mut layers = vec![seeds];
        let mut graph = Graph::new(grid);
        let mut count = 0u64;
        while let Some(layer) = layers.last()
            && !layer.is_empty()
        {
            count += layer.len() as u64;
            let mut next = Vec::new();
            let mut failed = Vec::new();
            for chunk in layer.chunks(CHUNK_CELLS) {
                if !go_on(count as f64 / f64::from(grid.cells())) {
                    return None;
                }
                let batches: Vec<Batch> = chunk
                    .par_chunks(TASK_CELLS)
                    .map(|cells| self.expand(cells, &visited))
                    .collect();
                for batch in batches {
                    absorb(tally, &batch);
                    next.extend(batch.new);
                    graph.extend(batch.edges);
                    failed.extend(batch.violations);
                }
            }
            // The order in which threads find cells must not show.
            next.sort_unstable();
            for (kind, cell, what) in failed {
                tally.violations.entry(kind).or_insert_with(|| Found {
                    what,
                    path: self.path(&layers, cell, seed_path),
                });
            }
            layers.push(next);
        }
        self.settle(&graph, &layers, seed_path, tally);
        Some(count)
    }

    fn settle(
        &self,
        graph: &Graph,
        layers: &[Vec<u32>],
        seed_path: &dyn Fn(u32) -> Vec<PathStep>,
        tally: &mut Outcome,
    ) {
        if let Some((cell, _)) = graph.hold_leaves_hold() {
            let what = "Hold leads to a cell that Hold does not cover".to_owned();
            let path = self.path(layers, cell, seed_path);
            tally
                .violations
                .entry(Violation::Left)
                .or_insert(Found { what, path });
        }
        match graph.longest() {
            Ok(longest) => {
                tally.periods_c1 = longest.c1;
                tally.periods_c2 = longest.c2;
                tally.periods = longest.total;
            }
            Err(cell) => {
                let what = "C1 and C2 can go round in cells without ever reaching Hold".to_owned();
                let path = self.path(layers, cell, seed_path);
                tally
                    .violations
                    .entry(Violation::Late)
                    .or_insert(Found { what, path });
            }
        }
    }

    fn expand(&self, cells: &[u32], visited: &CellSet) -> Batch {
        let mut batch = Batch::default();
        for cell in cells {
            self.expand_cell(*cell, visited, &mut batch);
        }
        batch
    }

    fn expand_cell(&self, index: u32, visited: &CellSet, batch: &mut Batch) {
        let grid = &self.table.header().grid;
        let cell = cell_at(grid.count(), index);
        let Some(bounds) = grid.bounds(cell) else {
            return;
        };
        batch.lookups += 1;
        let (worst, exceeded) = visits(self.table, cell);
        batch.worst_visits = batch.worst_visits.max(worst);
        if exceeded {
            let what = "a lookup visits more than the header states".to_owned();
            batch.violations.push((Violation::Visits, index, what));
        }
        // Both cut at the same bands.
        let parts = self.real.within(&bounds).into_iter();
        for ((state, f), (_, from_f)) in parts.zip(self.from.within(&bounds)) {
            let knowledge = &self.model.known;
            let mut real = widened(&bounds, &knowledge.real);
            let mut from = widened(&bounds, &knowledge.before);
            real[firmware::units::AXIS_F] = f;
            from[firmware::units::AXIS_F] = from_f;
            // The level and the run of the decision before do not matter to a decision that finds a
            // law.
            let before = PhaseState {
                phase: Phase::C1,
                level: 0,
                ticks_left: 0,
            };
            let (next, step) = before.step(self.table, state);
            let held = match step {
                Decision::Level(level) => {
                    let drive = self.model.drives.get(usize::from(level)).copied();
                    drive.zip(knowledge.drifts.get(usize::from(level)))
                }
                Decision::Outside => None,
            };
            let Some((drive, drift)) = held.filter(|_| next.phase != Phase::Fixed) else {
                let what = "no law has an entry for a reachable cell".to_owned();
                batch.violations.push((Violation::Uncovered, index, what));
                continue;
            };
            if missed_handover(self.table, next.phase, state) {
                let what = "C1 decides in I1: C2 has no entry where C1 hands over".to_owned();
                batch.violations.push((Violation::Handover, index, what));
            }
            self.bound(index, &real, next.phase, drive, batch);
            match successor(grid, self.model, &from, drift) {
                Some(cells) => {
                    visited.insert_box(&cells, &mut batch.new);
                    batch.edges.push(Edge {
                        from: index,
                        phase: next.phase,
                        to: cells,
                    });
                }
                None => {
                    let what = "the state may leave the table's grid".to_owned();
                    batch.violations.push((Violation::Uncovered, index, what));
                }
            }
        }
    }

    /// Bounds the frequency over the period.
    fn bound(
        &self,
        index: u32,
        real: &[Interval; STATES],
        phase: Phase,
        drive: super::drive::Drive,
        batch: &mut Batch,
    ) {
        // A cell does not know the command before.
        let range = match &self.model.changeover {
            None => self.model.period.frequency(real, drive),
            Some(changeover) => changeover.frequency(real, drive),
        };
        batch.range = Some(batch.range.map_or(range, |all| all.join(range)));
        if self
            .model
            .containment
            .is_some_and(|limit| range.low < limit)
        {
            let what = format!("f may fall to {:.4} Hz", range.low / 1e6);
            batch.violations.push((Violation::Containment, index, what));
        }
        if phase == Phase::Hold {
            batch.held = Some(batch.held.map_or(range, |all| all.join(range)));
            if range.low < self.inner.low || range.high > self.inner.high {
                let what = format!(
                    "f may range from {:.5} to {:.5} Hz within a period of Hold",
                    range.low / 1e6,
                    range.high / 1e6
                );
                batch.violations.push((Violation::Left, index, what));
            }
        }
    }

    /// The path of sets to a cell: backwards through the layers, then the seed's own.
    fn path(
        &self,
        layers: &[Vec<u32>],
        cell: u32,
        seed_path: &dyn Fn(u32) -> Vec<PathStep>,
    ) -> Vec<PathStep> {
        let grid = &self.table.header().grid;
        let mut at = cell;
        let mut back = vec![cell];
        let Some(depth) = layers
            .iter()
            .position(|layer| layer.binary_search(&cell).is_ok())
        else {
            return Vec::new();
        };
        for layer in layers[..depth].iter().rev() {
            let nowhere = CellSet::new(grid);
            let before = layer.par_chunks(TASK_CELLS).find_map_first(|cells| {
                let batch = self.expand(cells, &nowhere);
                let to = cell_at(grid.count(), at).0;
                let hit = |edge: &&Edge| {
                    (0..STATES).all(|d| edge.to.low[d] <= to[d] && to[d] <= edge.to.high[d])
                };
                batch.edges.iter().find(hit).map(|edge| edge.from)
            });
            let Some(before) = before else { break };
            back.push(before);
            at = before;
        }
        back.reverse();
        let mut path = seed_path(at);
        let start = path.last().map_or(0, |step| step.tick);
        for (period, index) in back.iter().enumerate() {
            path.extend(self.step_at(*index, start + period as u32 * self.model.period_ticks));
        }
        path
    }

    fn step_at(&self, index: u32, tick: u32) -> Option<PathStep> {
        let grid = &self.table.header().grid;
        let cell = cell_at(grid.count(), index);
        let bounds = grid.bounds(cell)?;
        let before = PhaseState {
            phase: Phase::C1,
            level: 0,
            ticks_left: 0,
        };
        let (state, _) = *self.real.within(&bounds).first()?;
        let (next, _) = before.step(self.table, state);
        Some(PathStep {
            tick,
            phase: next.phase,
            level: next.level,
            cell: Some(cell.0),
            set: widened(&bounds, &self.model.known.real)[firmware::units::AXIS_F],
        })
    }
}

/// A cell widened by an error.
fn widened(bounds: &[(i32, i32); STATES], error: &[f64; STATES]) -> [Interval; STATES] {
    std::array::from_fn(|d| {
        let (low, high) = (f64::from(bounds[d].0), f64::from(bounds[d].1));
        if error[d] == 0.0 {
            return Interval { low, high };
        }
        Interval {
            low: (low - error[d]).next_down(),
            high: (high + error[d]).next_up(),
        }
    })
}

fn absorb(tally: &mut Outcome, batch: &Batch) {
    tally.lookups += batch.lookups;
    tally.worst_visits = tally.worst_visits.max(batch.worst_visits);
    if let Some(range) = batch.range {
        tally.widen(range);
    }
    if let Some(range) = batch.held {
        tally.held = Some(tally.held.map_or(range, |held| held.join(range)));
    }
}

/// The cell at a position of the dense order.
pub(super) fn cell_at(count: [u16; STATES], mut index: u32) -> firmware::grid::Cell {
    let mut cell = [0u16; STATES];
    for d in 0..STATES {
        cell[d] = (index % u32::from(count[d])) as u16;
        index /= u32::from(count[d]);
    }
    firmware::grid::Cell(cell)
}
