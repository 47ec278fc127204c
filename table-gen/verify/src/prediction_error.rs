//! What the device's prediction says of the grid, for whoever knows what was delivered.
//!
//! The verifier's own bounds hold whatever the fleet delivers within the spec's error. A caller
//! that follows the delivery by itself needs less: how far the state that is decided on may be from
//! the real one, carried over the delay under what was commanded.

use firmware::table::TableView;
use model::plant::STATES;
use model::spec::Spec;

use super::delayed_loop::closed_loop;

/// How far off a prediction may be; an estimate, where commands act at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionError {
    /// Distance \[micro-units\] of the state that is decided on from `Φ_δ x +` (response to the
    /// expected power of the commands under way), x being the real state at the tick.
    pub error: [f64; STATES],
    /// The error is known where the real state at the trigger of the first decision is no larger
    /// \[micro-units\],
    pub reach: [f64; STATES],
    /// and where no later estimate is larger \[micro-units\].
    pub estimates: [f64; STATES],
}

/// The error of a table's prediction on a spec's plant; that of the spec's estimate where commands
/// act at once. The expected loss is the middle of the spec's band.
///
/// # Errors
/// A table that predicts over another delay than the spec's, or with coefficients that are far from
/// those of the spec's plant, or a plant that is not linear: in words.
pub fn prediction_error(table: &TableView<'_>, spec: &Spec) -> Result<PredictionError, String> {
    let known = closed_loop(table, spec).known;
    if let Some(limit) = known.limit {
        return Err(limit);
    }
    let everything = [f64::INFINITY; STATES];
    let (reach, estimates) = match &known.delay {
        Some(delay) => (delay.reach, delay.estimates),
        None => (everything, everything),
    };
    Ok(PredictionError {
        error: known.first,
        reach,
        estimates,
    })
}
