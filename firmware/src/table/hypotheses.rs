//! What the proof of a table assumed of meter, clock, car, fleet and event.
//!
//! A charger compares it with what it is ([`crate::charger`]); the verifier holds it against the
//! spec. Intervals are `[least, most]`.

use super::bytes::HeaderWords;
use super::error::TableError;
use super::field::{self, Field};
use crate::units::{MICRO, STATES};

/// Which way the fleet's chargers can move power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Direction {
    /// Charging can be reduced, at most to nothing.
    Unidirectional = 0,
    /// Charging can be reversed.
    Bidirectional = 1,
}

/// How the loss moves inside its band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum LossProfile {
    /// As an adversary likes.
    Band = 0,
    /// It steps to one value and stays there.
    Constant = 1,
    /// It steps upwards, at any times.
    NonDecreasing = 2,
}

/// What the proof assumed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hypotheses {
    /// Bound on the estimate's error, lag apart, in the order f, g, l, p \[µHz, kW\].
    pub estimate_error: [u32; STATES],
    /// Age of what the meter reads \[ms\].
    pub meter_lag_ms: [u16; 2],
    /// Time from a command to its power \[ms\].
    pub actuation_delay_ms: [u16; 2],
    /// Relative error of the delivered participation \[ppm\].
    pub participation_relative_ppm: u32,
    /// Error of the delivered participation beside the relative one \[ppm of full scale\].
    pub participation_absolute_ppm: u32,
    /// Band of the lost power \[kW\].
    pub loss_kw: [i32; 2],
    /// How it moves in the band.
    pub loss_profile: LossProfile,
    /// Which way the chargers can move power.
    pub direction: Direction,
    /// Whether each charger decides at moments of its own, on readings of its own.
    pub own_clocks: bool,
    /// Longest time between two decisions \[ms\]; at least the tick.
    pub tick_most_ms: u16,
    /// H \[kW s/Hz\].
    pub inertia_kw_s_per_hz: [u32; 2],
    /// 1/R_eq \[kW/Hz\].
    pub governor_gain_kw_per_hz: [i32; 2],
    /// D \[kW/Hz\].
    pub damping_kw_per_hz: [u32; 2],
    /// Power by which one charger moves the balance at participation 1 \[W\].
    pub power_per_charger_w: u32,
    /// Chargers of the fleet.
    pub chargers: u32,
    /// Version of the table: a newer one has a larger number.
    pub table_version: u32,
    /// Version of the program that wrote it: major, minor and patch in bits 24.., 12.. and 0...
    pub generator: u32,
}

impl Hypotheses {
    /// The paper's bidirectional fleet: everything is known exactly, 2 GW are lost.
    pub const PAPER: Self = Self {
        estimate_error: [0; STATES],
        meter_lag_ms: [0; 2],
        actuation_delay_ms: [0; 2],
        participation_relative_ppm: 0,
        participation_absolute_ppm: 0,
        loss_kw: [2_000_000; 2],
        loss_profile: LossProfile::Band,
        direction: Direction::Bidirectional,
        own_clocks: false,
        tick_most_ms: 100,
        inertia_kw_s_per_hz: [4_000_000; 2],
        governor_gain_kw_per_hz: [-5_000_000; 2],
        damping_kw_per_hz: [1_000_000; 2],
        power_per_charger_w: 56_000,
        chargers: 25_000,
        table_version: 0,
        generator: 0,
    };

    /// The block of a header as it stands; own clocks are a flag before it.
    #[inline(always)]
    pub(super) fn decode(words: &HeaderWords, own_clocks: bool) -> Self {
        let times = |field: Field| [words.half(field.start), words.half(field.start + 2)];
        let signed = |field: Field| [words.signed(field.start), words.signed(field.start + 4)];
        let pair = |field: Field| [words.word(field.start), words.word(field.start + 4)];
        Self {
            estimate_error: words.four(field::ESTIMATE_ERROR.start),
            meter_lag_ms: times(field::METER_LAG),
            actuation_delay_ms: times(field::ACTUATION_DELAY),
            participation_relative_ppm: words.word(field::PARTICIPATION_RELATIVE.start),
            participation_absolute_ppm: words.word(field::PARTICIPATION_ABSOLUTE.start),
            loss_kw: signed(field::LOSS),
            loss_profile: match words.byte(field::LOSS_PROFILE.start) {
                1 => LossProfile::Constant,
                2 => LossProfile::NonDecreasing,
                _ => LossProfile::Band,
            },
            direction: match words.byte(field::DIRECTION.start) {
                1 => Direction::Bidirectional,
                _ => Direction::Unidirectional,
            },
            own_clocks,
            tick_most_ms: words.half(field::TICK_MOST.start),
            inertia_kw_s_per_hz: pair(field::INERTIA_BAND),
            governor_gain_kw_per_hz: signed(field::GOVERNOR_GAIN_BAND),
            damping_kw_per_hz: pair(field::DAMPING_BAND),
            power_per_charger_w: words.word(field::POWER_PER_CHARGER.start),
            chargers: words.word(field::CHARGERS.start),
            table_version: words.word(field::TABLE_VERSION.start),
            generator: words.word(field::GENERATOR.start),
        }
    }

