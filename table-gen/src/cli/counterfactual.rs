//! `counterfactual TRACE.csv SPEC`: a recorded event with the fleet responding.

use firmware::table::TableView;
use serde::Serialize;

use super::record::RecordArgs;
use super::{Failure, OutputArgs, output, plot};
use lab::counterfactual::{self, Counterfactual, LIMITS, PlantAnswer, Question};

/// Most draws of the disturbance.
const DRAWS_MAX: usize = 100_000;

/// Arguments of `counterfactual`.
#[derive(Debug, clap::Args)]
pub(super) struct CounterfactualArgs {
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Powers of the fleet to try [GW]
    #[arg(
        long,
        value_name = "GW,...",
        value_delimiter = ',',
        default_value = "0.7,1.4"
    )]
    fleet_gw: Vec<f64>,
    /// Demand that relays disconnected when the record passed 48.8 Hz [GW]; the paper says about 1
    /// GW for 2019
    #[arg(long, value_name = "GW", default_value_t = 1.0)]
    relieved_gw: f64,
    /// Response that the governors held on the day [GW], for the second plant
    #[arg(long, value_name = "GW", default_value_t = 1.0)]
    governor_max_gw: f64,
    /// Draws of the disturbance for the uncertainty
    #[arg(long, value_name = "N", default_value_t = 50)]
    draws: usize,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Draw the frequency with the largest fleet in the terminal
    #[arg(long)]
    plot: bool,
}

#[derive(Debug, Serialize)]
struct CounterfactualReport<'r> {
    spec: &'r str,
    start: &'r str,
    recorded_nadir_hz: f64,
    relay_s: Option<f64>,
    plants: &'r [PlantAnswer],
    limits: [&'static str; LIMITS.len()],
}

impl CounterfactualArgs {
    /// The question that the options ask.
    fn question(&self) -> Result<Question, Failure> {
        let within = |option: &str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(Failure::BadInput(format!(
                    "{option} = {value} is out of range: {low} to {high}"
                )))
            }
        };
        for fleet_gw in &self.fleet_gw {
            within("--fleet-gw", *fleet_gw, 0.0, 100.0)?;
        }
        within("--relieved-gw", self.relieved_gw, 0.0, 100.0)?;
        within("--governor-max-gw", self.governor_max_gw, 0.0, 100.0)?;
        within("--draws", self.draws as f64, 1.0, DRAWS_MAX as f64)?;
        Ok(Question {
            fleets_gw: self.fleet_gw.clone().into(),
            relieved_gw: self.relieved_gw,
            governor_max_gw: self.governor_max_gw,
            draws: self.draws,
            seed: self.seed,
        })
    }
}

/// Runs the command.
pub(super) fn run(args: &CounterfactualArgs) -> Result<(), Failure> {
    let spec = args.record.spec()?;
    let question = args.question()?;
    let (record, bytes) = args.record.load(&spec)?;
    let table =
        TableView::parse(&bytes).map_err(|error| Failure::BadInput(format!("{error:?}")))?;
    let found = counterfactual::answer(&spec, &table, &record, &question).map_err(Failure::bad)?;
    let report = CounterfactualReport {
        spec: &spec.name,
        start: &record.start,
        recorded_nadir_hz: found.recorded_nadir_hz,
        relay_s: found.relay_s,
        plants: &found.plants,
        limits: LIMITS,
    };
    if args.output.json {
        return output::json(&report);
    }
    print(&report);
    if args.plot {
        output::line(plot::frequency(
            &last_curve(&found),
            &counterfactual::LEVELS_HZ,
        ));
    }
    for limit in LIMITS {
        output::line(format_args!("limit: {limit}"));
    }
    Ok(())
}

/// The largest fleet on the last plant.
fn last_curve(found: &Counterfactual) -> Vec<(f64, f64)> {
    let curves = found.plants.last().map(|plant| plant.curves.as_slice());
    let curve = curves.unwrap_or(&[]).last();
    let points = curve.map_or(&[][..], |(_, points)| points);
    points.iter().map(|(t, f, _)| (*t, *f)).collect()
}

fn print(report: &CounterfactualReport<'_>) {
    output::line(format_args!(
        "record from {}: nadir {:.3} Hz",
        report.start, report.recorded_nadir_hz
    ));
    let none = || "-".to_owned();
    for plant in report.plants {
        output::line(format_args!(
            "\n{}: up to {:.2} GW missing; without chargers the plant follows the record within {:.1} mHz",
            plant.name,
            plant.largest_missing_gw,
            1000.0 * plant.misfit_hz
        ));
        let header = [
            "disturbance",
            "fleet GW",
            "chargers",
            "nadir Hz",
            "5 %",
            "95 %",
        ];
        let mut fleets = output::table(&header);
        let mut levels = output::table(&["disturbance", "above Hz", "fleet GW", "chargers"]);
        for variant in &plant.variants {
            for fleet in &variant.fleets {
                let at = fleet.nadir_hz.at;
                let text = |value: Option<f64>| value.map_or_else(none, |v| format!("{v:.3}"));
                fleets.add_row(vec![
                    variant.name.to_owned(),
                    format!("{:.2}", fleet.fleet_gw),
                    output::grouped(fleet.chargers as usize),
                    format!("{:.3}", fleet.summary.nadir_hz),
                    text(at.map(|at| at.p05)),
                    text(at.map(|at| at.p95)),
                ]);
            }
            for level in &variant.levels {
                let much = || "more than 5".to_owned();
                levels.add_row(vec![
                    variant.name.to_owned(),
                    format!("{:.1}", level.level_hz),
                    level.fleet_gw.map_or_else(much, |gw| format!("{gw:.2}")),
                    level
                        .chargers
                        .map_or_else(none, |n| output::grouped(n as usize)),
                ]);
            }
        }
        output::line(fleets);
        output::line(levels);
    }
}
