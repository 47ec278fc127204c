//! What can be wrong at a tick, and what the charger does then.

use crate::frequency::FrequencyError;

/// Faults of one tick, as a set of bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Faults(u16);

impl Faults {
    /// No fault.
    pub const NONE: Self = Self(0);
    /// The metering chip did not answer.
    pub const BUS: Self = Self(1 << 0);
    /// No complete measurement.
    pub const NO_SIGNAL: Self = Self(1 << 1);
    /// The measurement is too old.
    pub const STALE: Self = Self(1 << 2);
    /// The measurement does not move.
    pub const STUCK: Self = Self(1 << 3);
    /// The measurement is out of range.
    pub const OUT_OF_RANGE: Self = Self(1 << 4);
    /// The measurement jumped.
    pub const IMPLAUSIBLE: Self = Self(1 << 5);
    /// The table was rejected at start-up.
    pub const TABLE_REJECTED: Self = Self(1 << 6);
    /// No law of the table covers the state.
    pub const OUTSIDE_DOMAIN: Self = Self(1 << 7);
    /// Ticks were missed and caught up.
    pub const OVERRUN: Self = Self(1 << 8);
    /// The clock jumped; the observer starts again.
    pub const CLOCK_JUMP: Self = Self(1 << 9);
    /// The controller restarted by brown-out or watchdog, and the observer is not trusted yet.
    pub const RESTARTED: Self = Self(1 << 10);
    /// The set-point did not reach the hardware.
    pub const DISPATCH: Self = Self(1 << 11);
    /// The charger is not what the proof of its table assumed.
    pub const MISFIT: Self = Self(1 << 12);
    /// The crystal does not run. The controller goes by its internal oscillator, and believes no
    /// frequency.
    pub const CLOCK: Self = Self(1 << 13);
    /// The last run was stopped by a panic, a hard fault or a crystal that failed.
    pub const STOPPED: Self = Self(1 << 14);
    /// Start after start did not come to a run ([`crate::retained`]). This one goes without
    /// settings, slots and orders, and offers nothing.
    pub const GUARDED: Self = Self(1 << 15);

    /// Every fault with its name, in the order of the bits.
    pub const NAMES: [(Self, &'static str); 16] = [
        (Self::BUS, "bus"),
        (Self::NO_SIGNAL, "no-signal"),
        (Self::STALE, "stale"),
        (Self::STUCK, "stuck"),
        (Self::OUT_OF_RANGE, "out-of-range"),
        (Self::IMPLAUSIBLE, "implausible"),
        (Self::TABLE_REJECTED, "table-rejected"),
        (Self::OUTSIDE_DOMAIN, "outside-domain"),
        (Self::OVERRUN, "overrun"),
        (Self::CLOCK_JUMP, "clock-jump"),
        (Self::RESTARTED, "restarted"),
        (Self::DISPATCH, "dispatch"),
        (Self::MISFIT, "misfit"),
        (Self::CLOCK, "clock"),
        (Self::STOPPED, "stopped"),
        (Self::GUARDED, "guarded"),
    ];

    /// The bits, as telemetry carries them.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// A set from its bits; unknown ones are kept.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Whether every fault of `other` is in this set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Adds the faults of another set.
    pub const fn insert(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// The faults of this set that are not in the other.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

impl From<FrequencyError> for Faults {
    fn from(error: FrequencyError) -> Self {
        match error {
            FrequencyError::Bus => Self::BUS,
            FrequencyError::Clock => Self::CLOCK,
            FrequencyError::NoSignal => Self::NO_SIGNAL,
            FrequencyError::Stale { .. } => Self::STALE,
            FrequencyError::Stuck { .. } => Self::STUCK,
            FrequencyError::OutOfRange { .. } => Self::OUT_OF_RANGE,
            FrequencyError::Implausible { .. } => Self::IMPLAUSIBLE,
        }
    }
}

/// Who decides the participation at a tick.
///
/// | mode | entered by | participation | left |
/// |---|---|---|---|
/// | `WarmUp` | start, clock jump, end of `Safe` | droop on f | when the observer is trusted |
/// | `Table` | a law covers the state | the table's | |
/// | `DroopOutside` | no law covers the state | droop on f | when a law covers it |
/// | `DroopNoTable` | the table was rejected | droop on f, the paper's | restart |
/// | `Hold` | no believed frequency | the last, held | frequency back, or `hold_ticks` |
/// | `Safe` | frequency lost for longer | released step by step | frequency back |
/// | `Release` | the end of an event | released while f is recovered | at zero; f below I1 |
/// | `DroopMisfit` | the charger does not fit its table | droop on f | restart |
///
/// Released step by step means: back to ordinary charging. In `Safe` without any signal the mains
/// is taken for gone, and nothing is energised. [`crate::event`] says when an event ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Mode {
    /// The observer is not trusted yet: droop.
    WarmUp = 0,
    /// The table decides.
    Table = 1,
    /// No law covers the state: droop.
    DroopOutside = 2,
    /// The table was rejected: droop.
    DroopNoTable = 3,
    /// Frequency lost for a moment: the last participation.
    Hold = 4,
    /// Frequency lost: back to ordinary charging.
    Safe = 5,
    /// The event is over: step by step back to ordinary charging.
    Release = 6,
    /// The charger is not what the proof of its table assumed: droop.
    DroopMisfit = 7,
}

impl Mode {
    /// Modes in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::WarmUp,
        Self::Table,
        Self::DroopOutside,
        Self::DroopNoTable,
        Self::Hold,
        Self::Safe,
        Self::Release,
        Self::DroopMisfit,
    ];
}

/// Why the controller started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// Power was applied, or a person pressed reset.
    PowerOn,
    /// The supply dipped.
    BrownOut,
    /// No tick was completed in time.
    Watchdog,
}
