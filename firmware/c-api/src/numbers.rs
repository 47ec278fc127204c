//! Enumerations and bits, as C sees them; the library's own numbers, held to them by the compiler.
//!
//! C passes any byte. So nothing that comes from C has one of these types: they name the bytes.

use firmware::charger::Misfits;
use firmware::fault::Faults;

/// Version of this interface; the first field of a configuration.
pub const HOLDFAST_VERSION: u32 = 1;
/// No limit, in a limit of the input.
pub const HOLDFAST_NO_LIMIT: u32 = 0xFFFF_FFFF;
/// The meter's error is not known yet: the configuration is refused.
pub const HOLDFAST_METER_UNKNOWN: u32 = 0xFFFF_FFFF;
/// Ticks of warm-up by the plant that the table names.
pub const HOLDFAST_WARM_UP_BY_PLANT: u16 = 0xFFFF;

/// How a call ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, but the table is rejected: the provider runs the droop. holdfast_read_table says why.
    TableRejected = 1,
    /// Done, but the charger is not what the table's proof assumed: the provider runs the droop.
    Misfit = 2,
    /// A pointer is NULL.
    Null = 16,
    /// The memory is too small: its size must be that of the type in this header.
    TooSmall = 17,
    /// A pointer is not aligned for its type.
    Misaligned = 18,
    /// The memory holds nothing yet: call the init function first.
    NotInitialised = 19,
    /// The configuration is of another version of this header.
    WrongVersion = 20,
    /// Neither unidirectional nor bidirectional.
    BadDirection = 21,
    /// Not 1 to 3 phases of 1 to 1000 V.
    BadConnection = 22,
    /// A power of 0 W.
    BadPower = 23,
    /// A longest tick of 0 ms.
    BadTick = 24,
    /// The meter's error is not given, or more than 10 Hz.
    BadMeter = 25,
    /// Limits on readings of zero, or a range of more than 10 Hz.
    BadGate = 26,
    /// A filter of none or more than 8 ticks.
    BadFilter = 27,
    /// A release that never ends, or of more than 1000000 ppm a tick.
    BadRelease = 28,
    /// Not a cause of a reset.
    BadResetCause = 29,
    /// A timer below 50 kHz or above 200 MHz.
    BadTimer = 30,
    /// A window of none or more than 16 cycles.
    BadCycles = 31,
    /// Neither 50 nor 60 Hz.
    BadNominal = 32,
    /// A jitter of more than 1 ms, or a clock that is wrong by more than 1000 ppm.
    BadClock = 33,
}

/// Which way the charger can move power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Direction {
    /// Charging can be reduced, at most to nothing.
    Unidirectional = 0,
    /// Charging can be reversed.
    Bidirectional = 1,
}

/// What the meter has to say at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Reading {
    /// The mains is not there, or nothing was measured yet.
    None = 0,
    /// The deviation is valid.
    Valid = 1,
    /// The meter did not answer. Any other number counts as this.
    MeterFailed = 2,
}

/// Why the controller started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ResetCause {
    /// Power was applied, or a person pressed reset.
    PowerOn = 0,
    /// The supply dipped.
    BrownOut = 1,
    /// The watchdog bit.
    Watchdog = 2,
}

/// Who decided at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// The state estimate is not trusted yet: droop.
    WarmUp = 0,
    /// The table.
    Table = 1,
    /// No law of the table covers the state: droop.
    DroopOutside = 2,
    /// The table was rejected: droop.
    DroopNoTable = 3,
    /// Frequency lost for a moment: the last participation.
    Hold = 4,
    /// Frequency lost: back to ordinary charging.
    Safe = 5,
    /// The event is over: step by step back to ordinary charging.
    Release = 6,
    /// The charger is not what the table's proof assumed: droop.
    DroopMisfit = 7,
}

/// The law in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// No event.
    NoControl = 0,
    /// The law that reaches the outer band.
    C1 = 1,
    /// The law that reaches the inner band.
    C2 = 2,
    /// The last participation is held.
    Fixed = 3,
    /// The law that keeps the frequency in the inner band.
    Hold = 4,
    /// The droop.
    Fallback = 5,
    /// The law that is always on.
    Response = 6,
}

/// Why a table was rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum TableFault {
    /// It was not.
    None = 0,
    /// Fewer bytes than a header.
    TooShort = 1,
    /// Not a table: erased or foreign flash.
    BadMagic = 2,
    /// Bytes in the wrong order.
    ByteOrder = 3,
    /// Another version of the format.
    UnsupportedVersion = 4,
    /// The header's length is not the table's.
    WrongLength = 5,
    /// The CRC does not match.
    BadCrc = 6,
    /// Made for another device.
    ForeignSpec = 7,
    /// The header's grid is impossible.
    BadGrid = 8,
    /// A field of the header is out of its range.
    BadField = 9,
    /// The block of a law is malformed.
    BadBlock = 10,
}

