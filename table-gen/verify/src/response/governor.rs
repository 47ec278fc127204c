//! Governors with a dead band, a limited rate and a limited output, as a disturbance of the linear
//! governor.
//!
//! # Derivation
//! The governors obey `T_G g' = clamp(v - g, ± R T_G)` with `v = K z(f)`, and g' = 0 where that
//! would carry g past a limit L or U; z(f) = f - e, with `e = clamp(f, ± d)` the dead band's share.
//! Let `a = g + T_G g'`: the input that a *linear* governor would need to move as this one does.
//! Lead-lag and turbine see g and g' alone, so the whole plant is the linear one with the
//! governor's input `K f` replaced by a, that is with the disturbance
//!
//! ```text
//! q = a - K f = -K e - r        r = v - a
//! ```
//!
//! at the same place. It has bounds in every step:
//!
//! * e rises with f, so it lies between the values at the ends of f's bounds. Where f stays below
//!   -d it is the constant -d: the dead band then costs a known shift and no uncertainty.
//! * with `s = v - g`, the rate's limit alone gives `r = s - clamp(s, ± R T_G)`, which rises with
//!   s.
//! * at the upper limit g = U and s > 0: g' = 0, so a = g and `r = s = v - U`; that needs s > 0 and
//!   a g that reaches U in the step. It is no less than what the rate's limit gives. The lower
//!   limit is the mirror image.
//!
//! So an output limit is not an unknown smaller gain in [0, K]; it is a power that is missing, of
//! at most what was asked beyond the limit, and none before the limit is reached. a lies between g
//! and v, so the bounds of the chain's states hold as they do for the linear plant. g is taken to
//! begin inside its limits.
//!
//! # Lines
//! With m the most that s moves within the step, x+ the positive part, and the sample's s and f,
//!
//! ```text
//! r <= (s + m - R T_G)+  +  (v(f - f_move) - U)+        the second only where g can reach U
//! r >= -(-s + m - R T_G)+  -  (L - v(f + f_move))+      the second only where g can reach L
//! r >= s - m - R T_G                always: a clamp takes off at most R T_G
//! ```
//!
//! Each positive part is convex in s or in f, so its chord over the sample's bounds lies above it.
//! s is `K_mid f - g` and what dead band and unknown gain add to it, so r, and with it q, lies
//! between two affine functions of the sample's f and g. The sweep carries them along as feedback:
//! what is missing at a limit grows and shrinks with f.
//!
//! With an unknown K the loop is linear around the middle of K's band; `(K - K_mid) z` is bounded
//! by the band's radius times |f| as for the linear plant, and `-K_mid e` is the rest.

use model::governor::Governor;
use model::interval::Interval;

use super::fleet_loop::FleetLoop;

/// Bounds of what governs the governors at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AtSample {
    /// f.
    pub(super) f: Interval,
    /// g.
    pub(super) g: Interval,
    /// `K_mid f - g`.
    pub(super) gap: Interval,
    /// How far f may move within the step \[Hz\].
    pub(super) f_move: f64,
}

/// Whether rate or output is limited: then g and the gap are watched.
pub(super) fn is_limited(governor: &Governor) -> bool {
    governor.rate_gw_per_s.is_finite() || governor.output_gw.iter().any(|end| end.is_finite())
}

/// Where g lies whatever happens.
pub(super) fn output(governor: &Governor) -> Interval {
    let [low, high] = governor.output_gw;
    Interval { low, high }
}

/// `f_factor * f + g_factor * g + constant` of the sample \[GW\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Affine {
    /// Factor of f.
    pub(super) f: f64,
    /// Factor of g.
    pub(super) g: f64,
    /// At 0.
    pub(super) constant: f64,
}

impl Affine {
    const ZERO: Self = Self::constant(0.0);

    const fn constant(constant: f64) -> Self {
        Self {
            f: 0.0,
            g: 0.0,
            constant,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            f: self.f + other.f,
            g: self.g + other.g,
            constant: self.constant + other.constant,
        }
    }

    fn minus(self) -> Self {
        Self {
            f: -self.f,
            g: -self.g,
            constant: -self.constant,
        }
    }
}

/// q lies between these in the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Disturbance {
    /// Below.
    pub(super) low: Affine,
    /// Above.
    pub(super) high: Affine,
}

/// Far above the rounding errors of the few operations between numbers below 100 that a line takes
/// \[GW\].
const PAD_GW: f64 = 1e-11;

