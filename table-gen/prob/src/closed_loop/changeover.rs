//! A delay that is a range: for the first part of a period the fleet gives a mixture of two
//! commands.
//!
//! A command of the moment t is followed by some chargers at t + a, by the last at t + b, and any
//! order is possible (`verify`'s changeover says why no third command is in it, for b at most a
//! period). Let the fleet give p⁻ under the old command and p under the new one. In those c = b - a
//! seconds it gives `p + θ(s) (p⁻ - p)`, θ anywhere in \[0, 1\]. Beside p that adds
//!
//! ```text
//! ∫ θ(s) (p⁻ - p) exp(A (τ - s)) b ds, over [0, c]
//! ```
//!
//! to the state at the period's end. θ is not negative, so this is an impulse, `j = (p⁻ - p) ∫ θ
//! ds`, times a vector of the convex hull of exp(A σ) b, σ in [τ - c, τ]; and j is in the hull of 0
//! and `c (p⁻ - p)`. The hull of the vectors is enclosed axis by axis, in the plant's modes. The
//! range of j is cut into pieces no wider than half a bin of the fleet's power held for the period:
//! each piece has one successor in the cover, and which piece it is is the adversary's choice.
//!
//! f is the same way within j times the hull of the frequency's row of exp(A σ) b, σ in [0, τ],
//! beside what it is under p.

use firmware::units::{AXIS_F, STATES};
use model::flow::{Flow, Matrix, Vector, apply, product, tube};
use model::interval::Interval;

use crate::modes::Modes;

/// Longest step in which exp(A s) b is enclosed at once \[s\].
const STEP_S: f64 = 0.01;
/// Slack for the roundings of what a step adds to the radii of a cover.
const SLACK: f64 = 1e-9;

/// How a period begins after a change of the command.
#[derive(Debug, Clone)]
pub(super) struct Changeover {
    /// c \[s\].
    length_s: f64,
    /// What a unit of impulse \[GW s\] adds at the period's end, in the modes.
    at_end: Vector<STATES>,
    /// The same to f, within the period.
    to_f: Interval,
    /// Widest piece of an impulse \[GW s\].
    piece_gw_s: f64,
    first_ticks: u32,
}

/// Hull of exp(A s) b over an interval of times, axis by axis.
fn hull(a: &Matrix<STATES>, b: &Vector<STATES>, from_s: f64, to_s: f64) -> Vector<STATES> {
    let length = (to_s - from_s).max(0.0).next_up();
    let count = (length / STEP_S).ceil().max(1.0);
    // A length that exceeds the exact quotient: the steps then cover the interval.
    let h = (length / count).next_up();
    let (within, step) = (tube(a, h), Flow::over(a, b, h));
    let mut at = Flow::over(a, b, from_s);
    let mut out: Option<Vector<STATES>> = None;
    for _ in 0..count as u32 {
        let here = apply(&product(&within, &at.phi), b);
        out = Some(out.map_or(here, |out| std::array::from_fn(|i| out[i].join(here[i]))));
        at = at.then(&step);
    }
    out.unwrap_or(*b)
}

impl Changeover {
    /// A changeover of so many milliseconds, at the beginning of a period \[s\], for bins of this
    /// width \[GW\].
    pub(super) fn new(
        modes: &Modes,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        length_ms: u32,
        [tick_s, period_s]: [f64; 2],
        bin_gw: f64,
    ) -> Self {
        let length_s = f64::from(length_ms) / 1000.0;
        let (in_modes, driven) = (modes.map(a), modes.vector(b));
        // Both ends are quotients of whole milliseconds: off by less than the step's slack.
        let from_s = (period_s - length_s - 1e-12).max(0.0);
        let first_ticks = (length_s / tick_s - 1e-9).ceil().max(0.0) as u32;
        let first_s = f64::from(first_ticks) * tick_s;
        let positive = hull(a, b, 0.0, first_s + 1e-12)[AXIS_F].low >= 0.0;
        Self {
            length_s,
            at_end: hull(&in_modes, &driven, from_s, period_s + 1e-12),
            to_f: hull(a, b, 0.0, period_s + 1e-12)[AXIS_F],
            piece_gw_s: 0.5 * bin_gw * period_s,
            first_ticks: if positive { first_ticks } else { 0 },
        }
    }

    /// The impulse \[GW s\] of a change between powers \[GW\].
    pub(super) fn impulse(&self, old: Interval, new: Interval) -> Interval {
        Interval::ZERO.join((old - new) * Interval::point(self.length_s))
    }

    /// The first ticks, in which f's answer to an impulse is not negative; none where that is not
    /// known for all of the changeover.
    pub(super) const fn first_ticks(&self) -> u32 {
        self.first_ticks
    }

    /// What an impulse may add to f within the period \[Hz\].
    pub(super) fn to_f(&self, impulse: Interval) -> Interval {
        self.to_f * impulse
    }

