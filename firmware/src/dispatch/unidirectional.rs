//! A charger that can only lower its charging current.
//!
//! Wanted is `I_limit (1 - u)`, with the lowest of all limits as the charger's own share. From 6 A
//! up it is offered as it is; below, the charger draws 6 A or pauses by its [`Threshold`], so that
//! the fleet's mean is what was wanted.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

use super::contactor::{Contactor, ContactorTimes};
use super::fleet::Threshold;
use super::pilot::{CURRENT_MAX_MA, CURRENT_MIN_MA, Pilot};
use super::{Dispatch, DispatchError, LimitSource, Limits, SetPoint};
use crate::units::{MICRO, Participation};
use crate::wide::divide;

/// Current to offer \[mA\], 0 for a pause: the rule alone, without hardware.
pub const fn current_ma(participation: Participation, limit_ma: u32, threshold: Threshold) -> u32 {
    let limit = if limit_ma < CURRENT_MAX_MA {
        limit_ma
    } else {
        CURRENT_MAX_MA
    };
    if limit < CURRENT_MIN_MA {
        return 0;
    }
    let kept_ppm = MICRO as u32 - participation.ppm();
    let wanted = divide(limit as u64 * kept_ppm as u64, MICRO as u32);
    if wanted >= CURRENT_MIN_MA {
        wanted
    } else if threshold.is_within(wanted, CURRENT_MIN_MA) {
        CURRENT_MIN_MA
    } else {
        0
    }
}

/// A unidirectional charger: pilot and contactor.
#[derive(Debug)]
pub struct Unidirectional<P, O> {
    pilot: Pilot<P>,
    contactor: Contactor<O>,
    threshold: Threshold,
    limits_ma: Limits,
}

impl<P: SetDutyCycle, O: OutputPin> Unidirectional<P, O> {
    /// A charger with limits \[mA\] and a place in the fleet.
    pub const fn new(
        pwm: P,
        contactor: O,
        times: ContactorTimes,
        threshold: Threshold,
        limits_ma: Limits,
    ) -> Self {
        Self {
            pilot: Pilot::new(pwm),
            contactor: Contactor::new(contactor, times),
            threshold,
            limits_ma,
        }
    }

    /// Replaces one source's limit \[mA\]; in force from the next tick.
    pub fn set_limit(&mut self, source: LimitSource, limit_ma: u32) {
        self.limits_ma.set(source, limit_ma);
    }
}

impl<P: SetDutyCycle, O: OutputPin> Dispatch for Unidirectional<P, O> {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        let wanted = current_ma(participation, self.limits_ma.lowest(), self.threshold);
        let pilot = |_| DispatchError::Pilot;
        if wanted == 0 {
            // First the pilot, then the contactor: it should open without load.
            self.pilot.offer(0).map_err(pilot)?;
        }
        let connected = self
            .contactor
            .request(wanted > 0, now_ms)
            .map_err(|_| DispatchError::Contactor)?;
        if !connected || wanted == 0 {
            self.pilot.offer(0).map_err(pilot)?;
            return Ok(SetPoint::Paused);
        }
        self.pilot.offer(wanted).map_err(pilot)?;
        Ok(SetPoint::Current { ma: wanted })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as PinTransaction};
    use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction as PwmTransaction};
    use proptest::prelude::*;

    #[test]
    fn the_fleets_mean_is_what_was_wanted() {
        let chargers = 10_000;
        for limit in [6_000, 16_000, 32_000] {
            for ppm in (0..=1_000_000).step_by(50_000) {
                let participation = Participation::from_ppm(ppm);
                let total: u64 = (0..chargers)
                    .map(|n| u64::from(current_ma(participation, limit, Threshold::of_serial(n))))
                    .sum();
                let mean = total as f64 / f64::from(chargers);
                let wanted = f64::from(limit) * (1.0 - f64::from(ppm) * 1e-6);
                // Rounding down to a mA, and 12 chargers of 10 000 with 6 A too much or too little.
                assert!(
                    (mean - wanted).abs() <= 1.0 + 7.2,
                    "{limit} {ppm}: {mean} {wanted}"
                );
            }
        }
    }

    proptest! {
        #[test]
        fn no_participation_lifts_a_limit(ppm in any::<u32>(), limit in any::<u32>(), theta in any::<u32>()) {
            let threshold = Threshold::from_ppm(theta);
            let ma = current_ma(Participation::from_ppm(ppm), limit, threshold);
            prop_assert!(ma <= limit && ma <= CURRENT_MAX_MA);
            prop_assert!(ma == 0 || ma >= CURRENT_MIN_MA);
        }
    }

    #[test]
    fn pauses_on_the_pilot_first_and_obeys_a_new_limit() {
        let duty = |counts| {
            [
                PwmTransaction::max_duty_cycle(1000),
                PwmTransaction::set_duty_cycle(counts),
            ]
        };
        let calls: std::vec::Vec<_> = [duty(533), duty(266), duty(1000), duty(1000)]
            .into_iter()
            .flatten()
            .collect();
        let mut pwm = Pwm::new(&calls);
        let mut pin = Pin::new(&[PinTransaction::set(State::High)]);
        let mut charger = Unidirectional::new(
            pwm.clone(),
            pin.clone(),
            ContactorTimes::DEFAULT,
            Threshold::from_ppm(500_000),
            Limits::all(32_000),
        );
        let current = |ma| Ok(SetPoint::Current { ma });
        assert_eq!(charger.apply(Participation::NONE, 0), current(32_000));
        charger.set_limit(LimitSource::Site, 16_000);
        assert_eq!(charger.apply(Participation::NONE, 100), current(16_000));
        assert_eq!(charger.apply(Participation::ALL, 200), Ok(SetPoint::Paused));
        pwm.done();
        pin.done();
    }
}
