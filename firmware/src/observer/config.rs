//! The coefficients of a tick of the chain, from the table's plant.

use crate::table::PlantParameters;
use crate::units::MICRO;

/// Terms of the exponential series. The coefficients' scaled norm is below 1, so the remainder is
/// below 1/17!.
const SERIES_TERMS: u32 = 16;
/// Chain states g, l, p, then the input's value and its slope over the tick.
const AUGMENTED: usize = 5;

/// Coefficients of one tick of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverConfig {
    /// Transition matrix of (g, l, p, f, Δf) over a tick; the last two rows are the identity's.
    pub(super) transition: [[f32; AUGMENTED]; 3],
    /// Length of a tick \[s\].
    pub(super) tick_s: f32,
    /// D \[GW/Hz\].
    pub(super) damping: f32,
    /// 2H \[GW s/Hz\].
    pub(super) twice_inertia: f32,
    /// Fleet power per ppm of participation \[GW\].
    pub(super) fleet_gw_per_ppm: f32,
    /// K = 1/R_eq \[GW/Hz\].
    pub(super) governor_gain: f32,
}

/// Why no observer can be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObserverError {
    /// A time constant of the chain is zero or below a quarter of a tick, which the series does not
    /// cover.
    TimeConstantTooShort,
}

impl ObserverConfig {
    /// Coefficients for a tick \[ms\] of this plant.
    ///
    /// # Errors
    /// A time constant below a quarter of a tick.
    pub fn new(plant: &PlantParameters, tick_ms: u16) -> Result<Self, ObserverError> {
        let tick_us = u32::from(tick_ms) * 1000;
        let shortest = plant
            .governor_time_us
            .min(plant.turbine_time_us)
            .min(plant.lag_time_us);
        if shortest == 0 || shortest < tick_us / 4 {
            return Err(ObserverError::TimeConstantTooShort);
        }
        let s = |us: u32| us as f32 / MICRO as f32;
        let (tg, tt) = (s(plant.governor_time_us), s(plant.turbine_time_us));
        let (t1, t2) = (s(plant.lead_time_us), s(plant.lag_time_us));
        let k = plant.governor_gain_kw_per_hz as f32 / MICRO as f32;
        let dt = f32::from(tick_ms) / 1000.0;
        let lead = t1 / tg;
        let rate = [
            [-dt / tg, 0.0, 0.0, k * dt / tg, 0.0],
            [
                (1.0 - lead) * dt / t2,
                -dt / t2,
                0.0,
                lead * k * dt / t2,
                0.0,
            ],
            [0.0, dt / tt, -dt / tt, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0; AUGMENTED],
        ];
        let exponential = exponential(&rate);
        Ok(Self {
            transition: [exponential[0], exponential[1], exponential[2]],
            tick_s: dt,
            damping: s(plant.damping_kw_per_hz),
            twice_inertia: 2.0 * s(plant.inertia_kw_s_per_hz),
            fleet_gw_per_ppm: s(plant.fleet_kw) / MICRO as f32,
            governor_gain: k,
        })
    }
}

/// exp of a small matrix by its series.
fn exponential(m: &[[f32; AUGMENTED]; AUGMENTED]) -> [[f32; AUGMENTED]; AUGMENTED] {
    let mut sum = [[0.0f32; AUGMENTED]; AUGMENTED];
    let mut term = sum;
    for i in 0..AUGMENTED {
        sum[i][i] = 1.0;
        term[i][i] = 1.0;
    }
    for n in 1..=SERIES_TERMS {
        let mut next = [[0.0f32; AUGMENTED]; AUGMENTED];
        for i in 0..AUGMENTED {
            for j in 0..AUGMENTED {
                let mut acc = 0.0;
                for (l, row) in m.iter().enumerate() {
                    acc += term[i][l] * row[j];
                }
                next[i][j] = acc / n as f32;
                sum[i][j] += next[i][j];
            }
        }
        term = next;
    }
    sum
}

/// The largest whole number that is not above, saturating; 0 for no number.
///
/// Converting drops the fraction, which is one too many where it was negative. A float without a
/// fraction converts back exactly, and from 2^23 on no float has one.
pub(super) const fn floor(value: f32) -> i32 {
    let whole = value as i32;
    if whole as f32 > value {
        whole.saturating_sub(1)
    } else {
        whole
    }
}
