//! The plant behind a recorded event: its parameters, each with an interval.
//!
//! The grid is the model's plant with limited governors ([`model::governor`]); the record is a fall
//! after a loss of infeed. What was lost may be known, in stages. `docs/identification.md` is the
//! reader's page, with three real events.
//!
//! | step | module |
//! |---|---|
//! | what is looked for, and where | [`parameters`] |
//! | the part of the record that counts | [`excerpt`] |
//! | the frequency that some values would have given | [`course`] |
//! | where fits start | [`search`] |
//! | least squares | [`mod@fit`] |
//! | intervals by profile likelihood | [`mod@intervals`] |
//! | inertia from the first second alone | [`slope`] |
//! | what the identified plants say of another event | [`forecast`] |
//! | a spec that other commands take | [`spec_file`] |
//! | the fit, drawn | [`figure`] |

pub mod course;
pub mod excerpt;
pub mod figure;
pub mod fit;
pub mod forecast;
pub mod intervals;
pub mod parameters;
pub mod search;
pub mod slope;
pub mod spec_file;

use std::cell::RefCell;

use serde::Serialize;

use crate::record::Record;
use course::Stage;
use excerpt::{Excerpt, ExcerptError};
use fit::{Data, Seen, fit};
use intervals::{CONFIDENCE, Noise};
use parameters::{COUNT, DEADBAND, LOSS, ONSET, PARAMETERS, RATE, Told, UPPER, Values};
use slope::FromSlope;

/// Evaluations of a fit for each parameter: of each start, and of the best of them.
const FIRST_PATIENCE: usize = 3;
/// See [`FIRST_PATIENCE`].
const PATIENCE: usize = 12;
/// Starts that are fitted to the end.
const FINALISTS: usize = 8;
/// Fewest samples of an excerpt beyond the number of parameters.
const SPARE_SAMPLES: usize = 5;

/// What is known of the event besides its record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Known {
    /// Losses in the order of time, the first at 0; none: one of unknown size.
    pub stages: Vec<Stage>,
    /// Parameters that are given, by their places in [`PARAMETERS`].
    pub given: Vec<(usize, f64)>,
    /// Time after the steepest second up to which the record counts \[s\].
    pub until_s: f64,
}

/// Time after the onset that counts unless said otherwise \[s\].
pub const UNTIL_S: f64 = 60.0;

/// Why nothing can be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The record has no event.
    #[error(transparent)]
    Excerpt(#[from] ExcerptError),
    /// Too few samples.
    #[error(
        "{found} samples count, equal neighbours and those within a second as one; allowed: at least {least} for this many parameters"
    )]
    Samples {
        /// Found.
        found: usize,
        /// Needed.
        least: usize,
    },
    /// The first loss is not at 0, or the losses are not in the order of time.
    #[error("losses at {at_s:?} s; allowed: the first at 0, the others in order")]
    Stages {
        /// Their times.
        at_s: Vec<f64>,
    },
    /// A given value lies outside the range in which its parameter is looked for.
    #[error("{key} = {value}; allowed: {low} to {high} {unit}")]
    Given {
        /// Its key.
        key: &'static str,
        /// What was given.
        value: f64,
        /// Least.
        low: f64,
        /// Greatest.
        high: f64,
        /// Its unit.
        unit: &'static str,
    },
}

/// What was found of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Its key, or its name.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The best value.
    pub value: f64,
    /// Least.
    pub low: f64,
    /// Greatest.
    pub high: f64,
    /// What of the interval the record tells.
    pub told: Told,
}

/// What a record says of its grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identified {
    /// Parameter by parameter; all intervals hold at once with `confidence`.
    pub parameters: Vec<Estimate>,
    /// See `parameters`.
    pub confidence: f64,
    /// Samples that counted.
    pub samples: usize,
    /// Standard deviation of what the best fit leaves \[Hz\].
    pub residual_hz: f64,
    /// The most that it leaves \[Hz\].
    pub largest_residual_hz: f64,
    /// Correlation of neighbouring residuals.
    pub correlation: f64,
    /// H by the first second alone, if the losses are known.
    pub first_second: Option<FromSlope>,
    /// What the record cannot tell, in sentences.
    pub cannot_tell: Vec<String>,
    /// Limits of the governors that the best fit does not need: (dead band, rate, output).
    pub needed: [bool; 3],
    /// Where the excerpt begins, in the record's time \[s\].
    pub from_s: f64,
    /// The best values.
    #[serde(skip)]
    pub best: Values,
    /// Values of other plants that explain the record well enough.
    #[serde(skip)]
    pub others: Vec<Values>,
    /// The excerpt and the best fit: time since its begin \[s\], reading and fit \[Hz, deviation\].
    #[serde(skip)]
    pub curve: Vec<(f64, f64, f64)>,
}

