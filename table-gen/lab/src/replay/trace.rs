//! A recorded frequency as CSV: NESO's raw months (`dtm,f`) or `utc_time,frequency_hz`. Lines that start with `#` are
//! comments.

use std::path::{Path, PathBuf};

use jiff::civil::DateTime;

/// Frequencies outside this are no mains frequency \[Hz\].
const PLAUSIBLE_HZ: std::ops::RangeInclusive<f64> = 40.0..=60.0;
/// Most samples of a trace: a month at ten a second.
const SAMPLES_MAX: usize = 31 * 86_400 * 10;

/// One sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceSample {
    /// Time since the first sample \[s\].
    pub time_s: f64,
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
}

/// A trace: at least two samples at one interval, times rising.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Time stamp of the first sample, as the file writes it.
    pub start: String,
    /// The samples.
    pub samples: Vec<TraceSample>,
    /// Time that was filled by holding the last sample \[s\].
    pub filled_s: f64,
}

/// Why a trace is refused; every variant but [`TraceError::Read`] names the line.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file cannot be read.
    #[error("{path}: {error}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The CSV is malformed.
    #[error("{path}: line {line}: {reason}", path = path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong and what is allowed.
        reason: String,
    },
}

/// Reads a trace. Gaps (a time step above 1.5 times the trace's shortest) up to `fill_gaps_s` are filled by holding the
/// last sample; longer ones, and any without the option, are errors.
///
/// # Errors
/// An unreadable file, an unknown header, a malformed row, an implausible frequency, a duplicate or decreasing time, a
/// gap, or fewer than two samples.
pub fn read(path: &Path, fill_gaps_s: Option<f64>) -> Result<Trace, TraceError> {
    let bytes = std::fs::read(path).map_err(|error| TraceError::Read {
        path: path.to_owned(),
        error,
    })?;
    parse(&bytes, fill_gaps_s).map_err(|(line, reason)| TraceError::Row {
        path: path.to_owned(),
        line,
        reason,
    })
}

type RowError = (u64, String);

fn parse(bytes: &[u8], fill_gaps_s: Option<f64>) -> Result<Trace, RowError> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let header_line = |reader: &csv::Reader<&[u8]>| reader.position().line().max(1);
    let header = match reader.headers() {
        Ok(header) => header.clone(),
        Err(error) => return Err((header_line(&reader), error.to_string())),
    };
    let known = [["dtm", "f"], ["utc_time", "frequency_hz"]];
    if !known
        .iter()
        .any(|names| header.iter().eq(names.iter().copied()))
    {
        let found: Vec<&str> = header.iter().collect();
        let line = header_line(&reader);
        let reason = format!(
            "columns {:?}; allowed: dtm,f or utc_time,frequency_hz",
            found.join(",")
        );
        return Err((line, reason));
    }
    let mut rows: Vec<(u64, f64, f64)> = Vec::new();
    let mut start: Option<(String, DateTime)> = None;
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            (line, error.to_string())
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |index: usize| record.get(index).unwrap_or("");
        let time = time_stamp(field(0)).ok_or_else(|| {
            let reason = format!(
                "time {:?}; allowed: 2019-08-09T15:52:33Z or 2019-08-09 15:52:33",
                field(0)
            );
            (line, reason)
        })?;
        let frequency_hz: f64 = field(1)
            .parse()
            .map_err(|_| (line, format!("frequency {:?} is not a number", field(1))))?;
        if !PLAUSIBLE_HZ.contains(&frequency_hz) {
            return Err((
                line,
                format!("frequency {frequency_hz} Hz; allowed: 40 to 60 Hz"),
            ));
        }
        let zero = start.get_or_insert_with(|| (field(0).to_owned(), time)).1;
        let time_s = time.duration_since(zero).as_secs_f64();
        if let Some((_, last, _)) = rows.last()
            && time_s <= *last
        {
            let word = if time_s == *last {
                "duplicate"
            } else {
                "decreasing"
            };
            return Err((line, format!("{word} time {:?}; times must rise", field(0))));
        }
        if rows.len() == SAMPLES_MAX {
            return Err((line, format!("more than {SAMPLES_MAX} samples")));
        }
        rows.push((line, time_s, frequency_hz));
    }
    let Some((start, _)) = start.filter(|_| rows.len() >= 2) else {
        return Err((header_line(&reader), "fewer than two samples".to_owned()));
    };
    let (samples, filled_s) = fill(&rows, fill_gaps_s)?;
    Ok(Trace {
        start,
        samples,
        filled_s,
    })
}

/// ISO 8601 with a `T` or a blank, dashes or slashes, and an optional `Z`. Local stamps are taken as they are: only
/// differences count.
fn time_stamp(text: &str) -> Option<DateTime> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    text.replacen('/', "-", 2).parse().ok()
}

