//! What an exploration counts, and the first violation of each kind that it met.

use std::collections::BTreeMap;

use firmware::grid::Cell;
use firmware::phase::Phase;
use firmware::table::{Law, TableView};
use firmware::units::State;

use super::closed_loop::Model;
use super::path::{PathStep, Traces};
use model::interval::Interval;

/// Ways in which a claim can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Violation {
    /// The frequency may fall below containment.
    Containment,
    /// I2 may not be reached in time, or never.
    Late,
    /// The frequency may leave I2 after it was to stay.
    Left,
    /// A reachable state has no entry.
    Uncovered,
    /// C1 may have to decide where C2 should.
    Handover,
    /// A lookup visits more than the header states.
    Visits,
}

/// A violation by sets: what, and the path of sets that leads there.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) what: String,
    pub(crate) path: Vec<PathStep>,
}

/// Bounds and violations.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outcome {
    /// Lowest frequency bound, between samples too \[µHz\].
    pub(crate) lowest: Option<f64>,
    /// Highest frequency bound, between samples too \[µHz\].
    pub(crate) highest: Option<f64>,
    /// Most consecutive periods in C1.
    pub(crate) periods_c1: u32,
    /// Most consecutive periods in C2.
    pub(crate) periods_c2: u32,
    /// Most periods of C1 and C2 together until Hold, where cells were explored.
    pub(crate) periods: u32,
    /// Most ticks from the last tick inside (I1, or I2 after Fixed) to I2.
    pub(crate) settle_ticks: u32,
    /// Most ticks from the event to the first entry of I2.
    pub(crate) event_ticks: u32,
    /// Lowest and highest frequency while Hold is in force \[µHz\].
    pub(crate) held: Option<Interval>,
    /// Decisions taken.
    pub(crate) lookups: u64,
    /// Most visits of a lookup.
    pub(crate) worst_visits: u16,
    /// The first violation of each kind.
    pub(crate) violations: BTreeMap<Violation, Found>,
    /// Why the exploration is not complete.
    pub(crate) limit: Option<String>,
}

impl Outcome {
    /// Notes a violation, unless one of its kind is known.
    pub(crate) fn violate(&mut self, kind: Violation, what: &str, trace: u32, traces: &Traces) {
        self.violations.entry(kind).or_insert_with(|| Found {
            what: what.to_owned(),
            path: traces.path(trace),
        });
    }

    /// Notes the frequencies of a segment.
    pub(crate) fn flown(&mut self, model: &Model, range: Interval, trace: u32, traces: &Traces) {
        self.widen(range);
        if model.containment.is_some_and(|limit| range.low < limit) {
            let what = format!("f may fall to {:.4} Hz", range.low / 1e6);
            self.violate(Violation::Containment, &what, trace, traces);
        }
    }

    /// Notes frequencies.
    pub(crate) fn widen(&mut self, range: Interval) {
        self.lowest = Some(self.lowest.map_or(range.low, |f| f.min(range.low)));
        self.highest = Some(self.highest.map_or(range.high, |f| f.max(range.high)));
    }

    /// Notes a decision at a cell: every law that the phase machine may have asked is checked.
    pub(crate) fn looked_up(
        &mut self,
        table: &TableView<'_>,
        cell: Cell,
        trace: u32,
        traces: &Traces,
    ) {
        self.lookups += 1;
        let (worst, exceeded) = visits(table, cell);
        self.worst_visits = self.worst_visits.max(worst);
        if exceeded {
            let what = "a lookup visits more than the header states";
            self.violate(Violation::Visits, what, trace, traces);
        }
    }
}

/// Whether C1 decided although f is in I1 and the table has a law for that: C2 does not cover where
/// C1 hands over.
pub(crate) fn missed_handover(table: &TableView<'_>, phase: Phase, measured: State) -> bool {
    phase == Phase::C1 && table.law(Law::C2).is_some() && table.header().outer.contains(measured)
}

/// Most visits of a lookup of any law at a cell, and whether they exceed the header's bound.
pub(crate) fn visits(table: &TableView<'_>, cell: Cell) -> (u16, bool) {
    let (mut worst, mut exceeded) = (0, false);
    for law in Law::ALL {
        let entry = table.header().laws[law as usize];
        if let (Some(view), Some(entry)) = (table.law(law), entry) {
            let visits = view.visits(cell);
            worst = worst.max(visits);
            exceeded |= visits > entry.worst_visits;
        }
    }
    (worst, exceeded)
}
