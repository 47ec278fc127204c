//! The phase machine: which law is in force, and when it decides.
//!
//! The paper's phases (its section V-A) and the two clocks of the spec's `[sampling]`:
//!
//! | phase | in force | examined |
//! |---|---|---|
//! | No control | until f falls below I1; no charger responds | every tick |
//! | C1 | f outside I1 | every period, counted from the switch |
//! | C2 | f in I1, outside I2 | every period, counted from the switch |
//! | Fixed | f in I2; the last participation is held | every tick |
//! | Hold | with `stay`: the safety law covers the state | every period, counted from the switch |
//!
//! A *decision* tries the laws in the order Hold, Fixed, C2, C1 and takes the first that applies
//! and has an entry for the cell. With none, the answer is [`Decision::Outside`] and the next tick
//! decides again: the caller runs the baseline droop meanwhile.

use crate::table::{Law, TableView};
use crate::units::State;

/// The law in force. Telemetry carries its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Phase {
    /// Not below I1 yet: no charger responds.
    NoControl = 0,
    /// The law that reaches I1.
    C1 = 1,
    /// The law that reaches I2.
    C2 = 2,
    /// Inside I2: the last participation is held.
    Fixed = 3,
    /// The law that keeps f in I2 for ever.
    Hold = 4,
    /// No law has an entry for the state: the baseline droop.
    Fallback = 5,
    /// The law that is always on ([`crate::response`]); its tables have no other phase.
    Response = 6,
}

impl Phase {
    /// All phases in the order of their numbers.
    pub const ALL: [Self; 7] = [
        Self::NoControl,
        Self::C1,
        Self::C2,
        Self::Fixed,
        Self::Hold,
        Self::Fallback,
        Self::Response,
    ];

    /// The phase's number, as telemetry and the link carry it.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The phase's name, as people and JSON read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoControl => "no-control",
            Self::C1 => Law::C1.name(),
            Self::C2 => Law::C2.name(),
            Self::Fixed => "fixed",
            Self::Hold => "hold",
            Self::Fallback => "fallback",
            Self::Response => "response",
        }
    }
}

/// What a tick decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// Apply this input level.
    Level(u8),
    /// No law has an entry for the state.
    Outside,
}

/// Phase, held level and clock: everything the machine remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PhaseState {
    /// The law in force.
    pub phase: Phase,
    /// Input level held since the last decision.
    pub level: u8,
    /// Ticks until the next decision; 0 decides at the next tick. Always 0 in No control, Fixed and
    /// Fallback.
    pub ticks_left: u16,
}

impl PhaseState {
    /// The state before the event.
    pub const INITIAL: Self = Self {
        phase: Phase::NoControl,
        level: 0,
        ticks_left: 0,
    };

    /// Advances by one tick with the state measured at it; pure, so that the verifier can call it
    /// on any state.
    #[must_use]
    pub fn step(self, table: &TableView<'_>, state: State) -> (Self, Decision) {
        self.step_ahead(table, state, || state)
    }

    /// The same where commands act with a delay. No control watches the `measured` state. Every
    /// other phase and every decision go by the state `ahead`, in which the command begins to act
    /// ([`crate::prediction`]). `ahead` is called only if the tick needs it.
    #[must_use]
    pub fn step_ahead(
        self,
        table: &TableView<'_>,
        measured: State,
        ahead: impl FnOnce() -> State,
    ) -> (Self, Decision) {
        let header = table.working();
        match self.phase {
            // Chargers can only answer a fall: above I1 there is nothing to do before the event.
            Phase::NoControl if measured.frequency_uhz() >= header.outer.low_uhz => {
                (self, Decision::Level(self.level))
            }
            Phase::C1 | Phase::C2 | Phase::Hold if self.ticks_left > 0 => {
                let ticks_left = self.ticks_left - 1;
                (Self { ticks_left, ..self }, Decision::Level(self.level))
            }
            _ => {
                let state = ahead();
                if self.phase == Phase::Fixed && header.inner.contains(state) {
                    return (self, Decision::Level(self.level));
                }
                self.decide(table, state)
            }
        }
    }

    fn decide(self, table: &TableView<'_>, state: State) -> (Self, Decision) {
        let header = table.working();
        let cell = header.grid.quantise(state);
        let law = |law: Law| cell.and_then(|cell| table.lookup(law, cell));
        // The decision holds for this tick and `period_ticks - 1` more.
        let held = |phase, level| {
            let ticks_left = header.period_ticks - 1;
            let next = Self {
                phase,
                level,
                ticks_left,
            };
            (next, Decision::Level(level))
        };
        if let Some(level) = law(Law::Hold) {
            return held(Phase::Hold, level);
        }
        if !header.stay && header.inner.contains(state) {
            let next = Self {
                phase: Phase::Fixed,
                level: self.level,
                ticks_left: 0,
            };
            return (next, Decision::Level(self.level));
        }
        if header.outer.contains(state)
            && let Some(level) = law(Law::C2)
        {
            return held(Phase::C2, level);
        }
        if let Some(level) = law(Law::C1) {
            return held(Phase::C1, level);
        }
        let next = Self {
            phase: Phase::Fallback,
            level: self.level,
            ticks_left: 0,
        };
        (next, Decision::Outside)
    }
}
