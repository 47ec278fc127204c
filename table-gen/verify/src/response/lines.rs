//! Straight lines below and above what the fleet delivers.
//!
//! # Derivation
//! At time t each charger draws what it decided at some moment, on a reading that speaks of a
//! moment s between `late_most_s` and `late_least_s` before t. Its command c obeys |c - v| <
//! smallest_change, and c = v where v is 0 or 1; v is the law's target, `clamp(droop (setpoint -
//! f(s) - e) + m, 0, 1)` with the reading's error e and the slope response m. v falls with f and
//! rises with m. So whatever the clocks, delays and errors of the single chargers, every command,
//! and with it the fleet's mean, lies between
//!
//! ```text
//! low(max f(s), least m)   low(z, m)  = v = 1 ? 1 : max(0, v - smallest_change), v at z + reading
//! high(min f(s), most m)   high(z, m) = v = 0 ? 0 : min(1, v + smallest_change), v at z - reading
//! ```
//!
//! and the delivered participation between `(1 - σ)(1 - δ) low - α` and `(1 - σ) high (1 + δ) + α +
//! σ`, inside \[0, 1\]: σ the hostile share, δ and α the relative and absolute errors of the
//! delivery.
//!
//! Both are piecewise linear in z with one jump. A line that lies below (above) the function at the
//! ends of an interval, at its kinks and at the lower (upper) side of its jump lies below (above)
//! it on the whole interval; the supporting lines of the convex hull of those points are such
//! lines. Which of them is best depends on where the worst trajectory runs, so several are kept.

use super::fleet_loop::{Assumed, RealLaw};
use model::interval::Interval;

/// Lines that are kept for each step, by where in the interval of f they touch: at its low end, its
/// middle, its high end.
pub(super) const TOUCHES: [f64; 3] = [0.001, 0.5, 0.999];

/// Far above the rounding errors of the few operations between numbers below 10 that a line takes:
/// a participation.
const PAD: f64 = 1e-12;

/// `u >= slope * f(k - back) + constant`, or `<=`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Line {
    /// Participation per Hz.
    pub(super) slope: f64,
    /// Participation at f = 0.
    pub(super) constant: f64,
    /// The sample that it speaks of, steps before the step's start.
    pub(super) back: usize,
}

/// Which side of the delivered participation a line bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// From below.
    Below,
    /// From above.
    Above,
}

/// What the fleet delivers at least or at most, as a function of one sample z of f.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delivered<'a> {
    /// The law.
    pub(super) law: &'a RealLaw,
    /// The assumptions.
    pub(super) assumed: &'a Assumed,
    /// The side.
    pub(super) side: Side,
    /// How far the extreme of f in the window may lie from the sample, on the side that counts,
    /// reading error included \[Hz\].
    pub(super) reach_hz: f64,
    /// The slope response, on the side that counts.
    pub(super) slope_response: f64,
}

