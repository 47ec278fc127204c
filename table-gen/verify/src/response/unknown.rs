//! What a plant that is not known adds to the plant in the middle of its bands.
//!
//! # Inertia, damping, governor gain
//! f' changes by the radius of 1/2H times the net power and by that of D times |f|, the governors'
//! input by the radius of K times |f|.
//!
//! # Time constants
//! Let a be the governors' input (K f, or what limits leave of it) and `s = a - g`. With `i_G =
//! 1/T_G`, `i_2 = 1/T_2`, `i_t = 1/T_t` and `r = T_1 / (T_G T_2)` the chain is
//!
//! ```text
//! g' = i_G s          l' = i_2 (g - l) + r s          p' = i_t (l - p)
//! ```
//!
//! It is linear in the four numbers, and every one of them stands before a difference of
//! neighbours. With ^ for the middle of a band,
//!
//! ```text
//! g' = i_G^ s + (i_G - i_G^) s
//! l' = i_2^ (g - l) + r^ s + (i_2 - i_2^)(g - l) + (r - r^) s
//! p' = i_t^ (l - p) + (i_t - i_t^)(l - p)
//! ```
//!
//! The first terms are the plant in the middle, with `s = (K^ f - g) + (K - K^) f + ...`, which
//! gain and limits count as before. The others are disturbances of g', l' and p', each at most a
//! radius times a difference. So no matrix of intervals is raised to a power: the sweep takes what
//! is wrong in each step once, and every difference is bounded where it is, after the first
//! seconds of an event far below the states themselves.
//!
//! The differences are watched at the samples. Within a step of length h, with `|s|` at the
//! sample at most that of `K^ f - g` and what unknown gain and dead band add,
//!
//! ```text
//! |s|     <= |s(0)| + |K| h |f'|                 a lies between g and K z, so that g' opposes
//! |g - l| <= |(g - l)(0)| + h |i_G - r| |s|      (g - l)' = (i_G - r) s - i_2 (g - l)
//! |l - p| <= |(l - p)(0)| + h (i_2 |g - l| + r |s|)
//! ```
//!
//! since a positive rate only takes from a difference.
//!
//! All parameters are constant. `g' opposes` needs a K that does not jump, the bound of p' in
//! `window` a T_t that stays, the chord of f between samples an H, a D and a K that do; and where
//! bands are cut into cells (`plan`), each cell is proven for plants that stay in it.

use model::interval::Interval;
use model::plant::STATES;

use super::fleet_loop::FleetLoop;
use super::governor;

/// Room for the roundings of the few operations that a bound takes.
const ROOM: f64 = 1.0 + 1e-9;

/// What is known of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Differences {
    /// f.
    pub(super) f: Interval,
    /// `K_mid f - g`.
    pub(super) gap: Interval,
    /// `g - l`.
    pub(super) lag: Interval,
    /// `l - p`.
    pub(super) turbine: Interval,
}

/// What is known of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OfStep {
    /// Bound of |f| \[Hz\].
    pub(super) f_most: f64,
    /// Bound of `|p + P u - w - D f|` \[GW\].
    pub(super) net_most: f64,
    /// What unknown time constants add to g', l' and p', at most \[GW/s\].
    pub(super) times: Option<[f64; 3]>,
}

/// Whether `K_mid f - g` is bounded at every sample.
pub(super) fn watches_gap(number: &FleetLoop) -> bool {
    governor::is_limited(&number.governor) || number.unknown_times.is_some()
}

/// Bounds of what unknown time constants add to g', l' and p' in the step after a sample \[GW/s\],
/// in which f moves by at most `f_move` \[Hz\]; nothing where they are known.
pub(super) fn added(number: &FleetLoop, sample: &Differences, f_move: f64) -> Option<[f64; 3]> {
    let unknown = number.unknown_times?;
    let times = &number.times;
    let inverse = |band: Interval| Interval::ONE / band;
    let most = |range: Interval| range.magnitude();
    let blind = number.gain_most * number.governor.deadband_hz;
    let start = most(sample.gap) + number.gain_radius * most(sample.f) + blind;
    let gap = (start + number.gain_most * f_move) * ROOM;
    let lead = times.lead_rate();
    let apart = most(inverse(times.governor) - lead);
    let lag = (most(sample.lag) + number.step_s * apart * gap) * ROOM;
    let moved = most(inverse(times.lag)) * lag + most(lead) * gap;
    let turbine = (most(sample.turbine) + number.step_s * moved) * ROOM;
    Some([
        unknown.governor * gap * ROOM,
        (unknown.lag * lag + unknown.lead * gap) * ROOM,
        unknown.turbine * turbine * ROOM,
    ])
}

/// The most that everything unknown may take from a functional in one step, by the magnitudes of
/// its factors.
pub(super) fn most(number: &FleetLoop, step: &OfStep, magnitude: &[f64; STATES]) -> f64 {
    let spread = dot(magnitude, &number.spread_f);
    let unknown_f = number.inverse_inertia_radius * step.net_most
        + number.inverse_inertia_most * number.damping_radius * step.f_most;
    let unknown_gain = number.gain_radius * step.f_most;
    let of_known_times =
        number.step_s * (spread * unknown_f + dot(magnitude, &number.spread_gain) * unknown_gain);
    let Some(unknown) = &number.unknown_times else {
        return of_known_times;
    };
    // Without a bound there is none of the whole.
    let Some(added) = &step.times else {
        return f64::INFINITY;
    };
    let of_times = unknown.spread.iter().zip(added);
    let of_times: f64 = of_times
        .map(|(spread, added)| dot(magnitude, spread) * added)
        .sum();
    of_known_times + number.step_s * of_times * ROOM
}

/// The product of a row and a column.
pub(super) fn dot(a: &[f64; STATES], b: &[f64; STATES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests;
