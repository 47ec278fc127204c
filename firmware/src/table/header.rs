//! What the header says: every number of the spec that the device needs.
//!
//! Where each field stands is in [`super::field`]; reader and writer are in `header_bytes`.

use super::field::SPEC_HASH_LEN;
use super::hypotheses::Hypotheses;
use super::law_name::LAWS;
use crate::droop::Droop;
use crate::grid::Grid;
use crate::units::{Band, Participation};

/// Most input levels a table may have.
pub const LEVELS_MAX: u8 = 32;
/// Longest tick \[ms\]: half of the shortest time after which a board's watchdog bites.
pub const TICK_MS_MAX: u16 = 200;

/// Directory entry of a law: kinds and lengths of its two parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawEntry {
    /// How membership of the domain is stored.
    pub domain_kind: u8,
    /// How the inputs are stored.
    pub inputs_kind: u8,
    /// Most nodes, entries or half-spaces that a lookup visits.
    pub worst_visits: u16,
    /// Bytes of the domain part.
    pub domain_len: u32,
    /// Bytes of the inputs part.
    pub inputs_len: u32,
}

/// Plant of the spec, for the observer: integers, so that no rounding is left to the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlantParameters {
    /// 1/R_eq \[kW/Hz\], negative.
    pub governor_gain_kw_per_hz: i32,
    /// T_G \[µs\].
    pub governor_time_us: u32,
    /// T_t \[µs\].
    pub turbine_time_us: u32,
    /// T_1 \[µs\].
    pub lead_time_us: u32,
    /// T_2 \[µs\].
    pub lag_time_us: u32,
    /// D \[kW/Hz\].
    pub damping_kw_per_hz: u32,
    /// H \[kW s/Hz\]; 2H multiplies f'.
    pub inertia_kw_s_per_hz: u32,
    /// Fleet power N_ev p_av \[kW\].
    pub fleet_kw: u32,
}

impl PlantParameters {
    /// The paper's Table I with the bidirectional fleet.
    pub const PAPER: Self = Self {
        governor_gain_kw_per_hz: -5_000_000,
        governor_time_us: 2_500_000,
        turbine_time_us: 500_000,
        lead_time_us: 2_000_000,
        lag_time_us: 12_000_000,
        damping_kw_per_hz: 1_000_000,
        inertia_kw_s_per_hz: 4_000_000,
        fleet_kw: 1_400_000,
    };
}

/// The header of a table, decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// First half of the SHA-256 of the spec.
    pub spec_hash: [u8; SPEC_HASH_LEN],
    /// Grid of the abstraction.
    pub grid: Grid,
    /// Difference between neighbouring input levels \[ppm of the fleet\].
    pub input_step_ppm: u32,
    /// Input levels, 1..=32.
    pub levels: u8,
    /// Whether Hold follows C1 and C2 (otherwise Fixed).
    pub stay: bool,
    /// Whether the table is a response: a law that is always on, in place of C1, C2 and Hold.
    pub always_on: bool,
    /// Length of a tick, `sampling.watch_s` \[ms\], at most [`TICK_MS_MAX`].
    pub tick_ms: u16,
    /// Ticks for which C1, C2 and Hold hold a decision; not zero.
    pub period_ticks: u16,
    /// Ticks from a command to its power, at most [`crate::prediction::DELAY_TICKS_MAX`].
    pub delay_ticks: u16,
    /// I1.
    pub outer: Band,
    /// I2.
    pub inner: Band,
    /// The fallback.
    pub droop: Droop,
    /// The plant, for the observer.
    pub plant: PlantParameters,
    /// What the proof assumed.
    pub hypotheses: Hypotheses,
    /// The directory, indexed by [`Law`](super::Law).
    pub laws: [Option<LawEntry>; LAWS],
}

impl Header {
    /// Participation of an input level; levels past the last saturate at the whole fleet.
    pub const fn participation(&self, level: u8) -> Participation {
        Participation::from_ppm(self.input_step_ppm.saturating_mul(level as u32))
    }
}

/// What a charger needs of the header at every tick, kept at hand; the rest is read anew from the
/// image when somebody asks ([`TableView::header`](super::TableView::header)).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Working {
    /// Grid of the abstraction.
    pub grid: Grid,
    /// Difference between neighbouring input levels \[ppm of the fleet\].
    pub input_step_ppm: u32,
    /// Input levels, 1..=32.
    pub levels: u8,
    /// Whether Hold follows C1 and C2 (otherwise Fixed).
    pub stay: bool,
    /// Whether the table is a response.
    pub always_on: bool,
    /// Length of a tick \[ms\].
    pub tick_ms: u16,
    /// Ticks for which C1, C2 and Hold hold a decision; not zero.
    pub period_ticks: u16,
    /// Ticks from a command to its power.
    pub delay_ticks: u16,
    /// I1.
    pub outer: Band,
    /// I2.
    pub inner: Band,
    /// The fallback.
    pub droop: Droop,
}

impl Working {
    /// Of a header.
    pub(super) const fn of(header: &Header) -> Self {
        Self {
            grid: header.grid,
            input_step_ppm: header.input_step_ppm,
            levels: header.levels,
            stay: header.stay,
            always_on: header.always_on,
            tick_ms: header.tick_ms,
            period_ticks: header.period_ticks,
            delay_ticks: header.delay_ticks,
            outer: header.outer,
            inner: header.inner,
            droop: header.droop,
        }
    }

    /// Participation of an input level; levels past the last saturate at the whole fleet.
    pub const fn participation(&self, level: u8) -> Participation {
        Participation::from_ppm(self.input_step_ppm.saturating_mul(level as u32))
    }
}
