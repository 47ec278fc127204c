//! A charger that can discharge the car into the grid.
//!
//! Participation moves the power from what the charger draws without an event towards its discharge
//! limit: `P = P_charge - u (P_charge + P_discharge)`, drawn from the grid positive. With equal
//! limits of 28 kW that is the paper's swing of 56 kW.

use super::{Dispatch, DispatchError, LimitSource, Limits, SetPoint};
use crate::units::{MICRO, Participation};
use crate::wide::divide;

/// A power stage that follows a signed set-point.
///
/// The implementation ramps and protects itself; it must accept every set-point within the limits
/// it was built for.
pub trait PowerStage {
    /// Why the stage refused.
    type Error;

    /// Sets the power drawn from the grid \[W\]; negative discharges the car.
    ///
    /// # Errors
    /// The stage did not take the set-point.
    fn set_power_w(&mut self, power_w: i32) -> Result<(), Self::Error>;
}

/// Power to set \[W\]: the rule alone, without hardware. Limits past 1 GW count as 1 GW.
pub const fn power_w(participation: Participation, charge_w: u32, discharge_w: u32) -> i32 {
    const LARGEST_W: u32 = 1_000_000_000;
    let charge = if charge_w < LARGEST_W {
        charge_w
    } else {
        LARGEST_W
    };
    let discharge = if discharge_w < LARGEST_W {
        discharge_w
    } else {
        LARGEST_W
    };
    // Given up: rounded down, so never past the discharge limit.
    let span = (charge + discharge) as u64;
    let given = divide(span * participation.ppm() as u64, MICRO as u32);
    charge.wrapping_sub(given).cast_signed()
}

/// A bidirectional charger.
#[derive(Debug)]
pub struct Bidirectional<S> {
    stage: S,
    charge_w: Limits,
    discharge_w: Limits,
}

impl<S: PowerStage> Bidirectional<S> {
    /// A charger with limits on charging and on discharging \[W\].
    pub const fn new(stage: S, charge_w: Limits, discharge_w: Limits) -> Self {
        Self {
            stage,
            charge_w,
            discharge_w,
        }
    }

    /// Replaces one source's limits \[W\]; a user who needs the energy sets `discharge_w` to 0.
    pub fn set_limits(&mut self, source: LimitSource, charge_w: u32, discharge_w: u32) {
        self.charge_w.set(source, charge_w);
        self.discharge_w.set(source, discharge_w);
    }
}

impl<S: PowerStage> Dispatch for Bidirectional<S> {
    fn apply(
        &mut self,
        participation: Participation,
        _now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        let charge = self.charge_w.lowest();
        let w = power_w(participation, charge, self.discharge_w.lowest());
        self.stage
            .set_power_w(w)
            .map_err(|_| DispatchError::Power)?;
        Ok(SetPoint::Power { w })
    }

    fn rest(&mut self, _now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.stage
            .set_power_w(0)
            .map_err(|_| DispatchError::Power)?;
        Ok(SetPoint::Power { w: 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn swings_by_56_kw_as_in_the_paper() {
        let at = |ppm| power_w(Participation::from_ppm(ppm), 28_000, 28_000);
        assert_eq!(at(0), 28_000);
        assert_eq!(at(500_000), 0);
        assert_eq!(at(1_000_000), -28_000);
    }

    #[test]
    fn a_user_who_forbids_discharging_wins() {
        struct Stage(i32);
        impl PowerStage for Stage {
            type Error = ();
            fn set_power_w(&mut self, power_w: i32) -> Result<(), ()> {
                self.0 = power_w;
                Ok(())
            }
        }
        let limits = Limits::all(28_000);
        let mut charger = Bidirectional::new(Stage(1), limits, limits);
        charger.set_limits(LimitSource::User, 28_000, 0);
        let set = charger.apply(Participation::ALL, 0);
        assert_eq!(set, Ok(SetPoint::Power { w: 0 }));
        assert_eq!(charger.stage.0, 0);
        charger.set_limits(LimitSource::User, 28_000, 28_000);
        assert!(charger.apply(Participation::ALL, 0).is_ok());
        assert_eq!(charger.stage.0, -28_000);
        assert_eq!(charger.rest(0), Ok(SetPoint::Power { w: 0 }));
        assert_eq!(charger.stage.0, 0);
    }

    proptest! {
        #[test]
        fn the_limits_always_win(ppm in any::<u32>(), charge in any::<u32>(), discharge in any::<u32>()) {
            let w = i64::from(power_w(Participation::from_ppm(ppm), charge, discharge));
            prop_assert!(-i64::from(discharge) <= w && w <= i64::from(charge));
        }
    }
}
