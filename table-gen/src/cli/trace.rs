//! A recorded frequency and the table that runs on it: what `replay` and `counterfactual` share.

use std::path::PathBuf;

use super::{Failure, Overrides, progress};
use lab::replay::trace::{self, Trace};
use model::spec::Spec;
use synth::pipeline;

/// Arguments of every command on a recorded frequency.
#[derive(Debug, clap::Args)]
pub(super) struct TraceArgs {
    /// Recorded frequency: CSV with columns dtm,f or utc_time,frequency_hz
    #[arg(value_name = "TRACE.csv")]
    trace: PathBuf,
    /// Name of a shipped spec, or path of a TOML file
    #[arg(value_name = "SPEC")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Hold the last sample over gaps up to this long [s]
    #[arg(long, value_name = "SECONDS")]
    fill_gaps: Option<f64>,
}

impl TraceArgs {
    /// The spec.
    pub(super) fn spec(&self) -> Result<Spec, Failure> {
        self.overrides.load(&self.spec)
    }

    /// The record, and the bytes of the spec's table.
    pub(super) fn load(&self, spec: &Spec) -> Result<(Trace, Vec<u8>), Failure> {
        check_gaps(self.fill_gaps)?;
        let trace = trace::read(&self.trace, self.fill_gaps).map_err(Failure::bad)?;
        progress::catch_interrupts();
        let bytes = pipeline::table_bytes(spec, self.table.as_deref(), &progress::watch)?;
        Ok((trace, bytes))
    }
}

/// The option `--fill-gaps` in its range.
fn check_gaps(fill_gaps_s: Option<f64>) -> Result<(), Failure> {
    match fill_gaps_s {
        Some(longest) if !(longest.is_finite() && longest > 0.0) => Err(Failure::BadInput(
            format!("--fill-gaps = {longest} is out of range: finite, above 0 s"),
        )),
        _ => Ok(()),
    }
}
