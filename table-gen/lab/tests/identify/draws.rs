//! Plants, losses and moments drawn at random, the records that they make, and whether the
//! intervals hold them. Shared by the tests and by the example that measures.

use lab::identify::course::Stage;
use lab::identify::parameters::{
    DAMPING, DEADBAND, GAIN, GOVERNOR_TIME, INERTIA, LAG_TIME, LEAD_TIME, LOSS, ONSET, PARAMETERS,
    RATE, REST, TURBINE_TIME, UPPER, Values, governor, plant,
};
use lab::identify::{Identified, Known, UNTIL_S, identify};
use lab::record::{Record, RecordSample};
use model::stepper::Stepper;
use rand::RngExt;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use rayon::prelude::*;

/// Time of a record before its loss \[s\], less a part of a step.
pub(crate) const QUIET_S: f64 = 15.0;
/// And after.
pub(crate) const AFTER_S: f64 = 45.0;
/// Step at which moments are drawn \[s\].
pub(crate) const MOMENT_S: f64 = 0.01;

/// Values near the middle of their ranges, which fall, but not to where no record has been.
pub(crate) fn drawn(rng: &mut Pcg64) -> Values {
    loop {
        let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let mut values = PARAMETERS.map(|p| p.value(0.5));
        values[INERTIA] = between(2.0, 8.0);
        values[GAIN] = -between(3.0, 10.0);
        values[DAMPING] = between(0.3, 2.0);
        values[GOVERNOR_TIME] = between(0.8, 5.0);
        values[TURBINE_TIME] = between(0.2, 1.0);
        values[LEAD_TIME] = between(0.5, 4.0);
        values[LAG_TIME] = between(4.0, 20.0);
        values[DEADBAND] = between(0.0, 0.05);
        values[RATE] = between(0.1, 1.0);
        values[UPPER] = between(0.3, 1.5);
        values[LOSS] = between(0.6, 1.8);
        values[REST] = between(-0.01, 0.01);
        // After the record's begin; a whole number of the steps at which records are made.
        values[ONSET] = QUIET_S + (between(0.0, 1.0) / MOMENT_S).round() * MOMENT_S;
        let lowest = made(&values, 1.0, 0.0)
            .samples
            .iter()
            .map(|s| s.frequency_hz)
            .fold(50.0, f64::min);
        if lowest > 48.6 && lowest < 49.9 {
            return values;
        }
    }
}

/// The record that a grid makes, rounded to `round_hz` (0: not).
pub(crate) fn made(values: &Values, step_s: f64, round_hz: f64) -> Record {
    let (plant, governor) = (plant(values), governor(values));
    let step = Stepper::new(&plant, governor, MOMENT_S);
    let output = governor.at_rest(&plant, values[REST]);
    let mut x = [values[REST], output, output, output];
    let rest_net = plant.damping * values[REST] - output;
    let onset = (values[ONSET] / MOMENT_S).round() as usize;
    let every = (step_s / MOMENT_S).round() as usize;
    let count = ((QUIET_S + AFTER_S) / MOMENT_S).round() as usize;
    let mut samples = Vec::new();
    for k in 0..=count {
        if k % every == 0 {
            let f = 50.0 + x[0];
            let read = if round_hz > 0.0 {
                (f / round_hz).round() * round_hz
            } else {
                f
            };
            samples.push(RecordSample {
                time_s: k as f64 * MOMENT_S,
                frequency_hz: read,
            });
        }
        let lost = if k >= onset { values[LOSS] } else { 0.0 };
        x = step.step(&x, rest_net - lost);
    }
    Record {
        start: "simulated".to_owned(),
        nominal_hz: 50.0,
        step_s,
        samples,
        filled_s: 0.0,
        skipped: Vec::new(),
    }
}

pub(crate) fn one_loss(gw: f64) -> Known {
    Known {
        stages: vec![Stage {
            after_s: 0.0,
            power_gw: gw,
            inertia_gw_s_per_hz: 0.0,
        }],
        given: Vec::new(),
        until_s: UNTIL_S,
    }
}

/// Parameters whose interval does not hold the value that made the record.
pub(crate) fn missed(found: &Identified, values: &Values) -> Vec<String> {
    let truth = |index: usize| match index {
        ONSET => values[ONSET] - found.from_s,
        _ => values[index],
    };
    found
        .parameters
        .iter()
        .enumerate()
        .filter(|(index, it)| !(it.low..=it.high).contains(&truth(*index)))
        .map(|(index, it)| {
            format!(
                "{} {} not in [{}, {}]",
                it.key,
                truth(index),
                it.low,
                it.high
            )
        })
        .collect()
}

/// What a spec says of the time constants, when it is given.
pub(crate) const CHAIN: [usize; 4] = [GOVERNOR_TIME, TURBINE_TIME, LEAD_TIME, LAG_TIME];

/// Of so many draws, those in which every interval holds; the parameters of `given` are told.
pub(crate) fn covered(step_s: f64, first_seed: u64, draws: u64, given: &[usize]) -> usize {
    let held = (0..draws).into_par_iter().filter(|draw| {
        let values = drawn(&mut Pcg64::seed_from_u64(first_seed + draw));
        let record = made(&values, step_s, 0.001);
        let known = Known {
            given: given.iter().map(|index| (*index, values[*index])).collect(),
            ..one_loss(values[LOSS])
        };
        let found = identify(&record, &known).unwrap();
        let missed = missed(&found, &values);
        if !missed.is_empty() {
            println!("seed {}: {missed:?}", first_seed + draw);
        }
        missed.is_empty()
    });
    held.count()
}
