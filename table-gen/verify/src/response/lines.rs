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
//! low(max f(s), least m)   low(z, m)  = v = 1 ? 1 : max(0, v - step), v at z + reading
//! high(min f(s), most m)   high(z, m) = v = 0 ? 0 : min(1, v + step), v at z - reading
//! ```
//!
//! with step = smallest_change, and the delivered participation between `(1 - σ)(1 - δ) low - α`
//! and `(1 - σ) high (1 + δ) + α + σ`, inside \[0, 1\]: σ the hostile share, δ and α the relative
//! and absolute errors of the delivery.
//!
//! # Levels that are shifted against each other
//! Commands are not arbitrary: charger i has the levels o_i + k smallest_change, and 0 and 1. Let c
//! be smallest_change and V a bound above of the targets of all chargers. A command is below V + c,
//! and if V + c <= 1 it is no 1 (a command of 1 needs a target above 1 - c), so it is at most the
//! largest level of its charger below V + c: `V + c - x_i c` with x_i in (0, 1\], the distance
//! from there down to the level, in levels. x_i goes once around the circle with o_i. If on every
//! arc the share of these chargers differs from the arc's length by at most D, then the share of
//! those with x_i > x is at least 1 - x - D, so the mean of x_i, which is the integral of that
//! share, is at least 1/2 - D. Hence their mean command is at most V + (1/2 + D) c, whatever
//! command each charger took and however it came there. From below the same: with a bound V below
//! of all targets and V > c no command is 0 (one of 0 needs a target below c), each is at least its
//! charger's smallest level above V - c, and their mean at least V - (1/2 + D) c. A level above 1
//! counts as 1, one below 0 as 0: neither is needed, since V + c <= 1 and V - c >= 0 there.
//!
//! D is said of the whole fleet, of which a hostile share σ may be whichever chargers suit the
//! adversary. An arc of length L holds at least L - D of the fleet, so at least L - D - σ of it are
//! honest, out of 1 - σ; as a share of the honest that is no less than L - D - σ. So the honest
//! have D + σ in place of D above. So
//!
//! ```text
//! low(z, m)  = v >= 1 ? 1 : v <= c ? 0 : v - step
//! high(z, m) = v <= 0 ? 0 : v >= 1 - c ? 1 : v + step   step = min(1, 1/2 + D + σ) c
//! ```
//!
//! D = 1 says nothing of the levels and gives the functions above. The device rounds an offset down
//! to 1 ppm, which step takes in.
//!
//! Both functions are piecewise linear in z with one jump each, or two. A line that lies below
//! (above) the function at the ends of an interval, at its kinks and at the lower (upper) side of
//! its jump lies below (above) it on the whole interval; the supporting lines of the convex hull of
//! those points are such lines. Which of them is best depends on where the worst trajectory runs,
//! so several are kept.

use super::fleet_loop::{Assumed, RealLaw};
use model::interval::Interval;

/// Lines that are kept for each step, by where in the interval of f they touch: at its low end, its
/// middle, its high end.
const TOUCHES: [f64; 3] = [0.001, 0.5, 0.999];
/// Lines that are kept for each step: those, and one as steep as the law. Beside a jump the hull's
/// edge is steeper than the law, which costs more where f swings than it gains.
pub(super) const LINES: usize = TOUCHES.len() + 1;

