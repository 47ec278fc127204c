//! A unidirectional charger: control pilot, contactor and what the car says.

use firmware::board::{Hardware, Rest};
use firmware::dispatch::Dispatch;
use firmware::table::Direction;
use product::output;
use settings::config::Limited;
use settings::orders::Ordered;
use settings::values::Values;

/// Which way it moves power.
pub(crate) const DIRECTION: Direction = Direction::Unidirectional;

/// The charger's output; `serial` is its place in the fleet.
pub(crate) fn on<H: Hardware>(
    hardware: &mut H,
    serial: u32,
    values: &Values,
) -> Option<Ordered<impl Dispatch + Limited + use<H>>> {
    // A line that is high all the time: no charging until the first tick has decided.
    let pwm = hardware.pwm(Rest::High)?;
    let coil = hardware.coil()?;
    let car = hardware.car()?;
    Some(output::pilot(pwm, coil, car, serial, values))
}
