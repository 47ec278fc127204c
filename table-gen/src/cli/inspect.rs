//! `inspect TABLE`: header, levels, jumps, and slices as pictures.

use std::path::PathBuf;

use firmware::grid::Cell;
use firmware::response::ResponseLaw;
use firmware::table::{Law, TableView};
use serde::Serialize;

use super::{Failure, OutputArgs, output};
use synth::inspect::{self, LawSurvey, slice};

/// Arguments of `inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct InspectArgs {
    /// The table
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// Also draw a slice of this law
    #[arg(long, value_name = "LAW", value_parser = ["C1", "C2", "Hold"])]
    slice: Option<String>,
    /// Axis to the right
    #[arg(long, default_value = "f", value_parser = ["f", "g", "l", "p"])]
    x: String,
    /// Axis upwards
    #[arg(long, default_value = "p", value_parser = ["f", "g", "l", "p"])]
    y: String,
    /// Cell (f,g,l,p) that the slice goes through; the middle of the grid if not given
    #[arg(long, value_name = "F,G,L,P", value_delimiter = ',', num_args = 4)]
    through: Vec<u16>,
    /// Write the slice as SVG to this file
    #[arg(long, value_name = "FILE", requires = "slice")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct InspectReport {
    table_bytes: usize,
    spec_hash: String,
    cells: [u16; 4],
    levels: u8,
    period_ms: u32,
    tick_ms: u16,
    stay: bool,
    laws: Vec<LawSurvey>,
    /// The law that is always on, in a table that is a response.
    #[serde(skip_serializing_if = "Option::is_none")]
    response: Option<ResponseReport>,
}

/// The parameters of a response, in the table's whole numbers.
#[derive(Debug, Serialize)]
struct ResponseReport {
    droop_gain_ppm_per_hz: u32,
    setpoint_uhz: i32,
    slope_gain_ppm_s_per_hz: u32,
    slope_threshold_uhz_per_s: u32,
    window_ticks: u16,
    slope_most_ppm: u32,
    release_ppm: u32,
    smallest_change_ppm: u32,
}

impl From<&ResponseLaw> for ResponseReport {
    fn from(law: &ResponseLaw) -> Self {
        Self {
            droop_gain_ppm_per_hz: law.droop_gain_ppm_per_hz,
            setpoint_uhz: law.setpoint_uhz,
            slope_gain_ppm_s_per_hz: law.slope_gain_ppm_s_per_hz,
            slope_threshold_uhz_per_s: law.slope_threshold_uhz_per_s,
            window_ticks: law.window_ticks,
            slope_most_ppm: law.slope_most_ppm,
            release_ppm: law.release_ppm,
            smallest_change_ppm: law.smallest_change_ppm,
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &InspectArgs) -> Result<(), Failure> {
    let bytes = std::fs::read(&args.table)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", args.table.display())))?;
    let table = TableView::parse(&bytes)
        .map_err(|error| Failure::BadInput(format!("{}: {error:?}", args.table.display())))?;
    let header = table.header();
    let report = InspectReport {
        table_bytes: bytes.len(),
        spec_hash: header
            .spec_hash
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect(),
        cells: header.grid.count(),
        levels: header.levels,
        period_ms: u32::from(header.tick_ms) * u32::from(header.period_ticks),
        tick_ms: header.tick_ms,
        stay: header.stay,
        laws: Law::ALL
            .into_iter()
            .filter_map(|law| inspect::survey(&table, law))
            .collect(),
        response: table.response().as_ref().map(ResponseReport::from),
    };
    if args.output.json {
        output::json(&report)?;
    } else {
        print(&report);
    }
    let Some(name) = &args.slice else {
        return Ok(());
    };
    let law = Law::ALL.into_iter().find(|law| law.name() == name);
    let axis = |name: &str| "fglp".find(name).unwrap_or(0);
    let middle = header.grid.count().map(|n| n / 2);
    let through = args.through.first_chunk::<4>().copied().unwrap_or(middle);
    let slice = law
        .and_then(|law| slice::cut(&table, law, axis(&args.x), axis(&args.y), Cell(through)))
        .ok_or_else(|| Failure::BadInput("--x and --y must be different axes".to_owned()))?;
    if let Some(path) = &args.svg {
        std::fs::write(path, slice.svg())
            .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))?;
    } else if !args.output.json {
        output::line(slice.ascii());
    }
    Ok(())
}

fn print(report: &InspectReport) {
    output::line(format_args!(
        "{} bytes, spec {}, {:?} cells, {} levels, period {} ms, tick {} ms{}",
        output::grouped(report.table_bytes),
        report.spec_hash,
        report.cells,
        report.levels,
        report.period_ms,
        report.tick_ms,
        if report.stay { ", stays in I2" } else { "" }
    ));
    if let Some(law) = &report.response {
        let mut table = output::table(&["response", "value", "unit"]);
        for (name, value, unit) in [
            ("droop gain", i64::from(law.droop_gain_ppm_per_hz), "ppm/Hz"),
            ("set-point", i64::from(law.setpoint_uhz), "µHz"),
            (
                "slope gain",
                i64::from(law.slope_gain_ppm_s_per_hz),
                "ppm s/Hz",
            ),
            (
                "slope threshold",
                i64::from(law.slope_threshold_uhz_per_s),
                "µHz/s",
            ),
            ("window", i64::from(law.window_ticks), "ticks"),
            ("slope response, most", i64::from(law.slope_most_ppm), "ppm"),
            ("release", i64::from(law.release_ppm), "ppm/tick"),
            ("smallest change", i64::from(law.smallest_change_ppm), "ppm"),
        ] {
            table.add_row(vec![name.to_owned(), value.to_string(), unit.to_owned()]);
        }
        output::line(table);
        return;
    }
    let mut table = output::table(&[
        "law",
        "cells",
        "largest jump",
        "mean jump",
        "most visits",
        "mean visits",
    ]);
    for law in &report.laws {
        table.add_row(vec![
            law.law.to_owned(),
            output::grouped(law.cells as usize),
            law.jump_max.to_string(),
            format!("{:.3}", law.jump_mean),
            law.visits_max.to_string(),
            format!("{:.1}", law.visits_mean),
        ]);
    }
    output::line(table);
    for law in &report.laws {
        output::line(format_args!(
            "{} cells by level: {:?}",
            law.law, law.histogram
        ));
    }
}
