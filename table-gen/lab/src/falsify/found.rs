//! What a search found.

use model::verdict::RealPath;
use serde::Serialize;

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Falsification {
    /// Control steps (ticks) simulated.
    pub steps: u64,
    /// Trajectories simulated.
    pub trajectories: u64,
    /// Smallest distance from breaking a claim \[Hz\]: f above containment, and inside I2 under
    /// Hold; at ticks.
    pub smallest_margin_hz: f64,
    /// A trajectory that breaks a claim.
    pub violation: Option<RealPath>,
}
