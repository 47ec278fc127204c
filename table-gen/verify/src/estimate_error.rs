//! What the state that is decided on says of the real one.
//!
//! Without a delay the device decides on an estimate, within the measurement's error. With one it
//! decides on a prediction; [`super::delayed_loop`] derives how far that may be off.

use model::flow::Vector;
use model::interval::Interval;
use model::plant::STATES;

use super::drive::Drive;
use super::held_input::HeldInput;

/// What a level adds over a period to the state that is decided on.
#[derive(Debug, Clone)]
pub(crate) struct PeriodEffect {
    /// Enclosure of the centre \[micro-units\].
    pub(crate) centre: Vector<STATES>,
    /// Largest distance from it, errors at the period's end included \[micro-units\].
    pub(crate) radius: [f64; STATES],
}

/// The time from a command to its power.
#[derive(Debug, Clone)]
pub(crate) struct CommandDelay {
    /// Its length \[ticks\].
    pub(crate) ticks: u32,
    /// The plant over it.
    pub(crate) segment: HeldInput,
    /// Net power that the device expects with nothing under way.
    pub(crate) expected: Drive,
    /// Magnitudes at the trigger for which the prediction's error is known \[micro-units\].
    pub(crate) reach: [f64; STATES],
    /// The same of every later estimate \[micro-units\].
    pub(crate) estimates: [f64; STATES],
}

/// What is known at a decision.
#[derive(Debug, Clone)]
pub(crate) struct EstimateError {
    /// How far the first decision's state may be from the real one at the trigger, carried over the
    /// delay as expected.
    pub(crate) first: [f64; STATES],
    /// Widens the cell of a decision for the way to the next one.
    pub(crate) before: [f64; STATES],
    /// How far the real state in which a command begins to act may be from the one that was decided
    /// on.
    pub(crate) real: [f64; STATES],
    /// The way to the next decision, by level.
    pub(crate) drifts: Vec<PeriodEffect>,
    /// The delay, if there is one.
    pub(crate) delay: Option<CommandDelay>,
    /// Why nothing is known.
    pub(crate) limit: Option<String>,
}

impl EstimateError {
    /// Of a loop without a delay: the estimate's error \[micro-units\]. `varied` is what a unit of
    /// varying net power adds over the time in which a level's own is certain.
    pub(crate) fn of_estimate(
        error: [f64; STATES],
        period: &HeldInput,
        varied: &[f64; STATES],
        drives: &[Drive],
    ) -> Self {
        let drifts = drives.iter().map(|drive| PeriodEffect {
            centre: period
                .flow
                .gamma
                .map(|gamma| gamma * Interval::point(drive.mid)),
            radius: std::array::from_fn(|d| up(up(varied[d] * drive.radius) + error[d])),
        });
        Self {
            first: error,
            before: error,
            real: error,
            drifts: drifts.collect(),
            delay: None,
            limit: None,
        }
    }
}

pub(super) fn up(value: f64) -> f64 {
    value.next_up()
}