/// Holds the last sample over gaps.
fn fill(
    rows: &[(u64, f64, f64)],
    fill_gaps_s: Option<f64>,
) -> Result<(Vec<TraceSample>, f64), RowError> {
    let steps = rows.windows(2).map(|pair| pair[1].1 - pair[0].1);
    let step = steps.fold(f64::INFINITY, f64::min);
    let mut samples = Vec::with_capacity(rows.len());
    let mut filled_s = 0.0;
    for (index, (line, time_s, frequency_hz)) in rows.iter().enumerate() {
        if index > 0 {
            let (_, last_s, last_hz) = rows[index - 1];
            let gap = time_s - last_s;
            if gap > 1.5 * step {
                match fill_gaps_s {
                    None => {
                        let reason = format!(
                            "gap of {gap} s before this row (samples are {step} s apart); --fill-gaps SECONDS holds the last sample over gaps up to that long"
                        );
                        return Err((*line, reason));
                    }
                    Some(longest) if gap > longest => {
                        let reason = format!(
                            "gap of {gap} s before this row; --fill-gaps allows {longest} s"
                        );
                        return Err((*line, reason));
                    }
                    Some(_) => {}
                }
                // The last sample is held; the samples in between keep the trace evenly spaced.
                let missing = (gap / step).round() as usize - 1;
                samples.extend((1..=missing).map(|k| TraceSample {
                    time_s: last_s + k as f64 * step,
                    frequency_hz: last_hz,
                }));
                filled_s += gap - step;
            }
        }
        samples.push(TraceSample {
            time_s: *time_s,
            frequency_hz: *frequency_hz,
        });
    }
    Ok((samples, filled_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(body: &str, fill: Option<f64>) -> Result<Trace, RowError> {
        parse(body.as_bytes(), fill)
    }

    #[test]
    fn both_formats_are_read() {
        let iso = text(
            "# c\nutc_time,frequency_hz\n2019-08-09T15:51:00Z,50.013\n2019-08-09T15:51:01Z,50.0\n",
            None,
        )
        .unwrap();
        assert_eq!(iso.samples[1].time_s, 1.0);
        let raw = text(
            "dtm,f\n2019-08-09 23:59:59,49.99\n2019-08-10 00:00:00,49.98\n",
            None,
        )
        .unwrap();
        assert_eq!(
            raw.samples[1],
            TraceSample {
                time_s: 1.0,
                frequency_hz: 49.98
            }
        );
        assert_eq!(raw.start, "2019-08-09 23:59:59");
    }

    #[test]
    fn bad_rows_are_named_by_line() {
        let head = "utc_time,frequency_hz\n2019-08-09T15:51:00Z,50.0\n";
        for (row, line, word) in [
            ("2019-08-09T15:51:00Z,50.0\n", 3, "duplicate"),
            ("2019-08-09T15:50:59Z,50.0\n", 3, "decreasing"),
            ("2019-08-09T15:51:01Z,fifty\n", 3, "not a number"),
            ("2019-08-09T15:51:01Z,NaN\n", 3, "allowed: 40 to 60"),
            ("2019-08-09T15:51:01Z,5\n", 3, "allowed: 40 to 60"),
            ("2019-13-09T15:51:01Z,50\n", 3, "time"),
            ("2019-08-09T15:51:01Z\n", 3, "field"),
            ("2019-08-09T15:51:01Z,50,1\n", 3, "field"),
            ("", 2, "fewer than two"),
        ] {
            let (found, reason) = text(&format!("{head}{row}"), None).unwrap_err();
            assert!(reason.contains(word), "{row:?}: {reason}");
            assert!(
                found == line || word == "fewer than two",
                "{row:?}: line {found}"
            );
        }
        assert!(
            text("a,b\n1,2\n", None)
                .unwrap_err()
                .1
                .contains("allowed: dtm,f")
        );
        assert!(text("", None).is_err());
    }

    #[test]
    fn gaps_are_errors_or_filled() {
        let body =
            "dtm,f\n2019-08-09 00:00:00,50\n2019-08-09 00:00:01,49.9\n2019-08-09 00:00:04,49.8\n";
        let (line, reason) = text(body, None).unwrap_err();
        assert_eq!(line, 4);
        assert!(reason.contains("gap of 3 s"), "{reason}");
        assert!(text(body, Some(2.0)).unwrap_err().1.contains("allows 2 s"));
        let filled = text(body, Some(3.0)).unwrap();
        let hz: Vec<f64> = filled.samples.iter().map(|s| s.frequency_hz).collect();
        assert_eq!(hz, [50.0, 49.9, 49.9, 49.9, 49.8]);
        assert_eq!(filled.filled_s, 2.0);
    }
}
