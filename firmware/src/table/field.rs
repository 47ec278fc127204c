//! Where each field of the header stands, in bytes from the start of the image.
//!
//! Reader, writer, tests and error messages use these ranges and no other numbers. To add a field,
//! add its range to [`ALL`] in its place and move those behind it; the compiler checks that the
//! fields follow one another without gaps.

use core::ops::Range;

/// A stretch of bytes in the image, or in an entry of the directory.
pub type Field = Range<usize>;

/// First bytes of every table.
pub const MAGIC: Field = 0..4;
/// Byte-order mark, u16.
pub const BYTE_ORDER: Field = 4..6;
/// Version of the format, u16.
pub const VERSION: Field = 6..8;
/// Total length, CRC included, u32 \[bytes\].
pub const LENGTH: Field = 8..12;
/// First half of the spec's SHA-256.
pub const SPEC_HASH: Field = 12..28;
/// Its bytes.
pub const SPEC_HASH_LEN: usize = SPEC_HASH.end - SPEC_HASH.start;
/// Lower edge of the first cell, f g l p, i32 \[µHz, kW\].
pub const LOWER_EDGE: Field = 28..44;
/// Cell width, f g l p, u32 \[µHz, kW\].
pub const WIDTH: Field = 44..60;
/// Cells, f g l p, u16.
pub const COUNT: Field = 60..68;
/// Input step, u32 \[ppm\].
pub const INPUT_STEP: Field = 68..72;
/// Input levels, u8.
pub const LEVELS: Field = 72..73;
/// Flags, u8; bit 0 is `stay`, bit 1 `always on`, bit 2 `own clocks`.
pub const FLAGS: Field = 73..74;
/// Tick, u16 \[ms\].
pub const TICK: Field = 74..76;
/// Ticks a period, u16.
pub const PERIOD: Field = 76..78;
/// Delay of the commands, u16 \[ticks\].
pub const DELAY: Field = 78..80;
/// I1: low, high, i32 \[µHz\].
pub const OUTER: Field = 80..88;
/// I2: low, high, i32 \[µHz\].
pub const INNER: Field = 88..96;
/// The droop's dead band, u32 \[µHz\].
pub const DROOP_DEADBAND: Field = 96..100;
/// The droop's full response, u32 \[µHz\].
pub const DROOP_FULL: Field = 100..104;
/// 1/R_eq, i32 \[kW/Hz\].
pub const GOVERNOR_GAIN: Field = 104..108;
/// T_G, u32 \[µs\].
pub const GOVERNOR_TIME: Field = 108..112;
/// T_t, u32 \[µs\].
pub const TURBINE_TIME: Field = 112..116;
/// T_1, u32 \[µs\].
pub const LEAD_TIME: Field = 116..120;
/// T_2, u32 \[µs\].
pub const LAG_TIME: Field = 120..124;
/// D, u32 \[kW/Hz\].
pub const DAMPING: Field = 124..128;
/// H, u32 \[kW s/Hz\].
pub const INERTIA: Field = 128..132;
/// Fleet power, u32 \[kW\].
pub const FLEET: Field = 132..136;
/// Hypothesis: bound on the estimate's error, f g l p, u32 \[µHz, kW\].
pub const ESTIMATE_ERROR: Field = 136..152;
/// Hypothesis: age of what the meter reads, least, most, u16 \[ms\].
pub const METER_LAG: Field = 152..156;
/// Hypothesis: time from a command to its power, least, most, u16 \[ms\].
pub const ACTUATION_DELAY: Field = 156..160;
/// Hypothesis: relative error of the participation, u32 \[ppm\].
pub const PARTICIPATION_RELATIVE: Field = 160..164;
/// Hypothesis: absolute error of the participation, u32 \[ppm\].
pub const PARTICIPATION_ABSOLUTE: Field = 164..168;
/// Hypothesis: lost power, low, high, i32 \[kW\].
pub const LOSS: Field = 168..176;
/// Hypothesis: how the loss moves, u8.
pub const LOSS_PROFILE: Field = 176..177;
/// Hypothesis: which way power can move, u8.
pub const DIRECTION: Field = 177..178;
/// Hypothesis: longest time between decisions, u16 \[ms\].
pub const TICK_MOST: Field = 178..180;
/// Hypothesis: H, low, high, u32 \[kW s/Hz\].
pub const INERTIA_BAND: Field = 180..188;
/// Hypothesis: 1/R_eq, low, high, i32 \[kW/Hz\].
pub const GOVERNOR_GAIN_BAND: Field = 188..196;
/// Hypothesis: D, low, high, u32 \[kW/Hz\].
pub const DAMPING_BAND: Field = 196..204;
/// Hypothesis: power of one charger, u32 \[W\].
pub const POWER_PER_CHARGER: Field = 204..208;
/// Hypothesis: chargers of the fleet, u32.
pub const CHARGERS: Field = 208..212;
/// Version of the table, u32.
pub const TABLE_VERSION: Field = 212..216;
/// Version of the generator, u32.
pub const GENERATOR: Field = 216..220;
/// The directory: an entry for C1, C2 and Hold each.
pub const DIRECTORY: Field = 220..256;

