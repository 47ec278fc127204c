//! What a tick did, and its log lines.

use crate::dispatch::SetPoint;
use crate::fault::{Faults, Mode};
use crate::phase::Phase;
use crate::units::{Participation, STATES, State};

/// What a tick did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Report {
    /// Ticks since the start, this one included; saturates.
    pub sequence: u32,
    /// The caller's clock \[ms\].
    pub now_ms: u32,
    /// Who decided.
    pub mode: Mode,
    /// The law in force.
    pub phase: Phase,
    /// State estimate.
    pub state: State,
    /// Lost power \[kW\], once known.
    pub loss_kw: Option<i32>,
    /// Share of the fleet that is to respond.
    pub participation: Participation,
    /// What the charger was told; `None` if the hardware refused.
    pub set_point: Option<SetPoint>,
    /// What was wrong.
    pub faults: Faults,
}

impl Report {
    /// Before the first tick.
    pub(super) const FIRST: Self = Self {
        sequence: 0,
        now_ms: 0,
        mode: Mode::WarmUp,
        phase: Phase::NoControl,
        state: State([0; STATES]),
        loss_kw: None,
        participation: Participation::NONE,
        set_point: None,
        faults: Faults::NONE,
    };
}

/// Logs what a tick changed: the mode, and faults that came or went.
#[cfg(feature = "defmt")]
pub(super) fn log_changes(before: &Report, now: &Report) {
    if now.mode != before.mode {
        defmt::info!(
            "tick {=u32}: {} -> {}, f {=i32} uHz",
            now.sequence,
            before.mode,
            now.mode,
            now.state.frequency_uhz()
        );
    }
    for (fault, name) in Faults::NAMES {
        if now.faults.without(before.faults).contains(fault) {
            defmt::warn!("tick {=u32}: fault {=str}", now.sequence, name);
        }
        if before.faults.without(now.faults).contains(fault) {
            defmt::info!("tick {=u32}: cleared {=str}", now.sequence, name);
        }
    }
}

/// Without the `defmt` feature nothing is logged; telemetry carries the same.
#[cfg(not(feature = "defmt"))]
pub(super) fn log_changes(_before: &Report, _now: &Report) {}
