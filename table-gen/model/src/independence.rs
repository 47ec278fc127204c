//! How far the mean of many chargers that err independently is from what they were told.
//!
//! # Hypothesis
//! Charger i was told the participation `u_i` when it last decided, and gives `X_i` in \[0, 1\]
//! until it decides again: drawn at the decision, with mean `u_i` whatever was drawn before. So a
//! charger that responds in full with probability u, one that is off by a few percent to both
//! sides, one that is sometimes away and makes up for it. Clocks and delays do not depend on the
//! draws. What the mean itself is off by is no matter of chance: it adds to the errors here.
//!
//! # Derivation
//! Let u be the mean of all `u_i`, x that of all `X_i`, N the chargers, ρ and α a relative and an
//! absolute error. For s > 0, since exp is convex,
//!
//! ```text
//! E[exp(s X_i) | what was before] <= 1 + u_i (e^s - 1) <= exp(s (1 + ρ) u_i + c(s))
//! c(s) = max over u in [0, 1] of ln(1 + u (e^s - 1)) - s (1 + ρ) u
//! ```
//!
//! Take the chargers in the order of their last decisions. What one is told may depend on what the
//! ones before it drew (through the frequency), and still the factors multiply: `E exp(s N x - s (1
//! + ρ) N u - N c(s)) <= 1`. So by Markov's inequality, whatever the law told them,
//!
//! ```text
//! P(x > (1 + ρ) u + α) <= exp(-N (s α - c(s)))       for every s > 0
//! P(x < (1 - ρ) u - α) <= exp(-N (s α - d(s)))
//! d(s) = max over u in [0, 1] of ln(1 - u (1 - e^-s)) + s (1 - ρ) u
//! ```
//!
//! The functions under the maxima are concave in u and not above 0 at its ends; their greatest
//! values are `c = ln y - 1 + 1/y` for `y = (e^s - 1) / (s (1 + ρ))` and `d = y - 1 - ln y` for `y
//! = s (1 - ρ) / (1 - e^-s)`, where y > 1, and 0 elsewhere. With ρ = 0 this is Hoeffding's bound,
//! `α = sqrt(L / 2)`; with one u for all it is Chernoff's.
//!
//! x and u change where a charger decides, and only there, so over a time a union over these
//! moments is a bound: N in each tick where every charger has its own clock.
//!
//! # Rounding
//! s is searched with plain numbers, since every s gives a bound; the bound at it is an interval's
//! end. α is rounded up and probabilities of being outside are, too.

use crate::exponential::{exp, ln};
use crate::interval::Interval;
use crate::spec::Spec;

/// Ends of the search for s, and its steps: each shrinks the range by the golden ratio.
const S_RANGE: [f64; 2] = [1e-7, 30.0];
const SEARCH_STEPS: u32 = 90;

/// Chargers that err independently, and the moments of a time at which one of them draws anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crowd {
    /// N.
    pub chargers: u32,
    /// Moments at which the mean may change.
    pub moments: u64,
}

/// The side on which the mean is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Above,
    Below,
}

impl Crowd {
    /// The chargers of a spec over a time \[s\], hostile ones left out: each decides once in a
    /// tick, and once more at both ends of the time.
    #[must_use]
    pub fn of(spec: &Spec, time_s: f64) -> Self {
        let ticks = (time_s / spec.sampling.watch_s).ceil().max(0.0) as u64 + 2;
        let all = spec.fleet.chargers;
        let hostile = (f64::from(all) * spec.uncertainty.hostile()).ceil() as u32;
        let chargers = all.saturating_sub(hostile).max(1);
        Self {
            chargers,
            moments: ticks.saturating_mul(chargers.into()),
        }
    }

