//! A signed power set-point as the duty of one PWM line.
//!
//! | duty | power drawn from the grid |
//! |---|---|
//! | 10 % | discharging with the span |
//! | 50 % | none |
//! | 90 % | charging with the span |
//! | below 5 %, above 95 % | none: the line is not driven |
//!
//! ## Tradeoffs
//! The ends are left free (a live zero, as in a 4 to 20 mA loop): a line that is cut, shorted, or
//! dead because its controller restarts must not be read as full power in either direction. One
//! line crosses an isolation barrier by one optocoupler. The power stage decodes linearly and must
//! treat what it cannot read as no power.

use crate::wide::divide;

use core::num::NonZeroU32;

use embedded_hal::pwm::SetDutyCycle;

use super::bidirectional::PowerStage;

/// The line to a power stage.
#[derive(Debug)]
pub struct PowerLine<P> {
    pwm: P,
    span_w: NonZeroU32,
}

impl<P: SetDutyCycle> PowerLine<P> {
    /// A line whose 10 % and 90 % stand for `span_w`, which the power stage must know; 0 counts as
    /// 1 W.
    pub const fn new(pwm: P, span_w: u32) -> Self {
        let span_w = match NonZeroU32::new(span_w) {
            Some(span_w) => span_w,
            None => NonZeroU32::MIN,
        };
        Self { pwm, span_w }
    }

    /// Duty of a power \[steps of the timer\]: rounded towards 50 %, so that the stage never reads
    /// more than was set, in either direction. Powers past the span count as the span.
    fn steps(&self, power_w: i32, steps_max: u16) -> u16 {
        let power = power_w.unsigned_abs().min(self.span_w.get());
        // The span is 40 % = 2/5 of the period, and the power at most the span.
        let spans = divide(
            u64::from(power) * 2 * u64::from(steps_max),
            self.span_w.get(),
        );
        let swing = (spans / 5) as u16;
        if power_w < 0 {
            steps_max.div_ceil(2).saturating_sub(swing)
        } else {
            (steps_max / 2).saturating_add(swing)
        }
    }
}

impl<P: SetDutyCycle> PowerStage for PowerLine<P> {
    type Error = P::Error;

    fn set_power_w(&mut self, power_w: i32) -> Result<(), P::Error> {
        let steps = self.steps(power_w, self.pwm.max_duty_cycle());
        self.pwm.set_duty_cycle(steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::pwm::{Mock, Transaction};
    use proptest::prelude::*;

    #[test]
    fn the_channel_gets_these_duties() {
        let expected = [
            (0, 21_000),
            (28_000, 37_800),
            (-28_000, 4_200),
            (i32::MAX, 37_800),
            (i32::MIN, 4_200),
            // 14 kW + 1 W: 29,400.6 and 12,599.4, both towards the middle.
            (14_001, 29_400),
            (-14_001, 12_600),
        ];
        let transactions: std::vec::Vec<_> = expected
            .iter()
            .flat_map(|(_, duty)| {
                [
                    Transaction::max_duty_cycle(42_000),
                    Transaction::set_duty_cycle(*duty),
                ]
            })
            .collect();
        let mut mock = Mock::new(&transactions);
        let mut line = PowerLine::new(mock.clone(), 28_000);
        for (power, _) in expected {
            assert_eq!(line.set_power_w(power), Ok(()));
        }
        mock.done();
    }

    proptest! {
        /// What the stage decodes is never past what was set, nor farther from it than the timer's
        /// steps explain.
        #[test]
        fn a_stage_never_reads_more(power in any::<i32>(), span in 1u32.., steps_max in 100u16..) {
            let mut mock = Mock::new(&[]);
            let line = PowerLine::new(mock.clone(), span);
            let steps = line.steps(power, steps_max);
            mock.done();
            let (span, whole) = (f64::from(span), f64::from(steps_max));
            let wanted = f64::from(power).clamp(-span, span);
            let decoded = (f64::from(steps) / whole - 0.5) * span / 0.4;
            // One step for the swing, half a step for the middle of an odd period; f64 is exact to
            // 1e-16.
            let step_w = span / (0.4 * whole);
            let exact = 1e-9 * span;
            prop_assert!((decoded - wanted).abs() <= 1.5 * step_w + exact);
            let past = if power < 0 { wanted - decoded } else { decoded - wanted };
            prop_assert!(past <= exact);
        }
    }
}
