//! Bound on the state estimate's error, for the spec's `uncertainty.measurement`.
//!
//! The copy of the chain and the chain itself obey the same equations, so the error of (g, l, p) is
//! the chain's response to the error of its input, `e_f(t) = f_measured - f`. For `|e_f| <= eps` it
//! is at most `eps` times the L1 norm of the impulse response:
//!
//! - g: `K/(T_G s + 1)` has an impulse response of one sign, so the norm is the DC gain |K|.
//! - l: the factor `(T_1 s + 1)/(T_2 s + 1)` has norm 1 for `T_1 <= T_2` and at most `2 T_1/T_2 -
//!   1` above that (a direct part `T_1/T_2` and a lag of gain `1 - T_1/T_2`). The same holds with
//!   T_G in T_2's place, so the larger of the two counts: `|K| max(1, 2 T_1 / max(T_G, T_2) - 1)`.
//!   When `T_1` is at most one of them the whole response keeps its sign, since lags in series do.
//! - p: a further lag of gain 1 and one sign: as l.
//!
//! For the paper's plant, `T_1 = 2 < T_2 = 12`: 5 eps on each of the three.
//!
//! What `eps` must contain: the source's error
//! ([`FrequencySource::error_uhz`](crate::frequency::FrequencySource)) and the interpolation
//! between samples. The device takes f as linear over a tick h; with `|f''| <= c` the error is at
//! most `c h²/8`. One step of power ΔP inside a tick bends f by `ΔP/2H` and adds `ΔP/2H · h/4`, for
//! that tick only.
//!
//! What it does not contain, and how to treat it:
//! - a lag of the source delays the whole estimate: add it to `uncertainty.actuation_delay_s`;
//! - a *constant* bias b is not an error in all directions: `x + b (1, K, K, K)` obeys the same
//!   plant with the loss shifted by `(D - K) b` (6 b for the paper's plant). Put `(D - K) b` into
//!   `loss_gw`, shrink I2 by b, and count only the rest of the error here;
//! - an initial error of the chain dies out with the chain's slowest time constant: see
//!   [`crate::charger::trust_ticks`];
//! - wrong plant parameters.

use crate::table::PlantParameters;
use crate::units::{MICRO, STATES};

/// f32 rounding of one estimate, see [`super`]: below 0.1 MW at 4 GW.
pub const ROUNDING_KW: u32 = 100;

/// What the frequency input of the observer is known to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputError {
    /// Error of a reading without constant bias and lag \[µHz\].
    pub reading_uhz: u32,
    /// Bound on |f''| between steps of power \[µHz/s²\].
    pub curvature_uhz_per_s2: u32,
    /// Largest step of the net power inside one tick \[kW\].
    pub power_step_kw: u32,
}

impl InputError {
    /// A bound on |f''| for this plant: `2H f'' = p' + (P u)' - w' - D f'`, with u and w constant
    /// between steps, `|p'| = |l - p|/T_t` and |f'| from the largest imbalance. Both powers in kW.
    pub fn curvature_uhz_per_s2(
        plant: &PlantParameters,
        lag_gap_kw: u32,
        imbalance_kw: u32,
    ) -> u32 {
        // kW / (kW s/Hz) is Hz/s: times 1e6 for µHz.
        let twice_inertia = 2 * u64::from(plant.inertia_kw_s_per_hz).max(1);
        let mechanical =
            u64::from(lag_gap_kw) * MICRO as u64 / u64::from(plant.turbine_time_us).max(1);
        let damping = u64::from(plant.damping_kw_per_hz) * u64::from(imbalance_kw) / twice_inertia;
        let rate = (mechanical + damping) * MICRO as u64 / twice_inertia + 1;
        u32::try_from(rate).unwrap_or(u32::MAX)
    }

