//! Participation to this charger's set-point.
//!
//! A participation u asks the fleet to give up the share u of what it can give up. A unidirectional
//! charger lowers its current through the control pilot ([`unidirectional`]), a bidirectional one
//! moves its power from charging towards discharging ([`bidirectional`], [`power_line`]). Limits
//! from other sources (user, site, cable) are applied last and always win.

pub mod bidirectional;
pub mod car;
pub mod contactor;
pub mod fleet;
pub mod pace;
pub mod pilot;
pub mod power_line;
pub mod unidirectional;

use crate::units::Participation;

/// What the charger was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SetPoint {
    /// No charging.
    Paused,
    /// Charging with at most this current \[mA\].
    Current {
        /// Current offered on the pilot \[mA\].
        ma: u32,
    },
    /// Power drawn from the grid \[W\]; negative while discharging.
    Power {
        /// Set-point \[W\].
        w: i32,
    },
}

/// Why the set-point did not reach the hardware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DispatchError {
    /// The pilot's PWM refused the duty.
    Pilot,
    /// The contactor's pin failed.
    Contactor,
    /// The power stage refused the set-point.
    Power,
}

/// Who limits this charger besides the frequency response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitSource {
    /// The driver, or the car's departure plan.
    User = 0,
    /// The site's load management.
    Site = 1,
    /// Cable, socket and installation.
    Cable = 2,
}

/// Number of [`LimitSource`]s.
pub const LIMIT_SOURCES: usize = 3;

/// Limits by source, in the dispatcher's unit (mA or W).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits([u32; LIMIT_SOURCES]);

impl Limits {
    /// The same limit from every source.
    pub const fn all(limit: u32) -> Self {
        Self([limit; LIMIT_SOURCES])
    }

    /// Replaces one source's limit.
    pub fn set(&mut self, source: LimitSource, limit: u32) {
        if let Some(slot) = self.0.get_mut(source as usize) {
            *slot = limit;
        }
    }

    /// The lowest limit.
    pub fn lowest(&self) -> u32 {
        let [user, site, cable] = self.0;
        user.min(site).min(cable)
    }
}

/// A charger's way to follow the participation.
///
/// The implementation applies its limits after the participation, and leaves the hardware in a
/// state that no later failure can make worse: it lowers before it raises.
pub trait Dispatch {
    /// Sets the hardware for this participation; `now_ms` is a monotonic clock that may wrap.
    ///
    /// # Errors
    /// The hardware refused; the caller withholds the watchdog, and tries again at the next tick.
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError>;

    /// Energises nothing: no current is offered, no contactor is closed, no power is set.
    ///
    /// # Errors
    /// As [`Dispatch::apply`].
    fn rest(&mut self, now_ms: u32) -> Result<SetPoint, DispatchError>;
}
