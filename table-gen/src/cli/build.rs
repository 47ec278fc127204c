//! `build SPEC`: the whole way, and its files.

use std::path::PathBuf;

use clap::ValueEnum;
use firmware::phase::Phase;
use firmware::table::{
    DENSE_HEADER_LEN, Header, InputsKind, Law, RESPONSE_LEN, TableView, bits_per_entry,
};
use serde::Serialize;

use super::checkpoint::CheckpointArgs;
use super::files::write_all;
use super::report::fleet_of;
use super::synth_report::SynthReport;
use super::{Failure, OutputArgs, SpecArgs, compare, output, progress, run_tables, verify};
use lab::compare::CompareConfig;
use lab::compare::quiet;
use lab::compare::verdict::Verdict;
use lab::report::{self, FLEET_CHARGERS, Findings};
use lab::simulation::closed_loop::{self, Estimator};
use lab::simulation::monitor::Summary;
use lab::simulation::scenario::Scenario;
use lab::simulation::trajectory::PhaseSpan;
use model::hex::hex;
use model::verdict::{Claim, ClaimName};
use synth::budget;
use synth::compress::{CompressedLaw, Options, VISITS_GOAL};
use synth::pipeline::{self, Emitted, Encoding};

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
    /// How the laws are stored; dense is large, and there to compare with
    #[arg(long, value_enum, default_value = "tree")]
    encoding: EncodingArg,
    /// Let the tree choose among the fastest inputs only: larger, fewest worst-case steps
    #[arg(long)]
    keep_minimal_time: bool,
    /// Keep every winning cell, whatever the domain's bytes
    #[arg(long)]
    exact_domain: bool,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EncodingArg {
    /// Trees and affine laws
    Tree,
    /// Bit-packed arrays
    Dense,
}

impl BuildArgs {
    fn encoding(&self) -> Encoding {
        match self.encoding {
            EncodingArg::Dense => Encoding::Dense,
            EncodingArg::Tree => Encoding::Tree(Options {
                keep_minimal_time: self.keep_minimal_time,
                exact_domain: self.exact_domain,
            }),
        }
    }
}

#[derive(Debug, Serialize)]
struct EncodingReport {
    phase: &'static str,
    encoding: &'static str,
    bytes: u32,
    domain_bytes: u32,
    inputs_bytes: u32,
    entries: u32,
    worst_visits: u16,
    /// What a dense array over the whole grid would take.
    dense_bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    domain_cells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worst_steps: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worst_steps_minimal: Option<u16>,
}

#[derive(Debug, Serialize)]
struct BuildReport<'r> {
    #[serde(flatten)]
    synth: &'r SynthReport,
    spec_hash: String,
    table_bytes: usize,
    encodings: Vec<EncodingReport>,
    /// Whether every claim of the spec is proven from the bytes.
    verified: bool,
    /// Proven time from leaving I1 to I2 [s].
    reach_within_s: Option<f64>,
    simulation: &'r Summary,
    phases: &'r [PhaseSpan],
    /// Where the table loses to the droop, at the spec's inertia.
    compare: &'r Verdict,
    /// What the runs of the comparison were watched for; nothing of it is proven.
    monitored: &'r [Claim],
}

/// Runs the command.
pub(super) fn run(args: &BuildArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    progress::catch_interrupts();
    let (synth, emitted) = if spec.preference.always_on {
        let emitted = Emitted {
            bytes: pipeline::response(&spec)?,
            laws: Vec::new(),
        };
        (SynthReport::of_response(&spec), emitted)
    } else {
        let synthesis = args.checkpoint.synthesise(&spec)?;
        let emitted = pipeline::emit(&synthesis, args.encoding(), &progress::watch)?;
        (SynthReport::new(&spec, &synthesis), emitted)
    };
    let bytes = emitted.bytes;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let run = closed_loop::simulate(&spec, &table, &Scenario::of(&spec), Estimator::FullState)
        .map_err(Failure::bad)?;
    let config = CompareConfig::of(&spec);
    let found = compare::scorecard_of(&spec, &table, &config)?;
    let against_droop = Verdict::of(&found, &config.chargers);
    let monitored = quiet::claim(&spec, &config, &found);
    let verdict = verify::examine(&bytes, &spec)?;
    let result = BuildReport {
        synth: &synth,
        spec_hash: hex(&spec.hash()),
        table_bytes: bytes.len(),
        encodings: encodings(&table, &emitted.laws),
        verified: verdict.verified,
        reach_within_s: verdict
            .claim(ClaimName::Settle)
            .and_then(|claim| claim.bound),
        simulation: &run.summary,
        phases: &run.phases,
        compare: &against_droop,
        monitored: std::slice::from_ref(&monitored),
    };
    let json = serde_json::to_string_pretty(&result).map_err(Failure::bad)?;
    let verdict_json = serde_json::to_string_pretty(&verdict).map_err(Failure::bad)?;
    let budget = budget::budget(&table);
    let budget_json = serde_json::to_string_pretty(&budget).map_err(Failure::bad)?;
    let findings = Findings {
        verdict: Some(verdict.clone()),
        budget: Some(budget),
        scorecard: Some((config, found)),
        fleet: Some(fleet_of(&spec, &table, FLEET_CHARGERS)?),
    };
    let page = report::render(&spec, &bytes, &[], &findings, Vec::new()).map_err(Failure::bad)?;
    // A table that is not proven must not be flashed by mistake for one that is.
    let table_name = if verdict.verified {
        "table.bin"
    } else {
        "table.unverified.bin"
    };
    let files = [
        (table_name, bytes.as_slice()),
        ("verdict.json", verdict_json.as_bytes()),
        ("budget.json", budget_json.as_bytes()),
        ("report.html", page.html.as_bytes()),
        ("build.json", json.as_bytes()),
    ];
    write_all(&args.out, &files)?;
    if args.output.json {
        output::line(json);
    } else {
        output::line(against_droop.sentence());
        output::line(quiet::sentence(&monitored));
        synth.print();
        print_encodings(&result);
        verify::print(&verdict);
        run_tables::summary(&run.summary);
        run_tables::phases(&run.phases);
        let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
        output::line(format_args!(
            "wrote {} to {}",
            names.join(", "),
            args.out.display()
        ));
    }
    verify::answer(&verdict)
}

