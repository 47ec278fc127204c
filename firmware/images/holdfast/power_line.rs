//! A bidirectional charger: the signed power set-point as the duty of PA8 (TIM1 channel 1, 1 kHz);
//! PB0 is not used, for the power stage has a contactor of its own.

use firmware::dispatch::bidirectional::Bidirectional;
use firmware::dispatch::power_line::PowerLine;
use firmware::dispatch::{Dispatch, Limits};
use stm32f4xx_hal::gpio::{PA8, PB0};
use stm32f4xx_hal::pac::TIM1;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::Timer;

/// Carrier of the set-point \[Hz\].
const LINE_HZ: u32 = 1_000;
/// What the line's 10 % and 90 % stand for, and the power stage's limit in both directions \[W\]:
/// the paper's swing of 56 kW.
const SPAN_W: u32 = 28_000;

/// The charger's output. Every charger follows its share, so its place in the fleet does not
/// matter.
pub(crate) fn new(
    (timer, line, _coil): (TIM1, PA8, PB0),
    _serial: u32,
    rcc: &mut Rcc,
) -> impl Dispatch + use<> {
    let (_, (channel, ..)) = Timer::new(timer, rcc).pwm_hz(LINE_HZ.Hz());
    let mut pwm = channel.with(line);
    // A line that is not driven stands for no power, until the first tick has decided.
    pwm.set_duty(0);
    pwm.enable();
    let stage = PowerLine::new(pwm, SPAN_W);
    Bidirectional::new(stage, Limits::all(SPAN_W), Limits::all(SPAN_W))
}
