//! A charger that can only lower its charging current.
//!
//! Wanted is `I_limit (1 - u)`, with the lowest of all limits as the charger's own share. From 6 A
//! up it is offered as it is; below, the charger draws 6 A or pauses by its [`Threshold`], so that
//! the fleet's mean is what was wanted. A charger that pauses goes on once [`RESUME_MA`] more is
//! wanted than its threshold asks for: noise of the meter must not toggle it.
//!
//! The contactor closes when a current is offered and the car asks for power, and not otherwise. It
//! opens at once when the car no longer asks, and when its state is a fault; after a while when
//! limits leave less than 6 A; and never because the response pauses the car.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

use super::car::{AlwaysAsking, CarSense, CarState};
use super::contactor::{Contactor, ContactorTimes};
use super::fleet::Threshold;
use super::pace::Pace;
use super::pilot::{CURRENT_MAX_MA, CURRENT_MIN_MA, Pilot};
use super::{Dispatch, DispatchError, LimitSource, Limits, SetPoint};
use crate::units::{MICRO, Participation};
use crate::wide::divide;

/// Current to offer \[mA\], 0 for a pause: the rule alone, for a charger that does not pause yet.
pub const fn current_ma(participation: Participation, limit_ma: u32, threshold: Threshold) -> u32 {
    Floor::new(threshold).current_ma(participation, limit_ma)
}

/// What a paused charger waits for beyond its threshold \[mA\]. The noise of a reading, 1 mHz
/// either way, is worth 130 mA of 32 A by a droop of 0.5 Hz. The fleet's mean falls short by so
/// much of a charger's rating at most, and only where less than 6 A and this is wanted.
pub const RESUME_MA: u32 = 200;

/// Chooses between 6 A and a pause, and knows what it chose.
#[derive(Debug, Clone, Copy)]
pub struct Floor {
    threshold: Threshold,
    paused: bool,
}

impl Floor {
    /// A charger that did not pause.
    pub const fn new(threshold: Threshold) -> Self {
        let paused = false;
        Self { threshold, paused }
    }

    /// Current to offer \[mA\], 0 for a pause.
    pub const fn current_ma(&mut self, participation: Participation, limit_ma: u32) -> u32 {
        let limit = if limit_ma < CURRENT_MAX_MA {
            limit_ma
        } else {
            CURRENT_MAX_MA
        };
        if limit < CURRENT_MIN_MA {
            return 0;
        }
        let wanted = wanted_ma(participation, limit);
        // At the limit nothing more can be wanted.
        let short = if self.paused && wanted < limit {
            RESUME_MA
        } else {
            0
        };
        let share = wanted.saturating_sub(short);
        self.paused = share < CURRENT_MIN_MA && !self.threshold.is_within(share, CURRENT_MIN_MA);
        if self.paused {
            0
        } else if wanted < CURRENT_MIN_MA {
            CURRENT_MIN_MA
        } else {
            wanted
        }
    }
}

/// The share of a limit that is wanted \[mA\].
const fn wanted_ma(participation: Participation, limit_ma: u32) -> u32 {
    let kept_ppm = MICRO as u32 - participation.ppm();
    divide(limit_ma as u64 * kept_ppm as u64, MICRO as u32)
}

/// A unidirectional charger: pilot, contactor and what the car says.
#[derive(Debug)]
pub struct Unidirectional<P, O, C = AlwaysAsking> {
    pilot: Pilot<P>,
    contactor: Contactor<O>,
    car: C,
    floor: Floor,
    pace: Pace,
    limits_ma: Limits,
}

impl<P: SetDutyCycle, O: OutputPin> Unidirectional<P, O> {
    /// A charger with limits \[mA\] and a place in the fleet, whose car always asks for power.
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
            car: AlwaysAsking,
            floor: Floor::new(threshold),
            pace: Pace::NONE,
            limits_ma,
        }
    }

    /// The same charger, whose pilot changes at this pace.
    #[must_use]
    pub const fn with_pace(mut self, pace: Pace) -> Self {
        self.pace = pace;
        self
    }

    /// The same charger, asking the car.
    pub fn with_car<C: CarSense>(self, car: C) -> Unidirectional<P, O, C> {
        Unidirectional {
            pilot: self.pilot,
            contactor: self.contactor,
            car,
            floor: self.floor,
            pace: self.pace,
            limits_ma: self.limits_ma,
        }
    }
}

