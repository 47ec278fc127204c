//! Adversaries for [`super::replay`]: fixed extremes, random bang-bang, and one that reads the state.

use firmware::phase::PhaseState;

use super::replay::Adversary;
use model::plant::STATES;

/// A small deterministic generator (SplitMix64): the same seed gives the same trajectory everywhere.
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In \[0, 1\).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// -1 or 1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.next() >> 63 == 0 { -1.0 } else { 1.0 }
    }
}

/// Everything constant, at a chosen point of its range.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constant {
    pub(crate) corner: [f64; STATES],
    pub(crate) moment: f64,
    pub(crate) share: f64,
    pub(crate) error: f64,
}

impl Adversary for Constant {
    fn event(&mut self) -> ([f64; STATES], f64) {
        (self.corner, self.moment)
    }

    fn tick(&mut self, _: &[f64; STATES], _: PhaseState) -> (f64, [f64; STATES]) {
        (self.share, [self.error; STATES])
    }
}

/// Corners of all ranges, switched at random.
#[derive(Debug, Clone)]
pub(crate) struct BangBang {
    pub(crate) random: Random,
    /// Mean ticks between switches of the net power.
    pub(crate) hold_ticks: f64,
    pub(crate) share: f64,
}

impl Adversary for BangBang {
    fn event(&mut self) -> ([f64; STATES], f64) {
        let corner = std::array::from_fn(|_| if self.random.sign() > 0.0 { 1.0 } else { 0.0 });
        (corner, self.random.unit())
    }

    fn tick(&mut self, _: &[f64; STATES], _: PhaseState) -> (f64, [f64; STATES]) {
        if self.random.unit() * self.hold_ticks < 1.0 {
            self.share = self.random.sign();
        }
        let error = std::array::from_fn(|_| self.random.sign());
        (self.share, error)
    }
}

/// Worst-case search: a linear functional of the state chooses the sign of the power (resonance with the slow
/// oscillation), the errors push the estimate across cells at random. The parameters can be drawn and mutated.
#[derive(Debug, Clone)]
pub(crate) struct Resonant {
    pub(crate) random: Random,
    pub(crate) corner: [f64; STATES],
    pub(crate) moment: f64,
    pub(crate) direction: [f64; STATES],
    pub(crate) level: f64,
}

impl Resonant {
    pub(crate) fn new(seed: u64) -> Self {
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
    pub(crate) fn mutated(&self, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut out = self.clone();
        let near = |value: f64, random: &mut Random| value + 0.1 * (2.0 * random.unit() - 1.0);
        out.direction = out.direction.map(|value| near(value, &mut random));
        out.level = near(out.level, &mut random);
        out.moment = near(out.moment, &mut random).clamp(0.0, 0.999);
        match random.next() % 6 {
            axis @ 0..=3 => out.corner[axis as usize] = 1.0 - out.corner[axis as usize],
            4 => out.level = 2.0 * random.unit() - 1.0,
            _ => out.moment = random.unit(),
        }
        out.random = random;
        out
    }
}

impl Adversary for Resonant {
    fn event(&mut self) -> ([f64; STATES], f64) {
        (self.corner, self.moment)
    }

    fn tick(&mut self, x: &[f64; STATES], _: PhaseState) -> (f64, [f64; STATES]) {
        // 1 Hz weighs as much as 5 GW: the governor's gain.
        let scaled = 5.0 * self.direction[0] * x[0]
            + self.direction[1] * x[1]
            + self.direction[2] * x[2]
            + self.direction[3] * x[3];
        let share = (scaled - self.level * 1e6).signum();
        let error = std::array::from_fn(|_| self.random.sign());
        (share, error)
    }
}
