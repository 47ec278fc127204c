//! The header: 172 bytes that carry every number of the spec that the device needs.
//!
//! | offset | bytes | field | unit |
//! |---:|---:|---|---|
//! | 0 | 4 | magic `HFDT` | |
//! | 4 | 2 | byte-order mark 0xFEFF | |
//! | 6 | 2 | format version | |
//! | 8 | 4 | total length, CRC included | bytes |
//! | 12 | 16 | spec hash (first half of SHA-256) | |
//! | 28 | 4 × 4 | lower edge of the first cell, f g l p | µHz, kW |
//! | 44 | 4 × 4 | cell width, f g l p | µHz, kW |
//! | 60 | 4 × 2 | cells, f g l p | |
//! | 68 | 4 | input step | ppm |
//! | 72 | 1 | input levels (1..=32) | |
//! | 73 | 1 | flags: bit 0 `stay` | |
//! | 74 | 2 | tick | ms |
//! | 76 | 2 | ticks a period | |
//! | 78 | 2 | delay of the commands (0..=64) | ticks |
//! | 80 | 2 × 4 | I1: low, high | µHz |
//! | 88 | 2 × 4 | I2: low, high | µHz |
//! | 96 | 2 × 4 | droop: dead band, full response | µHz |
//! | 104 | 8 × 4 | plant: 1/R_eq, T_G, T_t, T_1, T_2, D, H, fleet | kW/Hz, ms…, see [`PlantParameters`] |
//! | 136 | 3 × 12 | directory: C1, C2, Hold | see [`LawEntry`] |
//! | 172 | | prediction part ([`crate::prediction`]), if the delay is not 0; then blocks | |
//! | end - 4 | 4 | CRC-32 of all before it | |

use super::bytes::{array_at, byte_at, i32_at, u16_at, u32_at};
use super::{TableError, checksum};
use crate::droop::Droop;
use crate::grid::Grid;
use crate::prediction::{DELAY_TICKS_MAX, prediction_len};
use crate::units::{Band, MICRO, Participation, STATES};

/// First bytes of every table: "Holdfast decision table".
pub const MAGIC: [u8; 4] = *b"HFDT";
/// Byte-order mark as a little-endian reader must find it.
pub const BYTE_ORDER_MARK: u16 = 0xFEFF;
/// The version of the format that this module reads and writes.
pub const FORMAT_VERSION: u16 = 2;
/// Bytes of the spec hash.
pub const SPEC_HASH_LEN: usize = 16;
/// Laws that a table may hold.
pub const LAWS: usize = 3;
/// Bytes of a directory entry.
pub const DIRECTORY_ENTRY_LEN: usize = 12;
/// Offset of the directory.
pub(super) const DIRECTORY_AT: usize = 136;
/// Bytes of the header, directory included.
pub const HEADER_LEN: usize = DIRECTORY_AT + LAWS * DIRECTORY_ENTRY_LEN;
/// Bytes of the CRC at the end.
pub const CRC_LEN: usize = 4;
/// Most input levels a table may have.
pub const LEVELS_MAX: u8 = 32;

/// A law of the table, in the order of the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Law {
    /// Reaches I1.
    C1 = 0,
    /// Reaches I2.
    C2 = 1,
    /// Stays in I2.
    Hold = 2,
}

impl Law {
    /// All laws in the order of the directory.
    pub const ALL: [Self; LAWS] = [Self::C1, Self::C2, Self::Hold];
}

/// Directory entry of a law: kinds and lengths of its two parts; an absent law has kind 255 and zeros.
///
/// | offset | bytes | field |
/// |---:|---:|---|
/// | 0 | 1 | kind of the domain part |
/// | 1 | 1 | kind of the inputs part |
/// | 2 | 2 | worst visits of a lookup, both parts |
/// | 4 | 4 | bytes of the domain part |
/// | 8 | 4 | bytes of the inputs part |
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

/// Kind in the directory of a law that the table does not hold.
pub(super) const ABSENT: u8 = 255;

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
    /// Length of a tick, `sampling.watch_s` \[ms\].
    pub tick_ms: u16,
    /// Ticks for which C1, C2 and Hold hold a decision; not zero.
    pub period_ticks: u16,
    /// Ticks from a command to its power, 0..=[`DELAY_TICKS_MAX`].
    pub delay_ticks: u16,
    /// I1.
    pub outer: Band,
    /// I2.
    pub inner: Band,
    /// The fallback.
    pub droop: Droop,
    /// The plant, for the observer.
    pub plant: PlantParameters,
    /// The directory, indexed by [`Law`].
    pub laws: [Option<LawEntry>; LAWS],
}

impl Header {
    /// Participation of an input level; levels past the last saturate at the whole fleet.
    pub const fn participation(&self, level: u8) -> Participation {
        Participation::from_ppm(self.input_step_ppm.saturating_mul(level as u32))
    }

