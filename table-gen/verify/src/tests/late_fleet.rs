//! A fleet whose chargers follow a command at any moments within a range of delays, on the plant.

use firmware::units::{AXIS_F, State};

use super::Random;
use super::delay::{extreme, fly};
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Parts of a tick in which nobody changes over.
const PARTS: u32 = 10;
/// Most chargers of a fleet.
const CHARGERS_MAX: f64 = 200.0;

/// How a fleet's chargers come by their delays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Style {
    Early,
    Late,
    /// A share of them early, the others late.
    Groups,
    /// Each its own, for good.
    Own,
    /// Each its own, another one in every part of a tick.
    Changing,
    /// All early or all late, changing together at random moments.
    Together,
}

pub(super) const STYLES: [Style; 6] = [
    Style::Early,
    Style::Late,
    Style::Groups,
    Style::Own,
    Style::Changing,
    Style::Together,
];

/// Chargers with delays within `[least, most]`.
pub(super) struct Fleet {
    pub(super) style: Style,
    ends_s: [f64; 2],
    delays_s: Vec<f64>,
}

impl Fleet {
    pub(super) fn new(random: &mut Random, style: Style, ends_s: [f64; 2]) -> Self {
        let chargers = 1 + (random.unit() * CHARGERS_MAX) as usize;
        let share = random.unit();
        let [least, most] = ends_s;
        let delays_s = (0..chargers)
            .map(|_| match style {
                Style::Early => least,
                Style::Late => most,
                Style::Groups if random.unit() < share => least,
                Style::Groups => most,
                _ => least + random.unit() * (most - least),
            })
            .collect();
        Self {
            style,
            ends_s,
            delays_s,
        }
    }

    /// Share of the fleet that follows a command in a part of a tick that begins so long after its
    /// decision. A charger whose delay ends within the part may follow from its beginning, if all
    /// of the part is within the range; one with the most follows from the first part that reaches
    /// past it.
    fn following(&mut self, random: &mut Random, since_s: f64, part_s: f64) -> f64 {
        const ROUNDING_S: f64 = 1e-9;
        let [least, most] = self.ends_s;
        if since_s < least - ROUNDING_S {
            return 0.0;
        }
        if since_s + part_s > most + ROUNDING_S {
            return 1.0;
        }
        match self.style {
            Style::Changing => {
                for delay_s in &mut self.delays_s {
                    *delay_s = least + random.unit() * (most - least);
                }
            }
            Style::Together if random.unit() < 0.3 => {
                let same = if random.sign() > 0.0 { least } else { most };
                self.delays_s.fill(same);
            }
            _ => {}
        }
        let follow = self.delays_s.iter().filter(|delay| **delay <= since_s);
        follow.count() as f64 / self.delays_s.len() as f64
    }
}

/// A loop in mid-event: a command was decided a period ago, and another one is now.
pub(super) struct Run<'a> {
    pub(super) spec: &'a Spec,
    pub(super) plant: Plant,
    pub(super) fleet: Fleet,
    pub(super) x: [f64; STATES],
    /// Errors of participation and loss, in \[-1, 1\], and the mean ticks for which they are kept.
    pub(super) errors: [f64; 2],
    pub(super) pace: f64,
    /// f at the ends of all parts since it was emptied \[µHz\].
    pub(super) f: Vec<f64>,
}

impl Run<'_> {
    pub(super) fn measured(&self, random: &mut Random) -> State {
        let e = self.spec.uncertainty.measurement;
        State(std::array::from_fn(|d| {
            (self.x[d] + e[d] * 1e6 * extreme(random)).floor() as i32
        }))
    }

    /// A tick that begins so long after the decision of `new`; the others still follow `old`.
    pub(super) fn tick(&mut self, random: &mut Random, since_s: f64, [old, new]: [u8; 2]) {
        if random.unit() * self.pace < 1.0 {
            self.errors = [extreme(random), extreme(random)];
        }
        let uncertainty = &self.spec.uncertainty;
        let part_s = f64::from(self.spec.sampling.watch_ms()) / 1000.0 / f64::from(PARTS);
        let delivered = |level: u8| {
            let u = self.spec.input.value(level.into());
            (u * (1.0 + uncertainty.participation * self.errors[0])).min(1.0)
        };
        let [low, high] = uncertainty.loss_gw;
        let loss = 0.5 * (low + high) + 0.5 * (high - low) * self.errors[1];
        for part in 0..PARTS {
            let at_s = since_s + part_s * f64::from(part);
            let share = self.fleet.following(random, at_s, part_s);
            let mean = share * delivered(new) + (1.0 - share) * delivered(old);
            let power = (self.spec.fleet_power_gw() * mean - loss) * 1e6;
            self.f.push(self.x[AXIS_F]);
            self.x = fly(&self.plant, self.x, power, part_s);
            self.f.push(self.x[AXIS_F]);
        }
    }

    pub(super) fn lowest_and_highest(&self) -> (f64, f64) {
        let all = || self.f.iter().copied();
        (
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}
