//! What time constants in bands do to the governors' output, for games: how far two chains that
//! follow the same f can be apart.
//!
//! Let D(t) be the difference of the two chains' answers to a step of their input. It begins and
//! ends at 0, since both chains settle at what they are asked for. An input a that is between two
//! ends makes a difference of `∫ D'(τ) a(t - τ) dτ`, so the worst one jumps from end to end
//! whenever D turns, and gives half the distance of the ends times the variation of D.
//!
//! D is the sum of what the constants change one after another. A lag of R instead of T changes a
//! step response by `T - R` times the impulse response of both lags in a row, a lead by its change
//! times the impulse response of the rest. What follows in the row is a weighted mean over earlier
//! times, which makes no variation larger, and a long lag is a short one and such a mean: so the
//! shortest constants of the bands have the largest variation. In the row below, g and t are the
//! shortest T_G and T_t, s the shortest T_2:
//!
//! | constant | lags in the row | lead |
//! |---|---|---|
//! | T_G | T_G, g, T_t, T_2 | T_1 |
//! | T_t | g, T_t, t, T_2 | T_1 |
//! | T_1 | g, t, s | |
//! | T_2 | g, t, s, T_2 | T_1 |
//!
//! The variations are sums over samples in plain numbers, a thousandth taken more than what is
//! between samples. The verifier has its own derivation, in intervals; what games count too little
//! it would refuse.
//!
//! The states at the event may be off by what the spec's `initial` allows, both chains' alike, and
//! this dies out in two ways: a decay that begins at 1 moves by at most 1/e of a relative change of
//! its time constant, and each decay that takes part adds its own.

use firmware::units::{AXIS_G, AXIS_L, AXIS_P};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

/// Samples in the shortest lag.
const SAMPLES_PER_LAG: f64 = 16.0;
/// Most samples; what is left after them is bounded more roughly.
const SAMPLES_MOST: u32 = 1 << 16;
/// Share that may be left after the last sample, and what samples and roundings may hide.
const HIDDEN: f64 = 1e-3;

/// How far the governors' output may be from that of the spec's own constants \[µGW\], for what
/// they are asked for within a range that holds 0 and offsets of (g, l, p) within a box \[µGW\].
pub(crate) fn off(spec: &Spec, asked: Interval, offset: &[Interval; STATES]) -> Interval {
    let plant = &spec.plant;
    let own = [
        plant.governor_time_s,
        plant.turbine_time_s,
        plant.lead_time_s,
        plant.lag_time_s,
    ];
    let bands = spec.time_constant_bands();
    let change: [f64; 4] = std::array::from_fn(|i| {
        let [low, high] = bands[i];
        (high - own[i]).max(own[i] - low)
    });
    if change == [0.0; 4] {
        return Interval::ZERO;
    }
    let [governor, turbine, lead, lag] = own;
    let [g, t, _, s] = bands.map(|[low, _]| low);
    let of = |change: f64, lags: &[f64], lead: f64| {
        if change == 0.0 {
            0.0
        } else {
            change * variation(lags, lead)
        }
    };
    let share = of(change[0], &[governor, g, turbine, lag], lead)
        + of(change[1], &[g, turbine, t, lag], lead)
        + of(change[2], &[g, t, s], 0.0)
        + of(change[3], &[g, t, s, lag], lead);
    let most = asked.radius() * share + of_offset(own, bands, offset);
    Interval::point(most * (1.0 + HIDDEN)).symmetric()
}

/// The most that offsets at the event are worth.
fn of_offset(own: [f64; 4], bands: [[f64; 2]; 4], offset: &[Interval; STATES]) -> f64 {
    let [governor, _, lead, _] = own;
    let decay = |i: usize| {
        let [low, high] = bands[i];
        ((high / own[i]).max(own[i] / low) - 1.0).max(0.0) * (-1f64).exp()
    };
    let (of_governor, of_turbine, of_lag) = (decay(0), decay(1), decay(3));
    let [
        [governor_low, governor_high],
        _,
        [lead_low, lead_high],
        [lag_low, _],
    ] = bands;
    let ratio = lead / governor;
    let moved = (lead_high / governor_low - ratio).max(ratio - lead_low / governor_high);
    let of_g = moved * (governor_high / lag_low).min(1.0)
        + (1.0 - ratio).abs() * (of_governor + of_lag + of_turbine);
    let most = |axis: usize| offset[axis].magnitude();
    most(AXIS_P) * of_turbine + most(AXIS_L) * (of_turbine + of_lag) + most(AXIS_G) * of_g
}

/// Variation of the impulse response of lags in a row, with a lead at their end.
fn variation(lags: &[f64], lead: f64) -> f64 {
    let count = lags.len();
    let rates = |x: &[f64; 4]| -> [f64; 4] {
        std::array::from_fn(|i| match i {
            0 => -x[0] / lags[0],
            i if i < count => (x[i - 1] - x[i]) / lags[i],
            _ => 0.0,
        })
    };
    let output = |x: &[f64; 4]| x[count - 1] + lead * rates(x)[count - 1];
    let step = lags.iter().copied().fold(f64::INFINITY, f64::min) / SAMPLES_PER_LAG;
    let mut x = [1.0 / lags[0], 0.0, 0.0, 0.0];
    let (mut sum, mut before, mut rest) = (0.0, output(&x), f64::INFINITY);
    for _ in 0..SAMPLES_MOST {
        // A Runge-Kutta step of the fourth order.
        let at = |k: &[f64; 4], share: f64| std::array::from_fn(|i| x[i] + share * step * k[i]);
        let k1 = rates(&x);
        let k2 = rates(&at(&k1, 0.5));
        let k3 = rates(&at(&k2, 0.5));
        let k4 = rates(&at(&k3, 1.0));
        x = std::array::from_fn(|i| {
            x[i] + step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
        });
        let now = output(&x);
        sum += f64::abs(now - before);
        before = now;
        // Of a lag's output: that of what it follows, and the way to it.
        let mut left = [x[0]; 2];
        for i in 1..count {
            left = [left[1], left[1] + (x[i - 1] - x[i]).abs()];
        }
        rest = left[1] + lead * (left[0] + left[1]) / lags[count - 1];
        if rest <= HIDDEN * HIDDEN * sum {
            break;
        }
    }
    sum + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lags of T give t/T² exp(-t/T), which rises to 1/(e T) and falls; three of them rise to
    /// 2/(e² T). A lead that is as long as a lag takes that lag away.
    #[test]
    fn variations_by_hand() {
        let e = 1f64.exp();
        for time in [0.5, 3.0] {
            for (found, known) in [
                (variation(&[time; 2], 0.0), 2.0 / (e * time)),
                (variation(&[time; 3], 0.0), 4.0 / (e * e * time)),
                (variation(&[time; 3], time), 2.0 / (e * time)),
            ] {
                assert!((found / known - 1.0).abs() < HIDDEN, "{found} {known}");
            }
        }
    }

    #[test]
    fn nothing_is_off_without_a_band() {
        let spec = Spec::load("gb-bi-band", &[]).unwrap();
        let asked = Interval::hull(-1e6, 3e6);
        assert_eq!(off(&spec, asked, &[asked; STATES]), Interval::ZERO);
        let set = "uncertainty.turbine_time_s=[0.5,0.5]".to_owned();
        let spec = Spec::load("gb-bi-band", &[set]).unwrap();
        assert_eq!(off(&spec, asked, &[asked; STATES]), Interval::ZERO);
    }
}
