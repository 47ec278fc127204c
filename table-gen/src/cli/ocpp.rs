//! `ocpp`: a spec's fallback as messages of OCPP 2.1, and back.

use std::path::{Path, PathBuf};

use ::ocpp::container;
use ::ocpp::export::Messages;
use ::ocpp::fallback::Fallback;
use ::ocpp::import;
use clap::Subcommand;
use firmware::event::EventEnd;
use serde::Serialize;
use serde_json::Value;

use super::files::{write_all, write_one};
use super::{Failure, OutputArgs, Overrides, SpecArgs, output};

/// Arguments of `ocpp`.
#[derive(Debug, clap::Args)]
pub(super) struct OcppArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// The droop and the event's end of a spec as SetChargingProfile and SetDERControl
    Export(ExportArgs),
    /// The droop and the event's end of messages into a spec
    Import(ImportArgs),
    /// The table of a DataTransfer that `ocpp export --table` wrote
    Open(OpenArgs),
}

#[derive(Debug, clap::Args)]
struct ExportArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Write each call as a JSON file into this folder, instead of all of them to stdout
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Carry this table in a DataTransfer too; needs --key
    #[arg(long, value_name = "FILE", requires = "key")]
    table: Option<PathBuf>,
    /// Private Ed25519 key that signs the table: 32 bytes in Base64
    #[arg(long, value_name = "FILE", requires = "table")]
    key: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
struct ImportArgs {
    /// A call as OCPP-J sends it, its payload, a charging profile, or a list of them
    #[arg(value_name = "PROFILE.json")]
    profile: PathBuf,
    /// Spec that the rest is taken from: a shipped name or a path
    #[arg(long, value_name = "SPEC", default_value = "gb-bi")]
    spec: String,
    #[command(flatten)]
    overrides: Overrides,
    /// Write the whole spec to this file
    #[arg(long, value_name = "SPEC.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, clap::Args)]
struct OpenArgs {
    /// The call or its payload
    #[arg(value_name = "DATATRANSFER.json")]
    message: PathBuf,
    /// Public Ed25519 key of who is trusted: 32 bytes in Base64
    #[arg(long, value_name = "FILE")]
    trust: PathBuf,
    /// Where the table goes
    #[arg(long, value_name = "TABLE")]
    out: PathBuf,
}

/// Runs the command.
pub(super) fn run(args: &OcppArgs) -> Result<(), Failure> {
    match &args.action {
        Action::Export(args) => export(args),
        Action::Import(args) => import_into_spec(args),
        Action::Open(args) => open(args),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| in_file(path, error))
}

fn read_text(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|error| in_file(path, error))
}

/// Bad input in a file.
fn in_file(path: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{}: {error}", path.display()))
}

fn export(args: &ExportArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    let fallback = Fallback::of(&spec, EventEnd::DEFAULT).map_err(Failure::bad)?;
    let mut calls = Messages::of(&fallback).calls().map_err(Failure::bad)?;
    if let (Some(table), Some(key)) = (&args.table, &args.key) {
        let private = container::private_key(&read_text(key)?);
        let private = private.map_err(|error| in_file(key, error))?;
        let bytes = read(table)?;
        firmware::table::TableView::parse(&bytes)
            .map_err(|error| in_file(table, format!("not a table: {error:?}")))?;
        let call = container::seal(&bytes, &private).map_err(Failure::bad)?;
        calls.push(("DataTransfer", call));
    }
    let Some(dir) = &args.out else {
        let all: Vec<Value> = calls.into_iter().map(|(_, call)| call).collect();
        return output::json(&all);
    };
    let mut files = Vec::new();
    for (name, call) in &calls {
        let text = serde_json::to_string_pretty(call).map_err(Failure::bad)?;
        files.push((format!("{name}.json"), format!("{text}\n")));
    }
    let named: Vec<(&str, &[u8])> = files
        .iter()
        .map(|(name, text)| (name.as_str(), text.as_bytes()))
        .collect();
    write_all(dir, &named)?;
    for (name, _) in &files {
        output::line(format_args!("wrote {}", dir.join(name).display()));
    }
    Ok(())
}

#[derive(Debug, Serialize)]
struct Answer<'a> {
    deadband_hz: f64,
    droop_hz: f64,
    time_s: f64,
    power_per_charger_kw: f64,
    direction: &'static str,
    event_end: EventEndAnswer,
    not_taken: &'a [String],
}

#[derive(Debug, Serialize)]
struct EventEndAnswer {
    recovered_hz: f64,
    recovered_s: u16,
    release_s: u16,
    /// Whether the messages say it; otherwise it is the firmware's own.
    said: bool,
}

fn import_into_spec(args: &ImportArgs) -> Result<(), Failure> {
    let mut spec = args.overrides.load(&args.spec)?;
    let imported = import::read(&read_text(&args.profile)?);
    let imported = imported.map_err(|error| in_file(&args.profile, error))?;
    let mut fallback = Fallback::of(&spec, EventEnd::DEFAULT).map_err(Failure::bad)?;
    imported.put_into(&mut fallback);
    fallback.put_into(&mut spec).map_err(Failure::bad)?;
    spec.validate("the imported spec")?;
    if let Some(path) = &args.out {
        let text = toml::to_string_pretty(&spec).map_err(Failure::bad)?;
        write_one(path, text.as_bytes())?;
    }
    let end = fallback.event_end;
    let answer = Answer {
        deadband_hz: spec.baseline.deadband_hz,
        droop_hz: spec.baseline.droop_hz,
        time_s: spec.baseline.time_s,
        power_per_charger_kw: spec.fleet.power_per_charger_kw,
        direction: spec.fleet.direction.name(),
        event_end: EventEndAnswer {
            recovered_hz: (50e6 + f64::from(end.recovered_uhz)) / 1e6,
            recovered_s: end.recovered_s,
            release_s: end.release_s,
            said: imported.event_end.is_some(),
        },
        not_taken: &imported.not_taken,
    };
    for line in &imported.not_taken {
        eprintln!("not taken: {line}");
    }
    if args.output.json {
        return output::json(&answer);
    }
    show(&answer);
    Ok(())
}

/// The keys as a spec writes them, and the charger's setting.
fn show(answer: &Answer<'_>) {
    output::line("[fleet]");
    output::line(format_args!(
        "power_per_charger_kw = {:?}",
        answer.power_per_charger_kw
    ));
    output::line(format_args!("direction = {:?}", answer.direction));
    output::line("\n[baseline]");
    output::line(format_args!("deadband_hz = {:?}", answer.deadband_hz));
    output::line(format_args!("droop_hz = {:?}", answer.droop_hz));
    output::line(format_args!("time_s = {:?}", answer.time_s));
    let end = &answer.event_end;
    let whence = if end.said { "" } else { ", by the firmware" };
    output::line(format_args!(
        "\n# The event's end, a setting of the charger (EventEnd){whence}:\n# recovered from {:?} Hz up \
         for {} s, released over {} s",
        end.recovered_hz, end.recovered_s, end.release_s
    ));
}

fn open(args: &OpenArgs) -> Result<(), Failure> {
    let trusted = container::public_key(&read_text(&args.trust)?);
    let trusted = trusted.map_err(|error| in_file(&args.trust, error))?;
    let table = container::open(&read_text(&args.message)?, &trusted);
    let table = table.map_err(|error| match error {
        container::ContainerError::Signature => Failure::No(error.to_string()),
        other => in_file(&args.message, other),
    })?;
    write_one(&args.out, &table)?;
    output::line(format_args!(
        "wrote {} bytes to {}",
        table.len(),
        args.out.display()
    ));
    Ok(())
}
