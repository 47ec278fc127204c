//! The products of this repository: what the charger is that runs each image.
//!
//! The images are built from the same constants; whoever decides on a table for one of them (`cargo
//! fw`, a verdict's claim `image`) compares with these.

use super::{Installation, MeterFacts};
use crate::frequency::ade7953;
use crate::frequency::zero_crossing::{CYCLES_DEFAULT, ZeroCrossing};

/// Rate of the timer that captures the mains' edges \[Hz\].
pub const TIMER_HZ: u32 = 84_000_000;
/// Error of the crystal, temperature and ageing included \[ppm\].
pub const CLOCK_PPM: u16 = 20;
/// What the comparator in front of the timer keeps to, noise of the mains included \[ns\].
pub const JITTER_NS: u32 = 500;

/// A product.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Product {
    /// Name of its image.
    pub name: &'static str,
    /// What the charger is.
    pub installation: Installation,
    /// What its meter says of itself.
    pub meter: MeterFacts,
}

/// Every product: both directions, each with captured edges and with a metering chip.
#[must_use]
pub fn products() -> [Product; 4] {
    let edges = captured();
    let chip = MeterFacts {
        error_uhz: ade7953::ERROR_UHZ,
        lag_ms: ade7953::LAG_MS,
    };
    let product = |name, installation, meter| Product {
        name,
        installation,
        meter,
    };
    let (one_way, both_ways) = (
        Installation::REFERENCE_UNIDIRECTIONAL,
        Installation::REFERENCE_BIDIRECTIONAL,
    );
    [
        product("holdfast", one_way, edges),
        product("holdfast-bidirectional", both_ways, edges),
        product("holdfast-ade7953", one_way, chip),
        product("holdfast-ade7953-bidirectional", both_ways, chip),
    ]
}

/// The board's captures. A rate or a window outside the allowed ranges would be a meter that fits
/// nothing.
fn captured() -> MeterFacts {
    match ZeroCrossing::new(TIMER_HZ, CYCLES_DEFAULT, CLOCK_PPM) {
        Ok(window) => MeterFacts::of(&window.with_jitter_ns(JITTER_NS)),
        Err(_) => MeterFacts {
            error_uhz: u32::MAX,
            lag_ms: u16::MAX,
        },
    }
}