    /// `eps` of the module's derivation for a tick \[ms\] \[µHz\], rounded up.
    pub fn eps_uhz(&self, plant: &PlantParameters, tick_ms: u16) -> u32 {
        let h_ms = u64::from(tick_ms);
        let bend = u64::from(self.curvature_uhz_per_s2) * h_ms * h_ms / 8_000_000 + 1;
        let twice_inertia = 2 * u64::from(plant.inertia_kw_s_per_hz).max(1);
        let slope_uhz_per_s = u64::from(self.power_step_kw) * MICRO as u64 / twice_inertia;
        let step = slope_uhz_per_s * h_ms / 4000 + 1;
        let sum = u64::from(self.reading_uhz) + bend + step;
        u32::try_from(sum).unwrap_or(u32::MAX)
    }
}

/// Bound on |estimate - state| in each of (f, g, l, p), in micro-units: what goes into
/// `uncertainty.measurement`.
///
/// f itself carries the reading's error alone: the interpolation matters to the chain only.
pub fn measurement_bound(
    plant: &PlantParameters,
    tick_ms: u16,
    input: &InputError,
) -> [u32; STATES] {
    let eps = u64::from(input.eps_uhz(plant, tick_ms));
    let gain = u64::from(plant.governor_gain_kw_per_hz.unsigned_abs());
    // Gain in kW/Hz times µHz is 1e-6 kW.
    let governor = (eps * gain).div_ceil(MICRO as u64) + u64::from(ROUNDING_KW);
    let slow = plant.governor_time_us.max(plant.lag_time_us).max(1);
    let doubled_lead = 2 * u64::from(plant.lead_time_us);
    let overshoot = doubled_lead
        .saturating_sub(u64::from(slow))
        .max(u64::from(slow));
    let chain = (eps * gain)
        .div_ceil(MICRO as u64)
        .saturating_mul(overshoot)
        .div_ceil(u64::from(slow))
        + u64::from(ROUNDING_KW);
    let kw = |value: u64| u32::try_from(value).unwrap_or(u32::MAX);
    [input.reading_uhz, kw(governor), kw(chain), kw(chain)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_plant_has_a_gain_of_five() {
        let exact = InputError {
            reading_uhz: 2_000,
            curvature_uhz_per_s2: 0,
            power_step_kw: 0,
        };
        // 2 mHz, and a µHz for each of two terms rounded up: 5 * 2.002 mHz = 10.01 MW, and the f32
        // rounding.
        let bound = measurement_bound(&PlantParameters::PAPER, 100, &exact);
        assert_eq!(bound, [2_000, 10_110, 10_110, 10_110]);
    }

    #[test]
    fn a_lead_longer_than_both_lags_overshoots() {
        let plant = PlantParameters {
            lead_time_us: 24_000_000,
            ..PlantParameters::PAPER
        };
        let exact = InputError {
            reading_uhz: 1_998,
            curvature_uhz_per_s2: 0,
            power_step_kw: 0,
        };
        // 2 * 24/12 - 1 = 3 times the gain.
        let bound = measurement_bound(&plant, 100, &exact);
        assert_eq!(bound, [1_998, 10_100, 30_100, 30_100]);
    }

    #[test]
    fn between_samples_of_the_papers_event() {
        // |l - p| < 1 GW, imbalance 2 GW: (1/0.5 + 1 * 2/8)/8 = 0.28 Hz/s²,
        // 0.35 mHz over a tick of 0.1 s;
        // the loss of 2 GW inside a tick: 0.25 Hz/s * 0.1 s / 4 = 6.25 mHz.
        let curvature =
            InputError::curvature_uhz_per_s2(&PlantParameters::PAPER, 1_000_000, 2_000_000);
        assert_eq!(curvature, 281_251);
        let input = InputError {
            reading_uhz: 0,
            curvature_uhz_per_s2: curvature,
            power_step_kw: 2_000_000,
        };
        assert_eq!(input.eps_uhz(&PlantParameters::PAPER, 100), 352 + 6_251);
    }
}
