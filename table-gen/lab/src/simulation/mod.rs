//! The grid in time: the plant's exact steps, the controllers that drive it, and what is measured
//! on the way.
//!
//! | module | holds |
//! |---|---|
//! | [`scenario`] | what happens to the grid in a run |
//! | [`chance`] | what is drawn at each tick |
//! | [`mod@model::propagator`], [`power_system`] | the exact discrete step of the linear plant |
//! | [`beyond`] | a plant that is wrong in other ways: not linear, simulation only |
//! | [`baseline`] | the continuous loop with the baseline droop, which is not linear |
//! | [`closed_loop`] | the firmware's own loop on the emitted bytes |
//! | [`monitor`] | nadir, times, bands: one meter for all of them |
//! | [`recorder`], [`trajectory`] | what is kept of a run |
//! | [`monte_carlo`] | many runs, and what they have in common |

pub mod baseline;
pub mod beyond;
pub mod chance;
pub mod closed_loop;
pub mod monitor;
pub mod monte_carlo;
pub mod power_system;
pub mod recorder;
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
