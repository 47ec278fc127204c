//! What a spec says in OCPP: the droop of its fallback, the swing of a charger, the event's end.
//!
//! The event's end is no part of a spec: it is a setting of the charger
//! ([`firmware::event::EventEnd`]).

use firmware::event::EventEnd;
use model::spec::{Direction, Spec};

use crate::curve::FieldError;

/// Frequency of the grid at rest \[Hz\].
pub const NOMINAL_HZ: f64 = 50.0;
/// Micro-units of a unit.
const MICRO: f64 = 1e6;
/// Digits behind the point that a spec's numbers are given with.
const DIGITS: f64 = 1e9;

/// The fallback of a charger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fallback {
    /// Dead band below nominal \[µHz\].
    pub deadband_uhz: u32,
    /// Deviation below the dead band at which a charger gives its whole swing \[µHz\].
    pub full_uhz: u32,
    /// Time constant of the response \[s\].
    pub time_s: f64,
    /// Change of power of a charger at full response \[W\].
    pub swing_w: f64,
    /// Whether that takes it past zero to discharging.
    pub direction: Direction,
    /// When an event is over, and how long the way back takes.
    pub event_end: EventEnd,
}

impl Fallback {
    /// The fallback of a spec's chargers with this event's end.
    ///
    /// # Errors
    /// A droop that is no line: with no damping it is a step.
    pub fn of(spec: &Spec, event_end: EventEnd) -> Result<Self, FieldError> {
        let full_hz = spec.baseline.droop_hz * spec.plant.damping_gw_per_hz;
        let full_uhz = micro(full_hz);
        if full_uhz == 0 {
            let allowed = "above 0, for OCPP knows no step";
            let found = spec.plant.damping_gw_per_hz;
            return Err(FieldError::new("plant.damping_gw_per_hz", found, allowed));
        }
        Ok(Self {
            deadband_uhz: micro(spec.baseline.deadband_hz),
            full_uhz,
            time_s: spec.baseline.time_s,
            swing_w: rounded(1000.0 * spec.fleet.power_per_charger_kw),
            direction: spec.fleet.direction,
            event_end,
        })
    }

    /// Puts it into a spec, whose damping says what the droop's slope is in the spec's terms.
    ///
    /// # Errors
    /// A spec without damping.
    pub fn put_into(&self, spec: &mut Spec) -> Result<(), FieldError> {
        let damping = spec.plant.damping_gw_per_hz;
        if damping <= 0.0 {
            return Err(FieldError::new(
                "plant.damping_gw_per_hz",
                damping,
                "above 0",
            ));
        }
        spec.baseline.deadband_hz = f64::from(self.deadband_uhz) / MICRO;
        spec.baseline.droop_hz = rounded(f64::from(self.full_uhz) / MICRO / damping);
        spec.baseline.time_s = self.time_s;
        spec.fleet.power_per_charger_kw = rounded(self.swing_w / 1000.0);
        spec.fleet.direction = self.direction;
        Ok(())
    }

    /// What a charger draws in ordinary operation \[W\]: its swing, or half of it where it can give
    /// as much back.
    pub fn draw_w(&self) -> f64 {
        match self.direction {
            Direction::Unidirectional => self.swing_w,
            Direction::Bidirectional => self.swing_w / 2.0,
        }
    }

    /// Where the response begins \[Hz\].
    pub fn begins_hz(&self) -> f64 {
        below(self.deadband_uhz)
    }

    /// Where the whole swing is given \[Hz\].
    pub fn full_hz(&self) -> f64 {
        below(self.deadband_uhz + self.full_uhz)
    }
}

fn micro(value: f64) -> u32 {
    (value * MICRO).round() as u32
}

/// A frequency so far below nominal \[Hz\]: the number nearest to its decimal digits.
fn below(uhz: u32) -> f64 {
    (NOMINAL_HZ * MICRO - f64::from(uhz)) / MICRO
}

/// The number nearest to a decimal one of nine digits behind the point.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * DIGITS).round() / DIGITS
}

/// How far a frequency is below nominal \[µHz\].
pub(crate) fn deviation_uhz(field: &str, frequency_hz: f64) -> Result<u32, FieldError> {
    let uhz = NOMINAL_HZ * MICRO - (frequency_hz * MICRO).round();
    if (0.0..=5.0 * MICRO).contains(&uhz) {
        Ok(uhz as u32)
    } else {
        let allowed = "45 to 50 Hz, for the charger answers a fall alone";
        Err(FieldError::new(field, frequency_hz, allowed))
    }
}
