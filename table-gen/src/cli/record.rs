//! A recorded frequency and the table that runs on it: what `replay` and `counterfactual` share,
//! and the options by which every command reads a record.

use std::path::{Path, PathBuf};

use lab::record::columns::Choice;
use lab::record::{self, ReadOptions, Record};
use model::spec::Spec;
use synth::pipeline;

use super::{Failure, Overrides, progress};

/// How a record is read.
#[derive(Debug, clap::Args)]
pub(super) struct RecordOptions {
    /// Columns of the record, each a header name or a number from 1; the unit is Hz, mHz (deviation
    /// from nominal) or dHz (deviation in Hz)
    #[arg(long, value_name = "TIME,VALUE[:UNIT]", help_heading = "Record")]
    columns: Option<Choice>,
    /// Frequency of the record's system at rest [Hz]
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 50.0,
        help_heading = "Record"
    )]
    nominal_hz: f64,
    /// Hold the last sample over gaps up to this long [s]
    #[arg(long, value_name = "SECONDS", help_heading = "Record")]
    fill_gaps: Option<f64>,
    /// Leave out up to so many bad rows, and say how many
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Record")]
    skip_bad: usize,
}

impl RecordOptions {
    /// Reads a record, and says on stderr what was left out or filled.
    pub(super) fn read(&self, path: &Path) -> Result<Record, Failure> {
        let record = record::read(path, &self.checked()?).map_err(Failure::bad)?;
        let shown = path.display();
        if let Some(first) = record.skipped.first() {
            let (count, line, reason) = (record.skipped.len(), first.line, &first.reason);
            eprintln!("{shown}: {count} bad rows left out, the first at line {line}: {reason}");
        }
        if record.filled_s > 0.0 {
            eprintln!("{shown}: {:.1} s without samples filled", record.filled_s);
        }
        Ok(record)
    }

    fn checked(&self) -> Result<ReadOptions, Failure> {
        let refuse = |option: &str, value: f64, allowed: &str| {
            Err(Failure::BadInput(format!(
                "{option} = {value} is out of range: {allowed}"
            )))
        };
        if let Some(longest) = self.fill_gaps
            && !(longest.is_finite() && longest > 0.0)
        {
            return refuse("--fill-gaps", longest, "finite, above 0 s");
        }
        if !(self.nominal_hz == 50.0 || self.nominal_hz == 60.0) {
            return refuse("--nominal-hz", self.nominal_hz, "50 or 60");
        }
        Ok(ReadOptions {
            columns: self.columns.clone(),
            nominal_hz: self.nominal_hz,
            fill_gaps_s: self.fill_gaps,
            bad_rows_max: self.skip_bad,
        })
    }
}

/// Arguments of every command on a recorded frequency.
#[derive(Debug, clap::Args)]
pub(super) struct RecordArgs {
    /// Recorded frequency: text with a time and a frequency on each line (docs/records.md)
    #[arg(value_name = "TRACE.csv")]
    record: PathBuf,
    /// Name of a shipped spec, or path of a TOML file
    #[arg(value_name = "SPEC")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    #[command(flatten)]
    options: RecordOptions,
}

impl RecordArgs {
    /// The spec.
    pub(super) fn spec(&self) -> Result<Spec, Failure> {
        self.overrides.load(&self.spec)
    }

    /// The record, and the bytes of the spec's table.
    pub(super) fn load(&self, spec: &Spec) -> Result<(Record, Vec<u8>), Failure> {
        let record = self.options.read(&self.record)?;
        progress::catch_interrupts();
        let bytes = pipeline::table_bytes(spec, self.table.as_deref(), &progress::watch)?;
        Ok((record, bytes))
    }
}
