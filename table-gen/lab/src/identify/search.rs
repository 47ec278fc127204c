//! Where the fits start: plants drawn at random over all ranges, the best of them by their
//! equation.
//!
//! The governors' chain is driven by the frequency alone, so its output p follows from the record
//! for any governors. With W what was lost until then, the swing equation integrated from the onset
//! on,
//!
//! ```text
//! 2H (f - f_0) + D ∫ (f - f_0) = ∫ (p - p_0) - W
//! ```
//!
//! is linear in H and D: both are solved for, for each draw, and what is left is how well the draw
//! explains the record. That costs a tenth of a fit's one evaluation, and finds the valleys in
//! which fits then go down; rounding and noise of the readings hardly matter in integrals.

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::course::Stage;
use super::fit::Data;
use super::parameters::{
    COUNT, DAMPING, DEADBAND, GAIN, GOVERNOR_TIME, INERTIA, LAG_TIME, LEAD_TIME, LOSS, ONSET, RATE,
    REST, TURBINE_TIME, UPPER, Values, governor, plant,
};
use crate::simulation::chance::unit;

/// Draws.
const DRAWS: usize = 4000;
/// Starts that are kept.
const STARTS: usize = 16;
/// Step of the chain \[s\]: for starts alone.
const STEP_S: f64 = 0.1;
/// Seed of the draws: the same record, the same answer.
const SEED: u64 = 0x1DE7;
/// What is drawn.
const DRAWN: [usize; 9] = [
    GAIN,
    GOVERNOR_TIME,
    TURBINE_TIME,
    LEAD_TIME,
    LAG_TIME,
    DEADBAND,
    RATE,
    UPPER,
    ONSET,
];

/// The best starts, from values of which those that are not free stand.
pub fn starts(data: &Data, base: &Values, free: &[usize]) -> Vec<Values> {
    let signal = Signal::of(data);
    let mut random = Pcg64::seed_from_u64(SEED);
    let mut best: Vec<(f64, Values)> = Vec::with_capacity(STARTS + 1);
    for _ in 0..DRAWS {
        let mut values = *base;
        for index in DRAWN {
            // Drawn whether it is free or not, so that what is given does not change the others.
            let place = unit(&mut random);
            if free.contains(&index) {
                values[index] = data.ranges[index].value(place);
            }
        }
        if free.contains(&REST) {
            values[REST] = signal.before(values[ONSET]);
        }
        let Some(left) = signal.solve(data, &mut values, free) else {
            continue;
        };
        if best.len() < STARTS || best.last().is_some_and(|(worst, _)| left < *worst) {
            let at = best.partition_point(|(other, _)| *other <= left);
            best.insert(at, (left, values));
            best.truncate(STARTS);
        }
    }
    best.into_iter().map(|(_, values)| values).collect()
}

/// The record at even steps.
struct Signal {
    f: Vec<f64>,
}

impl Signal {
    /// Straight lines between the samples.
    fn of(data: &Data) -> Self {
        let end = data.times_s.last().copied().unwrap_or(0.0);
        let count = (end / STEP_S).floor() as usize + 1;
        let mut at = 0;
        let f = (0..count)
            .map(|k| {
                let time = k as f64 * STEP_S;
                while at + 2 < data.times_s.len() && data.times_s[at + 1] < time {
                    at += 1;
                }
                let (from, to) = (data.times_s[at], data.times_s[at + 1]);
                let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
                data.readings_hz[at] + share * (data.readings_hz[at + 1] - data.readings_hz[at])
            })
            .collect();
        Self { f }
    }

    /// Mean deviation before a time.
    fn before(&self, time_s: f64) -> f64 {
        let count = ((time_s / STEP_S) as usize).clamp(1, self.f.len());
        self.f[..count].iter().sum::<f64>() / count as f64
    }

    /// Sets H and D where they are free; mean square of what is left \[Hz²\].
    fn solve(&self, data: &Data, values: &mut Values, free: &[usize]) -> Option<f64> {
        let (plant, governor) = (plant(values), governor(values));
        let rest = values[REST];
        let onset = values[ONSET];
        let output = governor.at_rest(&plant, rest);
        let (mut g, mut l, mut p) = (output, output, output);
        // Sums of squares and products of a = f - f_0, b = ∫ a, c = ∫ (p - p_0) - W.
        let (mut b, mut given) = (0.0, 0.0);
        let [mut aa, mut ab, mut bb, mut ac, mut bc, mut cc] = [0.0; 6];
        let mut count = 0.0;
        for (k, f) in self.f.iter().enumerate() {
            let time = k as f64 * STEP_S;
            if time < onset {
                continue;
            }
            let a = f - rest;
            let c = given - lost(&data.stages, values[LOSS], time - onset);
            aa += a * a;
            ab += a * b;
            bb += b * b;
            ac += a * c;
            bc += b * c;
            cc += c * c;
            count += 1.0;
            b += STEP_S * a;
            given += STEP_S * (p - output);
            let [low, high] = governor.output_gw;
            let rate = governor.rate(&plant, *f, g);
            let lead = (g + plant.lead_time * rate - l) / plant.lag_time;
            // Implicit where a time constant may be as short as the step.
            g = (g + STEP_S * rate).clamp(low, high);
            l += STEP_S * lead;
            let share = STEP_S / plant.turbine_time;
            p = (p + share * l) / (1.0 + share);
        }
        // Least squares of a (2H) + b D = c, each inside its range.
        let inside = |index: usize, value: f64| {
            let range = &data.ranges[index];
            range.value(range.place(value.max(1e-9)))
        };
        let determinant = aa * bb - ab * ab;
        if count < 10.0 || determinant <= 0.0 {
            return None;
        }
        let mut damping = if free.contains(&DAMPING) {
            inside(DAMPING, (aa * bc - ab * ac) / determinant)
        } else {
            values[DAMPING]
        };
        let mut twice = 2.0 * values[INERTIA];
        if free.contains(&INERTIA) {
            twice = 2.0 * inside(INERTIA, 0.5 * (ac - ab * damping) / aa);
            if free.contains(&DAMPING) {
                damping = inside(DAMPING, (bc - ab * twice) / bb);
            }
        }
        (values[INERTIA], values[DAMPING]) = (0.5 * twice, damping);
        let left = twice * twice * aa + damping * damping * bb + cc + 2.0 * twice * damping * ab
            - 2.0 * twice * ac
            - 2.0 * damping * bc;
        Some(left / (twice * twice * count))
    }
}

/// Energy that was lost until a time after the onset \[GW s\].
fn lost(stages: &[Stage], single_gw: f64, after_s: f64) -> f64 {
    if stages.is_empty() {
        return single_gw * after_s;
    }
    let stages = stages.iter();
    stages
        .map(|s| s.power_gw * (after_s - s.after_s).max(0.0))
        .sum()
}

const _: () = assert!(
    DRAWN.len() + 4 == COUNT,
    "all but H, D, the loss and the rest are drawn"
);
