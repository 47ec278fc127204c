//! The baseline droop, used as the fallback law.
//!
//! The paper's baseline (its Fig. 2) is a dead band, a droop `1/R_ev`, a lag `1/(T_ev s + D)` and a
//! saturation. The lag of `T_ev` = 35 ms is that of the power electronics, an order below one tick,
//! so the device computes the lag's resting value `(-f - deadband) / (R_ev D)` and leaves the lag
//! to the hardware.

use crate::units::{MICRO, Participation, State};
use crate::wide::divide;

/// Baseline droop: none inside the dead band, then in proportion, saturated at the whole fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Droop {
    /// Dead band below nominal \[µHz\].
    pub deadband_uhz: u32,
    /// Deviation below the dead band at which every charger responds, `R_ev D` \[µHz\]; not zero.
    pub full_uhz: u32,
}

impl Droop {
    /// The baseline of the paper's Table I: dead band 0.15 Hz, `R_ev D` = 0.5 Hz. For a charger
    /// whose table is rejected.
    pub const PAPER: Self = Self {
        deadband_uhz: 150_000,
        full_uhz: 500_000,
    };

    /// Participation at a state. A drop of frequency only: chargers do not answer a rise.
    pub const fn participation(self, state: State) -> Participation {
        let below = -(state.frequency_uhz() as i64) - self.deadband_uhz as i64;
        if below <= 0 || self.full_uhz == 0 {
            return Participation::NONE;
        }
        Participation::from_ppm(divide(below as u64 * MICRO as u64, self.full_uhz))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_paper_at_hand_computed_points() {
        let at = |f| Droop::PAPER.participation(State([f, 0, 0, 0])).ppm();
        assert_eq!(at(0), 0);
        assert_eq!(at(300_000), 0);
        assert_eq!(at(-150_000), 0);
        assert_eq!(at(-150_001), 2);
        assert_eq!(at(-400_000), 500_000);
        assert_eq!(at(-650_000), 1_000_000);
        assert_eq!(at(i32::MIN), 1_000_000);
    }
}