/// Far above the rounding errors of the few operations between numbers below 10 that a line takes:
/// a participation.
const PAD: f64 = 1e-12;
/// What the device may round the offset of a charger's levels down by: 1 ppm.
const OFFSET_ROUNDING: f64 = 1.001e-6;

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

    /// How far the fleet's mean command may be from its target.
    fn step(&self) -> f64 {
        let change = self.law.smallest_change;
        let share = self.assumed.mean_step_share + self.assumed.hostile_share;
        (share * change + OFFSET_ROUNDING).min(change)
    }

    /// The bound at a sample.
    pub(super) fn at(&self, z: f64) -> f64 {
        let target = self.target(z).clamp(0.0, 1.0);
        let (change, step) = (self.law.smallest_change, self.step());
        let command = match self.side {
            Side::Below if target >= 1.0 => 1.0,
            Side::Below if target <= change => 0.0,
            Side::Below => target - step,
            Side::Above if target <= 0.0 => 0.0,
            Side::Above if target >= 1.0 - change => 1.0,
            Side::Above => target + step,
        };
        self.delivered(command)
    }

    /// Slope of the function where nothing is clamped.
    fn law_slope(&self) -> f64 {
        let error = match self.side {
            Side::Below => -self.assumed.participation,
            Side::Above => self.assumed.participation,
        };
        -(1.0 - self.assumed.hostile_share) * (1.0 + error) * self.law.droop
    }

    /// The points whose hull bounds the function on an interval: ends, kinks, and the outer side of
    /// the jump.
    fn corners(&self, range: Interval) -> Vec<(f64, f64)> {
        let (change, step) = (self.law.smallest_change, self.step());
        let assumed = self.assumed;
        let mut corners = vec![
            (range.low, self.at(range.low)),
            (range.high, self.at(range.high)),
        ];
        // (target, command there): the outer sides of the jumps, and the kinks.
        let kinks = match self.side {
            Side::Below => {
                let zero = assumed.participation_absolute
                    / ((1.0 - assumed.hostile_share) * (1.0 - assumed.participation)).max(1e-9);
                vec![
                    (1.0, 1.0 - step),
                    (change, 0.0),
                    ((step + zero).clamp(change, 1.0), zero.min(1.0 - step)),
                ]
            }
            Side::Above => {
                let full = (1.0 - assumed.hostile_share - assumed.participation_absolute)
                    / ((1.0 - assumed.hostile_share) * (1.0 + assumed.participation));
                let full = full.clamp(0.0, 1.0);
                vec![
                    (0.0, step),
                    (1.0 - change, 1.0),
                    ((full - step).clamp(0.0, 1.0 - change), full.max(step)),
                ]
            }
        };
        for (target, command) in kinks {
            let z = self.sample_of(target);
            // A corner too many is safe, one that rounding leaves out at an end is not.
            if range.low - 1e-9 < z && z < range.high + 1e-9 {
                corners.push((z, self.delivered(command)));
            }
        }
        corners
    }

    /// Lines on an interval of the sample, one for each of [`TOUCHES`], then one as steep as the
    /// law.
    pub(super) fn lines(&self, range: Interval, back: usize) -> [Line; LINES] {
        if self.law.droop <= 0.0 {
            let constant = match self.side {
                Side::Below => self.at(range.high),
                Side::Above => self.at(range.low),
            };
            return [Line {
                slope: 0.0,
                constant,
                back,
            }; LINES];
        }
        let corners = self.corners(range);
        let slope = |share: f64| {
            let at = range.low + (range.high - range.low) * share;
            supporting_slope(&corners, self.side, at)
        };
        let [low, middle, high] = TOUCHES.map(slope);
        [low, middle, high, self.law_slope()].map(|slope| {
            // The constant comes from all corners, so the line bounds them whatever the slope's
            // rounding.
            let offsets = corners.iter().map(|(z, value)| value - slope * z);
            let pad = PAD * (1.0 + slope.abs());
            let constant = match self.side {
                Side::Below => offsets.fold(f64::INFINITY, f64::min) - pad,
                Side::Above => offsets.fold(f64::NEG_INFINITY, f64::max) + pad,
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
    use model::discrepancy::arc_discrepancy;
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
            smallest_change in 0.0f64..1.0,
            mean_step_share in 0.5f64..=1.0,
            below in any::<bool>(),
        ) {
            let law = RealLaw { smallest_change, ..law() };
            let assumed = Assumed {
                hostile_share,
                participation_absolute,
                mean_step_share,
                ..assumed()
            };
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

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Chargers with the device's own law, each on a path of its own below (above) a common
        /// bound: their mean command stays on its side of the function. Among the paths are those
        /// that rise or fall to the bound from afar, and those that end a step beside it.
        #[test]
        fn the_mean_of_shifted_levels_keeps_to_half_a_step(
            chargers in 1usize..80,
            first in any::<u32>(),
            smallest_change_ppm in 1_000u32..400_000,
            bound_ppm in 0u32..=1_000_000,
            seed in any::<u64>(),
            below in any::<bool>(),
        ) {
            use firmware::response::{LevelOffset, ResponseLaw};
            use firmware::units::Participation;
            let device = ResponseLaw {
                droop_gain_ppm_per_hz: 1,
                setpoint_uhz: 0,
                slope_gain_ppm_s_per_hz: 0,
                slope_threshold_uhz_per_s: 0,
                window_ticks: 1,
                slope_most_ppm: 0,
                release_ppm: 0,
                smallest_change_ppm,
            };
            let serials: Vec<u32> = (0..chargers as u32).map(|n| first.wrapping_add(n)).collect();
            let offsets = serials.iter().map(|n| LevelOffset::of_serial(*n).units());
            let uneven = arc_discrepancy(offsets);
            let mut state = seed | 1;
            let mut random = |most: u32| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state % (u64::from(most) + 1)) as u32
            };
            let mut sum = 0u64;
            for serial in serials {
                let offset = LevelOffset::of_serial(serial);
                let mut command = Participation::NONE;
                let mut step = |target: u32| {
                    command = device.command(Participation::from_ppm(target), command, offset);
                    command.ppm()
                };
                // Anything before; then targets on the right side of the bound alone, and of all
                // commands there the one that is farthest on the other side of it.
                for _ in 0..random(3) {
                    step(random(1_000_000));
                }
                let far = if below { 1_000_000 } else { 0 };
                step(far);
                let on_side = |wanted: u32| {
                    if below { wanted.max(bound_ppm) } else { wanted.min(bound_ppm) }
                };
                let extreme = (0..12).map(|k| {
                    let near = smallest_change_ppm / 4 * (k % 5) + random(smallest_change_ppm / 8);
                    let wanted = if below {
                        bound_ppm.saturating_add(near)
                    } else {
                        bound_ppm.saturating_sub(near)
                    };
                    step(on_side(wanted.min(1_000_000)))
                });
                let chosen = if below { extreme.min() } else { extreme.max() };
                sum += u64::from(chosen.unwrap_or(0));
            }
            let mean = sum as f64 / 1e6 / chargers as f64;
            let law = RealLaw {
                droop: 1.0,
                setpoint_hz: 0.0,
                smallest_change: f64::from(smallest_change_ppm) / 1e6,
                rounding: 0.0,
                ..law()
            };
            let assumed = Assumed {
                participation: 0.0,
                mean_step_share: (0.5 + uneven).min(1.0),
                ..assumed()
            };
            let side = if below { Side::Below } else { Side::Above };
            let function = Delivered {
                law: &law,
                assumed: &assumed,
                side,
                reach_hz: 0.0,
                slope_response: 0.0,
            };
            let bound = function.at(-f64::from(bound_ppm) / 1e6);
            match side {
                Side::Below => prop_assert!(mean >= bound - 1e-9, "{mean} {bound}"),
                Side::Above => prop_assert!(mean <= bound + 1e-9, "{mean} {bound}"),
            }
        }
    }

    /// Solved by hand: levels 0.1 apart, offsets 0, 1/4, 1/2 and 3/4 of that, no target above 0.3.
    /// The largest levels below 0.4 are 0.3, 0.325, 0.35 and 0.375, so the mean is at most 0.3375.
    /// On an arc that just holds one offset there is 1/4 of the fleet more than its length says,
    /// with which the bound is 0.375.
    #[test]
    fn four_chargers_by_hand() {
        let law = RealLaw {
            smallest_change: 0.1,
            rounding: 0.0,
            ..law()
        };
        let assumed = Assumed {
            participation: 0.0,
            mean_step_share: 0.75,
            ..assumed()
        };
        let above = Delivered {
            law: &law,
            assumed: &assumed,
            side: Side::Above,
            reach_hz: 0.0,
            slope_response: 0.0,
        };
        let at = |target: f64| above.at(above.sample_of(target));
        assert!((at(0.3) - 0.375).abs() < 1e-5, "{}", at(0.3));
        assert!(at(0.3) > 0.3375);
        // From 0.9 on all of them may still have 1; at 0 and below none has anything.
        assert!((at(0.91) - 1.0).abs() < 1e-9);
        assert!(at(-0.01).abs() < 1e-9);
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
