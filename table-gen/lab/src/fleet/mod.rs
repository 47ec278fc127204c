//! A fleet of chargers, each with the whole firmware: its own meter, clock, threshold and faults; the sum of what they
//! give feeds the plant.
//!
//! A tick of the table is cut into ten parts. Each charger ticks in one of them, by its clock's offset, and sees the
//! frequency of that moment; the power of the fleet is constant over a part, and the plant takes an exact step. Responses
//! are summed as whole ppm, so that the result does not depend on the number of threads. Power follows responses by the scenario's delay, to the
//! nearest part of a tick.
//!
//! The power of the fleet is the spec's whatever the number of instances: each stands for `chargers / instances` of them.

mod hardware;
mod instance;
pub mod measure;

use std::collections::VecDeque;

use firmware::control_loop::ControlLoop;
use firmware::table::TableView;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::simulation::chance::unit;
use crate::simulation::closed_loop::{measured, participation};
use crate::simulation::monitor::{Knot, Monitor, Summary};
use crate::simulation::scenario::Scenario;
use instance::{Instance, Tally};
use measure::{FleetMeasures, Meters};
use model::plant::GridPlant;
use model::propagator::Propagator;
use model::spec::Spec;

/// Parts of a tick.
const PARTS: usize = 10;
/// Time for which the chargers watch the quiet grid before the event \[s\]: the observer's first guess, wrong by at most five
/// times the meter's error, has decayed by exp(-10 s / T_2) at least.
const QUIET_S: f64 = 10.0;
/// Length of a run unless asked otherwise \[s\].
pub const DURATION_S: f64 = 120.0;
/// Most instances: their memory is below 1 KB each.
pub const INSTANCES_MAX: usize = 5_000_000;

/// The fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetConfig {
    /// Instances of the firmware.
    pub instances: usize,
    /// Bound on the error of each charger's frequency meter, drawn anew each tick \[Hz\].
    pub noise_hz: f64,
    /// Share of chargers that never respond, 0..=1.
    pub failed_share: f64,
    /// Outages of a charger's meter in an hour.
    pub outages_per_hour: f64,
    /// Mean length of an outage \[s\].
    pub outage_s: f64,
    /// Whether the chargers' clocks are spread over the tick; otherwise all tick together.
    pub spread_clocks: bool,
    /// Seed of everything that is drawn.
    pub seed: u64,
}

impl FleetConfig {
    /// Meters within 1 mHz, nothing failed, clocks spread.
    pub fn sound(instances: usize) -> Self {
        Self {
            instances,
            noise_hz: 0.001,
            failed_share: 0.0,
            outages_per_hour: 0.0,
            outage_s: 2.0,
            spread_clocks: true,
            seed: 0,
        }
    }
}

/// One tick of the fleet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FleetSample {
    /// Time since the event \[s\].
    pub time_s: f64,
    /// Deviation of the frequency \[Hz\].
    pub f: f64,
    /// What one firmware that is told the true state would ask for.
    pub told: f64,
    /// Mean of what the working chargers ask for.
    pub asked: f64,
    /// Response of the whole fleet, failed chargers included, as a share of its power.
    pub given: f64,
}

/// A run of the fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetRun {
    /// One sample a tick.
    pub samples: Vec<FleetSample>,
    /// What the grid is judged by.
    pub summary: Summary,
    /// What the fleet is judged by.
    pub measures: FleetMeasures,
}

/// Bytes that an instance takes in memory.
pub const fn instance_bytes() -> usize {
    size_of::<Instance<'_>>()
}

