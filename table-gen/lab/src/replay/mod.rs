//! The firmware on a recorded frequency: what would this charger have done?
//!
//! The loop is open: the recorded grid does not feel the chargers. The firmware sees the last sample that was published
//! when its tick comes (no interpolation, which would look ahead) and reconstructs the rest of the state by its observer.

pub mod trace;

use firmware::control_loop::ControlLoop;
use firmware::observer::{Observer, ObserverConfig, ObserverError};
use firmware::table::TableView;
use firmware::units::MICRO;

use crate::simulation::NOMINAL_HZ;
use crate::simulation::trajectory::{PhaseSpan, extend_phases};
use trace::Trace;

/// A fall of this much \[Hz\] ...
const ONSET_FALL_HZ: f64 = 0.1;
/// ... within this time \[s\] is an event; quiet days stay below it.
const ONSET_WITHIN_S: f64 = 2.0;

/// One tick of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplaySample {
    /// Time since the start of the trace \[s\].
    pub time_s: f64,
    /// Recorded frequency \[Hz\].
    pub frequency_hz: f64,
    /// Participation that the firmware asked for.
    pub participation: f64,
}

/// What the firmware did.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// One sample a tick.
    pub samples: Vec<ReplaySample>,
    /// Phases in order.
    pub phases: Vec<PhaseSpan>,
    /// Start of the first event in the trace \[s\]: the last sample before a fall of 0.1 Hz within 2 s; `None` if none.
    pub onset_s: Option<f64>,
    /// First tick at or after the onset at which chargers respond \[s since the start\].
    pub first_response_s: Option<f64>,
    /// Times the chargers began to respond before the onset (or at all, without one).
    pub false_triggers: usize,
    /// Largest participation.
    pub max_participation: f64,
}

/// Runs the firmware of a table on a trace.
///
/// # Errors
/// A plant that the observer cannot follow.
pub fn replay(table: &TableView<'_>, trace: &Trace) -> Result<Replay, ObserverError> {
    let header = table.header();
    let tick_s = f64::from(header.tick_ms) / 1000.0;
    let deviation_uhz = |hz: f64| ((hz - NOMINAL_HZ) * f64::from(MICRO)).round() as i32;
    let config = ObserverConfig::new(&header.plant, header.tick_ms)?;
    let first = trace.samples[0].frequency_hz;
    let mut observer = Observer::at_rest(config, &header.plant, deviation_uhz(first));
    let mut firmware = ControlLoop::with_table(Ok(table.clone()));
    let end = trace.samples[trace.samples.len() - 1].time_s;
    let ticks = (end / tick_s).floor() as usize;
    let mut samples = Vec::with_capacity(ticks + 1);
    let mut phases = Vec::new();
    let mut at = 0;
    for tick in 0..=ticks {
        let time_s = tick as f64 * tick_s;
        // Half a millisecond of grace for times that are no binary fractions.
        while trace
            .samples
            .get(at + 1)
            .is_some_and(|next| next.time_s <= time_s + 5e-4)
        {
            at += 1;
        }
        let frequency_hz = trace.samples[at].frequency_hz;
        let action = firmware.step(observer.step(deviation_uhz(frequency_hz)));
        extend_phases(&mut phases, action.phase, time_s, time_s + tick_s);
        samples.push(ReplaySample {
            time_s,
            frequency_hz,
            participation: f64::from(action.participation.ppm()) / f64::from(MICRO),
        });
    }
    let onset_s = onset(trace);
    let responds = |sample: &&ReplaySample| sample.participation > 0.0;
    let after = |sample: &&ReplaySample| onset_s.is_some_and(|onset| sample.time_s >= onset);
    let first_response_s = samples
        .iter()
        .filter(after)
        .find(responds)
        .map(|s| s.time_s);
    let false_triggers = samples
        .windows(2)
        .filter(|pair| pair[0].participation == 0.0 && pair[1].participation > 0.0)
        .filter(|pair| onset_s.is_none_or(|onset| pair[1].time_s < onset))
        .count();
    let max_participation = samples.iter().map(|s| s.participation).fold(0.0, f64::max);
    Ok(Replay {
        samples,
        phases,
        onset_s,
        first_response_s,
        false_triggers,
        max_participation,
    })
}

/// Last sample before the first fall of [`ONSET_FALL_HZ`] within [`ONSET_WITHIN_S`].
fn onset(trace: &Trace) -> Option<f64> {
    let samples = &trace.samples;
    for (index, from) in samples.iter().enumerate() {
        let window = samples[index + 1..]
            .iter()
            .take_while(|to| to.time_s <= from.time_s + ONSET_WITHIN_S);
        let lowest = window
            .map(|to| to.frequency_hz)
            .fold(f64::INFINITY, f64::min);
        let falls_next = samples
            .get(index + 1)
            .is_some_and(|next| next.frequency_hz < from.frequency_hz);
        if falls_next && from.frequency_hz - lowest >= ONSET_FALL_HZ {
            return Some(from.time_s);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::trace::TraceSample;
    use super::*;

    fn trace(hz: &[f64]) -> Trace {
        let samples = hz
            .iter()
            .enumerate()
            .map(|(i, hz)| TraceSample {
                time_s: i as f64,
                frequency_hz: *hz,
            })
            .collect();
        Trace {
            start: String::new(),
            samples,
            filled_s: 0.0,
        }
    }

    #[test]
    fn onset_is_the_last_sample_before_the_fall() {
        assert_eq!(onset(&trace(&[50.0, 50.01, 49.99, 49.9, 49.8])), Some(1.0));
        assert_eq!(onset(&trace(&[50.0, 49.96, 49.93, 49.9])), None);
        assert_eq!(onset(&trace(&[50.0])), None);
    }
}