/// Identifies the plant behind a record.
///
/// # Errors
/// A record without a fall, too few samples, or knowledge that contradicts itself.
pub fn identify(record: &Record, known: &Known) -> Result<Identified, IdentifyError> {
    let at_s: Vec<f64> = known.stages.iter().map(|stage| stage.after_s).collect();
    let in_order = at_s.windows(2).all(|pair| pair[0] <= pair[1]);
    if !in_order || at_s.first().is_some_and(|first| *first != 0.0) {
        return Err(IdentifyError::Stages { at_s });
    }
    let excerpt = Excerpt::of(record, known.until_s)?;
    let mut ranges = PARAMETERS;
    (ranges[ONSET].from, ranges[ONSET].to) = excerpt.onset_s;
    let mut start = ranges.map(|range| range.value(0.5));
    start[LOSS] = 1.0;
    let mut free: Vec<usize> = (0..COUNT).collect();
    if !known.stages.is_empty() {
        free.retain(|index| *index != LOSS);
        start[LOSS] = known.stages.iter().map(|stage| stage.power_gw).sum();
    }
    for (index, value) in &known.given {
        let (range, value) = (ranges[*index], *value);
        let (low, high) = (range.from.min(range.to), range.from.max(range.to));
        if !(low..=high).contains(&value) {
            let (key, unit) = (range.key, range.unit);
            return Err(IdentifyError::Given {
                key,
                value,
                low,
                high,
                unit,
            });
        }
        free.retain(|other| other != index);
        start[*index] = value;
    }
    let data = Data {
        times_s: excerpt.times_s,
        readings_hz: excerpt.deviations_hz,
        stages: known.stages.clone(),
        ranges,
    };
    let least = free.len() + SPARE_SAMPLES;
    let found = data.misfits(&start).len();
    if found < least {
        return Err(IdentifyError::Samples { found, least });
    }
    let seen = RefCell::new(Seen::new());
    let mut fits: Vec<(f64, Values)> = search::starts(&data, &start, &free)
        .iter()
        .map(|start| fit(&data, start, &free, FIRST_PATIENCE, None, &seen))
        .collect();
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let fits: Vec<(f64, Values)> = fits
        .iter()
        .take(FINALISTS)
        .map(|(_, start)| fit(&data, start, &free, PATIENCE, None, &seen))
        .collect();
    let (noise, intervals) = intervals::intervals(&data, &free, &fits, &seen);
    let seen = seen.into_inner();
    Ok(answer(&data, seen, noise, &intervals, excerpt.from_s))
}

fn answer(
    data: &Data,
    seen: Seen,
    noise: Noise,
    intervals: &[intervals::Interval; COUNT],
    from_s: f64,
) -> Identified {
    let (least, best) = seen.best;
    let parameters: Vec<Estimate> = data
        .ranges
        .iter()
        .zip(intervals)
        .zip(best)
        .map(|((range, interval), value)| Estimate {
            key: range.key,
            unit: range.unit,
            value,
            low: interval.near.min(interval.far),
            high: interval.near.max(interval.far),
            told: interval.told,
        })
        .collect();
    // Without a limit the sum of squares rises by less than one sample's variance: not needed.
    let needed = [
        (DEADBAND, 0.0),
        (RATE, f64::INFINITY),
        (UPPER, f64::INFINITY),
    ]
    .map(|(index, off)| {
        let mut without = best;
        without[index] = off;
        fit::sum_of_squares(&data.misfits(&without)) - least > noise.variance
    });
    let residuals = data.residuals(&best);
    let samples = data.times_s.iter().zip(&data.readings_hz);
    let falls: Vec<(f64, f64)> = samples
        .clone()
        .map(|(time, reading)| (time - best[ONSET], best[parameters::REST] - reading))
        .collect();
    let first_second = (!data.stages.is_empty())
        .then(|| slope::inertia(&falls, &data.stages))
        .flatten();
    Identified {
        cannot_tell: cannot_tell(&parameters),
        parameters,
        confidence: CONFIDENCE,
        samples: residuals.len(),
        residual_hz: noise.residual_mhz / 1e3,
        largest_residual_hz: residuals.iter().fold(0.0f64, |most, r| most.max(r.abs())) / 1e3,
        correlation: noise.correlation,
        first_second,
        needed,
        from_s,
        best,
        others: seen.kept,
        curve: samples
            .zip(&residuals)
            .map(|((time, reading), residual)| (*time, *reading, reading - residual / 1e3))
            .collect(),
    }
}

/// What the intervals leave open, one sentence a parameter, and what no record of a fall tells.
fn cannot_tell(parameters: &[Estimate]) -> Vec<String> {
    let mut out: Vec<String> = parameters
        .iter()
        .filter_map(|it| {
            let (key, unit, low, high) = (it.key, it.unit, it.low, it.high);
            let (near, far) = if high <= 0.0 { (high, low) } else { (low, high) };
            match it.told {
                Told::Given | Told::BothEnds => None,
                Told::Nothing => Some(format!(
                    "{key}: nothing; anything from {low:.3} to {high:.3} {unit} explains the record"
                )),
                Told::AtMost => Some(format!(
                    "{key}: only that it is not beyond {far:.3} {unit}; {near:.3}, the near end of the range, explains the record too"
                )),
                Told::AtLeast => Some(format!(
                    "{key}: only that it is {near:.3} {unit} or beyond; {far:.3}, the far end of the range, explains the record too"
                )),
            }
        })
        .collect();
    out.push(
        "plant.governor.lower_gw: nothing; a fall asks the governors for more, never for less"
            .to_owned(),
    );
    out
}
