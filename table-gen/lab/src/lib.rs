//! The grid to try tables on.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`simulation`] | a table, or a baseline | the grid's frequency in time |
//! | [`car`] | a charger's set-point | the power that the grid sees |
//! | [`fleet`] | a table | the same with one firmware for each charger |
//! | [`record`] | a recorded frequency as text | samples at one interval |
//! | [`compare`] | a table | a scorecard: no response, droop, table and the limit side by side |
//! | [`identify`] | a recorded event | the plant behind it, with intervals |
//! | [`replay`] | a recorded frequency | what the firmware would have done |
//! | [`falsify`] | a table and a spec | a real trajectory that breaks a claim |
//! | [`counterfactual`] | a recorded event | what it would have been with the chargers |
//! | [`robustness`] | a temporal formula and a trace | true or false, and by how much |
//! | [`telemetry_lines`] | a charger's telemetry | lines for a person |
//! | [`report`] | runs and findings | one HTML page and its figures |
#![forbid(unsafe_code)]

pub mod car;
pub mod compare;
pub mod counterfactual;
pub mod falsify;
pub mod fleet;
pub mod identify;
pub mod record;
pub mod replay;
pub mod report;
pub mod robustness;
pub mod simulation;
pub mod telemetry_lines;
