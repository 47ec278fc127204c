//! The search against a whole fleet: chargers, losses and a plant that are drawn, and an adversary
//! who chooses what the fleet delivers at every moment.
//!
//! Of each trajectory are drawn: the inertia, governor gain and damping from the spec's bands (half
//! of them at an end), the loss by its profile, the initial state, the crowd, and a strategy:
//!
//! | strategy | the greatest response |
//! |---|---|
//! | pump | while f rises, the least while it falls |
//! | late | while f falls, the least while it rises |
//! | low, high | never, always |
//! | bang-bang | for half of a period |
//! | functional | by the sign of a linear functional of the state; the best so far is mutated |
//!
//! Every response lies within what the crowd's own chargers can give, and the error of
//! participation goes the same way. A hostile share of the fleet gives all where the response is
//! to be the greatest and nothing where it is to be the least; the crowd stands for the others. So
//! each trajectory is one of a real fleet.

use firmware::table::TableView;
use model::governor::Governor;
use model::spec::{LossProfile, Spec};
use model::stepper::Stepper;
use model::verdict::{ClaimName, RealPath};
use rayon::prelude::*;

use super::adversaries::Random;
use super::crowd::{Answers, Crowd, CrowdTimes, PARTS, fewest_members};
use super::draw::{Draw, MEMBERS_MOST};
use super::found::Falsification;
use super::judge::Judge;
use super::readers::SharedCrowd;

/// Fewest chargers of a crowd.
const MEMBERS_LEAST: u64 = 8;
/// Length of a trajectory \[s\]: twice the time to settle, and the steps of a loss before it.
const TRAJECTORY_S: f64 = 150.0;
/// Time for which the chargers watch the grid at rest \[s\].
const QUIET_S: f64 = 5.0;
/// Trajectories that are run side by side; the best of them is the next ones' model.
const BATCH: u64 = 64;
/// The same where plants are sampled, and how many are side by side.
const SAMPLED_MEMBERS: (u64, u64) = (1, 4);
/// See [`SAMPLED_MEMBERS`].
const SAMPLED_BATCH: u64 = 512;
/// Length of a trajectory beyond the last step of its loss, where a spec's time to settle is short
/// \[s\].
const BEYOND_S: f64 = 20.0;

/// How a trajectory ended.
struct Outcome {
    ticks: u64,
    margin_hz: f64,
    breach: Option<(ClaimName, f64)>,
    frequency: Vec<[f64; 2]>,
}

/// A table on a spec's fleets.
pub(super) struct Fleets<'a> {
    table: &'a TableView<'a>,
    spec: &'a Spec,
    tick_s: f64,
    times: CrowdTimes,
    /// Fewest chargers of a crowd in the search for the worst, and where plants are sampled.
    fewest: [u64; 2],
}

impl<'a> Fleets<'a> {
    /// Fleets of a spec.
    pub(super) fn new(table: &'a TableView<'a>, spec: &'a Spec) -> Self {
        let tick_s = f64::from(table.header().tick_ms) / 1000.0;
        let parts = |s: f64| s * PARTS as f64 / tick_s;
        let [least, most] = spec.command_delay_s();
        let [lag_ms, _] = spec.meter.lag_ms();
        // Inwards: a trajectory must be one that the spec allows.
        let (least, most) = (parts(least) - 1e-9, parts(most) + 1e-9);
        let least = least.ceil().max(0.0) as usize;
        // Where the proof knows the levels, as few as are shifted that evenly.
        let assumed = spec.uncertainty.level_discrepancy;
        let fewest = |least| fewest_members(assumed, least, MEMBERS_MOST);
        Self {
            fewest: [MEMBERS_LEAST, SAMPLED_MEMBERS.0].map(fewest),
            table,
            spec,
            tick_s,
            times: CrowdTimes {
                delay: (least, (most.floor() as usize).max(least)),
                lag: (parts(lag_ms / 1000.0) + 1e-9).ceil() as usize,
            },
        }
    }

