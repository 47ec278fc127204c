//! `budget TABLE|SPEC`: bytes by part, visits, free flash; `--sweep` the front of guarantee against
//! bytes.

use std::path::{Path, PathBuf};

use firmware::table::TableView;

use super::shares::Job;
use super::{Failure, OutputArgs, Overrides, output, progress, size_front};
use lab::report::chart;
use model::budget::Budget;
use model::spec::Spec;
use synth::budget::{self, sweep};
use synth::compress::Options;
use synth::pipeline::{self, Encoding};
use synth::synthesis;

/// Arguments of `budget`.
#[derive(Debug, clap::Args)]
pub(super) struct BudgetArgs {
    /// A table file, the name of a shipped spec, or the path of a TOML file
    #[arg(value_name = "TABLE|SPEC")]
    subject: String,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: OutputArgs,
    /// Choose among the fastest inputs only
    #[arg(long)]
    keep_minimal_time: bool,
    /// Keep every winning cell, whatever membership costs
    #[arg(long)]
    exact_domain: bool,
    /// Vary width, period and participation error of the spec; with --json one line a variant
    #[arg(long)]
    sweep: bool,
    /// Factors on the cell widths, for --sweep
    #[arg(long, value_delimiter = ',', default_value = "1,2", requires = "sweep")]
    widths: Vec<f64>,
    /// Periods [s], for --sweep
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1,1.5,2",
        requires = "sweep"
    )]
    periods: Vec<f64>,
    /// Participation errors, for --sweep
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0,0.1",
        requires = "sweep"
    )]
    errors: Vec<f64>,
    /// Write the sweep as SVG to this file
    #[arg(long, value_name = "FILE", requires = "sweep")]
    svg: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(args: &BudgetArgs) -> Result<(), Failure> {
    progress::catch_interrupts();
    let options = Options {
        keep_minimal_time: args.keep_minimal_time,
        exact_domain: args.exact_domain,
    };
    if args.sweep {
        let spec = args.overrides.load(&args.subject)?;
        return run_sweep(args, &spec, &options);
    }
    let path = Path::new(&args.subject);
    let bytes = if path.extension().is_some_and(|end| end != "toml") {
        std::fs::read(path)
            .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))?
    } else {
        let spec = args.overrides.load(&args.subject)?;
        if spec.preference.always_on {
            pipeline::response(&spec)?
        } else {
            let synthesis = synthesis::synthesise(&spec, &progress::watch)?;
            pipeline::emit(&synthesis, Encoding::Tree(options), &progress::watch)?.bytes
        }
    };
    let table = TableView::parse(&bytes)
        .map_err(|error| Failure::BadInput(format!("{}: {error:?}", args.subject)))?;
    let budget = budget::budget(&table);
    if args.output.json {
        return output::json(&budget);
    }
    print(&budget);
    Ok(())
}

fn print(budget: &Budget) {
    let mut table = output::table(&[
        "part",
        "domain B",
        "inputs B",
        "worst visits",
        "mean visits",
    ]);
    for law in &budget.laws {
        table.add_row(vec![
            law.law.clone().into_owned(),
            output::grouped(law.domain_bytes as usize),
            output::grouped(law.inputs_bytes as usize),
            law.worst_visits.to_string(),
            format!("{:.1}", law.mean_visits),
        ]);
    }
    output::line(table);
    output::line(format_args!(
        "table: {} bytes, of which header and CRC {}",
        output::grouped(budget.table_bytes),
        budget.header_bytes
    ));
    let grouped = |n: u64| output::grouped(n as usize);
    if let Some(bytes) = budget.measured.core_bytes {
        output::line(format_args!(
            "code: {} bytes for the charger without a HAL, measured on a Cortex-M4F",
            grouped(bytes)
        ));
    }
    output::line(match budget.measured.lookup_instructions {
        Some(n) => format!("worst lookup: {} instructions, quantiser included, measured on a Cortex-M4F", grouped(n)),
        None => "worst lookup: not measured for this table (`cargo fw costs` measures the shipped paper-bi)".to_owned(),
    });
    let mut table = output::table(&["microcontroller", "flash KiB", "left bytes", "taken"]);
    for room in &budget.rooms {
        table.add_row(vec![
            format!("{} ({})", room.part.name, room.part.core),
            room.part.flash_kib.to_string(),
            room.left_bytes.to_string(),
            format!("{:.2} %", 100.0 * room.share),
        ]);
    }
    output::line(table);
}

fn run_sweep(args: &BudgetArgs, spec: &Spec, options: &Options) -> Result<(), Failure> {
    let mut variants = Vec::new();
    for width_factor in &args.widths {
        for period_s in &args.periods {
            for participation in &args.errors {
                variants.push(sweep::Variant {
                    width_factor: *width_factor,
                    period_s: *period_s,
                    participation: *participation,
                });
            }
        }
    }
    let job = Job::join();
    let watch = |name| job.watch(name);
    let answers = job.answers(&variants, |own| {
        own.iter()
            .map(|variant| sweep::try_variant(spec, *variant, options, &watch))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| Failure::No(error.to_string()))
    })?;
    let Some(mut outcomes) = answers else {
        return Ok(());
    };
    sweep::mark_pareto(&mut outcomes);
    if let Some(path) = &args.svg {
        let picture = chart::svg(&size_front::figure(&outcomes)).map_err(Failure::bad)?;
        let picture = chart::with_style(&picture);
        std::fs::write(path, picture)
            .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))?;
    }
    if args.output.json {
        for outcome in &outcomes {
            output::line(serde_json::to_string(outcome).map_err(Failure::bad)?);
        }
        return Ok(());
    }
    let mut table = output::table(&["width", "period s", "error", "bytes", "to I2 s", "front"]);
    for outcome in &outcomes {
        let bytes = outcome.table_bytes.map_or("-".to_owned(), output::grouped);
        table.add_row(vec![
            format!("x{}", outcome.variant.width_factor),
            outcome.variant.period_s.to_string(),
            outcome.variant.participation.to_string(),
            bytes,
            output::seconds(outcome.settle_s),
            if outcome.pareto { "yes" } else { "" }.to_owned(),
        ]);
    }
    output::line(table);
    for outcome in outcomes.iter().filter(|outcome| outcome.reason.is_some()) {
        output::line(format_args!(
            "x{} {} s {}: {}",
            outcome.variant.width_factor,
            outcome.variant.period_s,
            outcome.variant.participation,
            outcome.reason.as_deref().unwrap_or("")
        ));
    }
    Ok(())
}
