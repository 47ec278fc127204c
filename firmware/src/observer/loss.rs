//! The lost power w, estimated from what frequency, turbine and fleet did.
//!
//! `2H f' = p + P u - w - D f`, integrated over a window of W ticks of length h, needs no
//! derivative:
//!
//! `w = mean(p + P u - D f) - 2H (f_now - f_W_ticks_ago) / (W h)`
//!
//! with trapezoids for p and f, which are continuous, and the held value for u. For a constant w
//! the estimate is exact up to the error bound of [`LossEstimator::error_kw`] once the window lies
//! behind the onset: W h = 1 s.

use super::config::{ObserverConfig, floor};
use crate::units::MICRO;

/// Ticks of the window.
pub const WINDOW_TICKS: usize = 10;

/// Balance of power over the last [`WINDOW_TICKS`] ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossEstimator {
    /// `p + P u - D f` of each tick \[GW\], and the frequency at its start \[Hz\].
    power_gw: [f32; WINDOW_TICKS],
    start_hz: [f32; WINDOW_TICKS],
    next: usize,
    filled: usize,
    /// p and f at the last tick.
    last: Option<(f32, f32)>,
}

impl LossEstimator {
    /// An empty window.
    pub const EMPTY: Self = Self {
        power_gw: [0.0; WINDOW_TICKS],
        start_hz: [0.0; WINDOW_TICKS],
        next: 0,
        filled: 0,
        last: None,
    };

    /// Takes turbine power \[GW\] and frequency deviation \[Hz\] at this tick and the fleet's power
    /// during the tick that ends now \[GW\]; the loss \[kW\] once the window is full.
    pub(super) fn step(
        &mut self,
        config: &ObserverConfig,
        p_gw: f32,
        f_hz: f32,
        fleet_gw: f32,
    ) -> Option<i32> {
        self.note(config, p_gw, f_hz, fleet_gw);
        if self.filled < WINDOW_TICKS {
            return None;
        }
        // The slot that the next tick overwrites is the oldest.
        let oldest_hz = self.start_hz.get(self.next).copied().unwrap_or(f_hz);
        let mut sum = 0.0;
        for power in self.power_gw {
            sum += power;
        }
        let mean = sum / WINDOW_TICKS as f32;
        let slope = (f_hz - oldest_hz) / (WINDOW_TICKS as f32 * config.tick_s);
        let loss = mean - config.twice_inertia * slope;
        Some(floor(loss * MICRO as f32))
    }

    /// The same for a tick whose loss nobody asks for.
    pub(super) fn note(&mut self, config: &ObserverConfig, p_gw: f32, f_hz: f32, fleet_gw: f32) {
        let Some((p_before, f_before)) = self.last.replace((p_gw, f_hz)) else {
            return;
        };
        let power = 0.5 * (p_before + p_gw) - config.damping * (0.5 * (f_before + f_hz)) + fleet_gw;
        if let (Some(slot), Some(start)) = (
            self.power_gw.get_mut(self.next),
            self.start_hz.get_mut(self.next),
        ) {
            *slot = power;
            *start = f_before;
        }
        self.next = if self.next + 1 < WINDOW_TICKS {
            self.next + 1
        } else {
            0
        };
        self.filled = (self.filled + 1).min(WINDOW_TICKS);
    }

    /// Forgets the window, after a gap in the readings.
    pub fn reset(&mut self) {
        *self = Self::EMPTY;
    }

    /// Bound on the estimate's error for a constant loss \[kW\], from the error of a reading
    /// \[µHz\], that of p \[kW\] and what the fleet may deliver more or less than commanded \[kW\]:
    /// `2H · 2 eps / (W h) + D eps + e_p + e_fleet`, and the trapezoids' `h²/8` terms, below 1 MW
    /// for the paper's event.
    pub fn error_kw(
        plant: &crate::table::PlantParameters,
        tick_ms: u16,
        eps_uhz: u32,
        turbine_kw: u32,
        fleet_kw: u32,
    ) -> u32 {
        let window_ms = WINDOW_TICKS as u64 * u64::from(tick_ms).max(1);
        // kW s/Hz · µHz / ms = 1e-3 kW.
        let slope =
            4 * u64::from(plant.inertia_kw_s_per_hz) * u64::from(eps_uhz) / (window_ms * 1000) + 1;
        let damping = u64::from(plant.damping_kw_per_hz) * u64::from(eps_uhz) / MICRO as u64 + 1;
        let sum = slope + damping + u64::from(turbine_kw) + u64::from(fleet_kw) + 1000;
        u32::try_from(sum).unwrap_or(u32::MAX)
    }
}