/// Bounds of q in the step after a sample; nothing for linear governors.
pub(super) fn disturbance(number: &FleetLoop, at: &AtSample) -> Option<Disturbance> {
    let governor = &number.governor;
    if governor.is_linear() {
        return None;
    }
    let f = widened(at.f, at.f_move);
    let dead = governor.deadband_hz;
    let blind = Interval {
        low: f.low.clamp(-dead, dead),
        high: f.high.clamp(-dead, dead),
    };
    let shift = Interval::point(-number.gain_mid) * blind;
    let [least, most] = if is_limited(governor) {
        unfollowed(number, at, f, blind)
    } else {
        [Affine::ZERO; 2]
    };
    Some(Disturbance {
        low: Affine::constant(shift.low - PAD_GW).plus(most.minus()),
        high: Affine::constant(shift.high + PAD_GW).plus(least.minus()),
    })
}

/// The chord of `(slope * x + constant)+` over an interval of x: slope and constant.
fn chord(range: Interval, slope: f64, constant: f64) -> (f64, f64) {
    let value = |x: f64| (slope * x + constant).max(0.0);
    let (low, high) = (value(range.low), value(range.high));
    let width = range.high - range.low;
    if !(width.is_finite() && width > 1e-9) {
        return (0.0, low.max(high));
    }
    let slope = (high - low) / width;
    // Above both ends, whatever the slope's rounding.
    let constant = (low - slope * range.low).max(high - slope * range.high);
    (slope, constant)
}

/// Lines below and above r.
fn unfollowed(number: &FleetLoop, at: &AtSample, f: Interval, blind: Interval) -> [Affine; 2] {
    let governor = &number.governor;
    // z rises with f.
    let seen = Interval {
        low: (f.low - blind.low).next_down(),
        high: (f.high - blind.high).next_up(),
    };
    // s less the gap of the sample: what dead band and unknown gain add.
    let unknown = (number.gain_radius * seen.magnitude()).next_up();
    let added = widened(Interval::point(-number.gain_mid) * blind, unknown);
    let gain = Interval::hull(
        number.gain_mid - number.gain_radius,
        number.gain_mid + number.gain_radius,
    );
    // s at the sample: from the gap, and no more than what f and g allow by themselves.
    let (from_gap, from_both) = (at.gap + added, gain * seen - at.g);
    let start = Interval {
        low: from_gap.low.max(from_both.low),
        high: from_gap.high.min(from_both.high),
    };
    // |g'| is at most |s| / T_G and at most R, and within the step s grows by what v and g move.
    let time = number.times.governor.low;
    let asked_move = number.gain_most * at.f_move;
    let share = number.step_s / time;
    let most = if share < 1.0 {
        (start.magnitude() + asked_move) / (1.0 - share)
    } else {
        f64::INFINITY
    };
    let moved = number.step_s * governor.rate_gw_per_s.min(most / time) * (1.0 + 1e-9);
    let s_move = asked_move + moved;
    let g = widened(at.g, moved);
    let s = widened(start, s_move);
    // A T_G that is not known: the least bounds r by its size, the most by what is taken off it.
    let follows = governor.rate_gw_per_s * time;
    let follows_most = governor.rate_gw_per_s * number.times.governor.high;
    let of_gap = |(slope, constant): (f64, f64)| Affine {
        f: slope * number.gain_mid,
        g: -slope,
        constant,
    };
    let of_f = |(slope, constant): (f64, f64)| Affine {
        f: slope,
        g: 0.0,
        constant,
    };
    let (mut least, mut above) = (Affine::ZERO, Affine::ZERO);
    if follows.is_finite() {
        above = of_gap(chord(at.gap, 1.0, added.high + s_move - follows));
        least = of_gap(chord(at.gap, -1.0, s_move - added.low - follows)).minus();
    }
    // The steepest gain asks for the most; past the dead band z is f and the dead band.
    let dead = governor.deadband_hz;
    let steepest = number.gain_most;
    let [lower, upper] = governor.output_gw;
    if g.high >= upper && s.high > 0.0 {
        let constant = steepest * (at.f_move - dead) - upper;
        above = above.plus(of_f(chord(at.f, -steepest, constant)));
    }
    if g.low <= lower && s.low < 0.0 {
        let constant = steepest * (at.f_move - dead) + lower;
        least = least.plus(of_f(chord(at.f, steepest, constant)).minus());
    }
    // Governors that are surely behind: r is what is asked less what the rate lets through.
    let behind = at.gap.mid() + added.low - s_move - follows_most;
    if behind > 0.0 {
        least = of_gap((1.0, added.low - s_move - follows_most));
    }
    least.constant -= PAD_GW;
    above.constant += PAD_GW;
    [least, above]
}