/// Runs the fleet on a spec's plant. `go_on` is asked once a tick; `None` if it said no.
pub fn run(
    spec: &Spec,
    table: &TableView<'_>,
    config: &FleetConfig,
    scenario: &Scenario,
    go_on: &dyn Fn() -> bool,
) -> Option<FleetRun> {
    let plant = GridPlant::new(spec);
    let tick_ms = u32::from(table.header().tick_ms);
    let tick_s = f64::from(tick_ms) / 1000.0;
    let part_s = tick_s / PARTS as f64;
    let step = Propagator::new(&plant, part_s);
    let mut slots = build(spec, table, config);
    let working: usize = slots.iter().map(Vec::len).sum();
    let total = config.instances as f64 * 1e6;
    let quiet_ticks = (QUIET_S / tick_s).ceil() as u32;
    for tick in 0..quiet_ticks {
        for slot in &mut slots {
            all(
                slot,
                tick * tick_ms,
                measured(&scenario.initial).frequency_uhz(),
            );
        }
    }
    slots.iter_mut().flatten().for_each(Instance::event);
    let ticks = (scenario.duration_s / tick_s).ceil().max(1.0) as u32;
    let mut told = ControlLoop::with_table(Ok(table.clone()));
    let mut given_of_slot = [0i64; PARTS];
    let late = (scenario.delay_s / part_s).round() as usize;
    let mut under_way: VecDeque<f64> = std::iter::repeat_n(0.0, late).collect();
    let mut x = scenario.initial;
    let mut monitor = Monitor::new(spec);
    let mut meters = Meters::new(tick_s, config.instances, plant.fleet);
    let mut samples = Vec::with_capacity(ticks as usize + 1);
    for tick in 0..=ticks {
        if !go_on() {
            return None;
        }
        let time_s = f64::from(tick) * tick_s;
        let now_ms = (quiet_ticks + tick) * tick_ms;
        let command = participation(&told.step(measured(&x)));
        let before = x[0];
        let mut tally = Tally::default();
        for (part, slot) in slots.iter_mut().enumerate() {
            let one = all(slot, now_ms, measured(&x).frequency_uhz());
            given_of_slot[part] = one.given_ppm;
            tally = tally + one;
            under_way.push_back(given_of_slot.iter().sum::<i64>() as f64 / total);
            let given = under_way.pop_front().unwrap_or(0.0);
            let net = plant.fleet * given - scenario.loss_gw;
            let from_s = time_s + part as f64 * part_s;
            let knot = |time_s: f64, x: &[f64; 4]| Knot {
                time_s,
                f: x[0],
                df: plant.derivative(*x, net)[0],
            };
            if tick < ticks {
                let next = step.step(&x, net);
                monitor.segment(knot(from_s, &x), knot(from_s + part_s, &next));
                x = next;
            }
        }
        let asked = tally.asked_ppm as f64 / (working.max(1) as f64 * 1e6);
        let given = tally.given_ppm as f64 / total;
        monitor.participation(asked);
        meters.tick(given, tally.changed, before);
        samples.push(FleetSample {
            time_s,
            f: before,
            told: command,
            asked,
            given,
        });
    }
    let mut changes: Vec<u32> = Vec::with_capacity(working);
    let mut missed = 0u64;
    for instance in slots.iter_mut().flatten() {
        changes.push(instance.changes);
        missed += u64::from(instance.missed_ticks());
    }
    Some(FleetRun {
        samples,
        summary: monitor.summary(),
        measures: meters.finish(config.instances - working, &changes, missed),
    })
}

/// One tick of all chargers of a slot.
fn all(slot: &mut [Instance<'_>], now_ms: u32, f_uhz: i32) -> Tally {
    slot.par_iter_mut()
        .with_min_len(256)
        .map(|instance| instance.tick(now_ms, f_uhz))
        .reduce(Tally::default, |a, b| a + b)
}

/// The working chargers by the part of the tick in which they tick.
fn build<'t>(spec: &Spec, table: &TableView<'t>, config: &FleetConfig) -> Vec<Vec<Instance<'t>>> {
    let mut random = Pcg64::seed_from_u64(config.seed);
    let mut slots: Vec<Vec<Instance<'t>>> = (0..PARTS).map(|_| Vec::new()).collect();
    let failed = (config.failed_share * config.instances as f64).round() as usize;
    // The failed ones are drawn without replacement: each of the rest fails with probability left / remaining.
    let mut failed_left = failed.min(config.instances);
    for index in 0..config.instances {
        let remaining = config.instances - index;
        let fails = unit(&mut random) * (remaining as f64) < failed_left as f64;
        let slot = (random.next_u64() % PARTS as u64) as usize;
        if fails {
            failed_left -= 1;
            continue;
        }
        let slot = if config.spread_clocks { slot } else { 0 };
        slots[slot].push(Instance::new(spec, table, config, index as u32));
    }
    slots
}