    /// Reads and checks the header, the length and the CRC.
    ///
    /// # Errors
    /// The first check that fails, in the order magic, byte order, version, length, CRC, fields.
    pub fn parse(bytes: &[u8]) -> Result<Self, TableError> {
        let needed = HEADER_LEN + CRC_LEN;
        if bytes.len() < needed {
            return Err(TableError::TooShort {
                found: bytes.len() as u32,
                needed: needed as u32,
            });
        }
        let magic = array_at(bytes, 0).unwrap_or_default();
        if magic != MAGIC {
            return Err(TableError::BadMagic { found: magic });
        }
        match u16_at(bytes, 4) {
            BYTE_ORDER_MARK => {}
            swapped if swapped == BYTE_ORDER_MARK.swap_bytes() => {
                return Err(TableError::WrongEndianness);
            }
            found => return Err(TableError::BadByteOrderMark { found }),
        }
        let version = u16_at(bytes, 6);
        if version != FORMAT_VERSION {
            return Err(TableError::UnsupportedVersion {
                found: version,
                supported: FORMAT_VERSION,
            });
        }
        let stated = u32_at(bytes, 8);
        if stated as usize != bytes.len() {
            return Err(TableError::WrongLength {
                found: bytes.len() as u32,
                stated,
            });
        }
        let (body, trailer) = bytes.split_at(bytes.len() - CRC_LEN);
        let (computed, stored) = (checksum(body), u32_at(trailer, 0));
        if computed != stored {
            return Err(TableError::BadCrc { computed, stored });
        }
        Self::fields(bytes)
    }

    fn fields(bytes: &[u8]) -> Result<Self, TableError> {
        let check = |ok: bool, offset: u16| {
            if ok {
                Ok(())
            } else {
                Err(TableError::BadField { offset })
            }
        };
        let mut lower = [0i32; STATES];
        let mut width = [0u32; STATES];
        let mut count = [0u16; STATES];
        for axis in 0..STATES {
            lower[axis] = i32_at(bytes, 28 + 4 * axis);
            width[axis] = u32_at(bytes, 44 + 4 * axis);
            count[axis] = u16_at(bytes, 60 + 2 * axis);
        }
        let grid = Grid::new(lower, width, count).map_err(TableError::BadGrid)?;
        let input_step_ppm = u32_at(bytes, 68);
        let levels = bytes[72];
        check((1..=LEVELS_MAX).contains(&levels), 72)?;
        let full = u64::from(input_step_ppm) * u64::from(levels - 1);
        check(full <= MICRO as u64, 68)?;
        let flags = bytes[73];
        check(flags & !1 == 0, 73)?;
        let (tick_ms, period_ticks) = (u16_at(bytes, 74), u16_at(bytes, 76));
        check(tick_ms > 0, 74)?;
        check(period_ticks > 0, 76)?;
        let delay_ticks = u16_at(bytes, 78);
        // The prediction part lies between header and blocks.
        let least = HEADER_LEN + prediction_len(delay_ticks) + CRC_LEN;
        check(delay_ticks <= DELAY_TICKS_MAX && bytes.len() >= least, 78)?;
        let band = |at| Band {
            low_uhz: i32_at(bytes, at),
            high_uhz: i32_at(bytes, at + 4),
        };
        let (outer, inner) = (band(80), band(88));
        check(outer.low_uhz < outer.high_uhz, 80)?;
        let nested = outer.low_uhz <= inner.low_uhz && inner.high_uhz <= outer.high_uhz;
        check(nested && inner.low_uhz < inner.high_uhz, 88)?;
        let droop = Droop {
            deadband_uhz: u32_at(bytes, 96),
            full_uhz: u32_at(bytes, 100),
        };
        check(droop.full_uhz > 0, 100)?;
        let plant = PlantParameters {
            governor_gain_kw_per_hz: i32_at(bytes, 104),
            governor_time_us: u32_at(bytes, 108),
            turbine_time_us: u32_at(bytes, 112),
            lead_time_us: u32_at(bytes, 116),
            lag_time_us: u32_at(bytes, 120),
            damping_kw_per_hz: u32_at(bytes, 124),
            inertia_kw_s_per_hz: u32_at(bytes, 128),
            fleet_kw: u32_at(bytes, 132),
        };
        check(plant.governor_time_us > 0, 108)?;
        check(plant.turbine_time_us > 0, 112)?;
        check(plant.lag_time_us > 0, 120)?;
        check(plant.inertia_kw_s_per_hz > 0, 128)?;
        let mut laws = [None; LAWS];
        for (index, law) in laws.iter_mut().enumerate() {
            *law = Self::entry(bytes, DIRECTORY_AT + index * DIRECTORY_ENTRY_LEN)?;
        }
        Ok(Self {
            spec_hash: array_at(bytes, 12).unwrap_or_default(),
            grid,
            input_step_ppm,
            levels,
            stay: flags & 1 == 1,
            tick_ms,
            period_ticks,
            delay_ticks,
            outer,
            inner,
            droop,
            plant,
            laws,
        })
    }

    fn entry(bytes: &[u8], at: usize) -> Result<Option<LawEntry>, TableError> {
        let entry = LawEntry {
            domain_kind: byte_at(bytes, at),
            inputs_kind: byte_at(bytes, at + 1),
            worst_visits: u16_at(bytes, at + 2),
            domain_len: u32_at(bytes, at + 4),
            inputs_len: u32_at(bytes, at + 8),
        };
        if entry.inputs_kind != ABSENT {
            return Ok(Some(entry));
        }
        let empty = entry.domain_kind == ABSENT
            && entry.worst_visits == 0
            && entry.domain_len == 0
            && entry.inputs_len == 0;
        if empty {
            Ok(None)
        } else {
            Err(TableError::BadField { offset: at as u16 })
        }
    }
}