fn encodings(table: &TableView<'_>, laws: &[CompressedLaw]) -> Vec<EncodingReport> {
    if table.response().is_some() {
        return vec![EncodingReport {
            phase: Phase::Response.name(),
            encoding: "parameters",
            bytes: RESPONSE_LEN as u32,
            domain_bytes: 0,
            inputs_bytes: RESPONSE_LEN as u32,
            entries: 0,
            worst_visits: 0,
            dense_bytes: 0,
            domain_cells: None,
            worst_steps: None,
            worst_steps_minimal: None,
        }];
    }
    Law::ALL
        .into_iter()
        .filter_map(|law| {
            let view = table.law(law)?;
            let entry = table.header().laws[law as usize]?;
            let compressed = laws.iter().find(|found| found.law == law);
            let report = compressed.map(|law| &law.report);
            Some(EncodingReport {
                phase: law.name(),
                encoding: if entry.inputs_kind == InputsKind::Dense as u8 {
                    "dense"
                } else {
                    "tree"
                },
                bytes: entry.domain_len + entry.inputs_len,
                domain_bytes: entry.domain_len,
                inputs_bytes: entry.inputs_len,
                entries: view.encoding().entries(),
                worst_visits: entry.worst_visits,
                dense_bytes: dense_bytes(&table.header()),
                domain_cells: report.map(|r| r.domain_cells),
                worst_steps: report.map(|r| r.steps),
                worst_steps_minimal: report.map(|r| r.steps_minimal),
            })
        })
        .collect()
}

/// Bytes of a dense law over the whole grid.
fn dense_bytes(header: &Header) -> u64 {
    let bits = u64::from(header.grid.cells()) * u64::from(bits_per_entry(header.levels));
    DENSE_HEADER_LEN as u64 + bits.div_ceil(8)
}

fn print_encodings(report: &BuildReport<'_>) {
    let mut table = output::table(&[
        "law",
        "encoding",
        "domain bytes",
        "inputs bytes",
        "entries",
        "worst visits",
        "cells covered",
        "worst steps (fastest)",
    ]);
    for row in &report.encodings {
        let steps = match (row.worst_steps, row.worst_steps_minimal) {
            (Some(steps), Some(minimal)) => format!("{steps} ({minimal})"),
            _ => "-".to_owned(),
        };
        table.add_row(vec![
            row.phase.to_owned(),
            row.encoding.to_owned(),
            output::grouped(row.domain_bytes as usize),
            output::grouped(row.inputs_bytes as usize),
            output::grouped(row.entries as usize),
            row.worst_visits.to_string(),
            row.domain_cells
                .map_or_else(|| "-".to_owned(), output::grouped),
            steps,
        ]);
    }
    output::line(table);
    output::line(format_args!(
        "table: {} bytes",
        output::grouped(report.table_bytes)
    ));
    let dense: u64 = report.encodings.iter().map(|row| row.dense_bytes).sum();
    let visits = report.encodings.iter().map(|row| row.worst_visits).max();
    let is_tree = report.encodings.iter().any(|row| row.encoding == "tree");
    if let (Some(visits), true) = (visits, is_tree) {
        let within = if visits <= VISITS_GOAL {
            "within"
        } else {
            "past"
        };
        output::line(format_args!(
            "why trees: dense arrays over the grid would take {} bytes; a lookup visits at most {visits} nodes, {within} the {VISITS_GOAL} aimed for",
            output::grouped(dense as usize)
        ));
    }
}