fn widened(range: Interval, by: f64) -> Interval {
    Interval {
        low: (range.low - by).next_down(),
        high: (range.high + by).next_up(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::testing::{assumed, law, plant};
    use model::plant::Plant;
    use proptest::prelude::*;

    fn number(governor: Governor, gain_radius: f64) -> FleetLoop {
        let mut band = plant();
        band.governor = governor;
        band.governor_gain = Interval::hull(-5.0 - gain_radius, -5.0 + gain_radius);
        FleetLoop::new(&band, law(), assumed(), 0.05)
    }

    proptest! {
        /// q of a real governor, at a real state inside the sample's bounds, is inside the bounds
        /// of the disturbance.
        #[test]
        fn a_real_governor_stays_inside(
            f in -0.9f64..0.3,
            g in -1.0f64..4.0,
            at in 0.0f64..=1.0,
            width in 0.0f64..0.4,
            g_width in 0.0f64..0.5,
            moved in -1.0f64..=1.0,
            g_moved in -1.0f64..=1.0,
            gain_radius in 0.0f64..1.0,
            gain_at in -1.0f64..=1.0,
            deadband_hz in 0.0f64..0.1,
            rate in prop_oneof![Just(f64::INFINITY), 0.01f64..0.5],
            upper in prop_oneof![Just(f64::INFINITY), 0.0f64..2.0],
            lower in prop_oneof![Just(f64::NEG_INFINITY), -1.0f64..0.0],
        ) {
            let governor = Governor { deadband_hz, rate_gw_per_s: rate, output_gw: [lower, upper] };
            let number = number(governor, gain_radius);
            let g = g.clamp(lower, upper);
            let real = Plant { governor_gain: -5.0 + gain_radius * gain_at, ..plant().known };
            let around = |x: f64, width: f64| Interval { low: x - width * at, high: x + width * (1.0 - at) };
            // The sample, from which f and g have moved to here by no more than they can.
            let f_at = f + 0.01 * moved;
            let back = (governor.rate(&real, f, g)).abs().min(governor.rate(&real, f_at, g).abs());
            let g_at = (g + 0.9 * number.step_s * back * g_moved).clamp(lower, upper);
            let gap = number.gain_mid * f_at - g_at;
            let sample = AtSample {
                f: around(f_at, width),
                g: around(g_at, g_width),
                gap: around(gap, 5.0 * width + g_width),
                f_move: 0.01,
            };
            let q = disturbance(&number, &sample).unwrap_or(Disturbance {
                low: Affine::ZERO,
                high: Affine::ZERO,
            });
            // The lines speak of the sample; within the step the real state has moved from it.
            let sampled = |line: Affine| line.f * f_at + line.g * g_at + line.constant;
            let a = g + real.governor_time * governor.rate(&real, f, g);
            // What the linear plant counts for an unknown gain is not in q.
            let unknown = (real.governor_gain - number.gain_mid) * governor.seen(f);
            let found = a - number.gain_mid * f - unknown;
            // Five roundings of numbers below 10.
            let slack = 5.0 * 10.0 * f64::EPSILON;
            let (low, high) = (sampled(q.low), sampled(q.high));
            prop_assert!(low - slack <= found && found <= high + slack, "{found} {low} {high} {q:?}");
        }
    }

    #[test]
    fn a_dead_band_that_is_passed_is_a_known_shift() {
        let number = number(
            Governor {
                deadband_hz: 0.02,
                ..Governor::LINEAR
            },
            0.0,
        );
        let point = Interval::ZERO;
        let at = AtSample {
            f: Interval::hull(-0.4, -0.1),
            g: point,
            gap: point,
            f_move: 0.01,
        };
        let q = disturbance(&number, &at).unwrap();
        // -K e = 5 * (-0.02): the governors ask for 0.1 GW less than linear ones.
        for line in [q.low, q.high] {
            assert_eq!((line.f, line.g), (0.0, 0.0));
            assert!((line.constant + 0.1).abs() < 1e-10, "{line:?}");
        }
    }
}
