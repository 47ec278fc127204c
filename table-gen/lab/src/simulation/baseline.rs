//! The plant with the baseline droop, in continuous time (the paper's Fig. 2, with R_ev in Hz and D
//! the plant's):
//!
//! ```text
//! e = max(-f - deadband, 0) / R_ev        T_ev q' = e - D q
//! u = clamp(q, 0, 1)                      EV power P u
//! ```
//!
//! Five states, with kinks at the dead band and at saturation, by the classical Runge-Kutta method.
//! At 1 ms the local error away from the kinks is about (h / T_ev)⁵ / 120 = 2e-10, and at a kink h²
//! times the change of slope, 1e-6 times a slope in q of at most 1/s: below the printed digits.
//! With a delay the power follows u by a whole number of steps, held over each: it is late by half
//! a step more or less.

use std::collections::VecDeque;

use super::beyond::Disturbances;
use super::beyond::plant::{BeyondPlant, runge_kutta};
use super::monitor::{Knot, Monitor};
use super::scenario::Scenario;
use super::trajectory::{Run, Sample};
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Step of the integration \[s\].
const STEP_S: f64 = 0.001;
/// Steps from one recorded sample to the next.
const STEPS_PER_SAMPLE: usize = 10;

/// Simulates the plant with the baseline, or without any response (`respond` false).
pub fn simulate(spec: &Spec, scenario: &Scenario, respond: bool) -> Run {
    let disturbances = Disturbances::of(spec, scenario.loss_gw);
    simulate_under(spec, &disturbances, scenario, respond)
}

/// The same under any disturbances, which replace the scenario's loss. Losses come at whole
/// milliseconds: on a step's end.
pub fn simulate_under(
    spec: &Spec,
    disturbances: &Disturbances,
    scenario: &Scenario,
    respond: bool,
) -> Run {
    let grid = Plant::new(spec);
    let plant = BeyondPlant::new(grid, disturbances, scenario.duration_s, scenario.seed);
    let baseline = &spec.baseline;
    let lag = baseline.time_s;
    let participation = |q: f64| if respond { q.clamp(0.0, 1.0) } else { 0.0 };
    let steps = (scenario.duration_s / STEP_S).round().max(1.0) as usize;
    let h = scenario.duration_s / steps as f64;
    let [f, g, l, p] = scenario.initial;
    let mut y = [f, g, l, p, 0.0];
    let late = (scenario.delay_s / h).round() as usize;
    let mut under_way: VecDeque<f64> = std::iter::repeat_n(0.0, late).collect();
    let mut monitor = Monitor::new(spec);
    let mut samples = Vec::with_capacity(steps / STEPS_PER_SAMPLE + 2);
    for step in 0..=steps {
        let time_s = h * step as f64;
        let drive = plant.drive(time_s + 0.5 * h);
        under_way.push_back(participation(y[STATES]));
        let acting = under_way.pop_front().unwrap_or(0.0);
        let delivered = |q: f64| if late == 0 { participation(q) } else { acting };
        let derivative = |y: &[f64; STATES + 1]| {
            let x = [y[0], y[1], y[2], y[3]];
            let q = y[STATES];
            let power = grid.fleet * delivered(q);
            let [df, dg, dl, dp] = plant.derivative(&x, &drive, power);
            let e = (-x[0] - baseline.deadband_hz).max(0.0) / baseline.droop_hz;
            [df, dg, dl, dp, (e - grid.damping * q) / lag]
        };
        let slope = derivative(&y);
        let u = participation(y[STATES]);
        monitor.participation(u);
        monitor.knot(Knot {
            time_s,
            f: y[0],
            df: slope[0],
        });
        if step % STEPS_PER_SAMPLE == 0 || step == steps {
            samples.push(Sample {
                time_s,
                state: [y[0], y[1], y[2], y[3]],
                participation: u,
                delivered: delivered(y[STATES]),
            });
        }
        if step < steps {
            y = runge_kutta(&derivative, &y, slope, h);
            let mut x = [y[0], y[1], y[2], y[3]];
            plant.limit(&mut x);
            y[..STATES].copy_from_slice(&x);
        }
    }
    Run {
        samples,
        phases: Vec::new(),
        summary: monitor.summary(),
    }
}
