//! What drives the car or the power stage, by the settings and under orders.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use firmware::dispatch::Limits;
use firmware::dispatch::bidirectional::Bidirectional;
use firmware::dispatch::car::CarSense;
use firmware::dispatch::power_line::PowerLine;
use firmware::dispatch::unidirectional::Unidirectional;
use settings::orders::Ordered;
use settings::values::Values;

/// What the line's 10 % and 90 % stand for, the most that a power stage moves in both directions
/// \[W\]: the paper's swing of 56 kW.
pub const SPAN_W: u32 = 28_000;

/// A unidirectional charger: control pilot, contactor and what the car says. `serial` is its place
/// in the fleet, unless the settings give it another.
pub fn pilot<P: SetDutyCycle, O: OutputPin, C: CarSense>(
    pwm: P,
    coil: O,
    car: C,
    serial: u32,
    values: &Values,
) -> Ordered<Unidirectional<P, O, C>> {
    let charger = Unidirectional::new(
        pwm,
        coil,
        values.contactor(),
        values.threshold(serial),
        Limits::all(values.borne_ma()),
    );
    let charger = charger.with_pace(values.pace()).with_car(car);
    Ordered::new(charger, *values)
}

/// A bidirectional charger: the signed power set-point as a duty. The power stage has a contactor
/// of its own. Every charger follows its share, so its place in the fleet does not matter.
pub fn power_line<P: SetDutyCycle>(
    pwm: P,
    values: &Values,
) -> Ordered<Bidirectional<PowerLine<P>>> {
    // The orders' limits, which are the settings' at first, come before the first power.
    let none = Limits::all(0);
    let stage = PowerLine::new(pwm, SPAN_W);
    Ordered::new(Bidirectional::new(stage, none, none), *values)
}
