//! What a fleet is judged by besides the frequency: how much moves at once, and what comes back.

use std::collections::VecDeque;

use serde::Serialize;

use super::instance::Counts;
use crate::simulation::NOMINAL_HZ;

/// Time over which a change of the response is measured \[s\].
const CHANGE_OVER_S: f64 = 1.0;
/// Time from which a grid counts as settled \[s\].
const SETTLED_S: f64 = 60.0;

/// Measures of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetMeasures {
    /// Chargers that never respond.
    pub failed: usize,
    /// Chargers that do the opposite of what they are told, or nothing, from the event on.
    pub hostile: usize,
    /// Largest rise of the response within a second \[GW\].
    pub rise_gw_per_s: f64,
    /// Largest fall of the response within a second \[GW\]: load that comes back at once.
    pub fall_gw_per_s: f64,
    /// Largest share of the fleet that changed its set-point in one tick.
    pub changed_at_once: f64,
    /// Highest frequency after the nadir \[Hz\]: the rebound.
    pub rebound_hz: f64,
    /// Largest change of the response within a second from 60 s on, as a share of the fleet.
    pub settled_change: f64,
    /// Mean number of changes of the set-point of a working charger.
    pub changes_mean: f64,
    /// The most of any charger.
    pub changes_max: u32,
    /// Mean number of changes of a working charger's command by 5 % of full scale and more.
    pub changes_per_charger: f64,
    /// The most of any charger.
    pub changes_per_charger_max: u32,
    /// Mean number of operations of a working charger's contactor.
    pub contactor_operations_per_charger: f64,
    /// The most of any charger.
    pub contactor_operations_max: u32,
    /// Time in which the response lay outside of what the proof assumes of a fleet \[s\]; `null`
    /// for a table by games, whose proof knows one participation.
    pub outside_proven_hull_s: Option<f64>,
    /// Farthest distance from it, as a share of the fleet.
    pub outside_proven_hull_by: Option<f64>,
    /// Share of the working chargers' ticks without a reading.
    pub missed_share: f64,
}

/// Meters of a run that goes on.
#[derive(Debug, Clone)]
pub(super) struct Meters {
    window: VecDeque<f64>,
    window_ticks: usize,
    instances: f64,
    fleet_gw: f64,
    rise: f64,
    fall: f64,
    changed: u32,
    lowest: f64,
    rebound: f64,
    settled: f64,
    settled_ticks: u64,
    ticks: u64,
}

/// What is known of a run once it is over.
pub(super) struct Finish<'r> {
    /// Chargers that never respond.
    pub(super) failed: usize,
    /// Chargers that do not do what they are told.
    pub(super) hostile: usize,
    /// Of each working charger.
    pub(super) counts: &'r [Counts],
    /// Ticks without a reading, of all of them together.
    pub(super) missed: u64,
    /// Time outside the proven hull \[s\], and the farthest distance.
    pub(super) outside: Option<(f64, f64)>,
}

impl Meters {
    pub(super) fn new(tick_s: f64, instances: usize, fleet_gw: f64) -> Self {
        let window_ticks = (CHANGE_OVER_S / tick_s).round().max(1.0) as usize;
        Self {
            window: VecDeque::with_capacity(window_ticks + 1),
            window_ticks,
            instances: instances as f64,
            fleet_gw,
            rise: 0.0,
            fall: 0.0,
            changed: 0,
            lowest: f64::INFINITY,
            rebound: f64::NEG_INFINITY,
            settled: 0.0,
            settled_ticks: (SETTLED_S / tick_s).round() as u64,
            ticks: 0,
        }
    }

    /// Takes a tick: response as a share, chargers that changed, deviation \[Hz\].
    pub(super) fn tick(&mut self, given: f64, changed: u32, f: f64) {
        self.ticks += 1;
        for earlier in &self.window {
            self.rise = self.rise.max(given - earlier);
            self.fall = self.fall.max(earlier - given);
            if self.ticks > self.settled_ticks {
                self.settled = self.settled.max((earlier - given).abs());
            }
        }
        if self.window.len() == self.window_ticks {
            self.window.pop_front();
        }
        self.window.push_back(given);
        self.changed = self.changed.max(changed);
        if f < self.lowest {
            self.lowest = f;
            self.rebound = f;
        }
        self.rebound = self.rebound.max(f);
    }

    /// The measures.
    pub(super) fn finish(&self, finish: &Finish<'_>) -> FleetMeasures {
        let working = finish.counts.len().max(1) as f64;
        let of = |count: fn(&Counts) -> u32| {
            let each = finish.counts.iter().map(count);
            let sum: u64 = each.clone().map(u64::from).sum();
            (sum as f64 / working, each.max().unwrap_or(0))
        };
        let (changes_mean, changes_max) = of(|counts| counts.set_points);
        let (changes_per_charger, changes_per_charger_max) = of(|counts| counts.changes);
        let (operations, operations_max) = of(|counts| counts.operations);
        FleetMeasures {
            failed: finish.failed,
            hostile: finish.hostile,
            rise_gw_per_s: self.rise * self.fleet_gw,
            fall_gw_per_s: self.fall * self.fleet_gw,
            changed_at_once: f64::from(self.changed) / self.instances,
            rebound_hz: NOMINAL_HZ + self.rebound,
            settled_change: self.settled,
            changes_mean,
            changes_max,
            changes_per_charger,
            changes_per_charger_max,
            contactor_operations_per_charger: operations,
            contactor_operations_max: operations_max,
            outside_proven_hull_s: finish.outside.map(|(seconds, _)| seconds),
            outside_proven_hull_by: finish.outside.map(|(_, farthest)| farthest),
            missed_share: finish.missed as f64 / (working * self.ticks.max(1) as f64),
        }
    }
}