    /// Searches for at least so many ticks of a fleet, or until a claim breaks.
    pub(super) fn search(&self, steps: u64, seed: u64) -> Falsification {
        let mut out = Falsification {
            steps: 0,
            trajectories: 0,
            smallest_margin_hz: f64::INFINITY,
            violation: None,
        };
        let mut random = Random::new(seed);
        let mut best: Option<(f64, Draw)> = None;
        while out.steps < steps && out.violation.is_none() {
            let draws: Vec<Draw> = (0..BATCH)
                .map(|index| match &best {
                    // Half of them are near the worst so far.
                    Some((_, best)) if index % 2 == 0 => Draw {
                        strategy: best.strategy.mutated(&mut random),
                        seed: random.number(),
                        ..best.clone()
                    },
                    _ => Draw::new(self.spec, self.fewest[0], random.number()),
                })
                .collect();
            let outcomes: Vec<Outcome> =
                draws.par_iter().map(|draw| self.run(draw, false)).collect();
            for (draw, outcome) in draws.iter().zip(outcomes) {
                out.steps += outcome.ticks;
                out.trajectories += 1;
                out.smallest_margin_hz = out.smallest_margin_hz.min(outcome.margin_hz);
                if best
                    .as_ref()
                    .is_none_or(|(margin, _)| outcome.margin_hz < *margin)
                {
                    best = Some((outcome.margin_hz, draw.clone()));
                }
                if outcome.breach.is_some() && out.violation.is_none() {
                    out.violation = self.path(draw);
                }
            }
        }
        out
    }

    /// Runs so many trajectories, each drawn anew and none near another, or until a claim breaks:
    /// what a fleet within the spec's bands does, rather than the worst that is found. Crowds are
    /// small ([`SAMPLED_MEMBERS`]), for what counts here is the number of plants, losses and
    /// states; a crowd of one is a fleet whose chargers all err alike, the worst case of the
    /// bounds.
    pub(super) fn sample(&self, runs: u64, seed: u64) -> Falsification {
        let mut out = Falsification {
            steps: 0,
            trajectories: 0,
            smallest_margin_hz: f64::INFINITY,
            violation: None,
        };
        let mut random = Random::new(seed);
        let least = self.fewest[1];
        let most = least + SAMPLED_MEMBERS.1 - 1;
        while out.trajectories < runs && out.violation.is_none() {
            let count = (runs - out.trajectories).min(SAMPLED_BATCH);
            let draws: Vec<Draw> = (0..count)
                .map(|_| {
                    let draw = Draw::new(self.spec, self.fewest[0], random.number());
                    let members = (least + random.number() % (most - least + 1)) as usize;
                    Draw { members, ..draw }
                })
                .collect();
            let outcomes: Vec<Outcome> =
                draws.par_iter().map(|draw| self.run(draw, false)).collect();
            for (draw, outcome) in draws.iter().zip(outcomes) {
                out.steps += outcome.ticks;
                out.trajectories += 1;
                out.smallest_margin_hz = out.smallest_margin_hz.min(outcome.margin_hz);
                if outcome.breach.is_some() && out.violation.is_none() {
                    out.violation = self.path(draw);
                }
            }
        }
        out
    }

    /// The path of a trajectory that breaks a claim.
    fn path(&self, draw: &Draw) -> Option<RealPath> {
        let outcome = self.run(draw, true);
        let (claim, breach_s) = outcome.breach?;
        let f_hz = outcome.frequency.last().map_or(0.0, |[_, f]| *f);
        Some(RealPath {
            what: format!("{claim}: f = {f_hz:.4} Hz"),
            breach_s,
            first_tick_s: 0.0,
            initial: draw.initial,
            adversary: draw.name(),
            points: Vec::new(),
            frequency: outcome.frequency,
        })
    }

    fn run(&self, draw: &Draw, keep: bool) -> Outcome {
        let (bound, rest) = (self.spec.uncertainty.measurement, draw.initial);
        let (table, members, times) = (self.table, draw.members, self.times);
        match SharedCrowd::draw(table, members, times, bound, rest, draw.seed) {
            Some(crowd) => self.follow(draw, crowd, keep),
            None => {
                let crowd = Crowd::draw(table, members, times, bound, rest, draw.seed);
                self.follow(draw, crowd, keep)
            }
        }
    }