    /// What an impulse may add at the period's end, in pieces.
    pub(super) fn pieces(&self, impulse: Interval) -> impl Iterator<Item = Vector<STATES>> {
        let width = impulse.high - impulse.low;
        let count = (width / self.piece_gw_s).ceil().max(1.0);
        let edge = move |i: f64| {
            if i == count {
                impulse.high
            } else {
                impulse.low + width * i / count
            }
        };
        // Neighbours share the very same edge, so no impulse is between them.
        (0..count as u32).map(move |i| {
            let piece = Interval::hull(edge(f64::from(i)), edge(f64::from(i) + 1.0));
            self.at_end.map(|axis| axis * piece)
        })
    }

    /// How far a piece reaches from its middle in each block, for powers of a fleet \[GW\].
    pub(super) fn reach(&self, modes: &Modes, fleet_gw: f64) -> Vec<f64> {
        let impulse = (fleet_gw * self.length_s).next_up();
        let half = 0.5 * self.piece_gw_s;
        let off = self
            .at_end
            .map(|axis| Interval::point(impulse * axis.radius() + half * axis.magnitude() + SLACK));
        let blocks = modes.blocks.iter();
        blocks.map(|block| Modes::length(&off, *block)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::plant::Plant;
    use model::spec::Spec;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    /// A decay with f' = -f + v, and three states of their own that die out: an impulse of j in
    /// the first tenth of a second leaves between e^-1 j and e^-0.9 j at the end of the second.
    #[test]
    fn an_impulse_by_hand() {
        let mut a = [[Interval::ZERO; STATES]; STATES];
        for (i, rate) in [-1.0, -2.0, -3.0, -4.0].into_iter().enumerate() {
            a[i][i] = Interval::point(rate);
        }
        let b = [Interval::ONE; STATES];
        let found = hull(&a, &b, 0.9, 1.0)[0];
        let (low, high) = ((-1.0f64).exp(), (-0.9f64).exp());
        assert!(found.low <= low && found.high >= high);
        // A step of 10 ms is enclosed to (4 · 0.01)².
        assert!(
            found.low > low - 2e-3 && found.high < high + 2e-3,
            "{found:?}"
        );
    }

    /// Mixtures that change at random moments stay within a piece, and f within its bounds.
    #[test]
    fn mixtures_stay_within_the_pieces() {
        let spec = Spec::load("gb-bi-delay", &[]).unwrap();
        let plant = Plant::new(&spec);
        let (a, b) = plant.matrices();
        let modes = Modes::new(&a).unwrap();
        let changeover = Changeover::new(&modes, (&a, &b), 300, [0.1, 1.0], 0.01);
        let fine = Flow::over(&a, &b, 0.001);
        let mut random = Pcg64::seed_from_u64(4);
        let mut unit = || (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
        let mut widest = 0.0f64;
        for _ in 0..60 {
            let (old, new) = (1.4 * unit(), 1.4 * unit());
            let impulse = changeover.impulse(Interval::point(old), Interval::point(new));
            let bounds = changeover.to_f(impulse);
            let switch = (300.0 * unit()) as u32;
            let (mut x, mut j, mut share) = ([0.0; STATES], 0.0, unit());
            for ms in 0..1000 {
                if ms % 7 == 0 {
                    share = if unit() < 0.5 {
                        f64::from(u8::from(ms < switch))
                    } else {
                        unit()
                    };
                }
                // What is delivered beside the new command.
                let beside = if ms < 300 { share * (old - new) } else { 0.0 };
                j += 0.001 * beside;
                x = std::array::from_fn(|i| {
                    let free: f64 = (0..STATES).map(|k| fine.phi[i][k].mid() * x[k]).sum();
                    free + fine.gamma[i].mid() * beside
                });
                // Plain numbers err by far less over a second.
                assert!(bounds.low - 1e-9 <= x[0] && x[0] <= bounds.high + 1e-9);
            }
            let m = modes.vector(&x.map(Interval::point)).map(Interval::mid);
            let held = changeover.pieces(impulse).filter(|piece| {
                (0..STATES).all(|i| piece[i].low - 1e-9 <= m[i] && m[i] <= piece[i].high + 1e-9)
            });
            assert!(held.count() > 0, "{old} {new} {j} {m:?}");
            let reach = changeover.reach(&modes, 1.4);
            for piece in changeover.pieces(impulse) {
                let off = piece.map(|axis| Interval::point(axis.radius()));
                for (block, reach) in modes.blocks.iter().zip(&reach) {
                    widest = widest.max(Modes::length(&off, *block) / reach);
                }
            }
        }
        // Pieces keep to the reach that the cover is made for, and come near it.
        assert!(widest <= 1.0 && widest > 0.5, "{widest}");
    }
}