    /// Least absolute error that, beside a relative one, covers the mean at all moments with a
    /// probability of `confidence`, below 1. At most 1, where nothing is asked any more.
    #[must_use]
    pub fn absolute_error(&self, relative: f64, confidence: f64) -> f64 {
        let [above, below] = [Side::Above, Side::Below].map(|side| {
            let rate = self.rate(confidence);
            let near = |s: f64| (rate.high + gap(side, s, relative)) / s;
            let s = smallest(&near);
            let s = Interval::point(s);
            ((rate + Interval::point(gap_bound(side, s, relative))) / s).high
        });
        above.max(below).min(1.0)
    }

    /// Upper bound of the probability that the mean is ever outside `u (1 ± relative) ± absolute`,
    /// whatever the law tells.
    #[must_use]
    pub fn outside(&self, relative: f64, absolute: f64) -> f64 {
        if absolute >= 1.0 {
            return 0.0;
        }
        let sides = [Side::Above, Side::Below].map(|side| {
            let near = |s: f64| gap(side, s, relative) - s * absolute;
            let s = Interval::point(smallest(&near));
            let exponent =
                Interval::point(gap_bound(side, s, relative)) - s * Interval::point(absolute);
            self.all(exp(Interval::point(f64::from(self.chargers)) * exponent))
        });
        (Interval::point(sides[0]) + Interval::point(sides[1]))
            .high
            .min(1.0)
    }

    /// The same where all chargers are told u at all moments: Chernoff's bound, which is smaller.
    #[must_use]
    pub fn outside_at(&self, u: f64, relative: f64, absolute: f64) -> f64 {
        let error = relative * u + absolute;
        let sides = [(Side::Above, u + error), (Side::Below, u - error)].map(|(side, at)| {
            // No mean lies outside [0, 1], and at the ends of u there is no chance.
            if !(0.0..=1.0).contains(&at) || u <= 0.0 || u >= 1.0 {
                return 0.0;
            }
            // The best s, in plain numbers; towards an end of [0, 1] it grows without bound.
            let odds = (at * (1.0 - u)) / (u * (1.0 - at)).max(f64::MIN_POSITIVE);
            let s = odds.ln().abs().clamp(S_RANGE[0], S_RANGE[1]);
            let (s, u) = (Interval::point(s), Interval::point(u));
            let error = Interval::point(relative) * u + Interval::point(absolute);
            let (signed, at) = match side {
                Side::Above => (s, u + error),
                Side::Below => (-s, u - error),
            };
            let each = exp(-(signed * at)) * (Interval::ONE + u * (exp(signed) - Interval::ONE));
            self.all(exp(Interval::point(f64::from(self.chargers)) * ln(each)))
        });
        (Interval::point(sides[0]) + Interval::point(sides[1]))
            .high
            .min(1.0)
    }

    /// Of one moment, for all of them; rounded up.
    fn all(&self, one: Interval) -> f64 {
        // Rounding to a double is off by less than one of them.
        let moments = (self.moments as f64).next_up();
        (Interval::point(moments) * one).high.min(1.0)
    }

    /// `ln(2 moments / (1 - confidence)) / N`: what `s α - c(s)` must reach on each side.
    fn rate(&self, confidence: f64) -> Interval {
        let moments = Interval::point((self.moments as f64).next_up());
        let lost = Interval::ONE - Interval::point(confidence);
        ln(Interval::point(2.0) * moments / lost) / Interval::point(f64::from(self.chargers))
    }
}

/// y of the derivation.
fn ratio(side: Side, s: Interval, relative: f64) -> Interval {
    let relative = Interval::point(relative);
    match side {
        Side::Above => (exp(s) - Interval::ONE) / (s * (Interval::ONE + relative)),
        Side::Below => s * (Interval::ONE - relative) / (Interval::ONE - exp(-s)),
    }
}

/// c or d, rounded up. Both rise with y.
fn gap_bound(side: Side, s: Interval, relative: f64) -> f64 {
    let y = Interval::point(ratio(side, s, relative).high);
    if y.high <= 1.0 {
        return 0.0;
    }
    let gap = match side {
        Side::Above => ln(y) - Interval::ONE + Interval::ONE / y,
        Side::Below => y - Interval::ONE - ln(y),
    };
    gap.high.max(0.0)
}

