//! The control pilot of IEC 61851-1 and SAE J1772: current as the duty of a 1 kHz square wave.
//!
//! | duty D \[%\] | current \[A\] |
//! |---|---|
//! | below 3, above 97 | no charging |
//! | 8 to 10 | 6 |
//! | 10 to 85 | 0.6 D |
//! | 85 to 96 | 2.5 (D - 64) |
//!
//! Up to 52.5 A, where the upper line starts, 51 A is the most that a duty stands for. Every
//! rounding is downwards, so that the current offered never exceeds the limit.

use crate::wide::divide;

use embedded_hal::pwm::SetDutyCycle;

/// Frequency of the pilot \[Hz\].
pub const PILOT_HZ: u32 = 1000;
/// Lowest current that can be offered \[mA\].
pub const CURRENT_MIN_MA: u32 = 6_000;
/// Highest current that can be offered \[mA\].
pub const CURRENT_MAX_MA: u32 = 80_000;
/// Highest current of the lower line, duty 85 % \[mA\].
const LOWER_LINE_MAX_MA: u32 = 51_000;
/// Lowest current of the upper line, just above duty 85 % \[mA\].
const UPPER_LINE_MIN_MA: u32 = 52_500;
/// A whole period, in the unit of [`duty_ppm`].
pub const WHOLE_PPM: u32 = 1_000_000;

const _: () = assert!(LOWER_LINE_MAX_MA == 85 * 600);
const _: () = assert!(CURRENT_MIN_MA == 10 * 600);
const _: () = assert!(CURRENT_MAX_MA == (96 - 64) * 2_500);

/// Duty for a current \[ppm of a period\], rounded down: the whole period (no charging) below 6 A,
/// 96 % from 80 A.
pub const fn duty_ppm(current_ma: u32) -> u32 {
    if current_ma < CURRENT_MIN_MA {
        WHOLE_PPM
    } else if current_ma <= LOWER_LINE_MAX_MA {
        // D = I / 0.6 A per percent: 10 000 ppm for 600 mA.
        current_ma * 50 / 3
    } else if current_ma < UPPER_LINE_MIN_MA {
        850_000
    } else if current_ma < CURRENT_MAX_MA {
        // D = I / 2.5 A per percent + 64.
        current_ma * 4 + 640_000
    } else {
        960_000
    }
}

/// Current that a duty \[ppm\] offers \[mA\], as a car decodes it; 0 for no charging.
pub const fn current_ma(duty_ppm: u32) -> u32 {
    match duty_ppm {
        80_000..100_000 => CURRENT_MIN_MA,
        100_000..=850_000 => duty_ppm * 3 / 50,
        850_001..=960_000 => (duty_ppm - 640_000) / 4,
        960_001..=970_000 => CURRENT_MAX_MA,
        _ => 0,
    }
}

/// The pilot's output stage.
#[derive(Debug)]
pub struct Pilot<P> {
    pwm: P,
}

impl<P: SetDutyCycle> Pilot<P> {
    /// A pilot on a PWM channel that runs at [`PILOT_HZ`].
    pub const fn new(pwm: P) -> Self {
        Self { pwm }
    }

    /// Offers a current \[mA\], no charging below 6 A. The duty is rounded down to a step of the
    /// timer, but not below the duty of 6 A.
    ///
    /// # Errors
    /// That of the PWM channel.
    pub fn offer(&mut self, current_ma: u32) -> Result<(), P::Error> {
        let ppm = duty_ppm(current_ma);
        if ppm == WHOLE_PPM {
            return self.pwm.set_duty_cycle_fully_on();
        }
        let steps = u64::from(self.pwm.max_duty_cycle()) * u64::from(ppm);
        let steps = divide(steps, WHOLE_PPM);
        // At most max_duty_cycle, which is 16 bits.
        self.pwm.set_duty_cycle(steps as u16)
    }

    /// The PWM channel, given back.
    pub fn release(self) -> P {
        self.pwm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::pwm::{Mock, Transaction};

    #[test]
    fn duty_at_the_corners_of_the_standard() {
        let corners = [
            (0, 1_000_000),
            (5_999, 1_000_000),
            (6_000, 100_000),
            (16_000, 266_666),
            (32_000, 533_333),
            (51_000, 850_000),
            (52_499, 850_000),
            (52_500, 850_000),
            (63_000, 892_000),
            (80_000, 960_000),
            (u32::MAX, 960_000),
        ];
        for (ma, ppm) in corners {
            assert_eq!(duty_ppm(ma), ppm, "{ma} mA");
        }
    }

    #[test]
    fn a_car_never_decodes_more_than_was_meant() {
        for ma in 0..=100_000 {
            let decoded = current_ma(duty_ppm(ma));
            assert!(decoded <= ma.min(CURRENT_MAX_MA), "{ma}: {decoded}");
            if ma >= CURRENT_MIN_MA && !(LOWER_LINE_MAX_MA..=UPPER_LINE_MIN_MA).contains(&ma) {
                // Rounding down twice, by less than a mA each.
                assert!(decoded + 2 > ma.min(CURRENT_MAX_MA), "{ma}: {decoded}");
            }
        }
    }

    #[test]
    fn the_channel_gets_these_duties() {
        let mut mock = Mock::new(&[
            Transaction::max_duty_cycle(8400),
            Transaction::set_duty_cycle(840),
            Transaction::max_duty_cycle(8400),
            Transaction::set_duty_cycle(4479),
            // 100 %: embedded-hal's own way to say fully on.
            Transaction::max_duty_cycle(8400),
            Transaction::set_duty_cycle(8400),
        ]);
        let mut pilot = Pilot::new(mock.clone());
        assert_eq!(pilot.offer(6_000), Ok(()));
        assert_eq!(pilot.offer(32_000), Ok(()));
        assert_eq!(pilot.offer(5_000), Ok(()));
        mock.done();
    }
}
