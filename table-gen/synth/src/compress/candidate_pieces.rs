//! Candidate pieces: the affine inputs that bring f to a set-point at the next decision.
//!
//! With the input held over a time t, `f(t) = Φ_f x + Γ_f (P u - w)`. Solved for u,
//!
//! ```text
//! u = (f* - k Φ_f x + Γ_f w) / (Γ_f P)
//! ```
//!
//! is the deadbeat input for k = 1; other k press harder or softer. Nothing rests on these pieces
//! being good: the game decides cell by cell whether one may be used.

use firmware::table::{AFFINE_FRACTION_BITS, AffineFunction};

use crate::drives::{MICRO, middle_power};
use model::flow::Flow;
use model::grid_shape::GridShape;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Set-points tried in a band, its ends included.
const SET_POINTS: u32 = 9;
/// Factors k tried.
const PRESSES: [f64; 5] = [0.6, 0.8, 1.0, 1.25, 1.6];
/// Times tried, in periods.
const PERIODS: [f64; 2] = [1.0, 2.0];

/// Pieces for set-points in a band of frequency deviation \[µHz\], the most central first.
pub fn candidates(
    spec: &Spec,
    shape: &GridShape<STATES>,
    band_uhz: [i32; 2],
) -> Vec<AffineFunction> {
    let (a, b) = Plant::new(spec).matrices();
    let [low, high] = band_uhz.map(f64::from);
    let mut found = Vec::new();
    for periods in PERIODS {
        let flow = Flow::over(&a, &b, periods * spec.sampling.period_s);
        let phi = flow.phi[0].map(Interval::mid);
        let gamma = flow.gamma[0].mid();
        for press in PRESSES {
            for at in 0..SET_POINTS {
                let share = f64::from(at) / f64::from(SET_POINTS - 1);
                let set_point = low + (high - low) * share;
                found.extend(law(spec, shape, &phi, gamma, press, set_point));
            }
        }
    }
    found.dedup();
    found
}

/// One law in levels, as integers; `None` if a factor does not fit the format.
fn law(
    spec: &Spec,
    shape: &GridShape<STATES>,
    phi: &[f64; STATES],
    gamma: f64,
    press: f64,
    set_point: f64,
) -> Option<AffineFunction> {
    let scale = f64::from(1u32 << AFFINE_FRACTION_BITS);
    // Micro-GW of a level, and of the loss alone.
    let per_level = spec.fleet_power_gw() * spec.input.step * MICRO * gamma;
    let loss = middle_power(spec, 0);
    // Half a level more turns the reader's floor into rounding to nearest.
    let mut constant = (set_point - gamma * loss) / per_level + 0.5;
    let mut factors = [0i16; STATES];
    for d in 0..STATES {
        let slope = -press * phi[d] / per_level;
        let first = shape.lower[d] + 0.5 * shape.width[d];
        constant += slope * first;
        factors[d] = whole(slope * shape.width[d] * scale, i16::MAX.into())? as i16;
    }
    let constant = whole(constant * scale, f64::from(i32::MAX))? as i32;
    Some(AffineFunction { factors, constant })
}

/// The nearest whole number, if its magnitude is within a bound.
fn whole(value: f64, bound: f64) -> Option<f64> {
    let value = value.round();
    (value.abs() <= bound).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_rounded_and_refused_past_its_bound() {
        assert_eq!(whole(2.4, 3.0), Some(2.0));
        assert_eq!(whole(-3.4, 3.0), Some(-3.0));
        assert_eq!(whole(3.6, 3.0), None);
        assert_eq!(whole(f64::NAN, 3.0), None);
    }
}