/// Fault: the meter did not answer.
pub const HOLDFAST_FAULT_BUS: u16 = 1;
/// Fault: no complete measurement.
pub const HOLDFAST_FAULT_NO_SIGNAL: u16 = 2;
/// Fault: the reading is too old.
pub const HOLDFAST_FAULT_STALE: u16 = 4;
/// Fault: the reading does not move.
pub const HOLDFAST_FAULT_STUCK: u16 = 8;
/// Fault: the reading is out of range.
pub const HOLDFAST_FAULT_OUT_OF_RANGE: u16 = 16;
/// Fault: the reading jumped.
pub const HOLDFAST_FAULT_IMPLAUSIBLE: u16 = 32;
/// Fault: the table was rejected.
pub const HOLDFAST_FAULT_TABLE_REJECTED: u16 = 64;
/// Fault: no law of the table covers the state.
pub const HOLDFAST_FAULT_OUTSIDE_DOMAIN: u16 = 128;
/// Fault: ticks were missed and caught up.
pub const HOLDFAST_FAULT_OVERRUN: u16 = 256;
/// Fault: the clock jumped.
pub const HOLDFAST_FAULT_CLOCK_JUMP: u16 = 512;
/// Fault: restarted by brown-out or watchdog, and not trusted yet.
pub const HOLDFAST_FAULT_RESTARTED: u16 = 1024;
/// Fault: the charger is not what the table's proof assumed.
pub const HOLDFAST_FAULT_MISFIT: u16 = 4096;

/// Misfit: the meter's error is larger than the proof assumed.
pub const HOLDFAST_MISFIT_METER_ERROR: u8 = 1;
/// Misfit: the meter's lag lies outside.
pub const HOLDFAST_MISFIT_METER_LAG: u8 = 2;
/// Misfit: the table's tick is longer than the charger keeps.
pub const HOLDFAST_MISFIT_TICK: u8 = 4;
/// Misfit: the charger moves power the other way.
pub const HOLDFAST_MISFIT_DIRECTION: u8 = 8;
/// Misfit: the charger's power is another.
pub const HOLDFAST_MISFIT_POWER: u8 = 16;
/// Misfit: a change of the set-point may wait too long; the provider never says so.
pub const HOLDFAST_MISFIT_PACE: u8 = 32;

/// Compile-time equality with the library's numbers.
macro_rules! same {
    ($($ours:expr => $theirs:expr),+ $(,)?) => {
        $(const _: () = assert!($ours as u32 == $theirs as u32);)+
    };
}

same! {
    HOLDFAST_FAULT_BUS => Faults::BUS.bits(),
    HOLDFAST_FAULT_NO_SIGNAL => Faults::NO_SIGNAL.bits(),
    HOLDFAST_FAULT_STALE => Faults::STALE.bits(),
    HOLDFAST_FAULT_STUCK => Faults::STUCK.bits(),
    HOLDFAST_FAULT_OUT_OF_RANGE => Faults::OUT_OF_RANGE.bits(),
    HOLDFAST_FAULT_IMPLAUSIBLE => Faults::IMPLAUSIBLE.bits(),
    HOLDFAST_FAULT_TABLE_REJECTED => Faults::TABLE_REJECTED.bits(),
    HOLDFAST_FAULT_OUTSIDE_DOMAIN => Faults::OUTSIDE_DOMAIN.bits(),
    HOLDFAST_FAULT_OVERRUN => Faults::OVERRUN.bits(),
    HOLDFAST_FAULT_CLOCK_JUMP => Faults::CLOCK_JUMP.bits(),
    HOLDFAST_FAULT_RESTARTED => Faults::RESTARTED.bits(),
    HOLDFAST_FAULT_MISFIT => Faults::MISFIT.bits(),
    HOLDFAST_MISFIT_METER_ERROR => Misfits::METER_ERROR.bits(),
    HOLDFAST_MISFIT_METER_LAG => Misfits::METER_LAG.bits(),
    HOLDFAST_MISFIT_TICK => Misfits::TICK.bits(),
    HOLDFAST_MISFIT_DIRECTION => Misfits::DIRECTION.bits(),
    HOLDFAST_MISFIT_POWER => Misfits::POWER.bits(),
    HOLDFAST_MISFIT_PACE => Misfits::PACE.bits(),
    Direction::Unidirectional => firmware::table::Direction::Unidirectional,
    Direction::Bidirectional => firmware::table::Direction::Bidirectional,
    Mode::WarmUp => firmware::fault::Mode::WarmUp,
    Mode::Table => firmware::fault::Mode::Table,
    Mode::DroopOutside => firmware::fault::Mode::DroopOutside,
    Mode::DroopNoTable => firmware::fault::Mode::DroopNoTable,
    Mode::Hold => firmware::fault::Mode::Hold,
    Mode::Safe => firmware::fault::Mode::Safe,
    Mode::Release => firmware::fault::Mode::Release,
    Mode::DroopMisfit => firmware::fault::Mode::DroopMisfit,
    Phase::NoControl => firmware::phase::Phase::NoControl,
    Phase::C1 => firmware::phase::Phase::C1,
    Phase::C2 => firmware::phase::Phase::C2,
    Phase::Fixed => firmware::phase::Phase::Fixed,
    Phase::Hold => firmware::phase::Phase::Hold,
    Phase::Fallback => firmware::phase::Phase::Fallback,
    Phase::Response => firmware::phase::Phase::Response,
}

// A mode, phase, fault or misfit that is added must get its number above.
const _: () = assert!(firmware::fault::Mode::ALL.len() == 8);
const _: () = assert!(firmware::phase::Phase::ALL.len() == 7);
const _: () = assert!(Misfits::NAMES.len() == 6);
// All but DISPATCH, CLOCK, STOPPED and GUARDED: the provider drives no hardware, has no clock and
// starts nothing.
const _: () = assert!(Faults::NAMES.len() == 12 + 4);
