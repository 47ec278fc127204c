//! Whether a charger is what the proof of its table assumed.
//!
//! Compared once, when the charger starts: the meter's error and lag, the tick, the direction and
//! the power. What a charger cannot know of itself (loss, inertia, the other chargers) is not
//! compared. Where something lies outside, the proof says nothing about this charger: it runs the
//! droop.

use crate::frequency::FrequencySource;
use crate::frequency::filter::Filter;
use crate::table::{Direction, Header, Hypotheses, TICK_MS_MAX};
use crate::units::MICRO;

/// What a meter says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeterFacts {
    /// Bound on a reading's error, lag apart \[µHz\].
    pub error_uhz: u32,
    /// Delay of a reading behind the frequency, for a ramp \[ms\].
    pub lag_ms: u16,
}

impl MeterFacts {
    /// Of a source.
    pub fn of<S: FrequencySource>(source: &S) -> Self {
        Self {
            error_uhz: source.error_uhz(),
            lag_ms: source.lag_ms(),
        }
    }
}

/// What a charger was built and configured as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Installation {
    /// Which way it can move power.
    pub direction: Direction,
    /// Power by which it moves the balance at participation 1 \[W\].
    pub power_w: u32,
    /// Longest tick that it keeps \[ms\]: its watchdog bites no sooner than after two of them.
    pub tick_most_ms: u16,
    /// Longest time that a change of its set-point waits for the one before \[ms\], see
    /// [`crate::dispatch::pace`].
    pub change_gap_ms: u16,
}

impl Installation {
    /// The reference charger with pilot and contactor: three phases of 230 V and 32 A.
    pub const REFERENCE_UNIDIRECTIONAL: Self = Self {
        direction: Direction::Unidirectional,
        power_w: 3 * 230 * 32,
        tick_most_ms: TICK_MS_MAX,
        change_gap_ms: 0,
    };
    /// The reference charger with a power stage: 28 kW both ways, the paper's swing of 56 kW.
    pub const REFERENCE_BIDIRECTIONAL: Self = Self {
        direction: Direction::Bidirectional,
        power_w: 2 * 28_000,
        tick_most_ms: TICK_MS_MAX,
        change_gap_ms: 0,
    };
}

/// The hypotheses that a charger does not meet, as a set of bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Misfits(u8);

impl Misfits {
    /// The charger is what was assumed.
    pub const NONE: Self = Self(0);
    /// The meter's error is larger.
    pub const METER_ERROR: Self = Self(1 << 0);
    /// The meter's lag, the filter's included, lies outside.
    pub const METER_LAG: Self = Self(1 << 1);
    /// The table's tick is longer than the charger keeps.
    pub const TICK: Self = Self(1 << 2);
    /// The charger moves power the other way.
    pub const DIRECTION: Self = Self(1 << 3);
    /// The charger's power is another, by more than the participation's error.
    pub const POWER: Self = Self(1 << 4);
    /// A change of the set-point may wait longer than a command may take to act.
    pub const PACE: Self = Self(1 << 5);

    /// Every misfit with its name, in the order of the bits.
    pub const NAMES: [(Self, &'static str); 6] = [
        (Self::METER_ERROR, "meter-error"),
        (Self::METER_LAG, "meter-lag"),
        (Self::TICK, "tick"),
        (Self::DIRECTION, "direction"),
        (Self::POWER, "power"),
        (Self::PACE, "pace"),
    ];

    /// The bits, as telemetry carries them.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether every misfit of `other` is in this set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The names of those in the set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES
            .into_iter()
            .filter(move |(misfit, _)| self.contains(*misfit))
            .map(|(_, name)| name)
    }

    const fn insert_if(&mut self, outside: bool, misfit: Self) {
        if outside {
            self.0 |= misfit.0;
        }
    }
}

/// Compares a charger with the header of its table.
pub fn misfits(
    header: &Header,
    installation: &Installation,
    meter: MeterFacts,
    filter: &Filter,
) -> Misfits {
    let assumed: &Hypotheses = &header.hypotheses;
    let mut found = Misfits::NONE;
    let [error_uhz, ..] = assumed.estimate_error;
    found.insert_if(meter.error_uhz > error_uhz, Misfits::METER_ERROR);
    let lag_ms =
        u32::from(meter.lag_ms) + filter.lag_half_ticks() as u32 * u32::from(header.tick_ms) / 2;
    let [least, most] = assumed.meter_lag_ms.map(u32::from);
    found.insert_if(lag_ms < least || lag_ms > most, Misfits::METER_LAG);
    let longest = assumed.tick_most_ms.min(installation.tick_most_ms);
    found.insert_if(header.tick_ms > longest, Misfits::TICK);
    found.insert_if(
        installation.direction != assumed.direction,
        Misfits::DIRECTION,
    );
    let power_w = assumed.power_per_charger_w;
    // In W ppm: below 2^32 · 2^20, and twice that.
    let off = u64::from(installation.power_w.abs_diff(power_w)) * MICRO as u64;
    let share = u64::from(assumed.participation_relative_ppm)
        + u64::from(assumed.participation_absolute_ppm);
    found.insert_if(off > u64::from(power_w) * share, Misfits::POWER);
    let [_, latest_ms] = assumed.actuation_delay_ms;
    found.insert_if(installation.change_gap_ms > latest_ms, Misfits::PACE);
    found
}
