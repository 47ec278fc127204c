//! The grid in time: the plant's exact steps, the controllers that drive it, and what is measured on the way.
//!
//! | module | holds |
//! |---|---|
//! | [`propagator`] | the exact discrete step of the linear plant |
//! | [`baseline`] | the continuous loop with the baseline droop, which is not linear |
//! | [`closed_loop`] | the firmware's own loop on the emitted bytes |
//! | [`monitor`] | nadir, times, bands: one meter for all of them |
//! | [`scenario`] | what happens to the grid |
//! | [`trajectory`] | the recorded samples |

pub mod baseline;
pub mod closed_loop;
pub mod monitor;
pub mod propagator;
pub mod scenario;
pub mod trajectory;

use serde::Serialize;

/// Nominal frequency \[Hz\].
pub const NOMINAL_HZ: f64 = 50.0;

/// A controller that can be simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ControllerKind {
    /// The chargers do not respond.
    None,
    /// The paper's droop.
    Baseline,
    /// The firmware with a table.
    Symbolic,
}
