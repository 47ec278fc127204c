//! `identify TRACE.csv [SPEC]`: the plant behind a recorded event.

use std::path::PathBuf;

use serde::Serialize;

use super::event::EventArgs;
use super::files::write_one;
use super::record::RecordOptions;
use super::{Failure, OutputArgs, Overrides, output};
use lab::identify::forecast::{Event, Forecast, forecast};
use lab::identify::parameters::{GOVERNOR_TIME, LAG_TIME, LEAD_TIME, TURBINE_TIME, Told};
use lab::identify::{self, Identified, Known, figure, spec_file};
use lab::report::chart;
use model::spec::Spec;

/// Arguments of `identify`.
#[derive(Debug, clap::Args)]
pub(super) struct IdentifyArgs {
    /// The recorded frequency
    #[arg(value_name = "TRACE.csv")]
    record: PathBuf,
    /// Spec whose time constants are taken as known, and whose other sections the identified one
    /// takes over; without it the time constants are looked for too
    #[arg(value_name = "SPEC")]
    spec: Option<String>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: RecordOptions,
    #[command(flatten)]
    event: EventArgs,
    /// Look for the time constants although a spec is named
    #[arg(long)]
    free_times: bool,
    /// Time after the steepest second up to which the record counts [s]
    #[arg(long, value_name = "S", default_value_t = identify::UNTIL_S)]
    until_s: f64,
    /// Write the identified spec here
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Make the intervals of inertia, gain and damping the spec's bands of [uncertainty]
    #[arg(long, requires = "out")]
    bands: bool,
    /// Draw record and fit here
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// Another event, which the identified plants forecast: its loss [GW], inertia [GW s/Hz] and
    /// frequency before it [Hz]; repeatable
    #[arg(long, value_name = "GW,H,HZ", value_delimiter = ',', num_args = 1)]
    forecast: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct IdentifyReport<'r> {
    start: &'r str,
    #[serde(flatten)]
    found: &'r Identified,
    forecasts: &'r [Forecast],
}

/// Runs the command.
pub(super) fn run(args: &IdentifyArgs) -> Result<(), Failure> {
    let base = match &args.spec {
        Some(spec) => args.overrides.load(spec)?,
        None => Spec::from_toml("", "defaults", &args.overrides.set)?,
    };
    let known = known(args, &base)?;
    let events = events(args)?;
    let record = args.options.read(&args.record)?;
    let found = identify::identify(&record, &known).map_err(Failure::bad)?;
    let forecasts: Vec<Forecast> = events
        .iter()
        .map(|event| {
            let rest_hz = event.rest_hz - record.nominal_hz;
            forecast(&found, Event { rest_hz, ..*event })
        })
        .collect();
    if let Some(path) = &args.figure {
        let drawn = chart::svg(&figure::figure(&found, record.nominal_hz)).map_err(Failure::bad)?;
        write_one(path, chart::with_style(&drawn).as_bytes())?;
    }
    if let Some(path) = &args.out {
        let spec = spec_file::spec(&base, &found, args.bands)?;
        let name = args
            .record
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let text = spec_file::text(&spec, &found, &name).map_err(Failure::bad)?;
        write_one(path, text.as_bytes())?;
    }
    if args.output.json {
        return output::json(&IdentifyReport {
            start: &record.start,
            found: &found,
            forecasts: &forecasts,
        });
    }
    print(&found);
    print_forecasts(&forecasts, record.nominal_hz);
    Ok(())
}

/// What the options know of the event.
fn known(args: &IdentifyArgs, base: &Spec) -> Result<Known, Failure> {
    let mut known = args.event.known(args.until_s)?;
    if args.spec.is_some() && !args.free_times {
        let plant = &base.plant;
        let times = [
            (GOVERNOR_TIME, plant.governor_time_s),
            (TURBINE_TIME, plant.turbine_time_s),
            (LEAD_TIME, plant.lead_time_s),
            (LAG_TIME, plant.lag_time_s),
        ];
        // What is given by name stands above the spec.
        let named: Vec<usize> = known.given.iter().map(|(index, _)| *index).collect();
        known.given.extend(
            times
                .into_iter()
                .filter(|(index, _)| !named.contains(index)),
        );
    }
    Ok(known)
}

