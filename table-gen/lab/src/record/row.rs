//! The rows of a record, good and bad.

/// Most samples of a record: a month at ten a second.
pub(super) const SAMPLES_MAX: usize = 31 * 86_400 * 10;

/// One sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordSample {
    /// Time since the first sample \[s\].
    pub time_s: f64,
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
}

/// A row that was left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadRow {
    /// Line, from 1.
    pub line: u64,
    /// What is wrong, and what is allowed.
    pub reason: String,
}

/// A row that was understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) line: u64,
    /// Since the first row \[s\].
    pub(super) time_s: f64,
    pub(super) frequency_hz: f64,
}

/// A bad row.
pub(super) fn bad(line: u64, reason: impl Into<String>) -> BadRow {
    let reason = reason.into();
    BadRow { line, reason }
}
