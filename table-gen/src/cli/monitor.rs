//! `monitor`: a charger's telemetry, live or from a recording.

use std::fs::File;
use std::path::PathBuf;

use super::{Failure, OutputArgs, output, progress};
use lab::telemetry_lines;

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub(super) struct MonitorArgs {
    /// Serial port (set its speed first: stty -F PORT 115200 raw -echo) or recorded file; - for
    /// standard input
    #[arg(value_name = "PORT|FILE")]
    source: PathBuf,
    /// Print every N-th tick; ticks that change mode, phase or faults are always printed
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn run(args: &MonitorArgs) -> Result<(), Failure> {
    let shown = args.source.display();
    let bad = |error: std::io::Error| Failure::BadInput(format!("{shown}: {error}"));
    let (mut file, mut input);
    let stream: &mut dyn std::io::Read = if args.source.as_os_str() == "-" {
        input = std::io::stdin();
        &mut input
    } else {
        file = File::open(&args.source).map_err(bad)?;
        &mut file
    };
    let mut stdout = std::io::stdout();
    let out: Option<&mut dyn std::io::Write> = if args.output.json {
        None
    } else {
        Some(&mut stdout)
    };
    progress::catch_interrupts();
    let summary = match telemetry_lines::watch(stream, out, args.every, &progress::interrupted) {
        Ok(summary) => summary,
        // Whoever read the lines has seen enough.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
        Err(error) => return Err(bad(error)),
    };
    if args.output.json {
        output::json(&summary)?;
    } else {
        eprintln!(
            "{} frames, {} lost, {} rejected, {} of another version",
            summary.frames, summary.lost, summary.rejected, summary.other_version
        );
    }
    if summary.frames == 0 {
        let reason = format!("{shown}: no telemetry frame was found");
        return Err(Failure::No(reason));
    }
    Ok(())
}
