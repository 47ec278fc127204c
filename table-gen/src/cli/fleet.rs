//! `fleet SPEC`: every charger with its own firmware.

use std::path::PathBuf;
use std::time::Instant;

use firmware::table::TableView;
use serde::Serialize;

use super::{Failure, OutputArgs, SpecArgs, output, plot, progress, run_tables};
use lab::fleet::measure::FleetMeasures;
use lab::fleet::{self, FleetConfig, FleetRun, INSTANCES_MAX};
use lab::simulation::NOMINAL_HZ;
use lab::simulation::monitor::Summary;
use lab::simulation::scenario::Scenario;
use synth::pipeline;

/// Arguments of `fleet`.
#[derive(Debug, clap::Args)]
pub(super) struct FleetArgs {
    #[command(flatten)]
    spec: SpecArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Instances of the firmware; together they have the power of the spec's fleet. Default: the
    /// spec's chargers
    #[arg(long, value_name = "N")]
    chargers: Option<usize>,
    /// Lost infeed [GW]; default: the middle of the spec's band
    #[arg(long, value_name = "GW", allow_negative_numbers = true)]
    loss_gw: Option<f64>,
    /// Length of the run [s]
    #[arg(
        long,
        value_name = "S",
        default_value_t = fleet::DURATION_S,
        allow_negative_numbers = true
    )]
    duration_s: f64,
    /// Bound on the error of each charger's frequency meter, drawn each tick [Hz]; default: the
    /// spec's
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    noise_hz: Option<f64>,
    /// Share of chargers that never respond
    #[arg(
        long,
        value_name = "X",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    failed: f64,
    /// Outages of each charger's meter in an hour
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    outages_per_hour: f64,
    /// Mean length of an outage [s]
    #[arg(
        long,
        value_name = "S",
        default_value_t = 2.0,
        allow_negative_numbers = true
    )]
    outage_s: f64,
    /// All chargers tick at the same moment, instead of spread over the tick
    #[arg(long)]
    one_clock: bool,
    /// Seed of what is drawn
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Table to run, instead of synthesising one; it must be of this spec
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Draw the frequency in the terminal
    #[arg(long)]
    plot: bool,
    /// Write time, frequency and participation (told, asked, given) of every tick as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct FleetReport<'r> {
    spec: &'r str,
    chargers: usize,
    fleet_gw: f64,
    loss_gw: f64,
    duration_s: f64,
    #[serde(flatten)]
    summary: &'r Summary,
    fleet: &'r FleetMeasures,
    changes_per_charger: f64,
    contactor_operations_per_charger: f64,
    outside_proven_hull_s: Option<f64>,
    /// Largest and mean distance of the response from what one firmware that is told the state asks
    /// for.
    gap_max: f64,
    gap_mean: f64,
}

/// Runs the command.
pub(super) fn run(args: &FleetArgs) -> Result<(), Failure> {
    let spec = args.spec.load()?;
    let instances = args.chargers.unwrap_or(spec.fleet.chargers as usize);
    let sound = FleetConfig::sound(&spec, instances);
    let config = FleetConfig {
        noise_hz: args.noise_hz.unwrap_or(sound.noise_hz),
        failed_share: args.failed,
        outages_per_hour: args.outages_per_hour,
        outage_s: args.outage_s,
        spread_clocks: !args.one_clock,
        seed: args.seed,
        ..sound
    };
    let mut scenario = Scenario::of(&spec);
    scenario.duration_s = args.duration_s;
    scenario.loss_gw = args.loss_gw.unwrap_or(scenario.loss_gw);
    scenario.check().map_err(Failure::bad)?;
    check(&config)?;
    progress::catch_interrupts();
    let bytes = pipeline::table_bytes(&spec, args.table.as_deref(), &progress::watch)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let start = Instant::now();
    let go_on = || !progress::interrupted();
    let run = fleet::run(&spec, &table, &config, &scenario, &go_on)
        .ok_or_else(|| Failure::No("interrupted".to_owned()))?;
    let elapsed_s = start.elapsed().as_secs_f64();
    if let Some(path) = &args.csv {
        write_csv(path, &run)?;
    }
    let gaps = run.samples.iter().map(|s| (s.given - s.told).abs());
    let report = FleetReport {
        spec: &spec.name,
        chargers: instances,
        fleet_gw: spec.fleet_power_gw(),
        loss_gw: scenario.loss_gw,
        duration_s: scenario.duration_s,
        summary: &run.summary,
        fleet: &run.measures,
        changes_per_charger: run.measures.changes_per_charger,
        contactor_operations_per_charger: run.measures.contactor_operations_per_charger,
        outside_proven_hull_s: run.measures.outside_proven_hull_s,
        gap_max: gaps.clone().fold(0.0, f64::max),
        gap_mean: gaps.sum::<f64>() / run.samples.len().max(1) as f64,
    };
    if args.output.json {
        return output::json(&report);
    }
    run_tables::summary(&run.summary);
    print(&report);
    output::line(format_args!(
        "{} chargers for {} s in {elapsed_s:.2} s; {} bytes each",
        output::grouped(instances),
        scenario.duration_s,
        fleet::instance_bytes()
    ));
    if args.plot {
        let points: Vec<(f64, f64)> = run
            .samples
            .iter()
            .map(|s| (s.time_s, NOMINAL_HZ + s.f))
            .collect();
        output::line(plot::frequency(&points, &run_tables::levels_hz(&spec)));
    }
    Ok(())
}

