//! Settings of a charger, and the time until its observer is trusted.

use super::fit::Installation;
use super::start::StartDelay;
use crate::event::EventEnd;
use crate::fault::Faults;
use crate::frequency::gate::GateLimits;
use crate::response::LevelOffset;
use crate::table::PlantParameters;
use crate::wide::divide;

/// Slowest time constants until an initial error of the chain counts as gone: `e^-6` = 0.25 %.
const TRUST_TIME_CONSTANTS: u64 = 6;

/// Ticks until the observer of this plant is trusted: 72 s for the paper's `T_2` = 12 s.
pub fn trust_ticks(plant: &PlantParameters, tick_ms: u16) -> u16 {
    let slowest = plant
        .governor_time_us
        .max(plant.lag_time_us)
        .max(plant.turbine_time_us);
    let tick_us = u32::from(tick_ms).max(1) * 1000;
    // Rounded up.
    let ticks = divide(
        TRUST_TIME_CONSTANTS * u64::from(slowest) + u64::from(tick_us - 1),
        tick_us,
    );
    u16::try_from(ticks).unwrap_or(u16::MAX)
}

/// Settings of a charger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChargerConfig {
    /// Which readings are believed.
    pub gate: GateLimits,
    /// Ticks of the moving average, 1 for none.
    pub filter_ticks: u8,
    /// Ticks without frequency during which the last participation is held.
    pub hold_ticks: u16,
    /// Release of the participation per tick once frequency is lost \[ppm\].
    pub release_ppm: u32,
    /// Ticks of warm-up; `None` takes [`trust_ticks`], or the table's delay if that is longer. A
    /// response needs none.
    pub warm_up_ticks: Option<u16>,
    /// By how much this charger's levels of a response are shifted: of its serial number, so that a
    /// fleet does not step together.
    pub level_offset: LevelOffset,
    /// What this charger is, to be compared with what the proof of its table assumed. `None` in
    /// experiments and simulations: nothing is compared.
    pub installation: Option<Installation>,
    /// When an event is over, and how long the way back takes.
    pub event_end: EventEnd,
    /// How long nothing is energised after a start, once the mains has been seen.
    pub start_delay: StartDelay,
    /// What is wrong from the start to the end of this run. With [`Faults::CLOCK`] among it no
    /// frequency is believed.
    pub standing_faults: Faults,
}

impl ChargerConfig {
    /// No filter, 1 s of hold at 100 ms a tick, release over 60 s, warm-up by the plant, levels as
    /// they are, nothing compared, [`EventEnd::DEFAULT`], no delay at the start, nothing wrong.
    pub const DEFAULT: Self = Self {
        gate: GateLimits::DEFAULT,
        filter_ticks: 1,
        hold_ticks: 10,
        release_ppm: 1_667,
        warm_up_ticks: None,
        level_offset: LevelOffset::NONE,
        installation: None,
        event_end: EventEnd::DEFAULT,
        start_delay: StartDelay::NONE,
        standing_faults: Faults::NONE,
    };
}
