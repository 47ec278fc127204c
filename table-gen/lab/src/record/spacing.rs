//! Rows to samples at one interval.

use super::row::{BadRow, RecordSample, Row, SAMPLES_MAX, bad};

/// Shortest and longest time between samples \[s\]: the charger's own tick, and the slowest records
/// that operators publish.
pub(super) const STEP_S: [f64; 2] = [0.1, 10.0];
/// A step counts as one interval from half to one and a half of it: what is nearer to one than to
/// none or two.
const NEAR: f64 = 0.5;
/// Time stamps are written to the millisecond at best \[s\].
const STAMP_S: f64 = 1e-3;
/// Milliseconds of a second.
const STAMPS_PER_S: f64 = 1e3;

/// Samples at one interval.
pub(super) struct Spaced {
    pub(super) step_s: f64,
    pub(super) samples: Vec<RecordSample>,
    pub(super) filled_s: f64,
}

/// Finds the interval, and holds the last sample over gaps up to `fill_gaps_s`.
///
/// # Errors
/// An interval out of range, a row off it, or a gap that is not to be filled.
pub(super) fn space(rows: &[Row], fill_gaps_s: Option<f64>) -> Result<Spaced, BadRow> {
    let step_s = median_step(rows);
    let [shortest, longest] = STEP_S;
    if step_s < shortest - STAMP_S || step_s > longest + STAMP_S {
        let reason = format!(
            "samples are {step_s} s apart, by their median; allowed: {shortest} to {longest} s"
        );
        return Err(bad(rows[1].line, reason));
    }
    let mut samples = Vec::with_capacity(rows.len());
    let mut filled_s = 0.0;
    let mut last: Option<&Row> = None;
    for row in rows {
        if let Some(last) = last {
            let gap = row.time_s - last.time_s;
            if gap < (1.0 - NEAR) * step_s {
                let gap = shown(gap);
                let reason = format!("{gap} s after the row before; samples are {step_s} s apart");
                return Err(bad(row.line, reason));
            }
            if gap > (1.0 + NEAR) * step_s {
                may_fill(gap, step_s, fill_gaps_s).map_err(|reason| bad(row.line, reason))?;
                let missing = (gap / step_s).round() as usize - 1;
                if missing > SAMPLES_MAX - samples.len() {
                    return Err(bad(row.line, format!("more than {SAMPLES_MAX} samples")));
                }
                samples.extend((1..=missing).map(|k| RecordSample {
                    time_s: last.time_s + k as f64 * step_s,
                    frequency_hz: last.frequency_hz,
                }));
                filled_s += gap - step_s;
            }
        }
        samples.push(RecordSample {
            time_s: row.time_s,
            frequency_hz: row.frequency_hz,
        });
        last = Some(row);
    }
    Ok(Spaced {
        step_s,
        samples,
        filled_s,
    })
}

/// A time as it is shown, to the millisecond.
fn shown(time_s: f64) -> f64 {
    (time_s * STAMPS_PER_S).round() / STAMPS_PER_S
}

fn may_fill(gap: f64, step_s: f64, fill_gaps_s: Option<f64>) -> Result<(), String> {
    let gap = shown(gap);
    match fill_gaps_s {
        None => Err(format!(
            "gap of {gap} s before this row (samples are {step_s} s apart); --fill-gaps SECONDS \
             holds the last sample over gaps up to that long"
        )),
        Some(longest) if gap > longest => Err(format!(
            "gap of {gap} s before this row; --fill-gaps allows {longest} s"
        )),
        Some(_) => Ok(()),
    }
}

/// The median of the steps, to the millisecond: one gap or one jittery stamp does not move it.
fn median_step(rows: &[Row]) -> f64 {
    let mut steps: Vec<f64> = rows
        .windows(2)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .collect();
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    shown(*median)
}