impl<P: SetDutyCycle, O: OutputPin, C: CarSense> Unidirectional<P, O, C> {
    /// Replaces one source's limit \[mA\]; in force from the next tick.
    pub fn set_limit(&mut self, source: LimitSource, limit_ma: u32) {
        self.limits_ma.set(source, limit_ma);
    }

    /// No current: first the pilot, then the contactor, so that it opens without load.
    fn pause(&mut self, connect: bool, now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.pilot.offer(0).map_err(|_| DispatchError::Pilot)?;
        self.contactor
            .request(connect, now_ms)
            .map_err(|_| DispatchError::Contactor)?;
        Ok(SetPoint::Paused)
    }
}

impl<P: SetDutyCycle, O: OutputPin, C: CarSense> Dispatch for Unidirectional<P, O, C> {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        let wanted = self
            .floor
            .current_ma(participation, self.limits_ma.lowest());
        // Asked at every tick, for a measurement may need it.
        let state = self.car.state();
        let may_ask = matches!(state, Some(CarState::B | CarState::C));
        if !may_ask {
            return self.rest(now_ms);
        }
        let limit_ma = self.limits_ma.lowest();
        let may_close = self.contactor.may_close(now_ms);
        let target = if may_close { wanted } else { 0 };
        let offered = self.pace.admit(target, limit_ma, now_ms);
        let limited = limit_ma < CURRENT_MIN_MA || (wanted > 0 && !may_close);
        if limited {
            return self.pause(wanted > 0, now_ms);
        }
        if offered == 0 {
            // The response pauses the car, and will let it go on.
            self.pilot.offer(0).map_err(|_| DispatchError::Pilot)?;
            let held = self.contactor.hold();
            held.map_err(|_| DispatchError::Contactor)?;
            return Ok(SetPoint::Paused);
        }
        // First the pilot, then the contactor: it closes when a current is offered and the car
        // asks.
        self.pilot
            .offer(offered)
            .map_err(|_| DispatchError::Pilot)?;
        let contact = if state == Some(CarState::C) {
            self.contactor.request(true, now_ms).map(|_closed| ())
        } else {
            self.contactor.idle()
        };
        contact.map_err(|_| DispatchError::Contactor)?;
        Ok(SetPoint::Current { ma: offered })
    }

    fn rest(&mut self, _now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.pace.reset();
        self.pilot.offer(0).map_err(|_| DispatchError::Pilot)?;
        self.contactor
            .idle()
            .map_err(|_| DispatchError::Contactor)?;
        Ok(SetPoint::Paused)
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

    proptest! {
        /// Noise of half the margin about any command toggles a charger once at most; and one that
        /// was never paused, or always, ends where its threshold says.
        #[test]
        fn noise_does_not_toggle(
            ppm in 0i64..=1_000_000, noise in proptest::collection::vec(-3_000i64..=3_000, 50),
            theta in 0u32..1_000_000,
        ) {
            let mut floor = Floor::new(Threshold::from_ppm(theta));
            // 3 000 ppm of 32 A are 96 mA, less than half of the margin.
            let mut at = |noise: i64| {
                let ppm = (ppm + noise).clamp(0, 1_000_000) as u32;
                floor.current_ma(Participation::from_ppm(ppm), 32_000) == 0
            };
            let paused: std::vec::Vec<bool> = noise.into_iter().map(&mut at).collect();
            let toggled = paused.windows(2).filter(|pair| pair[0] != pair[1]).count();
            prop_assert!(toggled <= 1, "{paused:?}");
        }

        /// What is short of the rule is a pause within the margin.
        #[test]
        fn a_paused_charger_resumes_within_the_margin(
            before: u32, ppm in 0u32..=1_000_000, limit in 6_000u32..=80_000, theta in 0u32..1_000_000,
        ) {
            let threshold = Threshold::from_ppm(theta);
            let mut floor = Floor::new(threshold);
            floor.current_ma(Participation::from_ppm(before), limit);
            let found = floor.current_ma(Participation::from_ppm(ppm), limit);
            let rule = current_ma(Participation::from_ppm(ppm), limit, threshold);
            if found != rule {
                let wanted = wanted_ma(Participation::from_ppm(ppm), limit);
                prop_assert!(found == 0 && wanted < limit && wanted < 6_000 + RESUME_MA);
                prop_assert!(!threshold.is_within(wanted - RESUME_MA.min(wanted), 6_000));
            }
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
        let calls: std::vec::Vec<_> = [duty(533), duty(266), duty(1000)]
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

    /// What happened on the two outputs, in order.
    #[derive(Debug, Clone, PartialEq, Eq)]
    enum Seen {
        Offered(u32),
        Closed(bool),
    }

    type Log = std::rc::Rc<core::cell::RefCell<std::vec::Vec<Seen>>>;

    struct LoggedPilot(Log);

    impl embedded_hal::pwm::ErrorType for LoggedPilot {
        type Error = core::convert::Infallible;
    }

    impl SetDutyCycle for LoggedPilot {
        fn max_duty_cycle(&self) -> u16 {
            10_000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Self::Error> {
            let ma = super::super::pilot::current_ma(u32::from(duty) * 100);
            self.0.borrow_mut().push(Seen::Offered(ma));
            Ok(())
        }
    }

    struct LoggedCoil(Log);

    impl embedded_hal::digital::ErrorType for LoggedCoil {
        type Error = core::convert::Infallible;
    }

    impl OutputPin for LoggedCoil {
        fn set_low(&mut self) -> Result<(), Self::Error> {
            self.0.borrow_mut().push(Seen::Closed(false));
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Self::Error> {
            self.0.borrow_mut().push(Seen::Closed(true));
            Ok(())
        }
    }

    struct Car(std::rc::Rc<core::cell::Cell<Option<CarState>>>);

    impl CarSense for Car {
        fn state(&mut self) -> Option<CarState> {
            self.0.get()
        }
    }

    #[test]
    fn the_contactor_closes_after_the_offer_and_only_for_a_car_that_asks() {
        let log = Log::default();
        let state = std::rc::Rc::new(core::cell::Cell::new(Some(CarState::A)));
        let mut charger = Unidirectional::new(
            LoggedPilot(log.clone()),
            LoggedCoil(log.clone()),
            ContactorTimes::DEFAULT,
            Threshold::from_ppm(0),
            Limits::all(30_000),
        )
        .with_car(Car(state.clone()));
        let mut tick = |car, now_ms| {
            state.set(car);
            let set = charger.apply(Participation::NONE, now_ms);
            (set.unwrap(), log.take())
        };
        let paused = SetPoint::Paused;
        let offered = SetPoint::Current { ma: 30_000 };
        use Seen::{Closed, Offered};
        let open = std::vec![Offered(0), Closed(false)];
        assert_eq!(tick(Some(CarState::A), 0), (paused, open));
        assert_eq!(
            tick(Some(CarState::B), 100),
            (offered, std::vec![Offered(30_000)])
        );
        let closes = std::vec![Offered(30_000), Closed(true)];
        assert_eq!(tick(Some(CarState::C), 200), (offered, closes.clone()));
        assert_eq!(
            tick(Some(CarState::C), 300),
            (offered, std::vec![Offered(30_000)])
        );
        let opens = std::vec![Offered(30_000), Closed(false)];
        assert_eq!(tick(Some(CarState::B), 400), (offered, opens));
        // Each of these opens a closed contactor, after the pilot has said so.
        let lost = [
            Some(CarState::A),
            Some(CarState::D),
            Some(CarState::E),
            Some(CarState::F),
            None,
        ];
        for (n, car) in (5u32..).zip(lost) {
            assert_eq!(tick(Some(CarState::C), 200 * n), (offered, closes.clone()));
            let opens = std::vec![Offered(0), Closed(false)];
            assert_eq!(tick(car, 200 * n + 100), (paused, opens), "{car:?}");
        }
    }

    #[test]
    fn a_charger_at_rest_offers_nothing_and_is_open() {
        let log = Log::default();
        let mut charger = Unidirectional::new(
            LoggedPilot(log.clone()),
            LoggedCoil(log.clone()),
            ContactorTimes::DEFAULT,
            Threshold::from_ppm(0),
            Limits::all(32_000),
        );
        assert_eq!(charger.rest(0), Ok(SetPoint::Paused));
        assert_eq!(log.take(), [Seen::Offered(0), Seen::Closed(false)]);
    }
}