/// Every number in its range.
fn check(config: &FleetConfig) -> Result<(), Failure> {
    let instances = config.instances;
    if !(1..=INSTANCES_MAX).contains(&instances) {
        return Err(Failure::BadInput(format!(
            "--chargers = {instances} is out of range: 1 to {INSTANCES_MAX}"
        )));
    }
    let numbers = [
        ("--noise-hz", config.noise_hz, 0.0, 1.0, "0 to 1 Hz"),
        ("--failed", config.failed_share, 0.0, 1.0, "0 to 1"),
        (
            "--outages-per-hour",
            config.outages_per_hour,
            0.0,
            3600.0,
            "0 to 3600",
        ),
        (
            "--outage-s",
            config.outage_s,
            0.001,
            3600.0,
            "0.001 to 3600 s",
        ),
    ];
    for (option, value, low, high, allowed) in numbers {
        if !(value >= low && value <= high) {
            return Err(Failure::BadInput(format!(
                "{option} = {value} is out of range: {allowed}"
            )));
        }
    }
    Ok(())
}

fn print(report: &FleetReport<'_>) {
    let fleet = report.fleet;
    let mut table = output::table(&["fleet", "value"]);
    let rows = [
        ("failed chargers", output::grouped(fleet.failed)),
        ("hostile chargers", output::grouped(fleet.hostile)),
        (
            "response off the told one",
            format!(
                "{:.3} at most, {:.4} on average",
                report.gap_max, report.gap_mean
            ),
        ),
        (
            "largest rise in a second",
            format!("{:.3} GW", fleet.rise_gw_per_s),
        ),
        (
            "largest fall in a second",
            format!("{:.3} GW", fleet.fall_gw_per_s),
        ),
        (
            "changed in one tick",
            format!("{:.1} %", 100.0 * fleet.changed_at_once),
        ),
        ("rebound", format!("{:.4} Hz", fleet.rebound_hz)),
        (
            "changes of a charger",
            format!(
                "{:.1} on average, {} at most",
                fleet.changes_mean, fleet.changes_max
            ),
        ),
        (
            "changes of 5 % and more",
            format!(
                "{:.1} on average, {} at most",
                fleet.changes_per_charger, fleet.changes_per_charger_max
            ),
        ),
        (
            "contactor operations",
            format!(
                "{:.2} on average, {} at most",
                fleet.contactor_operations_per_charger, fleet.contactor_operations_max
            ),
        ),
        (
            "largest change in a second after 60 s",
            format!("{:.2} % of the fleet", 100.0 * fleet.settled_change),
        ),
        (
            "outside what the proof assumes",
            match (fleet.outside_proven_hull_s, fleet.outside_proven_hull_by) {
                (Some(s), Some(by)) => format!("{s:.2} s, by {:.2} % of the fleet", 100.0 * by),
                _ => "the proof knows one participation".to_owned(),
            },
        ),
        (
            "ticks without a reading",
            format!("{:.3} %", 100.0 * fleet.missed_share),
        ),
    ];
    for (name, value) in rows {
        table.add_row(vec![name.to_owned(), value]);
    }
    output::line(table);
}

fn write_csv(path: &std::path::Path, run: &FleetRun) -> Result<(), Failure> {
    let fail =
        |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(|e| fail(&e))?;
    let columns = ["time_s", "frequency_hz", "told", "asked", "given"];
    writer.write_record(columns).map_err(|e| fail(&e))?;
    for s in &run.samples {
        let row = [s.time_s, NOMINAL_HZ + s.f, s.told, s.asked, s.given];
        writer.serialize(row).map_err(|e| fail(&e))?;
    }
    writer.flush().map_err(|e| fail(&e))
}
