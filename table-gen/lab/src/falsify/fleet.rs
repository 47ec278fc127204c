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
use model::plant::{Plant, STATES};
use model::spec::{LossProfile, Spec};
use model::stepper::Stepper;
use model::verdict::{ClaimName, RealPath};
use rayon::prelude::*;

use super::adversaries::{Random, drawn_plant, within};
use super::crowd::{Crowd, CrowdTimes, PARTS, fewest_members};
use super::found::Falsification;

/// Chargers of a crowd, least and most.
const MEMBERS: (u64, u64) = (8, 200);
/// Length of a trajectory \[s\]: twice the time to settle, and the steps of a loss before it.
const TRAJECTORY_S: f64 = 150.0;
/// Latest step of a loss that does not fall \[s\].
const STEPS_UNTIL_S: f64 = 60.0;
/// Most steps of such a loss.
const STEPS_MAX: u64 = 4;
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
/// Distance past a limit that counts \[Hz\]: far above the arithmetic's error.
const MARGIN_HZ: f64 = 1e-6;

/// Who chooses the response.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Strategy {
    Pump,
    Late,
    Low,
    High,
    BangBang {
        period_s: f64,
        phase: f64,
    },
    /// The response is the greatest where `direction · x > level`; 1 Hz weighs as much as 5 GW.
    Functional {
        direction: [f64; STATES],
        level: f64,
    },
}

impl Strategy {
    fn draw(random: &mut Random) -> Self {
        let side = |random: &mut Random| 2.0 * random.unit() - 1.0;
        match random.number() % 8 {
            0 => Self::Pump,
            1 => Self::Late,
            2 => Self::Low,
            3 => Self::High,
            // From 0.2 s to 40 s, evenly on a logarithmic scale.
            4 | 5 => Self::BangBang {
                period_s: 0.2 * 200f64.powf(random.unit()),
                phase: random.unit(),
            },
            _ => Self::Functional {
                direction: std::array::from_fn(|_| side(random)),
                level: side(random),
            },
        }
    }

    /// A neighbour.
    fn mutated(self, random: &mut Random) -> Self {
        let near = |value: f64, random: &mut Random| value + 0.1 * (2.0 * random.unit() - 1.0);
        match self {
            Self::BangBang { period_s, phase } => Self::BangBang {
                period_s: period_s * 1.2f64.powf(2.0 * random.unit() - 1.0),
                phase: near(phase, random),
            },
            Self::Functional { direction, level } => Self::Functional {
                direction: direction.map(|value| near(value, random)),
                level: near(level, random),
            },
            other => other,
        }
    }

    /// Whether the response is the greatest at a moment.
    fn is_high(self, time_s: f64, x: &[f64; STATES], slope: f64) -> bool {
        match self {
            Self::Pump => slope > 0.0,
            Self::Late => slope <= 0.0,
            Self::Low => false,
            Self::High => true,
            Self::BangBang { period_s, phase } => (time_s / period_s + phase).fract() < 0.5,
            Self::Functional { direction, level } => {
                let scaled = 5.0 * direction[0] * x[0]
                    + direction[1] * x[1]
                    + direction[2] * x[2]
                    + direction[3] * x[3];
                scaled > level
            }
        }
    }
}

/// Everything that is drawn for a trajectory.
#[derive(Debug, Clone, PartialEq)]
struct Draw {
    plant: Plant,
    initial: [f64; STATES],
    /// Times \[s\] and sizes of the loss from then on \[GW\].
    losses: Vec<(f64, f64)>,
    strategy: Strategy,
    members: usize,
    seed: u64,
}

impl Draw {
    fn new(spec: &Spec, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let plant = drawn_plant(&mut random, spec);
        let initial = &spec.uncertainty.initial;
        let initial =
            std::array::from_fn(|d| within(&mut random, [initial.lower[d], initial.upper[d]]));
        let losses = losses(spec, &mut random);
        let (least, most) = (fewest(spec, MEMBERS.0), MEMBERS.1);
        Self {
            plant,
            initial,
            losses,
            strategy: Strategy::draw(&mut random),
            members: (least + random.number() % (most - least + 1)) as usize,
            seed: random.number(),
        }
    }