/// The same in plain numbers, for the search.
fn gap(side: Side, s: f64, relative: f64) -> f64 {
    match side {
        Side::Above => {
            let y = (s.exp_m1() / (s * (1.0 + relative))).max(1.0);
            y.ln() - 1.0 + 1.0 / y
        }
        Side::Below => {
            let y = (s * (1.0 - relative) / -(-s).exp_m1()).max(1.0);
            y - 1.0 - y.ln()
        }
    }
}

/// About where a function with one valley is smallest, by golden sections on a logarithmic scale.
fn smallest(of: &dyn Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let [mut low, mut high] = S_RANGE.map(f64::ln);
    for _ in 0..SEARCH_STEPS {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if of(a.exp()) <= of(b.exp()) {
            high = b;
        } else {
            low = a;
        }
    }
    (0.5 * (low + high)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// 25,000 chargers, 120 decisions.
    const FLEET: Crowd = Crowd {
        chargers: 25_000,
        moments: 120,
    };

    /// Computed with another program: Chernoff's bound and a union over 120 decisions.
    #[test]
    fn chernoff_as_computed_elsewhere() {
        for (u, relative, known) in [
            (0.3, 0.05, 3.7e-4),
            (0.3, 0.1, 1.9e-21),
            (0.5, 0.05, 6.4e-12),
        ] {
            let found = FLEET.outside_at(u, relative, 0.0);
            // Two digits are known.
            let off = (found / known - 1.0).abs();
            assert!(off < 0.03, "{u} {relative}: {found:e}, {known:e}");
            // Whatever is told is less likely to be met than one known command.
            assert!(FLEET.outside(relative, 0.0) >= found);
        }
        // A small command is missed by 5 % and more: a relative error alone covers nothing.
        assert_eq!(FLEET.outside_at(0.001, 0.05, 0.0), 1.0);
        assert_eq!(FLEET.outside(0.05, 0.0), 1.0);
    }

    #[test]
    fn without_a_relative_error_it_is_hoeffding() {
        // sqrt(ln(2 M / lost) / 2 N), which the best s meets.
        let known = ((2.0 * 120.0 / 1e-6f64).ln() / 50_000.0).sqrt();
        let found = FLEET.absolute_error(0.0, 1.0 - 1e-6);
        // Coins are at most as wide: c(s) <= s²/8, and less by terms of the order of s⁴.
        assert!(
            found <= known * (1.0 + 1e-9) && found > known * 0.999,
            "{found} {known}"
        );
    }

    #[test]
    fn a_relative_error_spares_most_of_the_absolute_one() {
        let alone = FLEET.absolute_error(0.0, 1.0 - 1e-9);
        let beside = FLEET.absolute_error(0.1, 1.0 - 1e-9);
        assert!(beside < 0.3 * alone, "{beside} {alone}");
        // One charger is anywhere.
        let one = Crowd {
            chargers: 1,
            moments: 1,
        };
        assert_eq!(one.absolute_error(0.1, 0.999), 1.0);
        assert_eq!(one.outside(0.1, 1.0), 0.0);
    }

    proptest! {
        /// What is asked for is what is given, and each single command is within it.
        #[test]
        fn the_error_covers_what_was_asked(
            chargers in 100u32..10_000_000,
            moments in 1u64..1_000_000_000,
            relative in 0.0f64..0.3,
            digits in 1.0f64..12.0,
            u in 0.0f64..=1.0,
        ) {
            let crowd = Crowd { chargers, moments };
            let lost = 10f64.powf(-digits);
            let confidence = 1.0 - lost;
            let absolute = crowd.absolute_error(relative, confidence);
            prop_assert!((0.0..=1.0).contains(&absolute));
            // The two searches end a little apart.
            let outside = crowd.outside(relative, absolute);
            prop_assert!(outside <= (1.0 - confidence) * (1.0 + 1e-6), "{outside} {lost}");
            prop_assert!(crowd.outside_at(u, relative, absolute) <= outside * (1.0 + 1e-6) + 1e-300);
        }
    }
}
