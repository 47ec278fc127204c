//! The frequency that some values of the parameters would have given.
//!
//! Until the first loss the grid rests at the deviation before it, with a constant power that keeps
//! it there. From then on the plant is integrated by the classical Runge-Kutta method in steps that
//! end on every loss; samples between two steps are read off the cubic through both ends and their
//! slopes. With steps of 50 ms the error of a lag of 0.1 s is (h / T)⁵ / 120 = 3e-4 of what it lags
//! by in a step, which for a governor chain is below 10 MW and so below a microhertz. A limit of
//! the governors that begins or ends within a step adds to that, up to some tenths of a millihertz:
//! less than the rounding of a record of 1 mHz, which a test holds.

use model::plant::STATES;
use model::stepper::runge_kutta;

use super::parameters::{LOSS, ONSET, REST, Values, governor, plant};

/// Longest step in the first seconds after a loss, and later \[s\].
const STEP_S: f64 = 0.02;
/// See [`STEP_S`].
const LATE_STEP_S: f64 = 0.05;
/// What counts as the first seconds \[s\].
const FIRST_S: f64 = 8.0;

/// Power and inertia that are lost at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stage {
    /// When \[s after the first\].
    pub after_s: f64,
    /// Lost power \[GW\].
    pub power_gw: f64,
    /// Inertia that goes with it \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
}

/// Deviations \[Hz\] at rising times \[s\]. Without stages one loss of the parameter's size.
pub fn deviations(values: &Values, stages: &[Stage], times_s: &[f64]) -> Vec<f64> {
    let single = [Stage {
        after_s: 0.0,
        power_gw: values[LOSS],
        inertia_gw_s_per_hz: 0.0,
    }];
    let stages = if stages.is_empty() { &single } else { stages };
    let (mut plant, governor) = (plant(values), governor(values));
    let rest = values[REST];
    let output = governor.at_rest(&plant, rest);
    let mut x: [f64; STATES] = [rest, output, output, output];
    // What balances the rest.
    let mut net = plant.damping * rest - output;
    let mut stages = stages.iter().peekable();
    let onset = values[ONSET];
    let mut time = onset;
    let mut lost_at = onset;
    let mut out = Vec::with_capacity(times_s.len());
    let mut wanted = times_s.iter().copied().peekable();
    while wanted.next_if(|at| *at <= onset).is_some() {
        out.push(rest);
    }
    let mut first = None;
    while wanted.peek().is_some() {
        // A stage that rounding puts just after the time is due.
        while let Some(stage) = stages.next_if(|stage| onset + stage.after_s <= time + 1e-9) {
            net -= stage.power_gw;
            lost_at = time;
            first = None;
            plant.inertia -= stage.inertia_gw_s_per_hz;
        }
        let longest = if time - lost_at < FIRST_S {
            STEP_S
        } else {
            LATE_STEP_S
        };
        let end = stages
            .peek()
            .map_or(f64::INFINITY, |stage| onset + stage.after_s)
            .min(time + longest);
        let step = end - time;
        let slope = |x: &[f64; STATES]| governor.derivative(&plant, x, net);
        let begin = first.unwrap_or_else(|| slope(&x));
        let mut next = runge_kutta(&slope, &x, begin, step);
        governor.limit(&mut next);
        let last = slope(&next);
        while let Some(at) = wanted.next_if(|at| *at <= end) {
            let s = (at - time) / step;
            let (from, to) = (x[0], next[0]);
            let (rise, out_slope) = (step * begin[0], step * last[0]);
            let cubic = from
                + s * (rise
                    + s * (3.0 * (to - from) - 2.0 * rise - out_slope
                        + s * (rise + out_slope - 2.0 * (to - from))));
            out.push(cubic);
        }
        // The slope at a step's end is that at the next one's begin, unless something is lost
        // there.
        first = Some(last);
        x = next;
        time = end;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{self, PARAMETERS};
    use super::*;
    use model::governor::Governor;
    use model::plant::Plant;
    use model::stepper::Stepper;

    /// A loss of 1.6 GW on 2H = 8 GW s/Hz without damping and with governors that give next to
    /// nothing (a dead band of 0.2 Hz): -0.2 Hz/s, by hand.
    #[test]
    fn inertia_alone_is_a_straight_line() {
        let mut values = PARAMETERS.map(|p| p.value(0.5));
        values[parameters::INERTIA] = 4.0;
        values[parameters::DAMPING] = 0.0;
        values[parameters::DEADBAND] = 0.2;
        values[ONSET] = 0.3;
        values[REST] = 0.01;
        let stages = [Stage {
            after_s: 0.0,
            power_gw: 1.6,
            inertia_gw_s_per_hz: 0.0,
        }];
        let times = [0.0, 0.3, 0.8, 1.05, 1.25];
        let found = deviations(&values, &stages, &times);
        for (f, by_hand) in found.iter().zip([0.01, 0.01, -0.09, -0.14, -0.18]) {
            assert!((f - by_hand).abs() < 1e-12, "{found:?}");
        }
    }

    /// Against the laboratory's own stepper, in steps of 10 ms: two losses, all limits in force.
    /// The limits begin and end within steps of up to 50 ms here. What is asked for is less than
    /// what a record is off by itself, whose resolution is 1 mHz: 1 mHz / √12 r.m.s.
    #[test]
    fn it_is_the_course_of_the_laboratory() {
        let mut values = PARAMETERS.map(|p| p.value(0.4));
        values[parameters::INERTIA] = 3.0;
        values[parameters::GAIN] = -6.0;
        values[parameters::DEADBAND] = 0.02;
        values[parameters::RATE] = 0.3;
        values[parameters::UPPER] = 0.9;
        values[ONSET] = 0.0;
        values[REST] = 0.0;
        let stage = |after_s, power_gw| Stage {
            after_s,
            power_gw,
            inertia_gw_s_per_hz: 0.0,
        };
        let stages = [stage(0.0, 0.8), stage(10.0, 0.5)];
        let times: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.1).collect();
        let found = deviations(&values, &stages, &times);
        let (plant, governor): (Plant, Governor) = (plant(&values), governor(&values));
        let step = Stepper::new(&plant, governor, 0.1);
        let mut x = [0.0; STATES];
        for (k, f) in found.iter().enumerate() {
            assert!((x[0] - f).abs() < 0.001 / 12f64.sqrt(), "{k}: {} {f}", x[0]);
            x = step.step(&x, if k < 100 { -0.8 } else { -1.3 });
        }
    }
}
