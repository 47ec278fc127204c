//! `build SPEC`: the whole way, and its files.

use std::path::PathBuf;

use firmware::table::{Law, TableView};
use serde::Serialize;

use super::files::write_all;
use super::synth::SynthReport;
use super::{Failure, OutputArgs, SpecArgs, output, progress, simulate};
use crate::pipeline;
use crate::report::{self, Findings};
use crate::simulation::closed_loop::{self, Estimator};
use crate::simulation::monitor::Summary;
use crate::simulation::scenario::Scenario;
use crate::simulation::trajectory::PhaseSpan;
use crate::synthesis;

/// Arguments of `build`.
#[derive(Debug, clap::Args)]
pub(super) struct BuildArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Folder for the files; made if it does not exist
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
}

#[derive(Debug, Serialize)]
struct EncodingReport {
    phase: &'static str,
    encoding: String,
    bytes: u32,
    entries: u32,
    worst_visits: u16,
}

#[derive(Debug, Serialize)]
struct BuildReport<'r> {
    #[serde(flatten)]
    synth: &'r SynthReport,
    spec_hash: String,
    table_bytes: usize,
    encodings: Vec<EncodingReport>,
    simulation: &'r Summary,
    phases: &'r [PhaseSpan],
}

/// Runs the command.
pub(super) fn run(args: &BuildArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    progress::catch_interrupts();
    let synthesis = synthesis::synthesise(&spec, &progress::watch)?;
    let synth = SynthReport::new(&spec, &synthesis);
    let bytes = pipeline::emit(&spec, &synthesis).map_err(Failure::bad)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let run = closed_loop::simulate(&spec, &table, &Scenario::of(&spec), Estimator::FullState)
        .map_err(Failure::bad)?;
    let result = BuildReport {
        synth: &synth,
        spec_hash: hex(&spec.hash()),
        table_bytes: bytes.len(),
        encodings: encodings(&table),
        simulation: &run.summary,
        phases: &run.phases,
    };
    let json = serde_json::to_string_pretty(&result).map_err(Failure::bad)?;
    let findings = Findings::default();
    let page = report::render(&spec, &bytes, &[], &findings, Vec::new()).map_err(Failure::bad)?;
    let files = [
        ("table.bin", bytes.as_slice()),
        ("report.html", page.html.as_bytes()),
        ("build.json", json.as_bytes()),
    ];
    write_all(&args.out, &files)?;
    if args.output.json {
        output::line(json);
        return Ok(());
    }
    synth.print();
    print_encodings(&result);
    simulate::summary(&run.summary);
    simulate::phases(&run.phases);
    output::line(format_args!("wrote {}", args.out.display()));
    Ok(())
}

fn encodings(table: &TableView<'_>) -> Vec<EncodingReport> {
    let laws = [(Law::C1, "C1"), (Law::C2, "C2"), (Law::Hold, "Hold")];
    laws.into_iter()
        .filter_map(|(law, phase)| {
            let view = table.law(law)?;
            let entry = table.header().laws[law as usize]?;
            Some(EncodingReport {
                phase,
                encoding: format!("{:?}", entry.inputs_kind),
                bytes: entry.domain_len + entry.inputs_len,
                entries: view.encoding().entries(),
                worst_visits: view.encoding().worst_visits(),
            })
        })
        .collect()
}

fn print_encodings(report: &BuildReport<'_>) {
    let mut table = output::table(&["law", "encoding", "bytes", "entries", "worst visits"]);
    for row in &report.encodings {
        table.add_row(vec![
            row.phase.to_owned(),
            row.encoding.clone(),
            output::grouped(row.bytes as usize),
            output::grouped(row.entries as usize),
            row.worst_visits.to_string(),
        ]);
    }
    output::line(table);
    output::line(format_args!(
        "table: {} bytes",
        output::grouped(report.table_bytes)
    ));
}

/// Lower-case hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
