//! The firmware's own control loop against the plant, from the bytes of a table.
//!
//! Time goes in ticks of the table. At each tick the state is measured (floored to micro-units, as the device stores
//! it), the firmware answers, and the plant takes exact steps until the next tick. With an actuation delay the command
//! acts later; a delay that is no whole number of ticks splits each tick in two.

use std::collections::VecDeque;

use firmware::control_loop::ControlLoop;
use firmware::observer::{Observer, ObserverConfig, ObserverError};
use firmware::table::TableView;
use firmware::units::{MICRO, State};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::monitor::{Knot, Monitor};
use super::propagator::Propagator;
use super::scenario::Scenario;
use super::trajectory::{PhaseSpan, Run, Sample, extend_phases};
use crate::plant::{GridPlant, STATES};
use crate::spec::Spec;

/// How the firmware comes to know the grid state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// It is told (the paper's assumption).
    FullState,
    /// It reconstructs g, l and p from f.
    Observer,
}

/// Why the loop cannot run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LoopError {
    /// The table's plant has a time constant that the observer cannot follow at its tick.
    #[error("the observer cannot be made: {0:?}")]
    Observer(ObserverError),
}

/// A state as the device stores it.
pub fn measured(x: &[f64; STATES]) -> State {
    // Saturates far outside every grid.
    State(x.map(|value| (value * f64::from(MICRO)).floor() as i32))
}

/// Propagators of a tick that is split by the delay.
struct Steps {
    /// Part of a tick in which the older command still acts, and the steps through both parts.
    early: Option<Propagator>,
    late: Option<Propagator>,
    early_s: f64,
}

impl Steps {
    fn new(plant: &GridPlant, tick_s: f64, remainder_s: f64) -> Self {
        let part = |time_s: f64| (time_s > 0.0).then(|| Propagator::new(plant, time_s));
        Self {
            early: part(remainder_s),
            late: part(tick_s - remainder_s),
            early_s: remainder_s,
        }
    }
}

/// Runs the firmware on a table against a spec's plant.
///
/// # Errors
/// A plant that the observer cannot follow, if it is asked for.
pub fn simulate(
    spec: &Spec,
    table: &TableView<'_>,
    scenario: &Scenario,
    estimator: Estimator,
) -> Result<Run, LoopError> {
    let plant = GridPlant::new(spec);
    let tick_s = f64::from(table.header().tick_ms) / 1000.0;
    let whole = (scenario.delay_s / tick_s + 1e-9).floor();
    // What is left after whole ticks; rounding dust counts as none.
    let remainder_s = (scenario.delay_s - whole * tick_s).max(0.0);
    let remainder_s = if remainder_s < 1e-9 { 0.0 } else { remainder_s };
    let steps = Steps::new(&plant, tick_s, remainder_s);
    let mut observer = match estimator {
        Estimator::FullState => None,
        Estimator::Observer => {
            let parameters = &table.header().plant;
            let config = ObserverConfig::new(parameters, table.header().tick_ms)
                .map_err(LoopError::Observer)?;
            let f_uhz = measured(&scenario.initial).frequency_uhz();
            Some(Observer::at_rest(config, parameters, f_uhz))
        }
    };
    let mut firmware = ControlLoop::with_table(Ok(table.clone()));
    let mut random = Pcg64::seed_from_u64(scenario.seed);
    let mut draw = || {
        if scenario.participation_error == 0.0 {
            0.0
        } else {
            random.random_range(-scenario.participation_error..=scenario.participation_error)
        }
    };
    let mut monitor = Monitor::new(spec);
    let mut phases: Vec<PhaseSpan> = Vec::new();
    let ticks = (scenario.duration_s / tick_s).ceil().max(1.0) as usize;
    let mut samples = Vec::with_capacity(ticks + 1);
    // Commands on their way: `whole` ticks old at the front, plus one for the part of a tick.
    let mut pending: VecDeque<f64> = VecDeque::from(vec![0.0; whole as usize + 1]);
    let mut x = scenario.initial;
    let net = |u: f64| plant.fleet * u - scenario.loss_gw;
    for tick in 0..=ticks {
        let time_s = tick as f64 * tick_s;
        let state = measured(&x);
        let state = match &mut observer {
            None => state,
            Some(observer) => observer.step(state.frequency_uhz()),
        };
        let action = firmware.step(state);
        let command = f64::from(action.participation.ppm()) / f64::from(MICRO);
        pending.push_back(command);
        let older = pending.pop_front().unwrap_or(0.0);
        let newer = pending.front().copied().unwrap_or(command);
        let error = draw();
        let delivered = |u: f64| (u * (1.0 + error)).clamp(0.0, 1.0);
        monitor.participation(command);
        samples.push(Sample {
            time_s,
            state: x,
            participation: command,
            delivered: delivered(if steps.early.is_some() { older } else { newer }),
        });
        if tick == ticks {
            monitor.knot(knot(&plant, time_s, &x, net(delivered(newer))));
            break;
        }
        extend_phases(&mut phases, action.phase, time_s, time_s + tick_s);
        let mut at = time_s;
        let parts = [
            (&steps.early, older, steps.early_s),
            (&steps.late, newer, tick_s - steps.early_s),
        ];
        for (propagator, u, length_s) in parts {
            let Some(propagator) = propagator else {
                continue;
            };
            let power = net(delivered(u));
            // The slope jumps with the power: each part starts with a knot of its own.
            monitor.knot(knot(&plant, at, &x, power));
            x = propagator.step(&x, power);
            at += length_s;
            monitor.knot(knot(&plant, at, &x, power));
        }
    }
    Ok(Run {
        samples,
        phases,
        summary: monitor.summary(),
    })
}

fn knot(plant: &GridPlant, time_s: f64, x: &[f64; STATES], net_power: f64) -> Knot {
    Knot {
        time_s,
        f: x[0],
        df: plant.derivative(*x, net_power)[0],
    }
}