impl Delivered<'_> {
    /// Target at a sample, before the clamp.
    fn target(&self, z: f64) -> f64 {
        let shift = match self.side {
            Side::Below => -self.reach_hz,
            Side::Above => self.reach_hz,
        };
        let rounding = match self.side {
            Side::Below => -self.law.rounding,
            Side::Above => self.law.rounding,
        };
        self.law.droop * (self.law.setpoint_hz - z + shift) + self.slope_response + rounding
    }

    /// The sample at which the target takes a value.
    fn sample_of(&self, target: f64) -> f64 {
        (self.target(0.0) - target) / self.law.droop
    }

    /// Delivered participation for a command.
    fn delivered(&self, command: f64) -> f64 {
        let Assumed {
            participation,
            participation_absolute,
            hostile_share,
            ..
        } = *self.assumed;
        match self.side {
            Side::Below => ((1.0 - hostile_share) * (1.0 - participation) * command
                - participation_absolute
                - PAD)
                .max(0.0),
            Side::Above => ((1.0 - hostile_share) * (1.0 + participation) * command
                + participation_absolute
                + hostile_share
                + PAD)
                .min(1.0),
        }
    }

    /// The bound at a sample.
    pub(super) fn at(&self, z: f64) -> f64 {
        let target = self.target(z).clamp(0.0, 1.0);
        let change = self.law.smallest_change;
        let command = match self.side {
            Side::Below if target >= 1.0 => 1.0,
            Side::Below => (target - change).max(0.0),
            Side::Above if target <= 0.0 => 0.0,
            Side::Above => (target + change).min(1.0),
        };
        self.delivered(command)
    }

    /// The points whose hull bounds the function on an interval: ends, kinks, and the outer side of
    /// the jump.
    fn corners(&self, range: Interval) -> Vec<(f64, f64)> {
        let change = self.law.smallest_change;
        let assumed = self.assumed;
        let mut corners = vec![
            (range.low, self.at(range.low)),
            (range.high, self.at(range.high)),
        ];
        // (target, command there): the jump's outer side and the kinks.
        let kinks = match self.side {
            Side::Below => {
                let zero = assumed.participation_absolute
                    / ((1.0 - assumed.hostile_share) * (1.0 - assumed.participation)).max(1e-9);
                vec![
                    (1.0, 1.0 - change),
                    (change, 0.0),
                    ((change + zero).min(1.0), zero.min(1.0)),
                ]
            }
            Side::Above => {
                let full = (1.0 - assumed.hostile_share - assumed.participation_absolute)
                    / ((1.0 - assumed.hostile_share) * (1.0 + assumed.participation));
                let full = full.clamp(0.0, 1.0);
                vec![
                    (0.0, change),
                    (1.0 - change, 1.0),
                    ((full - change).max(0.0), full.max(change)),
                ]
            }
        };
        for (target, command) in kinks {
            let z = self.sample_of(target);
            if range.low < z && z < range.high {
                corners.push((z, self.delivered(command)));
            }
        }
        corners
    }

    /// Lines on an interval of the sample, one for each of [`TOUCHES`].
    pub(super) fn lines(&self, range: Interval, back: usize) -> [Line; TOUCHES.len()] {
        if self.law.droop <= 0.0 {
            let constant = match self.side {
                Side::Below => self.at(range.high),
                Side::Above => self.at(range.low),
            };
            return [Line {
                slope: 0.0,
                constant,
                back,
            }; TOUCHES.len()];
        }
        let corners = self.corners(range);
        TOUCHES.map(|share| {
            let at = range.low + (range.high - range.low) * share;
            let slope = supporting_slope(&corners, self.side, at);
            // The constant comes from all corners, so the line bounds them whatever the slope's
            // rounding.
            let offsets = corners.iter().map(|(z, value)| value - slope * z);
            let constant = match self.side {
                Side::Below => offsets.fold(f64::INFINITY, f64::min) - PAD,
                Side::Above => offsets.fold(f64::NEG_INFINITY, f64::max) + PAD,
            };
            Line {
                slope,
                constant,
                back,
            }
        })
    }
}

/// Slope of the edge of the points' lower (upper) convex hull above (below) `at`.
fn supporting_slope(corners: &[(f64, f64)], side: Side, at: f64) -> f64 {
    let sign = match side {
        Side::Below => 1.0,
        Side::Above => -1.0,
    };
    let mut sorted: Vec<(f64, f64)> = corners
        .iter()
        .map(|(z, value)| (*z, sign * value))
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    sorted.dedup_by(|next, kept| next.0 - kept.0 < 1e-12);
    let mut hull: Vec<(f64, f64)> = Vec::with_capacity(sorted.len());
    for point in sorted {
        while let [.., a, b] = hull[..] {
            if (b.1 - a.1) * (point.0 - a.0) < (point.1 - a.1) * (b.0 - a.0) {
                break;
            }
            hull.pop();
        }
        hull.push(point);
    }
    let edge = hull
        .windows(2)
        .find(|edge| edge[1].0 >= at)
        .or_else(|| hull.windows(2).next_back());
    edge.map_or(0.0, |edge| {
        sign * (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::testing::{assumed, law};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lines_bound_the_function_everywhere(
            low in -0.8f64..0.1,
            width in 0.0f64..0.6,
            reach_hz in 0.0f64..0.05,
            slope_response in 0.0f64..0.6,
            share in 0.0f64..=1.0,
            hostile_share in 0.0f64..0.2,
            participation_absolute in 0.0f64..0.05,
            below in any::<bool>(),
        ) {
            let law = law();
            let assumed = Assumed { hostile_share, participation_absolute, ..assumed() };
            let side = if below { Side::Below } else { Side::Above };
            let delivered = Delivered { law: &law, assumed: &assumed, side, reach_hz, slope_response };
            let range = Interval::hull(low, low + width);
            let z = low + width * share;
            for line in delivered.lines(range, 3) {
                let (line, value) = (line.slope * z + line.constant, delivered.at(z));
                match side {
                    Side::Below => prop_assert!(line <= value, "{line} {value}"),
                    Side::Above => prop_assert!(line >= value, "{line} {value}"),
                }
            }
        }
    }

    #[test]
    fn a_saturated_fleet_is_a_constant() {
        let (law, assumed) = (law(), assumed());
        let below = Delivered {
            law: &law,
            assumed: &assumed,
            side: Side::Below,
            reach_hz: 0.002,
            slope_response: 0.0,
        };
        // 6 / 1.4 * (0.05 - 0.002) falls short of 1 by far at -0.05 - ...; at -0.35 Hz the target
        // is 1.27.
        let line = below.lines(Interval::hull(-0.5, -0.35), 2)[1];
        assert!(line.slope.abs() < 1e-9);
        assert!((line.constant - 0.9).abs() < 1e-9, "{line:?}");
    }
}
