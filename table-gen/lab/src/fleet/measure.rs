//! What a fleet is judged by besides the frequency: how much moves at once, and what comes back.

use std::collections::VecDeque;

use serde::Serialize;

use crate::simulation::NOMINAL_HZ;

/// Time over which a change of the response is measured \[s\].
const CHANGE_OVER_S: f64 = 1.0;

/// Measures of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetMeasures {
    /// Chargers that never respond.
    pub failed: usize,
    /// Largest rise of the response within a second \[GW\].
    pub rise_gw_per_s: f64,
    /// Largest fall of the response within a second \[GW\]: load that comes back at once.
    pub fall_gw_per_s: f64,
    /// Largest share of the fleet that changed its set-point in one tick.
    pub changed_at_once: f64,
    /// Highest frequency after the nadir \[Hz\]: the rebound.
    pub rebound_hz: f64,
    /// Mean number of changes of the set-point of a working charger.
    pub changes_mean: f64,
    /// The most of any charger.
    pub changes_max: u32,
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
    ticks: u64,
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
            ticks: 0,
        }
    }

    /// Takes a tick: response as a share, chargers that changed, deviation \[Hz\].
    pub(super) fn tick(&mut self, given: f64, changed: u32, f: f64) {
        self.ticks += 1;
        for earlier in &self.window {
            self.rise = self.rise.max(given - earlier);
            self.fall = self.fall.max(earlier - given);
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

    /// The measures; `changes` of each working charger, and ticks missed by all of them together.
    pub(super) fn finish(&self, failed: usize, changes: &[u32], missed: u64) -> FleetMeasures {
        let working = changes.len().max(1) as f64;
        let sum: u64 = changes.iter().map(|n| u64::from(*n)).sum();
        FleetMeasures {
            failed,
            rise_gw_per_s: self.rise * self.fleet_gw,
            fall_gw_per_s: self.fall * self.fleet_gw,
            changed_at_once: f64::from(self.changed) / self.instances,
            rebound_hz: NOMINAL_HZ + self.rebound,
            changes_mean: sum as f64 / working,
            changes_max: changes.iter().copied().max().unwrap_or(0),
            missed_share: missed as f64 / (working * self.ticks.max(1) as f64),
        }
    }
}
