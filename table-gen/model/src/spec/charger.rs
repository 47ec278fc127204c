//! The car and the contactor: what stands between a charger's decision and its power.

use serde::{Deserialize, Serialize};

/// Cars and contactors: what stands between a charger's command and the grid.
///
/// Dead time, ramp and the pilot's wait add to `uncertainty.actuation_delay_s` in what a table says
/// of itself and in the proof ([`crate::spec::Spec::command_delay_s`]); the claim `dispatch` of a
/// verdict holds the rest against the errors of participation. The fleet of the laboratory has such
/// cars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChargerSpec {
    /// Time until a car begins to answer a set-point; each car's own.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0 to 60. Default: [0, 0].
    pub dead_time_s: [f64; 2],
    /// Time in which a car moves by its whole swing; each car's own.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0 to 60. Default: [0, 0].
    pub ramp_s: [f64; 2],
    /// Least time between two changes of a pilot, except to pause. Unidirectional chargers only.
    ///
    /// Unit: s. Allowed: a number from 0 to 60. Default: 0.
    pub pilot_change_s: f64,
    /// Current above 6 A from which a paused car is charged again. Unidirectional chargers only.
    ///
    /// Unit: A. Allowed: a number from 0 to 26. Default: 0.
    pub resume_above_floor_a: f64,
    /// Largest draw of a car, as a share of its charger's rating; each car's own. Unidirectional
    /// chargers only.
    ///
    /// Unit: 1. Allowed: 2 numbers, each from 0 to 1. Default: [1, 1].
    pub draw: [f64; 2],
    /// Share of the cars that pause by themselves when their set-point changes.
    ///
    /// Unit: 1. Allowed: a number from 0 to 1. Default: 0.
    pub pausing_share: f64,
    /// Length of such a pause, each drawn anew.
    ///
    /// Unit: s. Allowed: 2 numbers, each from 0 to 600. Default: [10, 60].
    pub pause_s: [f64; 2],
    /// Length of a pause after which the contactor opens.
    ///
    /// Unit: s. Allowed: a number from 0 to 86400. Default: 10.
    pub contactor_opens_after_s: f64,
    /// Least time for which it then stays open.
    ///
    /// Unit: s. Allowed: a number from 0 to 86400. Default: 60.
    pub contactor_open_least_s: f64,
    /// Error of a charger's clock, each its own within this: of its ticks, and of what it reads.
    ///
    /// Unit: ppm. Allowed: a number from 0 to 1000. Default: 0.
    pub clock_ppm: f64,
}

impl Default for ChargerSpec {
    fn default() -> Self {
        Self {
            dead_time_s: [0.0, 0.0],
            ramp_s: [0.0, 0.0],
            pilot_change_s: 0.0,
            resume_above_floor_a: 0.0,
            draw: [1.0, 1.0],
            pausing_share: 0.0,
            pause_s: [10.0, 60.0],
            contactor_opens_after_s: 10.0,
            contactor_open_least_s: 60.0,
            clock_ppm: 0.0,
        }
    }
}
