//! The part of a record that counts: from a little before the steepest second to a while after.

use crate::record::Record;

/// Time before the steepest second that shows the rest \[s\].
const BEFORE_S: f64 = 10.0;
/// How far the onset may lie before and after the begin of the steepest second \[s\]: losses come
/// in stages, and samples a second apart show the steepest second up to one late.
const ONSET_BEFORE_S: f64 = 2.0;
/// See [`ONSET_BEFORE_S`].
const ONSET_AFTER_S: f64 = 1.0;
/// Least fall of the steepest second \[Hz\]: several times what demand does by itself.
const LEAST_HZ: f64 = 0.03;

/// Why a record has no excerpt.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ExcerptError {
    /// No second falls steeply enough.
    #[error(
        "the steepest second falls by {found_hz:.4} Hz; allowed: at least {LEAST_HZ} Hz, or it is no loss of infeed"
    )]
    NoFall {
        /// Its fall.
        found_hz: f64,
    },
}

/// An excerpt.
#[derive(Debug, Clone, PartialEq)]
pub struct Excerpt {
    /// Where it begins in the record \[s\].
    pub from_s: f64,
    /// Times since then \[s\].
    pub times_s: Vec<f64>,
    /// Deviations from nominal \[Hz\].
    pub deviations_hz: Vec<f64>,
    /// Where the onset is looked for, since the begin \[s\].
    pub onset_s: (f64, f64),
    /// The steepest second \[Hz/s\], positive.
    pub steepest_hz_per_s: f64,
}

impl Excerpt {
    /// The excerpt up to a time after the steepest second \[s\].
    ///
    /// # Errors
    /// A record without a fall.
    pub fn of(record: &Record, until_s: f64) -> Result<Self, ExcerptError> {
        let samples = &record.samples;
        // Samples in a second, at least one step.
        let apart = (1.0 / record.step_s).round().max(1.0) as usize;
        let span_s = apart as f64 * record.step_s;
        let fall = |at: usize| samples[at].frequency_hz - samples[at + apart].frequency_hz;
        let steepest = (0..samples.len().saturating_sub(apart))
            .max_by(|a, b| fall(*a).total_cmp(&fall(*b)))
            .map(|at| (at, fall(at)));
        let (at, fall_hz) = steepest.unwrap_or((0, 0.0));
        if fall_hz < LEAST_HZ {
            return Err(ExcerptError::NoFall { found_hz: fall_hz });
        }
        let steep_s = samples[at].time_s;
        let inside: Vec<_> = samples
            .iter()
            .filter(|s| s.time_s >= steep_s - BEFORE_S && s.time_s <= steep_s + until_s)
            .collect();
        let from_s = inside.first().map_or(0.0, |sample| sample.time_s);
        Ok(Self {
            from_s,
            times_s: inside.iter().map(|s| s.time_s - from_s).collect(),
            deviations_hz: inside
                .iter()
                .map(|s| s.frequency_hz - record.nominal_hz)
                .collect(),
            onset_s: (
                (steep_s - ONSET_BEFORE_S - from_s).max(0.0),
                steep_s + ONSET_AFTER_S - from_s,
            ),
            steepest_hz_per_s: fall_hz / span_s,
        })
    }
}
