//! A bidirectional charger: the signed power set-point as a duty. The power stage has a contactor
//! of its own.

use firmware::board::{Hardware, Rest};
use firmware::dispatch::Dispatch;
use firmware::table::Direction;
use product::output;
use settings::config::Limited;
use settings::orders::Ordered;
use settings::values::Values;

/// Which way it moves power.
pub(crate) const DIRECTION: Direction = Direction::Bidirectional;

/// The charger's output. Every charger follows its share, so its place in the fleet does not
/// matter.
pub(crate) fn on<H: Hardware>(
    hardware: &mut H,
    _serial: u32,
    values: &Values,
) -> Option<Ordered<impl Dispatch + Limited + use<H>>> {
    // A line that is not driven stands for no power, until the first tick has decided.
    let pwm = hardware.pwm(Rest::Low)?;
    Some(output::power_line(pwm, values))
}
