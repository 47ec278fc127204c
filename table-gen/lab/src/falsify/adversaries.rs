//! Adversaries for [`super::trajectory`]: fixed extremes, random bang-bang, and one that reads the
//! state.

use model::plant::{Plant, STATES};
use model::spec::Spec;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::trajectory::Adversary;
use crate::simulation::chance::unit;

/// Draws of a search: the same seed gives the same trajectory everywhere.
#[derive(Debug, Clone)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// The draws of a seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Any number.
    pub fn number(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// In \[0, 1\).
    pub fn unit(&mut self) -> f64 {
        unit(&mut self.0)
    }

    /// -1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.number() >> 63 == 0 { -1.0 } else { 1.0 }
    }
}

/// A number of a range, at an end of it half of the time.
pub(super) fn within(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    match random.number() % 4 {
        0 => low,
        1 => high,
        _ => low + (high - low) * random.unit(),
    }
}

/// A plant whose H, 1/R_eq and D are within a spec's bands.
pub(super) fn drawn_plant(random: &mut Random, spec: &Spec) -> Plant {
    Plant {
        inertia: within(random, spec.inertia_band()),
        governor_gain: within(random, spec.governor_gain_band()),
        damping: within(random, spec.damping_band()),
        ..Plant::new(spec)
    }
}

/// Time constants within a spec's bands.
pub(super) fn draw_times(random: &mut Random, spec: &Spec, plant: &mut Plant) {
    let [governor, turbine, lead, lag] = spec.time_constant_bands();
    plant.governor_time = within(random, governor);
    plant.turbine_time = within(random, turbine);
    plant.lead_time = within(random, lead);
    plant.lag_time = within(random, lag);
}

/// Everything constant, at a chosen point of its range.
#[derive(Debug, Clone, Copy)]
pub struct Constant {
    /// Initial state, as a point of its box: each axis in \[0, 1\].
    pub corner: [f64; STATES],
    /// The event's moment within its tick, in \[0, 1\).
    pub moment: f64,
    /// Net power within its interval, in \[-1, 1\].
    pub share: f64,
    /// The estimate's error within its bound, in \[-1, 1\].
    pub error: f64,
    /// Share of the fleet that answers after the least delay, in \[0, 1\]; the rest after the most.
    pub early: f64,
}

impl Adversary for Constant {
    fn event(&mut self) -> ([f64; STATES], f64) {
        (self.corner, self.moment)
    }

    fn tick(&mut self, _: &[f64; STATES]) -> (f64, [f64; STATES]) {
        (self.share, [self.error; STATES])
    }

    fn early(&mut self, _: &[f64; STATES]) -> f64 {
        self.early
    }
}

/// Corners of all ranges, switched at random.
#[derive(Debug, Clone)]
pub struct BangBang {
    /// Chooses.
    pub random: Random,
    /// Mean ticks between switches of the net power.
    pub hold_ticks: f64,
    /// Net power within its interval, in \[-1, 1\], until the first switch.
    pub share: f64,
    /// Share of the fleet that answers after the least delay, until the first switch.
    pub early: f64,
}

impl Adversary for BangBang {
    fn event(&mut self) -> ([f64; STATES], f64) {
        let corner = std::array::from_fn(|_| if self.random.sign() > 0.0 { 1.0 } else { 0.0 });
        (corner, self.random.unit())
    }

    fn tick(&mut self, _: &[f64; STATES]) -> (f64, [f64; STATES]) {
        if self.random.unit() * self.hold_ticks < 1.0 {
            self.share = self.random.sign();
        }
        let error = std::array::from_fn(|_| self.random.sign());
        (self.share, error)
    }

    fn early(&mut self, _: &[f64; STATES]) -> f64 {
        match self.random.number() % 8 {
            0 => self.early = 0.0,
            1 => self.early = 1.0,
            2 => self.early = self.random.unit(),
            _ => {}
        }
        self.early
    }
}

/// Worst-case search: a linear functional of the state chooses the sign of the power (resonance
/// with the slow oscillation), the errors push the estimate across cells at random. The parameters
/// can be drawn and mutated.
#[derive(Debug, Clone)]
pub struct Resonant {
    random: Random,
    corner: [f64; STATES],
    moment: f64,
    direction: [f64; STATES],
    level: f64,
}

impl Resonant {
    /// All parameters drawn.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self {
            corner: std::array::from_fn(|_| if random.sign() > 0.0 { 1.0 } else { 0.0 }),
            moment: random.unit(),
            direction: std::array::from_fn(|_| 2.0 * random.unit() - 1.0),
            level: 2.0 * random.unit() - 1.0,
            random,
        }
    }

    /// A neighbour: one parameter drawn anew, all others moved a little.
    pub fn mutated(&self, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut out = self.clone();
        let near = |value: f64, random: &mut Random| value + 0.1 * (2.0 * random.unit() - 1.0);
        out.direction = out.direction.map(|value| near(value, &mut random));
        out.level = near(out.level, &mut random);
        out.moment = near(out.moment, &mut random).clamp(0.0, 0.999);
        match random.number() % 6 {
            axis @ 0..=3 => out.corner[axis as usize] = 1.0 - out.corner[axis as usize],
            4 => out.level = 2.0 * random.unit() - 1.0,
            _ => out.moment = random.unit(),
        }
        out.random = random;
        out
    }
}

impl Resonant {
    /// The functional that chooses.
    fn above(&self, x: &[f64; STATES]) -> f64 {
        // 1 Hz weighs as much as 5 GW: the governor's gain.
        let scaled = 5.0 * self.direction[0] * x[0]
            + self.direction[1] * x[1]
            + self.direction[2] * x[2]
            + self.direction[3] * x[3];
        scaled - self.level
    }
}

impl Adversary for Resonant {
    fn event(&mut self) -> ([f64; STATES], f64) {
        (self.corner, self.moment)
    }

    fn tick(&mut self, x: &[f64; STATES]) -> (f64, [f64; STATES]) {
        let share = self.above(x).signum();
        let error = std::array::from_fn(|_| self.random.sign());
        (share, error)
    }

    fn early(&mut self, x: &[f64; STATES]) -> f64 {
        // With the power or against it: a bit of what was drawn once.
        let with = (self.moment * 1024.0) as u64 & 1 == 0;
        if (self.above(x) > 0.0) == with {
            1.0
        } else {
            0.0
        }
    }
}
