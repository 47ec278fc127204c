//! What the car says on the control pilot: states A to F of IEC 61851-1.
//!
//! The car loads the pilot with resistors. What matters is the voltage of the pilot's upper level:
//!
//! | state | upper level | the car |
//! |---|---|---|
//! | A | 12 V | is not there |
//! | B | 9 V | is connected |
//! | C | 6 V | asks for power |
//! | D | 3 V | asks for power and for ventilation |
//! | E | 0 V | none: a fault, or no supply |
//! | F | -12 V | none: the charger is out of order |
//!
//! The standard allows each level a volt in either direction. Between two of them the middle
//! decides.

/// State of the car.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CarState {
    /// No car.
    A,
    /// Connected.
    B,
    /// Asks for power.
    C,
    /// Asks for power and ventilation, which no charger of ours has.
    D,
    /// Fault.
    E,
    /// Out of order.
    F,
}

impl CarState {
    /// The state at this upper level of the pilot \[mV\].
    pub const fn of_level(upper_mv: i32) -> Self {
        match upper_mv {
            10_500.. => Self::A,
            7_500.. => Self::B,
            4_500.. => Self::C,
            1_500.. => Self::D,
            -6_000.. => Self::E,
            _ => Self::F,
        }
    }
}

/// Measures the state of the car.
///
/// The implementation must not block for longer than two periods of the pilot, 2 ms. It is asked
/// once a tick.
pub trait CarSense {
    /// The state now; `None` if it cannot be measured, which counts as a fault.
    fn state(&mut self) -> Option<CarState>;
}

/// A car that always asks for power: for a charger whose pilot another controller watches, and for
/// simulations.
#[derive(Debug, Clone, Copy, Default)]
pub struct AlwaysAsking;

impl CarSense for AlwaysAsking {
    fn state(&mut self) -> Option<CarState> {
        Some(CarState::C)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_that_the_standard_allows_is_its_state() {
        let levels = [
            (12_000, CarState::A),
            (9_000, CarState::B),
            (6_000, CarState::C),
            (3_000, CarState::D),
            (0, CarState::E),
            (-12_000, CarState::F),
        ];
        for (level, state) in levels {
            for off in -1_000..=1_000 {
                assert_eq!(CarState::of_level(level + off), state, "{level} {off}");
            }
        }
    }
}
