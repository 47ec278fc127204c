//! A unidirectional charger: the control pilot on PA8 (TIM1 channel 1, 1 kHz), the contactor on
//! PB0, high closes.

use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::pilot::PILOT_HZ;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::dispatch::{Dispatch, Limits};
use stm32f4xx_hal::gpio::{PA8, PB0};
use stm32f4xx_hal::pac::TIM1;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::Timer;

/// What socket and cable bear \[mA\].
const CABLE_MA: u32 = 32_000;

/// The charger's output; `serial` is its place in the fleet.
pub(crate) fn new(
    (timer, line, coil): (TIM1, PA8, PB0),
    serial: u32,
    rcc: &mut Rcc,
) -> impl Dispatch + use<> {
    let (_, (channel, ..)) = Timer::new(timer, rcc).pwm_hz(PILOT_HZ.Hz());
    let mut pilot = channel.with(line);
    // No charging until the first tick has decided.
    pilot.set_duty(pilot.get_max_duty());
    pilot.enable();
    Unidirectional::new(
        pilot,
        coil.into_push_pull_output(),
        ContactorTimes::DEFAULT,
        Threshold::of_serial(serial),
        Limits::all(CABLE_MA),
    )
}
