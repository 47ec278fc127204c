//! `compare SPEC`: the scorecard.

use std::path::{Path, PathBuf};
use std::time::Instant;

use firmware::table::TableView;
use serde::Serialize;

use super::band::{Band, Numbers};
use super::files::write_all;
use super::shares::Job;
use super::{Failure, OutputArgs, SpecArgs, output, progress};
use lab::compare::chargers::ChargersConfig;
use lab::compare::grids::Grids;
use lab::compare::quiet;
use lab::compare::verdict::Verdict;
use lab::compare::{self, CHARGERS, CHARGERS_MAX, CompareConfig, CompareError, Row, Scorecard};
use lab::report::{page, scorecard};
use lab::simulation::scenario::DURATION_S_MAX;
use model::spec::Spec;
use model::verdict::Claim;
use synth::pipeline;

/// Distance between losses \[GW\].
const LOSS_STEP_GW: f64 = 0.1;
/// Most losses of a scorecard.
const LOSSES_MAX: f64 = 1000.0;

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub(super) struct CompareArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Lost infeeds, every 0.1 GW [GW]; one, or a band LOW,HIGH
    #[arg(
        long,
        value_name = "GW",
        default_value = "0.3,2.8",
        allow_hyphen_values = true
    )]
    loss_gw: Band,
    /// Inertias H [GW s/Hz], one or more, all else as the spec's plant; default: the spec's plant,
    /// and the corners of its bands
    #[arg(long, value_name = "H,H,...", allow_hyphen_values = true)]
    inertia: Option<Numbers>,
    /// Chargers of the fleet that droop and table run on; together they have the power of the
    /// spec's fleet
    #[arg(long, value_name = "N", default_value_t = CHARGERS)]
    chargers: usize,
    /// Deviation at which the limit, everything at once, responds [Hz]
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = compare::TRIGGER_HZ,
        allow_negative_numbers = true
    )]
    trigger_hz: f64,
    /// Length of a run [s]
    #[arg(
        long,
        value_name = "S",
        default_value_t = compare::DURATION_S,
        allow_negative_numbers = true
    )]
    duration_s: f64,
    /// Seed of the meters' errors
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write every run as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the figures as .svg and .csv, and a page with all of it, into this folder
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct CompareReport<'r> {
    spec: &'r str,
    chargers: usize,
    meter_hz: f64,
    delay_s: [f64; 2],
    trigger_hz: f64,
    duration_s: f64,
    #[serde(flatten)]
    verdict: &'r Verdict,
    /// What the runs were watched for; nothing of it is proven.
    claims: &'r [Claim],
    rows: &'r [Row],
}

/// Runs the command.
pub(super) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    let config = config(args, &spec)?;
    progress::catch_interrupts();
    let job = Job::join();
    let watch = |name| job.watch(name);
    let bytes = pipeline::table_bytes(&spec, args.table.as_deref(), &watch)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let start = Instant::now();
    let by_loss = job.answers(&config.losses_gw, |own| {
        let config = CompareConfig {
            losses_gw: own.to_vec(),
            ..config.clone()
        };
        let found = scorecard_of(&spec, &table, &config)?;
        Ok(own.iter().map(|loss| found.of_loss(*loss)).collect())
    })?;
    let Some(by_loss) = by_loss else {
        return Ok(());
    };
    let found = Scorecard::joined(&by_loss, config.grids.number());
    let elapsed_s = start.elapsed().as_secs_f64();
    if let Some(path) = &args.csv {
        write_csv(path, &found)?;
    }
    if let Some(dir) = &args.figures {
        write_figures(dir, &spec, &config, &found)?;
    }
    let verdict = Verdict::of(&found, &config.chargers);
    let monitored = quiet::claim(&spec, &config, &found);
    if args.output.json {
        return output::json(&CompareReport {
            spec: &spec.name,
            chargers: config.chargers.number,
            meter_hz: config.chargers.meter_hz,
            delay_s: config.chargers.delay_s,
            trigger_hz: config.trigger_hz,
            duration_s: config.duration_s,
            verdict: &verdict,
            claims: std::slice::from_ref(&monitored),
            rows: &found.rows,
        });
    }
    output::line(verdict.sentence());
    output::line(quiet::sentence(&monitored));
    for view in found.views(&config.grids) {
        output::line(format_args!("{}; nadirs in Hz", view.caption));
        let mut table = output::table(&scorecard::HEADER);
        for row in scorecard::rows(&view) {
            table.add_row(row);
        }
        output::line(table);
    }
    output::line(format_args!(
        "{} runs of {} s in {elapsed_s:.1} s; {} chargers, meters within {} Hz, delays {} to {} s; limit at {} Hz",
        found.rows.len(),
        config.duration_s,
        config.chargers.number,
        config.chargers.meter_hz,
        config.chargers.delay_s[0],
        config.chargers.delay_s[1],
        config.trigger_hz
    ));
    Ok(())
}

