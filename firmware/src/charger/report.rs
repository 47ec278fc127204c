//! What a tick did, and its log lines.

use super::fit::Misfits;
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
    /// What the proof of the table assumed otherwise.
    pub misfits: Misfits,
}

/// What stands until a tick changes it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Standing {
    /// Who decided.
    pub(super) mode: Mode,
    /// The law in force.
    pub(super) phase: Phase,
    /// State estimate.
    pub(super) state: State,
    /// Lost power \[kW\], once known.
    pub(super) loss_kw: Option<i32>,
    /// What is commanded.
    pub(super) participation: Participation,
}

impl Standing {
    /// Before the first tick.
    pub(super) const FIRST: Self = Self {
        mode: Mode::WarmUp,
        phase: Phase::NoControl,
        state: State([0; STATES]),
        loss_kw: None,
        participation: Participation::NONE,
    };
}

/// Logs what a tick changed: the mode, and faults that came or went. Without the `defmt` feature it
/// is empty and logs nothing; telemetry carries the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChangeLog {
    #[cfg(feature = "defmt")]
    mode: Mode,
    #[cfg(feature = "defmt")]
    faults: Faults,
    #[cfg(feature = "defmt")]
    misfits: Misfits,
}

impl ChangeLog {
    /// Before the first tick.
    pub(super) const FIRST: Self = Self {
        #[cfg(feature = "defmt")]
        mode: Standing::FIRST.mode,
        #[cfg(feature = "defmt")]
        faults: Faults::NONE,
        #[cfg(feature = "defmt")]
        misfits: Misfits::NONE,
    };

    /// Logs what is new in a report.
    #[cfg(feature = "defmt")]
    pub(super) fn note(&mut self, now: &Report) {
        if now.mode != self.mode {
            defmt::info!(
                "tick {=u32}: {} -> {}, f {=i32} uHz",
                now.sequence,
                self.mode,
                now.mode,
                now.state.frequency_uhz()
            );
        }
        for (fault, name) in Faults::NAMES {
            if now.faults.without(self.faults).contains(fault) {
                defmt::warn!("tick {=u32}: fault {=str}", now.sequence, name);
            }
            if self.faults.without(now.faults).contains(fault) {
                defmt::info!("tick {=u32}: cleared {=str}", now.sequence, name);
            }
        }
        // Found when the charger starts; they stay.
        if now.misfits != self.misfits {
            for (misfit, name) in Misfits::NAMES {
                if now.misfits.contains(misfit) {
                    defmt::warn!(
                        "tick {=u32}: not as the table assumes: {=str}",
                        now.sequence,
                        name
                    );
                }
            }
        }
        self.misfits = now.misfits;
        self.mode = now.mode;
        self.faults = now.faults;
    }

    /// Logs nothing.
    #[cfg(not(feature = "defmt"))]
    pub(super) const fn note(&mut self, _now: &Report) {}
}
