//! The falsifier: adversaries that try to break a table, with the firmware's own control loop.
//!
//! It proves nothing, and so it shares nothing with the proof but the equations: a claim that the verifier accepts and
//! the falsifier breaks is a defect of the verifier. Three kinds of trajectory take turns:
//!
//! | kind | chooses |
//! |---|---|
//! | constant | a corner of every range, held |
//! | bang-bang | corners switched at random, at a random pace |
//! | resonant | the sign of the net power by a linear functional of the state; the best functional so far is mutated |
//!
//! The search is deterministic in its seed.

use firmware::table::TableView;

use crate::adversaries::{BangBang, Constant, Random, Resonant};
use crate::closed_loop::{Model, micro};
use crate::replay::{Adversary, Breach, Replay};
use crate::witness::real_path;
use crate::{RealPath, VerifyError};
use model::spec::Spec;
use serde::Serialize;

/// Length of a trajectory without a horizon \[s\]: several periods of the slow oscillation (28 s for the paper's plant).
const TRAJECTORY_S: f64 = 120.0;

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Falsification {
    /// Control steps (ticks) simulated.
    pub steps: u64,
    /// Trajectories simulated.
    pub trajectories: u64,
    /// Smallest distance from breaking a claim \[Hz\]: f above containment, and inside I2 under Hold; at ticks.
    pub smallest_margin_hz: f64,
    /// A trajectory that breaks a claim.
    pub violation: Option<RealPath>,
}

/// Searches for a trajectory that breaks a claim, for at least so many control steps or until one is found.
///
/// # Errors
/// A table that the firmware rejects.
pub fn falsify(
    bytes: &[u8],
    spec: &Spec,
    steps: u64,
    seed: u64,
) -> Result<Falsification, VerifyError> {
    let table = TableView::parse(bytes).map_err(VerifyError::Table)?;
    let model = Model::new(&table, spec);
    let settle = (spec.requirements.settle_within_s / model.tick_s).floor() as u32;
    let inner = spec.requirements.inner_hz.map(|hz| micro(hz).mid());
    let search = Search {
        replay: Replay::new(&table, &model, inner, settle),
        ticks: {
            let length_s = spec.requirements.horizon_s.unwrap_or(TRAJECTORY_S);
            (length_s / model.tick_s).ceil() as u32
        },
    };
    Ok(search.run(steps, seed))
}

struct Search<'a> {
    replay: Replay<'a>,
    ticks: u32,
}

/// One trajectory's outcome.
struct Outcome {
    steps: u64,
    margin: f64,
    breach: Option<Breach>,
}

impl Search<'_> {
    fn run(&self, steps: u64, seed: u64) -> Falsification {
        let mut out = Falsification {
            steps: 0,
            trajectories: 0,
            smallest_margin_hz: f64::INFINITY,
            violation: None,
        };
        let mut random = Random::new(seed);
        let mut best: Option<(f64, Resonant)> = None;
        while out.steps < steps {
            let draw = random.next();
            let kind = out.trajectories % 4;
            let resonant = match &best {
                // Every other resonant trajectory starts from the best so far.
                Some((_, best)) if kind == 3 => best.mutated(draw),
                _ => Resonant::new(draw),
            };
            let make = || -> Box<dyn Adversary> {
                match kind {
                    0 => Box::new(constant(draw)),
                    1 => Box::new(bang_bang(draw)),
                    _ => Box::new(resonant.clone()),
                }
            };
            let outcome = self.outcome(make().as_mut());
            out.steps += outcome.steps;
            out.trajectories += 1;
            out.smallest_margin_hz = out.smallest_margin_hz.min(outcome.margin / 1e6);
            if kind >= 2
                && best
                    .as_ref()
                    .is_none_or(|(margin, _)| outcome.margin < *margin)
            {
                best = Some((outcome.margin, resonant.clone()));
            }
            if let Some(breach) = outcome.breach {
                let mut samples = Vec::new();
                self.replay.run(make().as_mut(), self.ticks, &mut |sample| {
                    samples.push(*sample);
                });
                let name = format!("kind {kind} of trajectory, draw {draw}");
                out.violation = Some(real_path(breach, &samples, &name));
                break;
            }
        }
        out
    }

    fn outcome(&self, adversary: &mut dyn Adversary) -> Outcome {
        let mut margin = f64::INFINITY;
        let breach = self.replay.run(adversary, self.ticks, &mut |sample| {
            margin = margin.min(self.replay.margin(sample));
        });
        Outcome {
            steps: breach.map_or(u64::from(self.ticks), |breach| u64::from(breach.tick) + 1),
            margin,
            breach,
        }
    }
}