    fn follow(&self, draw: &Draw, mut crowd: impl Answers, keep: bool) -> Outcome {
        let uncertainty = &self.spec.uncertainty;
        let part_s = self.tick_s / PARTS as f64;
        let step = Stepper::new(&draw.plant, Governor::of(self.spec), part_s);
        let (mut x, rest) = (draw.initial, draw.initial);
        for _ in 0..(QUIET_S / self.tick_s).ceil() as usize * PARTS {
            crowd.part(rest);
        }
        let mut judge = Judge::new(self.spec);
        let last_s = draw.losses.last().map_or(0.0, |(at_s, _)| *at_s);
        let length_s = match uncertainty.loss_profile {
            // As long as it takes to settle, and what may leave again.
            LossProfile::Constant | LossProfile::NonDecreasing => {
                TRAJECTORY_S.min(last_s + 2.0 * self.spec.requirements.settle_within_s + BEYOND_S)
            }
            LossProfile::Band => TRAJECTORY_S,
        };
        let parts = (length_s / part_s).round() as usize;
        let mut frequency = Vec::new();
        let mut ticks = 0;
        let [loss_low, loss_high] = uncertainty.loss_gw;
        for part in 0..parts {
            let time_s = part as f64 * part_s;
            if part % PARTS == 0 {
                ticks += 1;
                if keep {
                    frequency.push([time_s, x[0]]);
                }
            }
            let (least, most) = crowd.part(x);
            let stands = draw
                .losses
                .iter()
                .rev()
                .find(|(from_s, _)| *from_s <= time_s);
            let (since_s, loss) = stands.copied().unwrap_or((0.0, loss_low));
            let slope = draw
                .plant
                .derivative(x, draw.plant.fleet * 0.5 * (least + most) - loss)[0];
            let high = draw.strategy.is_high(time_s, &x, slope);
            let (relative, absolute) = (
                uncertainty.participation,
                uncertainty.participation_absolute,
            );
            let hostile = uncertainty.hostile();
            let honest = 1.0 - hostile;
            let given = if high {
                (honest * most * (1.0 + relative) + absolute + hostile).min(1.0)
            } else {
                (honest * least * (1.0 - relative) - absolute).max(0.0)
            };
            let loss = match uncertainty.loss_profile {
                LossProfile::Band if high => loss_low,
                LossProfile::Band => loss_high,
                LossProfile::Constant | LossProfile::NonDecreasing => loss,
            };
            x = step.step(&x, draw.plant.fleet * given - loss);
            if let Some(claim) = judge.judge(time_s + part_s, since_s, x[0]) {
                frequency.push([time_s + part_s, x[0]]);
                return Outcome {
                    ticks,
                    margin_hz: judge.margin_hz,
                    breach: Some((claim, time_s + part_s)),
                    frequency,
                };
            }
        }
        Outcome {
            ticks,
            margin_hz: judge.margin_hz,
            breach: None,
            frequency,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::falsify;
    use super::*;
    use synth::pipeline;

    #[test]
    fn a_loss_beyond_the_fleet_is_found_and_a_small_one_does_no_harm() {
        let load = |loss: &str| {
            let loss = format!("uncertainty.loss_gw={loss}");
            Spec::load("gb-bi", &[loss]).unwrap()
        };
        let small = load("[0, 0.5]");
        let bytes = pipeline::response(&small).unwrap();
        let stands = falsify(&bytes, &small, 20_000, 1).unwrap();
        assert_eq!(stands.violation, None);
        assert!(stands.smallest_margin_hz > 0.0 && stands.steps >= 20_000);
        // 3.5 GW without a response take f to 50 - 3.5 * 0.436 = 48.5 Hz; with all of 1.4 GW at
        // once to 50 - 2.1 * 0.436 = 49.08, which is below 49.5 too.
        let large = load("[0, 3.5]");
        let falls = falsify(&bytes, &large, 1_000_000, 1).unwrap();
        let real = falls.violation.unwrap();
        assert!(real.what.starts_with("containment"), "{real:?}");
        assert!(falls.steps < 1_000_000 && falls.smallest_margin_hz < 0.0);
        // The same seed gives the same search, on any number of threads.
        assert_eq!(
            falsify(&bytes, &small, 20_000, 7),
            falsify(&bytes, &small, 20_000, 7)
        );
    }
}
