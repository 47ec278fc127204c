//! A recorded run.

use firmware::phase::Phase;
use serde::Serialize;

use super::monitor::Summary;

/// One moment of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sample {
    /// Time since the event \[s\].
    pub time_s: f64,
    /// Grid state (f, g, l, p) \[Hz, GW\].
    pub state: [f64; 4],
    /// Participation commanded from now on.
    pub participation: f64,
    /// Participation that the fleet delivers from now on.
    pub delivered: f64,
}

/// A stretch of one phase.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhaseSpan {
    /// Its name.
    pub phase: &'static str,
    /// From \[s\].
    pub start_s: f64,
    /// To \[s\].
    pub end_s: f64,
}

/// A run: its samples, its phases (none without the firmware) and its summary.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// One sample a step.
    pub samples: Vec<Sample>,
    /// Phases in order, without gaps.
    pub phases: Vec<PhaseSpan>,
    /// What it is judged by.
    pub summary: Summary,
}

/// Appends a stretch of a phase, or lengthens the last one if it is the same.
pub fn extend_phases(phases: &mut Vec<PhaseSpan>, phase: Phase, start_s: f64, end_s: f64) {
    let name = phase.name();
    match phases.last_mut() {
        Some(last) if last.phase == name => last.end_s = end_s,
        _ => phases.push(PhaseSpan {
            phase: name,
            start_s,
            end_s,
        }),
    }
}
