//! A recorded frequency as it comes: text with one sample a line.
//!
//! | module | holds |
//! |---|---|
//! | [`columns`] | which column is the time and which the frequency, and its unit |
//! | [`time_stamp`] | the ways to write a time |
//! | `fields` | a line to its fields: separators, quotes, decimal commas |
//! | `spacing` | rows to samples at one interval: gaps, and what is done about them |
//!
//! The text is UTF-8, with or without byte-order mark; lines end in LF or CRLF; lines that are
//! blank or begin with `#` are skipped, and so is Excel's `sep=;`. Whatever a record does not say
//! plainly is refused with the line that does not say it. `docs/records.md` is the reader's page.

pub mod columns;
mod fields;
mod row;
mod spacing;
pub mod time_stamp;

use std::path::{Path, PathBuf};

use crate::simulation::NOMINAL_HZ;
use columns::{Choice, Columns};
use fields::Separator;
pub use row::{BadRow, RecordSample};
use row::{Row, SAMPLES_MAX, bad};
use time_stamp::TimeStamp;

/// Most deviation of a sample from nominal \[Hz\]: what the charger's own gate lets pass as mains.
pub const RANGE_HZ: f64 = 5.0;
/// A record: at least two samples at one interval, times rising.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Time stamp of the first sample, as the file writes it.
    pub start: String,
    /// Frequency of the system at rest \[Hz\].
    pub nominal_hz: f64,
    /// Time from a sample to the next \[s\].
    pub step_s: f64,
    /// The samples.
    pub samples: Vec<RecordSample>,
    /// Time that was filled by holding the last sample \[s\].
    pub filled_s: f64,
    /// Rows that were left out.
    pub skipped: Vec<BadRow>,
}

impl Record {
    /// Deviation from nominal in time \[s, Hz\].
    pub fn deviations(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let deviation = |s: &RecordSample| (s.time_s, s.frequency_hz - self.nominal_hz);
        self.samples.iter().map(deviation)
    }

    /// Time of the last sample \[s\].
    pub fn end_s(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.time_s)
    }
}

/// How a record is read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Which columns; `None` goes by the header's names.
    pub columns: Option<Choice>,
    /// Frequency of the system at rest \[Hz\].
    pub nominal_hz: f64,
    /// Gaps up to this long are filled by holding the last sample \[s\]; `None` refuses any.
    pub fill_gaps_s: Option<f64>,
    /// Most bad rows that are left out.
    pub bad_rows_max: usize,
}

impl Default for ReadOptions {
    /// By the header's names, 50 Hz, no gap and no bad row.
    fn default() -> Self {
        Self {
            columns: None,
            nominal_hz: NOMINAL_HZ,
            fill_gaps_s: None,
            bad_rows_max: 0,
        }
    }
}

/// Why a record is refused.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be read.
    #[error("{path}: {error}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A line is not understood.
    #[error("{path}: line {line}: {reason}", path = path.display(), line = row.line, reason = row.reason)]
    Row {
        /// The file.
        path: PathBuf,
        /// Where and why.
        row: BadRow,
    },
}

/// Reads a record from a file.
///
/// # Errors
/// An unreadable file, or the first line that is not understood.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Record, RecordError> {
    let bytes = std::fs::read(path).map_err(|error| RecordError::Read {
        path: path.to_owned(),
        error,
    })?;
    parse(&bytes, options).map_err(|row| RecordError::Row {
        path: path.to_owned(),
        row,
    })
}

/// Reads a record from its bytes.
///
/// # Errors
/// The first line that is not understood.
pub fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Record, BadRow> {
    let text = decode(bytes)?;
    let mut lines = text
        .lines()
        .zip(1u64..)
        .filter(|(line, _)| !line.trim().is_empty() && !line.starts_with('#'))
        .peekable();
    let mut declared = None;
    if let Some((line, _)) = lines.peek() {
        declared = fields::declared_separator(line);
        if declared.is_some() {
            lines.next();
        }
    }
    let Some(&(header, header_line)) = lines.peek() else {
        return Err(bad(1, "no header and no samples"));
    };
    let separator = declared.unwrap_or_else(|| Separator::of(header));
    let header = fields::split(header, separator).map_err(|reason| bad(header_line, reason))?;
    let columns = Columns::of(&header, options.columns.as_ref())
        .map_err(|reason| bad(header_line, reason))?;
    if columns.has_header {
        lines.next();
    }
    let mut rows = Rows::new(&columns, options, header.len());
    let mut last_line = header_line;
    for (text, line) in lines {
        last_line = line;
        rows.take(text, line, separator)
            .map_err(|row| rows.earlier(row))?;
    }
    if rows.rows.len() < 2 {
        return Err(bad(last_line, "fewer than two samples"));
    }
    let spaced = spacing::space(&rows.rows, options.fill_gaps_s)?;
    Ok(Record {
        start: rows.start.map_or_else(String::new, |(text, _)| text),
        nominal_hz: options.nominal_hz,
        step_s: spaced.step_s,
        samples: spaced.samples,
        filled_s: spaced.filled_s,
        skipped: rows.skipped,
    })
}

