//! What is passed: records of plain numbers, without gaps, of one layout on every core.

use firmware::charger::Report;
use firmware::limit_provider::Allowance;

/// What a provider is told once. Call holdfast_default_config first, then change what is different.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Config {
    /// HOLDFAST_VERSION.
    pub version: u32,
    /// holdfast_direction: which way the charger can move power.
    pub direction: u8,
    /// Phases that carry the current, 1 to 3.
    pub phases: u8,
    /// Nominal voltage of a phase in V.
    pub voltage_v: u16,
    /// Power by which the charger moves the balance at full response, in W: its rated power, or
    /// twice that if it can discharge.
    pub power_w: u32,
    /// Serial number: the place in the fleet. Chargers of a fleet must have different ones.
    pub serial: u32,
    /// Bound on a reading's error, lag apart, in uHz. No default: it is the meter's.
    pub meter_error_uhz: u32,
    /// Delay of a reading behind the frequency, in ms: half of the meter's averaging time.
    pub meter_lag_ms: u16,
    /// Ticks of unchanged readings after which the meter is stuck; 0 for meters that may repeat
    /// themselves.
    pub stuck_after_ticks: u16,
    /// Longest time between two ticks that the charger guarantees, by its watchdog, in ms.
    pub tick_most_ms: u16,
    /// Ticks without frequency for which the last response is held.
    pub hold_ticks: u16,
    /// What a tick lets go of the response after that, in ppm.
    pub release_ppm: u32,
    /// Largest deviation from nominal that is believed, in uHz.
    pub range_uhz: u32,
    /// Fastest change that is believed, in uHz/s.
    pub rate_uhz_per_s: u32,
    /// Lowest deviation at which an event counts as recovered, in uHz.
    pub recovered_uhz: i32,
    /// Time for which the frequency must have recovered until an event is over, in s.
    pub recovered_s: u16,
    /// Time in which the response is then let go, in s.
    pub recovered_release_s: u16,
    /// Oldest reading that is believed, in ms.
    pub age_ms: u16,
    /// Ticks until the state estimate is trusted; HOLDFAST_WARM_UP_BY_PLANT but in simulations.
    pub warm_up_ticks: u16,
    /// Delay of the start that is the same for all chargers, in s.
    pub start_fixed_s: u16,
    /// Most of the delay of the start that is drawn at random, in s.
    pub start_random_s: u16,
    /// Ticks of the moving average, 1 to 8; 1 for none.
    pub filter_ticks: u8,
    /// holdfast_reset_cause: why the controller started.
    pub reset_cause: u8,
    /// 0.
    pub reserved: u16,
}

/// What a provider is told at every tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Input {
    /// A clock in ms that may wrap.
    pub now_ms: u32,
    /// Deviation of the frequency from nominal in uHz.
    pub deviation_uhz: i32,
    /// Age of that reading in ms.
    pub age_ms: u16,
    /// holdfast_reading: whether the deviation is valid.
    pub reading: u8,
    /// Whether a car is connected that may be charged: 0 no, anything else yes.
    pub car_present: u8,
    /// Lowest limit on the current of a phase in mA; HOLDFAST_NO_LIMIT for none.
    pub limit_ma: u32,
    /// Lowest limit on charging in W; HOLDFAST_NO_LIMIT for none.
    pub charge_limit_w: u32,
    /// Lowest limit on discharging in W; 0 where the car must not be discharged.
    pub discharge_limit_w: u32,
}

