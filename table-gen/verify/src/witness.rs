//! From "not proven" to "refuted": a search for a real trajectory that breaks a claim as the sets suggest.

use super::adversaries::{BangBang, Constant, Random, Resonant};
use super::closed_loop::Model;
use super::path::phase_name;
use super::replay::{Adversary, Breach, Replay, Sample};
use super::tally::Violation;
use super::verdict::{RealPath, RealPoint};
use firmware::units::AXIS_F;
use model::plant::STATES;

/// Moments of the event that are tried where nothing else is uncertain.
const MOMENTS: u32 = 4000;
/// Trajectories that are tried where much is uncertain.
const TRIES: u64 = 400;
/// Most control ticks of the whole search.
const TICKS_MAX: u64 = 3_000_000;

/// A real trajectory that breaks a claim in this way, if one is found.
pub(crate) fn find(
    replay: &Replay<'_>,
    model: &Model,
    kind: Violation,
    ticks: u32,
) -> Option<RealPath> {
    let tries = TICKS_MAX / u64::from(ticks.max(1));
    if model.is_exact() {
        let count = u64::from(MOMENTS).min(tries.max(1));
        return (0..count).find_map(|n| {
            let make = || -> Box<dyn Adversary> {
                Box::new(Constant {
                    corner: [0.5; STATES],
                    moment: n as f64 / count as f64,
                    share: 0.0,
                    error: 0.0,
                })
            };
            attempt(replay, kind, ticks, &make, "none")
        });
    }
    (0..TRIES.min(tries.max(1))).find_map(|seed| {
        let nominal = || Constant {
            corner: [0.5; STATES],
            moment: seed as f64 / TRIES as f64,
            share: 0.0,
            error: 0.0,
        };
        let constant = || constant(seed);
        let bang = || BangBang {
            random: Random::new(seed),
            hold_ticks: 1.0 + (seed % 64) as f64,
            share: 1.0,
        };
        let resonant = || Resonant::new(seed);
        let run = |make: &dyn Fn() -> Box<dyn Adversary>, name: &str| {
            attempt(replay, kind, ticks, make, name)
        };
        run(&|| Box::new(nominal()), "middle of every range")
            .or_else(|| {
                run(
                    &|| Box::new(constant()),
                    &format!("constant extremes, number {seed}"),
                )
            })
            .or_else(|| {
                run(
                    &|| Box::new(bang()),
                    &format!("random extremes, seed {seed}"),
                )
            })
            .or_else(|| {
                run(
                    &|| Box::new(resonant()),
                    &format!("resonant extremes, seed {seed}"),
                )
            })
    })
}

fn constant(seed: u64) -> Constant {
    let mut random = Random::new(seed);
    let bit = |n: u64| seed >> n & 1 == 1;
    Constant {
        corner: std::array::from_fn(|d| if bit(2 + d as u64) { 1.0 } else { 0.0 }),
        moment: random.unit(),
        share: if bit(0) { 1.0 } else { -1.0 },
        error: if bit(1) { 1.0 } else { -1.0 },
    }
}

/// Runs once to find a breach; once more to record it.
fn attempt(
    replay: &Replay<'_>,
    kind: Violation,
    ticks: u32,
    make: &dyn Fn() -> Box<dyn Adversary>,
    name: &str,
) -> Option<RealPath> {
    let breach = replay.run(make().as_mut(), ticks, &mut |_| {})?;
    if breach.kind != kind {
        return None;
    }
    let mut samples = Vec::new();
    replay.run(make().as_mut(), ticks, &mut |sample| samples.push(*sample));
    Some(real_path(breach, &samples, name))
}

pub(crate) fn real_path(breach: Breach, samples: &[Sample], adversary: &str) -> RealPath {
    let changed = |i: usize| {
        let (before, now) = (&samples[i.max(1) - 1], &samples[i]);
        i == 0 || i + 1 == samples.len() || (before.phase, before.level) != (now.phase, now.level)
    };
    let points = (0..samples.len())
        .filter(|i| changed(*i))
        .map(|i| RealPoint {
            time_s: samples[i].time_s,
            phase: phase_name(samples[i].phase),
            level: samples[i].level,
            state: samples[i].x.map(|v| v / 1e6),
        })
        .collect();
    let f = breach.f / 1e6;
    let what = match breach.kind {
        Violation::Containment => format!("f falls to {f:.4} Hz"),
        Violation::Late => "I2 is not reached in time".to_owned(),
        Violation::Left => format!("f leaves I2 at {f:.4} Hz under Hold"),
        Violation::Uncovered => format!("no law has an entry at f = {f:.4} Hz"),
        Violation::Handover => format!("C1 decides in I1, at f = {f:.4} Hz"),
        Violation::Visits => "a lookup visits too much".to_owned(),
    };
    RealPath {
        what,
        breach_s: breach.time_s,
        first_tick_s: samples.get(1).map_or(0.0, |sample| sample.time_s),
        initial: samples.first().map_or([0.0; 4], |s| s.x.map(|v| v / 1e6)),
        adversary: adversary.to_owned(),
        points,
        frequency: samples
            .iter()
            .map(|sample| [sample.time_s, sample.x[AXIS_F] / 1e6])
            .collect(),
    }
}