    /// Whether every number of the block is in its range, and means something.
    pub(super) fn check(&self, words: &HeaderWords, tick_ms: u16) -> Result<(), TableError> {
        let check = |ok: bool, field: &Field| {
            if ok {
                Ok(())
            } else {
                Err(TableError::bad_field(field))
            }
        };
        let is = |field: &Field, number: u8| words.byte(field.start) == number;
        let profile = is(&field::LOSS_PROFILE, self.loss_profile as u8);
        check(profile, &field::LOSS_PROFILE)?;
        let direction = is(&field::DIRECTION, self.direction as u8);
        check(direction, &field::DIRECTION)?;
        let [low, high] = self.meter_lag_ms;
        check(low <= high, &field::METER_LAG)?;
        let [low, high] = self.actuation_delay_ms;
        check(low <= high, &field::ACTUATION_DELAY)?;
        let full = MICRO as u32;
        let relative = self.participation_relative_ppm < full;
        check(relative, &field::PARTICIPATION_RELATIVE)?;
        let absolute = self.participation_absolute_ppm < full;
        check(absolute, &field::PARTICIPATION_ABSOLUTE)?;
        let [low, high] = self.loss_kw;
        check(low <= high, &field::LOSS)?;
        check(self.tick_most_ms >= tick_ms, &field::TICK_MOST)?;
        let [low, high] = self.inertia_kw_s_per_hz;
        check(low > 0 && low <= high, &field::INERTIA_BAND)?;
        let [low, high] = self.governor_gain_kw_per_hz;
        check(low <= high, &field::GOVERNOR_GAIN_BAND)?;
        let [low, high] = self.damping_kw_per_hz;
        check(low <= high, &field::DAMPING_BAND)?;
        check(self.power_per_charger_w > 0, &field::POWER_PER_CHARGER)?;
        check(self.chargers > 0, &field::CHARGERS)
    }

    /// Writes the block into a header; own clocks are a flag of the header.
    pub(super) fn write(&self, mut put: impl FnMut(Field, &[u8])) {
        let words = self.estimate_error.map(u32::to_le_bytes);
        put(field::ESTIMATE_ERROR, words.as_flattened());
        let times = |ms: [u16; 2]| ms.map(u16::to_le_bytes);
        put(field::METER_LAG, times(self.meter_lag_ms).as_flattened());
        let delay = times(self.actuation_delay_ms);
        put(field::ACTUATION_DELAY, delay.as_flattened());
        let relative = self.participation_relative_ppm;
        put(field::PARTICIPATION_RELATIVE, &relative.to_le_bytes());
        let absolute = self.participation_absolute_ppm;
        put(field::PARTICIPATION_ABSOLUTE, &absolute.to_le_bytes());
        let signed = |ends: [i32; 2]| ends.map(i32::to_le_bytes);
        let ends = |ends: [u32; 2]| ends.map(u32::to_le_bytes);
        put(field::LOSS, signed(self.loss_kw).as_flattened());
        put(field::LOSS_PROFILE, &[self.loss_profile as u8]);
        put(field::DIRECTION, &[self.direction as u8]);
        put(field::TICK_MOST, &self.tick_most_ms.to_le_bytes());
        let inertia = ends(self.inertia_kw_s_per_hz);
        put(field::INERTIA_BAND, inertia.as_flattened());
        let gain = signed(self.governor_gain_kw_per_hz);
        put(field::GOVERNOR_GAIN_BAND, gain.as_flattened());
        let damping = ends(self.damping_kw_per_hz);
        put(field::DAMPING_BAND, damping.as_flattened());
        let power = self.power_per_charger_w;
        put(field::POWER_PER_CHARGER, &power.to_le_bytes());
        put(field::CHARGERS, &self.chargers.to_le_bytes());
        put(field::TABLE_VERSION, &self.table_version.to_le_bytes());
        put(field::GENERATOR, &self.generator.to_le_bytes());
    }
}
