//! What is drawn of a trajectory against a fleet: plant, loss, state, crowd and strategy.

use model::plant::{Plant, STATES};
use model::spec::{LossProfile, Spec};

use super::adversaries::{Random, draw_times, drawn_plant, within};

/// Most chargers of a crowd.
pub(super) const MEMBERS_MOST: u64 = 200;
/// Latest step of a loss that does not fall \[s\].
const STEPS_UNTIL_S: f64 = 60.0;
/// Most steps of such a loss.
const STEPS_MAX: u64 = 4;

/// Who chooses the response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Strategy {
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
    pub(super) fn mutated(self, random: &mut Random) -> Self {
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
    pub(super) fn is_high(self, time_s: f64, x: &[f64; STATES], slope: f64) -> bool {
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
pub(super) struct Draw {
    pub(super) plant: Plant,
    pub(super) initial: [f64; STATES],
    /// Times \[s\] and sizes of the loss from then on \[GW\].
    pub(super) losses: Vec<(f64, f64)>,
    pub(super) strategy: Strategy,
    pub(super) members: usize,
    pub(super) seed: u64,
}

impl Draw {
    /// Everything by its seed, with at least so many chargers.
    pub(super) fn new(spec: &Spec, least: u64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut plant = drawn_plant(&mut random, spec);
        let initial = &spec.uncertainty.initial;
        let initial =
            std::array::from_fn(|d| within(&mut random, [initial.lower[d], initial.upper[d]]));
        let losses = losses(spec, &mut random);
        let strategy = Strategy::draw(&mut random);
        let members = (least + random.number() % (MEMBERS_MOST - least + 1)) as usize;
        let seed = random.number();
        // Last, so that specs without such bands are drawn as they were.
        draw_times(&mut random, spec, &mut plant);
        Self {
            plant,
            initial,
            losses,
            strategy,
            members,
            seed,
        }
    }

    pub(super) fn name(&self) -> String {
        format!(
            "{:?} against {} chargers, losses {:?} (s, GW), {:?}, seed {}",
            self.strategy, self.members, self.losses, self.plant, self.seed
        )
    }
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