fn constant(draw: u64) -> Constant {
    let mut random = Random::new(draw);
    Constant {
        corner: std::array::from_fn(|_| if random.sign() > 0.0 { 1.0 } else { 0.0 }),
        moment: random.unit(),
        share: random.sign(),
        error: random.sign(),
    }
}

fn bang_bang(draw: u64) -> BangBang {
    let mut random = Random::new(draw);
    // From every tick to every 100 ticks, evenly on a logarithmic scale.
    let hold_ticks = 100f64.powf(random.unit());
    BangBang {
        share: random.sign(),
        random,
        hold_ticks,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::table::Law;
    use synth::game::{Unwatched, Watch};
    use synth::pipeline;
    use synth::synthesis;

    fn small(more: &[&str]) -> Spec {
        let base = [
            "grid={lower=[-0.9,-0.4,-0.2,-0.2],upper=[0.1,3.2,2.0,2.0],width=[0.02,0.2,0.1,0.1],alignment=\"edges\"}",
            "sampling.period_s=2.0",
            "uncertainty.measurement=[0,0,0,0]",
            "uncertainty.participation=0.01",
            "uncertainty.loss_gw=[1.995,2.005]",
        ];
        let all: Vec<String> = base.iter().chain(more).map(|s| (*s).to_owned()).collect();
        Spec::load("gb-bi", &all).unwrap()
    }

    #[test]
    fn a_proven_table_stands_a_broken_one_and_a_wider_spec_fall() {
        let spec = small(&[]);
        let unwatched = |_: &'static str| Box::new(Unwatched) as Box<dyn Watch>;
        let laws = synthesis::synthesise(&spec, &unwatched).unwrap();
        let dense = pipeline::Encoding::Dense;
        let bytes = pipeline::emit(&spec, &laws, dense, &unwatched)
            .unwrap()
            .bytes;
        let stands = falsify(&bytes, &spec, 200_000, 1).unwrap();
        assert_eq!(stands.violation, None);
        assert!(stands.smallest_margin_hz > 0.0 && stands.steps >= 200_000);
        // Far more uncertainty than the kernel was made for.
        let wider = small(&[
            "uncertainty.loss_gw=[1.7,2.3]",
            "uncertainty.participation=0.2",
        ]);
        let falls = falsify(&bytes, &wider, 1_000_000, 1).unwrap();
        assert!(falls.violation.is_some(), "{falls:?}");
        // C1's block emptied: the first decision has no entry.
        let entry = TableView::parse(&bytes).unwrap().header().laws[Law::C1 as usize].unwrap();
        let mut broken = bytes.clone();
        let from = firmware::table::HEADER_LEN + firmware::table::DENSE_HEADER_LEN;
        let to = firmware::table::HEADER_LEN + (entry.domain_len + entry.inputs_len) as usize;
        broken[from..to].fill(0);
        firmware::table::seal(&mut broken).unwrap();
        let falls = falsify(&broken, &spec, 1_000_000, 1).unwrap();
        assert!(falls.violation.unwrap().what.contains("no law"));
        // The same seed gives the same search.
        assert_eq!(
            falsify(&bytes, &spec, 20_000, 7).unwrap(),
            falsify(&bytes, &spec, 20_000, 7).unwrap()
        );
    }
}
