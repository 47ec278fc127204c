//! A bidirectional charger: the signed power set-point as a duty. The power stage has a contactor
//! of its own.

use firmware::board::{Hardware, Rest};
use firmware::charger::Installation;
use firmware::dispatch::bidirectional::Bidirectional;
use firmware::dispatch::power_line::PowerLine;
use firmware::dispatch::{Dispatch, Limits};

/// What the line's 10 % and 90 % stand for, and the power stage's limit in both directions \[W\]:
/// the paper's swing of 56 kW.
const SPAN_W: u32 = 28_000;

/// What this charger is.
pub(crate) const INSTALLATION: Installation = Installation::REFERENCE_BIDIRECTIONAL;
const _: () = assert!(INSTALLATION.power_w == 2 * SPAN_W);

/// The charger's output. Every charger follows its share, so its place in the fleet does not
/// matter.
pub(crate) fn on<H: Hardware>(hardware: &mut H, _serial: u32) -> Option<impl Dispatch + use<H>> {
    // A line that is not driven stands for no power, until the first tick has decided.
    let stage = PowerLine::new(hardware.pwm(Rest::Low)?, SPAN_W);
    Some(Bidirectional::new(
        stage,
        Limits::all(SPAN_W),
        Limits::all(SPAN_W),
    ))
}
