//! A fleet of chargers, each with the whole firmware: its own meter, clock, threshold and faults;
//! the sum of what they give feeds the plant.
//!
//! | module | holds |
//! |---|---|
//! | `config` | how many chargers, and what is wrong with them |
//! | `hardware`, `instance` | one charger: the firmware on its own hardware, and its car |
//! | `chargers` | all of them in time: whose tick it is, and what is under way |
//! | [`hull`] | the response that the proof assumes, and for how long the fleet left it |
//! | [`measure`] | what a fleet is judged by besides the frequency |
//!
//! A tick of the table is cut into ten parts. Each charger ticks in one of them, by its own clock,
//! and sees the frequency of that moment; the power of the fleet is constant over a part, and the
//! plant takes an exact step.
//!
//! The power of the fleet is the spec's whatever the number of instances: each stands for `chargers
//! / instances` of them.

mod chargers;
mod config;
mod hardware;
pub mod hull;
mod instance;
pub mod measure;

use firmware::control_loop::ControlLoop;
use firmware::table::TableView;
use firmware::units::MICRO;

use crate::simulation::closed_loop::{measured, participation};
use crate::simulation::monitor::{Knot, Monitor, Summary};
use crate::simulation::scenario::Scenario;
use chargers::Chargers;
pub use config::FleetConfig;
use config::PARTS;
use hull::{HullConfig, OutsideHull};
use instance::{Instance, Tally};
use measure::{Finish, FleetMeasures, Meters};
use model::governor::Governor;
use model::plant::Plant;
use model::spec::Spec;
use model::stepper::Stepper;

/// Time for which the chargers watch the quiet grid before the event \[s\]: the observer's first
/// guess, wrong by at most five times the meter's error, has decayed by exp(-10 s / T_2) at least.
const QUIET_S: f64 = 10.0;
/// Length of a run unless asked otherwise \[s\].
pub const DURATION_S: f64 = 120.0;
/// Most instances: their memory is below 1 KB each.
pub const INSTANCES_MAX: usize = 5_000_000;

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
///
/// Each charger has its own delay; the scenario's is not used.
pub fn run(
    spec: &Spec,
    table: &TableView<'_>,
    config: &FleetConfig,
    scenario: &Scenario,
    go_on: &dyn Fn() -> bool,
) -> Option<FleetRun> {
    let plant = Plant::new(spec);
    let tick_s = f64::from(table.header().tick_ms) / 1000.0;
    let part_s = tick_s / PARTS as f64;
    let step = Stepper::new(&plant, Governor::of(spec), part_s);
    let mut x = scenario.initial;
    let rest_uhz = measured(&x).frequency_uhz();
    let mut chargers = Chargers::new(spec, table, config, rest_uhz);
    let working = chargers.working();
    let mut outside = hull_config(spec, table).map(|hull| OutsideHull::new(hull, rest_uhz));
    for _ in 0..(QUIET_S / tick_s).ceil() as usize * PARTS {
        let (given, _) = chargers.part(rest_uhz);
        if let Some(outside) = &mut outside {
            outside.part(rest_uhz, given);
        }
    }
    chargers.event();
    if let Some(outside) = &mut outside {
        outside.forget();
    }
    let ticks = (scenario.duration_s / tick_s).ceil().max(1.0) as u32;
    let mut told = ControlLoop::with_table(Ok(table.clone()));
    let mut monitor = Monitor::new(spec);
    let mut meters = Meters::new(tick_s, config.instances, plant.fleet);
    let mut samples = Vec::with_capacity(ticks as usize + 1);
    for tick in 0..=ticks {
        if !go_on() {
            return None;
        }
        let time_s = f64::from(tick) * tick_s;
        let command = participation(&told.step(measured(&x)));
        let before = x[0];
        let mut tally = Tally::default();
        let mut response = 0.0;
        for part in 0..PARTS {
            let f_uhz = measured(&x).frequency_uhz();
            let (given, one) = chargers.part(f_uhz);
            (response, tally) = (given, tally + one);
            if tick == ticks {
                continue;
            }
            if let Some(outside) = &mut outside {
                outside.part(f_uhz, given);
            }
            let net = plant.fleet * given - scenario.loss_gw;
            let from_s = time_s + part as f64 * part_s;
            let knot = |time_s: f64, x: &[f64; 4]| Knot {
                time_s,
                f: x[0],
                df: plant.derivative(*x, net)[0],
            };
            let next = step.step(&x, net);
            monitor.segment(knot(from_s, &x), knot(from_s + part_s, &next));
            x = next;
        }
        let asked = tally.asked_ppm as f64 / (working.max(1) as f64 * 1e6);
        monitor.participation(asked);
        meters.tick(response, tally.changed, before);
        samples.push(FleetSample {
            time_s,
            f: before,
            told: command,
            asked,
            given: response,
        });
    }
    let (counts, missed) = chargers.counts();
    Some(FleetRun {
        samples,
        summary: monitor.summary(),
        measures: meters.finish(&Finish {
            failed: config.instances - working,
            hostile: chargers.hostile(),
            counts: &counts,
            missed,
            outside: outside.map(|outside| (outside.seconds(), outside.farthest)),
        }),
    })
}

/// What the proof of a table assumes of the fleet; `None` for a table by games, whose proof knows
/// one participation.
fn hull_config(spec: &Spec, table: &TableView<'_>) -> Option<HullConfig> {
    let law = table.response()?;
    let uncertainty = &spec.uncertainty;
    Some(HullConfig {
        law,
        tick_ms: table.header().tick_ms,
        meter_uhz: (uncertainty.measurement[0] * f64::from(MICRO)).round() as i32,
        meter_lag_s: spec.meter.lag_ms().map(|ms| ms / 1000.0),
        delay_s: spec.command_delay_s(),
        participation: uncertainty.participation,
        participation_absolute: uncertainty.participation_absolute,
        hostile_share: uncertainty.hostile(),
        mean_step_share: uncertainty.mean_step_share(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use synth::pipeline;

    /// From the event on a tenth of 40 chargers gives the opposite or nothing: within what the
    /// proof assumes where the spec says so, and outside of it where it does not.
    #[test]
    fn hostile_chargers_stay_within_the_share_that_is_assumed() {
        let outside_s = |set: &[String]| {
            let spec = Spec::load("gb-bi", set).unwrap();
            let bytes = pipeline::response(&spec).unwrap();
            let table = TableView::parse(&bytes).unwrap();
            let config = FleetConfig {
                hostile_share: 0.1,
                ..FleetConfig::sound(&spec, 40)
            };
            let scenario = Scenario {
                loss_gw: 0.2,
                duration_s: 20.0,
                ..Scenario::of(&spec)
            };
            let run = run(&spec, &table, &config, &scenario, &|| true).unwrap();
            assert_eq!(run.measures.hostile, 4);
            run.measures.outside_proven_hull_s.unwrap()
        };
        let assumed = ["uncertainty.hostile_share=0.1".to_owned()];
        assert_eq!(outside_s(&assumed), 0.0);
        // A loss of 0.2 GW asks for little; 5 % of the fleet give all, for most of the run.
        assert!(outside_s(&[]) > 10.0);
    }
}
