//! A unidirectional charger: control pilot, contactor and what the car says.

use firmware::board::{Hardware, Rest};
use firmware::charger::{Installation, StartDelay};
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::dispatch::{Dispatch, Limits};

/// What socket and cable bear \[mA\].
const CABLE_MA: u32 = 32_000;

/// What this charger is.
pub(crate) const INSTALLATION: Installation = Installation::REFERENCE_UNIDIRECTIONAL;
const _: () = assert!(INSTALLATION.power_w == CABLE_MA / 1000 * 3 * 230);
// A reset opens the contactor, and it stays open for its time: nothing need be kept over the reset.
const FIXED_MS: u32 = StartDelay::street(0).fixed_s as u32 * 1000;
const _: () = assert!(FIXED_MS >= ContactorTimes::DEFAULT.off_min_ms);

/// The charger's output; `serial` is its place in the fleet.
pub(crate) fn on<H: Hardware>(hardware: &mut H, serial: u32) -> Option<impl Dispatch + use<H>> {
    // A line that is high all the time: no charging until the first tick has decided.
    let charger = Unidirectional::new(
        hardware.pwm(Rest::High)?,
        hardware.coil()?,
        ContactorTimes::DEFAULT,
        Threshold::of_serial(serial),
        Limits::all(CABLE_MA),
    );
    Some(charger.with_car(hardware.car()?))
}