/// The scorecard, unless interrupted.
pub(super) fn scorecard_of(
    spec: &Spec,
    table: &TableView<'_>,
    config: &CompareConfig,
) -> Result<Scorecard, Failure> {
    let go_on = || !progress::interrupted();
    compare::compare(spec, table, config, &go_on).map_err(|error| match error {
        CompareError::Interrupted => Failure::No(error.to_string()),
        CompareError::Observer(_) => Failure::bad(error),
    })
}

/// Every number in its range.
fn config(args: &CompareArgs, spec: &Spec) -> Result<CompareConfig, Failure> {
    let [low, high] = args.loss_gw.0;
    let steps = ((high - low) / LOSS_STEP_GW + 1e-9).floor();
    let inertias: &[f64] = args.inertia.as_ref().map_or(&[], |numbers| &numbers.0);
    let chargers = args.chargers as f64;
    let within = [
        ("--loss-gw", low, -100.0, 100.0, "-100 to 100 GW"),
        ("--loss-gw", high, -100.0, 100.0, "-100 to 100 GW"),
        ("--loss-gw, losses", steps, 0.0, LOSSES_MAX, "at most 1000"),
        (
            "--chargers",
            chargers,
            1.0,
            CHARGERS_MAX as f64,
            "1 to 100000",
        ),
        ("--trigger-hz", args.trigger_hz, -10.0, 0.0, "-10 to 0 Hz"),
        (
            "--duration-s",
            args.duration_s,
            1.0,
            DURATION_S_MAX,
            "1 to 86400 s",
        ),
    ];
    let inertias_within = inertias
        .iter()
        .map(|h| ("--inertia", *h, 0.001, 10_000.0, "0.001 to 10000 GW s/Hz"));
    for (option, value, least, most, allowed) in within.into_iter().chain(inertias_within) {
        if !(value >= least && value <= most) {
            return Err(Failure::BadInput(format!(
                "{option} = {value} is out of range: {allowed}"
            )));
        }
    }
    // Tenths, so that 0.3 + 0.1 is 0.4.
    let loss = |n: u32| ((low + LOSS_STEP_GW * f64::from(n)) * 1e9).round() / 1e9;
    Ok(CompareConfig {
        losses_gw: (0..=steps as u32).map(loss).collect(),
        grids: match &args.inertia {
            Some(numbers) => Grids::of_inertias(spec, &numbers.0),
            None => Grids::of(spec),
        },
        trigger_hz: args.trigger_hz,
        duration_s: args.duration_s,
        chargers: ChargersConfig {
            seed: args.seed,
            ..ChargersConfig::of(spec, args.chargers)
        },
    })
}

fn write_csv(path: &Path, found: &Scorecard) -> Result<(), Failure> {
    let fail =
        |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(|e| fail(&e))?;
    writer
        .write_record([
            "loss_gw",
            "inertia_gw_s_per_hz",
            "controller",
            "nadir_hz",
            "nadir_time_s",
            "final_hz",
            "seconds_below_49_5",
            "participation_gw_s",
            "changes_per_charger",
            "changes_most",
            "ripple_hz",
            "plant",
        ])
        .map_err(|e| fail(&e))?;
    for row in &found.rows {
        let o = &row.outcome;
        let cells = (
            row.loss_gw,
            row.inertia_gw_s_per_hz,
            row.controller.name(),
            o.nadir_hz,
            o.nadir_time_s,
            o.final_hz,
            o.seconds_below_49_5,
            o.participation_gw_s,
            o.changes_per_charger,
            o.changes_most,
            o.ripple_hz,
            row.plant.as_str(),
        );
        writer.serialize(cells).map_err(|e| fail(&e))?;
    }
    writer.flush().map_err(|e| fail(&e))
}

fn write_figures(
    dir: &Path,
    spec: &Spec,
    config: &CompareConfig,
    found: &Scorecard,
) -> Result<(), Failure> {
    let section = scorecard::scorecard(&spec.name, config, found);
    let title = format!("Holdfast scorecard: {}", spec.name);
    let about = "A table beside the droop, no response and the limit.";
    let page = page::render(&title, about, &[section]).map_err(Failure::bad)?;
    let mut files = vec![("compare.html".to_owned(), page.html)];
    for figure in page.figures {
        files.push((format!("{}.svg", figure.id), figure.svg));
        files.push((format!("{}.csv", figure.id), figure.csv));
    }
    let named: Vec<(&str, &[u8])> = files
        .iter()
        .map(|(name, text)| (name.as_str(), text.as_bytes()))
        .collect();
    write_all(dir, &named)
}