/// What is allowed until the next tick, and why. All zeros where a call fails: nothing is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Output {
    /// Ticks since the start.
    pub sequence: u32,
    /// Power drawn from the grid in W: the most for a charger that can only charge, the set-point
    /// for a bidirectional one, negative while discharging.
    pub power_w: i32,
    /// Current of a phase that belongs to it, in mA.
    pub current_ma: u32,
    /// Share of the charger's power that responds, in ppm.
    pub participation_ppm: u32,
    /// Believed deviation of the frequency in uHz, then the estimates of governor, lead-lag and
    /// turbine in kW, which are 0 for tables that need none.
    pub state: [i32; 4],
    /// Estimate of the lost power in kW; 0 if it is not known.
    pub loss_kw: i32,
    /// Bits HOLDFAST_FAULT_*: what was wrong at this tick.
    pub faults: u16,
    /// Bits HOLDFAST_MISFIT_*: what the table's proof assumed otherwise.
    pub misfits: u8,
    /// holdfast_mode: who decided.
    pub mode: u8,
    /// holdfast_phase: the law in force.
    pub phase: u8,
    /// Whether anything may be energised: 1 if a car is present and the start is over.
    pub energise: u8,
    /// Whether loss_kw is known.
    pub loss_known: u8,
    /// 0.
    pub reserved: u8,
}

/// What is known of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct TableInfo {
    /// First half of the SHA-256 of the spec that the table was made from.
    pub spec_hash: [u8; 16],
    /// Bytes of the table.
    pub length: u32,
    /// CRC-32 of its bytes.
    pub crc: u32,
    /// Version: a newer table has a larger one.
    pub table_version: u32,
    /// Version of the program that made it: major, minor, patch in bits 24, 12 and 0 upwards.
    pub generator: u32,
    /// Power by which one charger moves the balance, in W, as the proof assumed.
    pub power_per_charger_w: u32,
    /// Chargers of the fleet, as the proof assumed.
    pub chargers: u32,
    /// Bound on the meter's error that the proof assumed, in uHz.
    pub meter_error_uhz: u32,
    /// Least lag of the meter that the proof assumed, in ms.
    pub meter_lag_least_ms: u16,
    /// Most of it.
    pub meter_lag_most_ms: u16,
    /// Length of a tick in ms.
    pub tick_ms: u16,
    /// holdfast_direction that the proof assumed.
    pub direction: u8,
    /// holdfast_table_fault: why the table is rejected; everything else is 0 then.
    pub fault: u8,
}

/// What a window of zero crossings is told once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct CapturesConfig {
    /// Rate of the timer in Hz, 50 kHz to 200 MHz.
    pub timer_hz: u32,
    /// Most by which a crossing is captured early or late, in ns, at most 1 ms.
    pub jitter_ns: u32,
    /// Tolerance of the timer's clock in ppm, at most 1000.
    pub clock_ppm: u16,
    /// Cycles of the window, 1 to 16; 5 are 100 ms at 50 Hz.
    pub cycles: u8,
    /// Nominal frequency: 50 or 60 Hz.
    pub nominal_hz: u8,
}

// The same layout on every core, without gaps: C may compare and store the bytes.
const _: () = assert!(size_of::<Config>() == 60);
const _: () = assert!(size_of::<Input>() == 24);
const _: () = assert!(size_of::<Output>() == 44);
const _: () = assert!(size_of::<TableInfo>() == 52);
const _: () = assert!(size_of::<CapturesConfig>() == 12);

impl Output {
    /// Nothing is allowed.
    pub const NOTHING: Self = Self {
        sequence: 0,
        power_w: 0,
        current_ma: 0,
        participation_ppm: 0,
        state: [0; 4],
        loss_kw: 0,
        faults: 0,
        misfits: 0,
        mode: 0,
        phase: 0,
        energise: 0,
        loss_known: 0,
        reserved: 0,
    };

    /// A tick's.
    pub fn of(report: &Report, allowed: &Allowance) -> Self {
        Self {
            sequence: report.sequence,
            power_w: allowed.power_w,
            current_ma: allowed.current_ma,
            participation_ppm: report.participation.ppm(),
            state: report.state.0,
            loss_kw: report.loss_kw.unwrap_or(0),
            faults: report.faults.bits(),
            misfits: report.misfits.bits(),
            mode: report.mode as u8,
            phase: report.phase.number(),
            energise: u8::from(allowed.energise),
            loss_known: u8::from(report.loss_kw.is_some()),
            reserved: 0,
        }
    }
}
