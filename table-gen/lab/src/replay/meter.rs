//! The frequency that a charger's meter would have read while a record was made.
//!
//! Between two samples the frequency is taken as a straight line: a sample that is held until the
//! next would show as a jump in one tick, ten times as steep as the grid was (0.04 Hz in a second
//! would be 0.4 Hz/s). Where the record itself jumps there is nothing to draw a line through, and
//! the gate judges the jump as it is:
//!
//! | in the record | what the meter reads |
//! |---|---|
//! | a single sample that is off by itself | that value at one tick, no longer |
//! | a jump that lasts | the last value, then the new one |

use core::num::NonZeroU16;

use firmware::frequency::{FrequencyError, FrequencySource, Reading};
use firmware::units::MICRO;

use crate::record::{Record, RecordSample};

/// Steepest change that counts as one of the grid \[Hz/s\]. The worst that the shipped specs know
/// is 2.2 GW on 102 GVA s (H = 2.04 GW s/Hz): 2.2 / (2 * 2.04) = 0.54 Hz/s. Twice that is 1.08.
const STEEPEST_HZ_PER_S: f64 = 1.0;
/// Records are written to the millihertz \[µHz\].
const RESOLUTION_UHZ: u32 = 1_000;
/// Grace for times that are no binary fractions \[s\].
const GRACE_S: f64 = 5e-4;

/// Plays a record, one reading a tick; before its beginning the frequency is that of its first
/// sample.
#[derive(Debug)]
pub(super) struct RecordMeter<'r> {
    record: &'r Record,
    tick_s: f64,
    /// Ticks before the beginning that are left.
    early_ticks: u32,
    /// Ticks of the record that were read.
    ticks: u32,
    /// The last sample that has come.
    at: usize,
}

impl<'r> RecordMeter<'r> {
    /// A meter that shows the first sample for so many ticks before the record begins.
    pub(super) fn new(record: &'r Record, tick_s: f64, early_ticks: u32) -> Self {
        Self {
            record,
            tick_s,
            early_ticks,
            ticks: 0,
            at: 0,
        }
    }

    /// The frequency at the next tick \[Hz\].
    fn next_hz(&mut self) -> f64 {
        let samples = &self.record.samples;
        if self.early_ticks > 0 {
            self.early_ticks -= 1;
            return samples[0].frequency_hz;
        }
        let time_s = f64::from(self.ticks) * self.tick_s;
        self.ticks += 1;
        let before = self.at;
        let has_come = |next: &RecordSample| next.time_s <= time_s + GRACE_S;
        while samples.get(self.at + 1).is_some_and(has_come) {
            self.at += 1;
        }
        let fresh = self.at != before;
        if fresh && stands_alone(samples, self.at) {
            return samples[self.at].frequency_hz;
        }
        self.between(time_s)
    }

    /// The line between the samples around a time that do not stand alone \[Hz\].
    fn between(&self, time_s: f64) -> f64 {
        let samples = &self.record.samples;
        let from = samples[self.at - usize::from(stands_alone(samples, self.at))];
        let next = self.at + 1 + usize::from(stands_alone(samples, self.at + 1));
        match samples.get(next) {
            Some(to) if is_of_the_grid(&from, to) => {
                let share = (time_s - from.time_s) / (to.time_s - from.time_s);
                from.frequency_hz + share.clamp(0.0, 1.0) * (to.frequency_hz - from.frequency_hz)
            }
            _ => from.frequency_hz,
        }
    }
}

/// Whether a sample jumps from the one before and the next jumps back.
pub(super) fn stands_alone(samples: &[RecordSample], at: usize) -> bool {
    let before = at.checked_sub(1).and_then(|at| samples.get(at));
    match (before, samples.get(at), samples.get(at + 1)) {
        (Some(before), Some(here), Some(after)) => {
            !is_of_the_grid(before, here)
                && !is_of_the_grid(here, after)
                && is_of_the_grid(before, after)
        }
        _ => false,
    }
}

fn is_of_the_grid(from: &RecordSample, to: &RecordSample) -> bool {
    let change_hz = (to.frequency_hz - from.frequency_hz).abs();
    change_hz <= STEEPEST_HZ_PER_S * (to.time_s - from.time_s)
}

impl FrequencySource for RecordMeter<'_> {
    fn error_uhz(&self) -> u32 {
        RESOLUTION_UHZ
    }

    fn lag_ms(&self) -> u16 {
        0
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        // A record may stand still: it has fewer digits than a meter.
        None
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        let deviation_hz = self.next_hz() - self.record.nominal_hz;
        Ok(Reading {
            deviation_uhz: (deviation_hz * f64::from(MICRO)).round() as i32,
            age_ms: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::tests::record;

    fn readings_hz(hz: &[f64], step_s: f64) -> Vec<f64> {
        let record = record(hz, step_s);
        let mut meter = RecordMeter::new(&record, 0.1, 0);
        let ticks = (record.end_s() / 0.1).round() as usize;
        (0..=ticks).map(|_| meter.next_hz()).collect()
    }

    #[test]
    fn the_steepest_slope_is_the_records() {
        // 0.04 Hz in a second: 4 mHz a tick.
        let readings = readings_hz(&[50.0, 49.96, 49.96, 50.0], 1.0);
        let slopes = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let steepest = slopes.fold(0.0, f64::max);
        assert!((steepest - 0.004).abs() < 1e-12, "{steepest}");
        assert_eq!(readings[10], 49.96);
    }

    #[test]
    fn a_sample_that_stands_alone_is_one_reading() {
        let readings = readings_hz(&[50.0, 50.0, 48.0, 50.0, 50.0], 1.0);
        let off: Vec<usize> = (0..readings.len())
            .filter(|k| readings[*k] != 50.0)
            .collect();
        assert_eq!(off, [20]);
        assert_eq!(readings[20], 48.0);
    }

    #[test]
    fn a_jump_that_lasts_comes_at_its_sample() {
        let readings = readings_hz(&[50.0, 50.0, 48.5, 48.5], 1.0);
        assert!(readings[..20].iter().all(|hz| *hz == 50.0));
        assert!(readings[20..].iter().all(|hz| *hz == 48.5));
    }

    #[test]
    fn a_record_at_the_tick_is_read_as_it_is() {
        let hz = [50.0, 49.0, 50.0, 49.99, 49.5, 49.5];
        assert_eq!(readings_hz(&hz, 0.1), hz);
    }
}
