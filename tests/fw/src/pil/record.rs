//! The recorded frequency of 9 August 2019.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The record, from the workspace's root: comments, a line of names, then `time,frequency` each
/// second.
pub const PATH: &str = "tests/data/gb-frequency-2019-08-09.csv";
/// Nominal frequency \[Hz\].
const NOMINAL_HZ: f64 = 50.0;

/// Why there is no record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file.
    #[error("{path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A line.
    #[error("{path}: not `time,frequency`: {line}", path = path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// What it says.
        line: String,
    },
}

/// The deviation of each second \[Hz\].
///
/// # Errors
/// The file cannot be read, or holds something else.
pub fn deviations_hz(path: &Path) -> Result<Vec<f64>, RecordError> {
    let text = fs::read_to_string(path).map_err(|source| RecordError::Read {
        path: path.to_owned(),
        source,
    })?;
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|line| {
        let frequency_hz = line.split_once(',').and_then(|(_, hz)| hz.parse().ok());
        let frequency_hz: f64 = frequency_hz.ok_or_else(|| RecordError::Line {
            path: path.to_owned(),
            line: line.to_owned(),
        })?;
        Ok(frequency_hz - NOMINAL_HZ)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_record_falls_from_rest_to_below_49_1_hz() {
        let deviations_hz = deviations_hz(&crate::root().join(PATH)).unwrap();
        // 15:51:01 to 15:53:33, a sample a second.
        assert_eq!(deviations_hz.len(), 153);
        assert!((deviations_hz[0] - 0.011).abs() < 1e-9);
        let lowest_hz = deviations_hz.iter().copied().fold(0.0, f64::min);
        assert!((lowest_hz + 0.917).abs() < 1e-9);
    }
}