    fn name(&self) -> String {
        format!(
            "{:?} against {} chargers, losses {:?} (s, GW), H = {:.3}, seed {}",
            self.strategy, self.members, self.losses, self.plant.inertia, self.seed
        )
    }
}

/// Fewest chargers within a spec's hypotheses, at least so many.
fn fewest(spec: &Spec, least: u64) -> u64 {
    fewest_members(spec.uncertainty.level_discrepancy, least, MEMBERS.1)
}

/// A loss by the spec's profile.
fn losses(spec: &Spec, random: &mut Random) -> Vec<(f64, f64)> {
    let [low, high] = spec.uncertainty.loss_gw;
    let mut size = |least: f64| match random.number() % 4 {
        0 => least,
        1 => high,
        _ => least + (high - least) * random.unit(),
    };
    let first = (0.0, size(low));
    if spec.uncertainty.loss_profile == LossProfile::Constant {
        return vec![first];
    }
    // A band's adversary moves the loss with the response, see `run`; here are its upward steps.
    let mut out = vec![first];
    let steps = random.number() % STEPS_MAX;
    let mut times: Vec<f64> = (0..steps).map(|_| STEPS_UNTIL_S * random.unit()).collect();
    times.sort_by(f64::total_cmp);
    for time_s in times {
        let least = out.last().map_or(low, |(_, gw)| *gw);
        out.push((time_s, least + (high - least) * random.unit()));
    }
    out
}

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
        Self {
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
                    _ => Draw::new(self.spec, random.number()),
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
        // Where the proof knows the levels, as few as are shifted that evenly.
        let (least, more) = SAMPLED_MEMBERS;
        let least = fewest(self.spec, least);
        let most = least + more - 1;
        while out.trajectories < runs && out.violation.is_none() {
            let count = (runs - out.trajectories).min(SAMPLED_BATCH);
            let draws: Vec<Draw> = (0..count)
                .map(|_| {
                    let draw = Draw::new(self.spec, random.number());
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
        let uncertainty = &self.spec.uncertainty;
        let part_s = self.tick_s / PARTS as f64;
        let step = Stepper::new(&draw.plant, Governor::of(self.spec), part_s);
        let bound = uncertainty.measurement;
        let (mut x, rest) = (draw.initial, draw.initial);
        let mut crowd = Crowd::draw(self.table, draw.members, self.times, bound, rest, draw.seed);
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

/// The claims of a spec about f.
struct Judge<'s> {
    spec: &'s Spec,
    /// When f first left I1, since the loss last rose \[s\].
    left_s: Option<f64>,
    since_s: f64,
    margin_hz: f64,
}

impl<'s> Judge<'s> {
    const fn new(spec: &'s Spec) -> Self {
        Self {
            spec,
            left_s: None,
            since_s: 0.0,
            margin_hz: f64::INFINITY,
        }
    }

    /// Takes f \[Hz\] at a time \[s\], with the time since which the loss stands \[s\]; the claim
    /// that is broken.
    fn judge(&mut self, time_s: f64, since_s: f64, f: f64) -> Option<ClaimName> {
        let requirements = &self.spec.requirements;
        if let Some(limit) = requirements.containment_hz {
            self.margin_hz = self.margin_hz.min(f - limit);
            if f < limit - MARGIN_HZ {
                return Some(ClaimName::Containment);
            }
        }
        if since_s > self.since_s {
            (self.since_s, self.left_s) = (since_s, None);
        }
        let [outer_low, outer_high] = requirements.outer_hz;
        if self.left_s.is_none() && (f < outer_low || f > outer_high) {
            self.left_s = Some(time_s);
        }
        let due_s = self.left_s? + requirements.settle_within_s;
        if !requirements.stay || time_s < due_s {
            return None;
        }
        let [low, high] = requirements.inner_hz;
        self.margin_hz = self.margin_hz.min(f - low).min(high - f);
        let outside = f < low - MARGIN_HZ || f > high + MARGIN_HZ;
        outside.then_some(ClaimName::Settle)
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
