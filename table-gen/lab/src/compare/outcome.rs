//! What a run of the scorecard is judged by.

use serde::{Deserialize, Serialize};

/// What a run is judged by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Lowest frequency \[Hz, absolute\].
    pub nadir_hz: f64,
    /// When \[s after the event\].
    pub nadir_time_s: f64,
    /// Frequency at the end \[Hz, absolute\].
    pub final_hz: f64,
    /// Time below 49.5 Hz \[s\].
    pub seconds_below_49_5: f64,
    /// Energy that the fleet gave \[GW s\].
    pub participation_gw_s: f64,
    /// Changes of a charger's command by 5 % of full scale and more, on average.
    pub changes_per_charger: f64,
    /// The most of any charger.
    pub changes_most: u32,
    /// Highest less lowest frequency from 60 s on \[Hz\].
    pub ripple_hz: f64,
}