/// All fields, in the order in which they stand.
pub const ALL: [Field; 43] = [
    MAGIC,
    BYTE_ORDER,
    VERSION,
    LENGTH,
    SPEC_HASH,
    LOWER_EDGE,
    WIDTH,
    COUNT,
    INPUT_STEP,
    LEVELS,
    FLAGS,
    TICK,
    PERIOD,
    DELAY,
    OUTER,
    INNER,
    DROOP_DEADBAND,
    DROOP_FULL,
    GOVERNOR_GAIN,
    GOVERNOR_TIME,
    TURBINE_TIME,
    LEAD_TIME,
    LAG_TIME,
    DAMPING,
    INERTIA,
    FLEET,
    ESTIMATE_ERROR,
    METER_LAG,
    ACTUATION_DELAY,
    PARTICIPATION_RELATIVE,
    PARTICIPATION_ABSOLUTE,
    LOSS,
    LOSS_PROFILE,
    DIRECTION,
    TICK_MOST,
    INERTIA_BAND,
    GOVERNOR_GAIN_BAND,
    DAMPING_BAND,
    POWER_PER_CHARGER,
    CHARGERS,
    TABLE_VERSION,
    GENERATOR,
    DIRECTORY,
];

/// Where the fields of a directory entry stand, in bytes from the start of the entry.
pub mod entry {
    use super::Field;

    /// Kind of the domain part, u8.
    pub const DOMAIN_KIND: Field = 0..1;
    /// Kind of the inputs part, u8.
    pub const INPUTS_KIND: Field = 1..2;
    /// Worst visits of a lookup, both parts, u16.
    pub const WORST_VISITS: Field = 2..4;
    /// Bytes of the domain part, u32.
    pub const DOMAIN_LEN: Field = 4..8;
    /// Bytes of the inputs part, u32.
    pub const INPUTS_LEN: Field = 8..12;
}

/// Where the parameters of a response part stand, in bytes from the start of the part.
pub mod response {
    use super::Field;

    /// Droop gain, u32 \[ppm/Hz\].
    pub const DROOP_GAIN: Field = 0..4;
    /// Set-point, i32 \[µHz\].
    pub const SETPOINT: Field = 4..8;
    /// Slope gain, u32 \[ppm s/Hz\].
    pub const SLOPE_GAIN: Field = 8..12;
    /// Slope threshold, u32 \[µHz/s\].
    pub const SLOPE_THRESHOLD: Field = 12..16;
    /// Window of the slope, u32 \[ticks\].
    pub const WINDOW: Field = 16..20;
    /// Largest slope response, u32 \[ppm\].
    pub const SLOPE_MOST: Field = 20..24;
    /// Release of the slope response in a tick, u32 \[ppm\].
    pub const RELEASE: Field = 24..28;
    /// Smallest change of a command, u32 \[ppm\].
    pub const SMALLEST_CHANGE: Field = 28..32;
}