/// Events to forecast; their rest is still absolute.
fn events(args: &IdentifyArgs) -> Result<Vec<Event>, Failure> {
    if !args.forecast.len().is_multiple_of(3) {
        return Err(Failure::BadInput(
            "--forecast: allowed: three numbers, loss [GW], inertia [GW s/Hz], frequency before [Hz]".to_owned(),
        ));
    }
    let event = |three: &[f64]| Event {
        loss_gw: three[0],
        inertia_gw_s_per_hz: three[1],
        rest_hz: three[2],
    };
    let events: Vec<Event> = args.forecast.chunks_exact(3).map(event).collect();
    for event in &events {
        if !(event.loss_gw > 0.0 && event.inertia_gw_s_per_hz >= 0.1 && event.rest_hz > 0.0) {
            return Err(Failure::BadInput(format!(
                "--forecast {},{},{}: allowed: a loss above 0, an inertia of at least 0.1, a frequency above 0",
                event.loss_gw, event.inertia_gw_s_per_hz, event.rest_hz
            )));
        }
    }
    Ok(events)
}

fn print(found: &Identified) {
    output::line(format_args!(
        "{} samples from {:.1} s on; the best plant leaves {:.2} mHz (at most {:.1} mHz), neighbours correlated by {:.2}",
        found.samples,
        found.from_s,
        1e3 * found.residual_hz,
        1e3 * found.largest_residual_hz,
        found.correlation
    ));
    let mut table = output::table(&["parameter", "unit", "best", "from", "to", "told"]);
    for it in &found.parameters {
        let told = match it.told {
            Told::Given => "given",
            Told::BothEnds => "both ends",
            Told::AtMost => "at most",
            Told::AtLeast => "at least",
            Told::Nothing => "nothing",
        };
        table.add_row(vec![
            it.key.to_owned(),
            it.unit.to_owned(),
            format!("{:.4}", it.value),
            format!("{:.4}", it.low),
            format!("{:.4}", it.high),
            told.to_owned(),
        ]);
    }
    output::line(table);
    output::line(format_args!(
        "all intervals hold at once with {} % if the errors are as assumed",
        100.0 * found.confidence
    ));
    let time_constants = found.parameters.iter().any(|it| {
        let is_time = it.key.starts_with("plant.") && it.key.ends_with("_time_s");
        is_time && it.told != Told::Given
    });
    if time_constants {
        output::line(
            "the time constants were looked for as well: such intervals are a hint, and hold less \
             often than that (docs/identification.md)",
        );
    }
    if let Some(slope) = &found.first_second {
        output::line(format_args!(
            "inertia by the first {:.1} s alone: {:.3} GW s/Hz from {} samples, rather too large than too small",
            slope.until_s, slope.inertia_gw_s_per_hz, slope.samples
        ));
    }
    for sentence in &found.cannot_tell {
        output::line(format_args!("cannot tell: {sentence}"));
    }
}

fn print_forecasts(forecasts: &[Forecast], nominal_hz: f64) {
    if forecasts.is_empty() {
        return;
    }
    let mut table = output::table(&[
        "loss GW",
        "H",
        "before Hz",
        "nadir Hz",
        "after 2 s Hz",
        "steepest Hz/s",
    ]);
    for it in forecasts {
        let range = |range: &identify::forecast::Range, add: f64| {
            let digits = |value: f64| format!("{:.3}", add + value);
            format!(
                "{} ({} to {})",
                digits(range.best),
                digits(range.low),
                digits(range.high)
            )
        };
        table.add_row(vec![
            format!("{:.3}", it.event.loss_gw),
            format!("{:.2}", it.event.inertia_gw_s_per_hz),
            format!("{:.3}", nominal_hz + it.event.rest_hz),
            range(&it.nadir_hz, nominal_hz),
            range(&it.after_2_s_hz, nominal_hz),
            range(&it.steepest_hz_per_s, 0.0),
        ]);
    }
    output::line(table);
}