/// UTF-8 without its byte-order mark.
fn decode(bytes: &[u8]) -> Result<&str, BadRow> {
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Err(bad(1, "the text is UTF-16; allowed: UTF-8"));
    }
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count() as u64;
        bad(line, "a byte that is not UTF-8; allowed: UTF-8")
    })
}

/// The rows as they are read.
struct Rows<'a> {
    columns: &'a Columns,
    options: &'a ReadOptions,
    fields: usize,
    start: Option<(String, TimeStamp)>,
    rows: Vec<Row>,
    skipped: Vec<BadRow>,
}

impl<'a> Rows<'a> {
    fn new(columns: &'a Columns, options: &'a ReadOptions, fields: usize) -> Self {
        Self {
            columns,
            options,
            fields,
            start: None,
            rows: Vec::new(),
            skipped: Vec::new(),
        }
    }

    /// Takes a line: a row, or one of the bad rows that are allowed.
    fn take(&mut self, text: &str, line: u64, separator: Separator) -> Result<(), BadRow> {
        if self.rows.len() == SAMPLES_MAX {
            return Err(bad(line, format!("more than {SAMPLES_MAX} samples")));
        }
        match self.row(text, line, separator) {
            Ok(row) => self.rows.push(row),
            Err(reason) if self.skipped.len() < self.options.bad_rows_max => {
                self.skipped.push(bad(line, reason));
            }
            Err(reason) if self.options.bad_rows_max > 0 => {
                let most = self.options.bad_rows_max;
                let reason = format!("{reason}; --skip-bad {most} left out as many before");
                return Err(bad(line, reason));
            }
            Err(reason) => return Err(bad(line, reason)),
        }
        Ok(())
    }

    /// The first thing that is wrong: a row that leapt ahead in time shows as a gap before it, and
    /// only then as rows that do not rise.
    fn earlier(&self, row: BadRow) -> BadRow {
        if self.rows.len() < 3 {
            return row;
        }
        let spaced = spacing::space(&self.rows, self.options.fill_gaps_s);
        spaced.err().unwrap_or(row)
    }

    fn row(&mut self, text: &str, line: u64, separator: Separator) -> Result<Row, String> {
        let fields = fields::split(text, separator)?;
        if fields.len() != self.fields {
            let (found, wanted) = (fields.len(), self.fields);
            return Err(format!("{found} fields; the first line has {wanted}"));
        }
        let text = self.columns.time_text(&fields);
        let stamp = self.columns.clock.read(&text)?;
        let value = fields::number(&fields[self.columns.value])?;
        let frequency_hz = self
            .columns
            .unit
            .frequency_hz(value, self.options.nominal_hz);
        self.plausible(value, frequency_hz)?;
        let time_s = match &self.start {
            None => 0.0,
            Some((_, zero)) => stamp.seconds_since(zero)?,
        };
        if let Some(last) = self.rows.last() {
            let before = last.line;
            if time_s == last.time_s {
                return Err(format!(
                    "time {text:?} again, as in line {before}; times must rise"
                ));
            }
            if time_s < last.time_s {
                return Err(format!(
                    "time {text:?} is before line {before}'s; times must rise"
                ));
            }
        }
        if self.start.is_none() {
            self.start = Some((text.into_owned(), stamp));
        }
        Ok(Row {
            line,
            time_s,
            frequency_hz,
        })
    }

    fn plausible(&self, value: f64, frequency_hz: f64) -> Result<(), String> {
        let nominal_hz = self.options.nominal_hz;
        // Written so that no number at all is refused too.
        if (frequency_hz - nominal_hz).abs() <= RANGE_HZ {
            return Ok(());
        }
        let unit = self.columns.unit;
        let (low, high) = unit.range(nominal_hz, RANGE_HZ);
        let other = if nominal_hz == NOMINAL_HZ && (value - 60.0).abs() <= RANGE_HZ {
            "; --nominal-hz 60 reads a system of 60 Hz"
        } else {
            ""
        };
        Err(format!("{value} {unit}; allowed: {low} to {high}{other}"))
    }
}
