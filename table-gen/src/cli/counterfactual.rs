//! `counterfactual TRACE.csv SPEC`: a recorded event with the fleet responding.

use firmware::table::TableView;
use serde::Serialize;

use super::event::EventArgs;
use super::record::RecordArgs;
use super::{Failure, OutputArgs, output, plot};
use lab::counterfactual::grids::{self, Grid, Role, Source};
use lab::counterfactual::{self, Counterfactual, LIMITS, PlantAnswer, Question};
use lab::identify::Identified;

/// Most draws of the disturbance.
const DRAWS_MAX: usize = 100_000;

/// The plant on which a recorded event runs again.
#[derive(Debug, clap::Args)]
pub(super) struct GridArgs {
    /// The plant that answers: `identified` from the record (a spec with limited governors is taken
    /// as it is), or `stated`, the spec's with the response held as a limit
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = Which::Identified, help_heading = "Recorded event")]
    plant: Which,
    #[command(flatten)]
    event: EventArgs,
    /// Time after the steepest second up to which the record tells the plant [s]
    #[arg(long, value_name = "S", default_value_t = grids::UNTIL_S, help_heading = "Recorded event")]
    until_s: f64,
}

/// See [`GridArgs`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    Identified,
    Stated,
}

impl GridArgs {
    /// What they ask for.
    pub(super) fn grid(&self) -> Result<Grid, Failure> {
        let known = self.event.known(self.until_s)?;
        Ok(match self.plant {
            Which::Identified => Grid::Identified(known),
            Which::Stated => Grid::Stated,
        })
    }
}

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
    #[command(flatten)]
    grid: GridArgs,
    /// Response that the governors held on the day [GW], for `--plant stated`
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
    /// Where the plant of the answer comes from.
    plant: Source,
    identified: Option<&'r Identified>,
    not_identified: Option<&'r str>,
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
            grid: self.grid.grid()?,
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
        plant: found.source,
        identified: found.identified.as_ref(),
        not_identified: found.not_identified.as_deref(),
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
    if let Some(why) = report.not_identified {
        output::line(format_args!("the record tells no plant: {why}"));
    }
    let none = || "-".to_owned();
    for plant in report.plants {
        let role = match plant.role {
            Role::Comparison => "to compare with",
            Role::Answer => "the answer",
        };
        output::line(format_args!(
            "\n{} ({role}): up to {:.2} GW missing; without chargers the plant follows the record within {:.1} mHz",
            plant.name,
            plant.largest_missing_gw,
            1000.0 * plant.misfit_hz
        ));
        if let (Role::Answer, Some(found)) = (plant.role, report.identified) {
            identified(found);
        }
        let header = [
            "disturbance",
            "fleet GW",
            "chargers",
            "nadir Hz",
            "5 %",
            "95 %",
            "over plants",
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
                    fleet
                        .nadir_over_plants_hz
                        .map_or_else(none, |[low, high]| format!("{low:.3} to {high:.3}")),
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

/// The plant that the record tells, on one line.
fn identified(found: &Identified) {
    let told: Vec<String> = found
        .parameters
        .iter()
        .filter(|it| it.low < it.high)
        .map(|it| {
            let key = it.key.rsplit('.').next().unwrap_or(it.key);
            format!("{key} {:.3} [{:.3}, {:.3}]", it.value, it.low, it.high)
        })
        .collect();
    output::line(format_args!(
        "identified from {} samples, which the best plant leaves by {:.1} mHz: {}",
        found.samples,
        1e3 * found.residual_hz,
        told.join("; ")
    ));
}
