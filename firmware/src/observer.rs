//! The governor chain (g, l, p), reconstructed from frequency alone.
//!
//! The chain is driven by f and nothing else (`g' = (K f - g)/T_G`, `l' = (g + T_1 g' - l)/T_2`, `p' = (l - p)/T_t`), so
//! the device can run a copy of it. Each tick advances the copy by the exact solution for a frequency that is linear
//! between two samples (first-order hold), with coefficients computed once from the table's plant parameters.
//!
//! Tradeoffs: f32 in GW and Hz. One rounding is at most 2^-23 relative, so a chain near 4 GW rounds by at most 0.5 kW a
//! tick, and the slowest mode (T_2) forgets it within T_2 / tick ticks: below 0.1 MW for T_2 = 12 s and 100 ms ticks.
//! Additions and products only, in a fixed order: host and target agree to the bit.

use crate::table::PlantParameters;
use crate::units::{MICRO, State};

/// Terms of the exponential series. The coefficients' scaled norm is below 1, so the remainder is below 1/17!.
const SERIES_TERMS: u32 = 16;
/// Chain states g, l, p, then the input's value and its slope over the tick.
const AUGMENTED: usize = 5;

/// Coefficients of one tick of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverConfig {
    /// Transition matrix of (g, l, p, f, Δf) over a tick; the last two rows are the identity's.
    transition: [[f32; AUGMENTED]; 3],
}

/// Why no observer can be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObserverError {
    /// A time constant of the chain is zero or below a quarter of a tick, which the series does not cover.
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

/// The chain's state as the device knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    config: ObserverConfig,
    /// g, l, p \[GW\].
    chain: [f32; 3],
    /// The last frequency \[Hz\].
    f_hz: f32,
}

impl Observer {
    /// An observer at rest at a frequency deviation \[µHz\]: the chain in its steady state g = l = p = K f.
    pub fn at_rest(config: ObserverConfig, plant: &PlantParameters, f_uhz: i32) -> Self {
        let f_hz = f_uhz as f32 / MICRO as f32;
        let rest = plant.governor_gain_kw_per_hz as f32 / MICRO as f32 * f_hz;
        Self {
            config,
            chain: [rest; 3],
            f_hz,
        }
    }

    /// Takes the frequency deviation measured at this tick \[µHz\] and returns the state estimate.
    pub fn step(&mut self, f_uhz: i32) -> State {
        let f_hz = f_uhz as f32 / MICRO as f32;
        let [g, l, p] = self.chain;
        let input = [g, l, p, self.f_hz, f_hz - self.f_hz];
        for (next, row) in self.chain.iter_mut().zip(&self.config.transition) {
            let mut acc = 0.0;
            for (coefficient, value) in row.iter().zip(&input) {
                acc += coefficient * value;
            }
            *next = acc;
        }
        self.f_hz = f_hz;
        self.estimate(f_uhz)
    }

    /// The estimate as it stands, with this frequency \[µHz\].
    fn estimate(&self, f_uhz: i32) -> State {
        let micro = |gw: f32| libm::floorf(gw * MICRO as f32) as i32;
        let [g, l, p] = self.chain;
        State([f_uhz, micro(g), micro(l), micro(p)])
    }
}
