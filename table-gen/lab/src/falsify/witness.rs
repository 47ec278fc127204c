//! From "not proven" to "refuted": a search for a real trajectory that breaks a claim as the sets
//! suggest.

use firmware::table::{TableError, TableView};
use firmware::units::AXIS_F;
use model::plant::STATES;
use model::spec::Spec;
use model::verdict::{ClaimName, RealPath, RealPoint, Verdict};

use super::adversaries::{BangBang, Constant, Random, Resonant};
use super::trajectory::{Adversary, Breach, Sample, Trajectories};

/// Length of a trajectory \[s\] where the spec asks for ever.
const OPEN_HORIZON_S: f64 = 300.0;
/// Moments of the event that are tried where nothing else is uncertain.
const MOMENTS: u32 = 4000;
/// Trajectories that are tried where much is uncertain.
const TRIES: u64 = 400;
/// Most control ticks of the whole search.
const TICKS_MAX: u64 = 3_000_000;

/// Searches a real trajectory for the failures of a verdict. The first that is refuted so becomes
/// the verdict's counterexample: of several failures, the one with a real trajectory says most.
///
/// # Errors
/// A table that the firmware rejects.
pub fn refute(verdict: &mut Verdict, bytes: &[u8], spec: &Spec) -> Result<(), TableError> {
    let table = TableView::parse(bytes)?;
    let trajectories = Trajectories::new(&table, spec);
    let horizon_s = spec.requirements.horizon_s.unwrap_or(OPEN_HORIZON_S);
    let ticks = (horizon_s / trajectories.tick_s()).ceil() as u32;
    let failures = std::mem::take(&mut verdict.failures);
    let refuted = failures.iter().find_map(|failure| {
        let real = find(&trajectories, spec, failure.claim, ticks)?;
        let mut refuted = failure.clone();
        refuted.real = Some(real);
        Some(refuted)
    });
    verdict.failures = failures;
    if refuted.is_some() {
        verdict.counterexample = refuted;
    }
    Ok(())
}

/// Whether the loop is deterministic but for the moment of the event.
fn is_exact(spec: &Spec) -> bool {
    let uncertainty = &spec.uncertainty;
    let [low, high] = uncertainty.loss_gw;
    low == high
        && uncertainty.participation == 0.0
        && uncertainty.hostile() == 0.0
        && uncertainty.actuation_delay_s.exact_s().is_some()
        && uncertainty.measurement == [0.0; STATES]
        && uncertainty.initial.lower == uncertainty.initial.upper
}

/// A real trajectory that breaks a claim, if one is found.
fn find(
    trajectories: &Trajectories<'_>,
    spec: &Spec,
    claim: ClaimName,
    ticks: u32,
) -> Option<RealPath> {
    let tries = TICKS_MAX / u64::from(ticks.max(1));
    if is_exact(spec) {
        let count = u64::from(MOMENTS).min(tries.max(1));
        return (0..count).find_map(|n| {
            let make = || -> Box<dyn Adversary> {
                Box::new(Constant {
                    corner: [0.5; STATES],
                    moment: n as f64 / count as f64,
                    share: 0.0,
                    error: 0.0,
                    early: 1.0,
                })
            };
            attempt(trajectories, claim, ticks, &make, "none")
        });
    }
    (0..TRIES.min(tries.max(1))).find_map(|seed| {
        let nominal = || Constant {
            corner: [0.5; STATES],
            moment: seed as f64 / TRIES as f64,
            share: 0.0,
            error: 0.0,
            early: 0.5,
        };
        let constant = || constant(seed);
        let bang = || BangBang {
            random: Random::new(seed),
            hold_ticks: 1.0 + (seed % 64) as f64,
            share: 1.0,
            early: 1.0,
        };
        let resonant = || Resonant::new(seed);
        let run = |make: &dyn Fn() -> Box<dyn Adversary>, name: &str| {
            attempt(trajectories, claim, ticks, make, name)
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
        early: if bit(6) { 1.0 } else { 0.0 },
    }
}

/// Runs once to find a breach; once more to record it.
fn attempt(
    trajectories: &Trajectories<'_>,
    claim: ClaimName,
    ticks: u32,
    make: &dyn Fn() -> Box<dyn Adversary>,
    name: &str,
) -> Option<RealPath> {
    let breach = trajectories.run(make().as_mut(), ticks, &mut |_| {})?;
    if breach.claim != claim {
        return None;
    }
    let mut samples = Vec::new();
    trajectories.run(make().as_mut(), ticks, &mut |sample| samples.push(*sample));
    Some(real_path(breach, &samples, name))
}

/// A trajectory for people, from its samples: the event, then every tick.
pub(super) fn real_path(breach: Breach, samples: &[Sample], adversary: &str) -> RealPath {
    let changed = |i: usize| {
        let (before, now) = (&samples[i.max(1) - 1], &samples[i]);
        i == 0 || i + 1 == samples.len() || (before.phase, before.level) != (now.phase, now.level)
    };
    let points = (0..samples.len())
        .filter(|i| changed(*i))
        .map(|i| RealPoint {
            time_s: samples[i].time_s,
            phase: samples[i].phase,
            level: samples[i].level,
            state: samples[i].x,
        })
        .collect();
    let f = breach.f_hz;
    let what = match breach.claim {
        ClaimName::Containment => format!("f falls to {f:.4} Hz"),
        ClaimName::Stay => format!("f leaves I2 at {f:.4} Hz under Hold"),
        ClaimName::Table => format!("no law has an entry at f = {f:.4} Hz"),
        ClaimName::HandOver => format!("C1 decides in I1, at f = {f:.4} Hz"),
        _ => "I2 is not reached in time".to_owned(),
    };
    RealPath {
        what,
        breach_s: breach.time_s,
        first_tick_s: samples.get(1).map_or(0.0, |sample| sample.time_s),
        initial: samples.first().map_or([0.0; STATES], |s| s.x),
        adversary: adversary.to_owned(),
        points,
        frequency: samples
            .iter()
            .map(|sample| [sample.time_s, sample.x[AXIS_F]])
            .collect(),
    }
}
