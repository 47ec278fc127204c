//! `cargo fw`: the images, built, run in QEMU and measured.
//!
//! Exit codes: 0 done; 1 host and target differ, or a figure is past its goal; 2 bad input or a
//! missing tool.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Parser, Subcommand};
use firmware::link::session::{Session, Wires};
use firmware::link::{Request, Setup, SourceKind};
use firmware::table::TableView;

use fw::board::{self, BoardError};
use fw::c_api::library::RV32IMC;
use fw::c_api::program::{CORTEX_M0, CORTEX_M4};
use fw::c_api::{self, CApiError};
use fw::costs;
use fw::figures::CostError;
use fw::images::{self, Elf, Image, PIL, PRODUCTS};
use fw::lookups;
use fw::pil::machine::{self, Machine};
use fw::pil::qemu::Target;
use fw::pil::run::{Outcome, Pair, closed_loop, recorded};
use fw::pil::scenario::{self, Scenario};
use fw::pil::{qemu, record};
use fw::root;
use fw::table_fit::{self, Built, Candidate};

/// The table of processor-in-the-loop runs and measurements: a table by games.
const TABLE: &str = "firmware/tables/paper-bi.bin";
/// A table whose commands act late.
const LATE_TABLE: &str = "firmware/tables/gb-bi-delay.bin";

/// Tables over which the C interface is measured: by games, and a response.
const C_COST_TABLES: [&str; 2] = ["paper-bi", "gb-bi"];
/// Table of the C example.
const C_EXAMPLE_TABLE: &str = "firmware/tables/gb-uni.bin";

/// Most random scenarios with commands that act late.
const LATE_SCENARIOS_MAX: u64 = 200;

/// The images of Holdfast: built, run in QEMU, measured.
#[derive(Debug, Parser)]
#[command(name = "fw", max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Build the images, print their sizes, write ELF, BIN and HEX (the default)
    Images {
        /// Folder for the files
        #[arg(long, default_value = "out/firmware")]
        out: PathBuf,
        /// Build the product's images with log lines over the debug probe
        #[arg(long)]
        log: bool,
        #[command(flatten)]
        choice: Choice,
    },
    /// Say which table goes into which image, whether it fits and what is proven of it; build
    /// nothing
    Check {
        #[command(flatten)]
        choice: Choice,
    },
    /// Processor in the loop: the pil image in QEMU against the same code on the host, compared to
    /// the bit
    Pil {
        /// Random scenarios
        #[arg(long, default_value_t = 1000)]
        scenarios: u64,
        /// Ticks of a random scenario (100 ms each)
        #[arg(long, default_value_t = 600)]
        ticks: u32,
        /// Table [default: the one that the images carry]
        #[arg(long)]
        table: Option<PathBuf>,
        /// The core
        #[arg(long, value_enum, default_value_t = Core::M4)]
        core: Core,
    },
    /// The C interface: static libraries, a bare C program in QEMU against the host, costs, the
    /// CMake package
    CApi {
        /// Random scenarios
        #[arg(long, default_value_t = 1000)]
        scenarios: u64,
        /// Ticks of a random scenario (100 ms each)
        #[arg(long, default_value_t = 600)]
        ticks: u32,
        /// Folder of the package
        #[arg(long, default_value = "out/c-api")]
        out: PathBuf,
        /// Take the figures over
        #[arg(long)]
        bless: bool,
    },
    /// The unmodified images on an emulated board: scenarios that each state what must hold, and
    /// the host on the same captures, equal to the bit
    Board {
        /// Scenarios [default: all but those that take minutes]
        scenarios: Vec<String>,
        /// Folder of images built before, NAME.elf, in place of what is built now
        #[arg(long, value_name = "FOLDER")]
        images: Option<PathBuf>,
        /// Take the deepest stacks over
        #[arg(long, conflicts_with_all = ["scenarios", "images"])]
        bless: bool,
    },
    /// Measure flash, RAM, stack and instructions, and compare with firmware/expected
    Costs {
        /// Take the figures over
        #[arg(long)]
        bless: bool,
    },
}

/// Tables and products.
#[derive(Debug, Default, clap::Args)]
struct Choice {
    /// Table for the images, in place of the shipped one for each product; also HOLDFAST_TABLE=FILE
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// One product alone, by the name of its image
    #[arg(long, value_name = "NAME")]
    product: Option<String>,
    /// Take a table that does not fit, for an experiment: the charger says so and runs the droop
    #[arg(long)]
    force: bool,
}

/// The cores that the pil image runs on.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Core {
    /// Cortex-M4F, the reference board
    M4,
    /// Code for Cortex-M0+, where floating point is software
    M0,
    /// RV32IMC, without floating point and without atomics
    Riscv,
}

impl Core {
    const fn machine(self) -> Machine {
        match self {
            Self::M4 => machine::CORTEX_M4,
            Self::M0 => machine::CORTEX_M0,
            Self::Riscv => machine::RISCV,
        }
    }
}

type AnyError = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let command = Cli::parse().command.unwrap_or(Command::Images {
        out: "out/firmware".into(),
        log: false,
        choice: Choice::default(),
    });
    let result = match command {
        Command::Images { out, log, choice } => build_images(&out, log, &choice),
        Command::Check { choice } => plan(&choice).map(drop),
        Command::Pil {
            scenarios,
            ticks,
            table,
            core,
        } => processor_in_the_loop(scenarios, ticks.max(1), table.as_deref(), core.machine()),
        Command::CApi {
            scenarios,
            ticks,
            out,
            bless,
        } => c_interface((scenarios, ticks.max(1)), &root().join(out), bless),
        Command::Board {
            scenarios,
            images,
            bless,
        } => board::play(&scenarios, images, bless).map_err(AnyError::from),
        Command::Costs { bless } => measure(bless),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            let wrong = matches!(error.downcast_ref(), Some(CostError::Wrong(_)));
            let differs = matches!(error.downcast_ref(), Some(qemu::PilError::Differs(_)));
            let in_c = matches!(error.downcast_ref(), Some(CApiError::Differs(_)));
            let on_board = matches!(
                error.downcast_ref(),
                Some(BoardError::Fails | BoardError::Differs { .. } | BoardError::Cost(_))
            );
            let no = wrong || differs || in_c || on_board;
            ExitCode::from(if no { 1 } else { 2 })
        }
    }
}

/// Which image is built with which table; `None` for the shipped one. Said before anything is
/// built.
///
/// A table that was named goes into the products that it fits. A product that was named must fit.
fn plan(choice: &Choice) -> Result<Vec<(Image, Option<PathBuf>)>, AnyError> {
    let variable = std::env::var_os(images::TABLE_VARIABLE).map(PathBuf::from);
    // Relative to where the command was started, whatever folder cargo builds in.
    let named = match choice.table.clone().or(variable) {
        Some(path) if path.as_os_str().is_empty() => Some(path),
        Some(path) => Some(std::path::absolute(path)?),
        None => None,
    };
    let candidate = named.as_deref().map(Candidate::read).transpose()?;
    if let Some(candidate) = &candidate {
        println!("{}", candidate.describe());
    }
    let mut chosen = Vec::new();
    let mut refused = Vec::new();
    let mut known = false;
    for built in Built::all() {
        let name = built.image.name;
        if choice.product.as_ref().is_some_and(|wanted| wanted != name) {
            continue;
        }
        known = true;
        let shipped;
        let table = match &candidate {
            Some(candidate) => candidate,
            None => {
                let path = built.default_table();
                if !path.exists() {
                    println!(
                        "{name}: NO TABLE, for {} is missing: the charger runs on the droop",
                        path.display()
                    );
                    chosen.push((built.image, None));
                    continue;
                }
                shipped = Candidate::read(&path)?;
                println!("{}", shipped.describe());
                &shipped
            }
        };
        let misfits = table.misfits(&built)?;
        if misfits.is_empty() {
            println!("{name}: the table fits");
        } else if candidate.is_none() {
            println!(
                "{name}: DOES NOT FIT its shipped table ({}): the charger says so and runs on the droop",
                table_fit::names(misfits)
            );
        } else if choice.force {
            println!(
                "{name}: DOES NOT FIT ({}), FORCED: the charger says so and runs on the droop",
                table_fit::names(misfits)
            );
        } else {
            let reason = format!("{name}: {}", table_fit::names(misfits));
            println!("{reason}: not built");
            refused.push(reason);
            continue;
        }
        chosen.push((built.image, named.clone()));
    }
    if !known {
        let names = PRODUCTS.map(|image| image.name).join(", ");
        return Err(format!("no such product; allowed: {names}").into());
    }
    if chosen.is_empty() {
        let reasons = refused.join("; ");
        return Err(format!("the table does not fit: {reasons}; --force for an experiment").into());
    }
    Ok(chosen)
}

fn build_images(out: &Path, log: bool, choice: &Choice) -> Result<(), AnyError> {
    let products = plan(choice)?
        .into_iter()
        .map(|(image, table)| (if log { image.with_log() } else { image }, table));
    for (image, table) in products.chain([(PIL, None)]) {
        let elf = Elf::read(&images::build_with(
            image,
            images::TARGET,
            table.as_deref(),
        )?)?;
        println!("{}", image.name);
        for section in elf.sections()? {
            let place = match (section.in_flash, section.in_ram) {
                (true, true) => "flash and RAM",
                (true, false) => "flash",
                _ => "RAM",
            };
            println!(
                "  {:<20} {:#010x} {:>8} bytes  {place}",
                section.name, section.address, section.size
            );
        }
        for file in images::write(image, &elf, &root().join(out))? {
            println!("  {}", file.display());
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>, AnyError> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// The table of a run: the one named, or the one that the images carry.
fn table_bytes(named: Option<&Path>) -> Result<Vec<u8>, AnyError> {
    named.map_or_else(|| read(&root().join(TABLE)), read)
}

fn processor_in_the_loop(
    scenarios: u64,
    ticks: u32,
    table: Option<&Path>,
    machine: Machine,
) -> Result<(), AnyError> {
    let table = table_bytes(table)?;
    let image = images::build(PIL, machine.target)?;
    in_lock_step(machine, &image, &table, |pair| {
        runs(pair, (scenarios, ticks), 0)?;
        replay(pair)
    })?;
    let late = read(&root().join(LATE_TABLE))?;
    let delay_ticks = TableView::parse(&late)
        .map_err(|error| format!("{LATE_TABLE}: {error:?}"))?
        .header()
        .delay_ticks;
    if delay_ticks == 0 {
        return Err(format!("{LATE_TABLE}: its commands do not act late").into());
    }
    println!(
        "a table of {} bytes whose commands act {delay_ticks} ticks late:",
        late.len()
    );
    in_lock_step(machine, &image, &late, |pair| {
        let scenarios = scenarios.min(LATE_SCENARIOS_MAX);
        runs(pair, (scenarios, ticks), delay_ticks)
    })
}

/// Host and target with one table, from the start of the emulator to its end.
fn in_lock_step(
    machine: Machine,
    image: &Path,
    table: &[u8],
    play: impl FnOnce(&mut Pair<'_, '_>) -> Result<(), AnyError>,
) -> Result<(), AnyError> {
    let started = Instant::now();
    let mut target = Target::start(machine, image, table, false)?;
    let wires = Wires::default();
    let mut host = Session::new(&wires, table);
    if let Some(reason) = host.table_error() {
        return Err(format!("the firmware's reader rejects the table: {reason:?}").into());
    }
    let mut pair = Pair::new(&mut host, &mut target)?;
    play(&mut pair)?;
    let agreed = pair.agreed;
    target.ask(&Request::Stop)?;
    println!(
        "{agreed} answers in {:.1} s, {} and the host equal to the bit",
        started.elapsed().as_secs_f64(),
        machine.name
    );
    Ok(())
}

/// The events and so many random scenarios of so many ticks, on a grid whose fleet answers late.
fn runs(
    pair: &mut Pair<'_, '_>,
    (scenarios, ticks): (u64, u32),
    delay_ticks: u16,
) -> Result<(), AnyError> {
    let late = |scenario| Scenario {
        delay_ticks,
        ..scenario
    };
    for bidirectional in [false, true] {
        let outcome = closed_loop(pair, &late(scenario::event(bidirectional)))?;
        tell("the paper's event", &outcome);
    }
    let outcome = closed_loop(pair, &late(scenario::recovery()))?;
    tell("the same to its end", &outcome);
    let mut sum: Option<Outcome> = None;
    for n in 0..scenarios {
        let outcome = closed_loop(pair, &late(scenario::random(n, ticks)))
            .map_err(|error| format!("random scenario {n}: {error}"))?;
        match &mut sum {
            Some(sum) => sum.add(&outcome),
            None => sum = Some(outcome),
        }
    }
    if let Some(sum) = sum {
        tell(&format!("{scenarios} random scenarios"), &sum);
    }
    Ok(())
}

fn replay(pair: &mut Pair<'_, '_>) -> Result<(), AnyError> {
    let deviations_hz = record::deviations_hz(&root().join(record::PATH))?;
    for source in [
        SourceKind::Deviation,
        SourceKind::Ade7953,
        SourceKind::ZeroCrossing,
    ] {
        let setup = Setup {
            source,
            bidirectional: source == SourceKind::Deviation,
            serial: 1,
            limit: 32_000,
            warm_up_ticks: None,
            brown_out: false,
        };
        let outcome = recorded(pair, setup, &deviations_hz)?;
        tell(&format!("9 August 2019, {source:?}"), &outcome);
    }
    Ok(())
}

fn tell(what: &str, outcome: &Outcome) {
    let [warm_up, table, outside, none, hold, safe, release, _misfit] = outcome.modes;
    println!(
        "{what}: lowest {:.3} Hz, participation up to {:.3}, faults {:#06x}; ticks: {warm_up} warm-up, \
         {table} table, {outside} outside, {none} no table, {hold} hold, {safe} safe, {release} release",
        50.0 + outcome.lowest_hz,
        outcome.most,
        outcome.faults
    );
}

fn c_interface((scenarios, ticks): (u64, u32), out: &Path, bless: bool) -> Result<(), AnyError> {
    let libraries = c_api::libraries()?;
    c_api::compare(&libraries, scenarios, ticks)?;
    c_api::package::write(&libraries, out)?;
    let said = c_api::package::build_with_cmake(out, C_EXAMPLE_TABLE)?;
    println!("the example, built by CMake with {}:", out.display());
    for line in said.lines() {
        println!("    {line}");
    }
    let mut tables = Vec::new();
    for name in C_COST_TABLES {
        tables.push((name, c_api::table(name)?));
    }
    let library = |place| c_api::library_of(place, &libraries);
    let cores = [
        library(CORTEX_M4)?,
        library(CORTEX_M0)?,
        c_api::library_for(RV32IMC, &libraries)?,
    ];
    let figures = c_api::costs::measure(cores, &tables)?;
    print!("{}", figures.text());
    Ok(figures.check("c-api.txt", bless)?)
}

fn measure(bless: bool) -> Result<(), AnyError> {
    let sizes = costs::sizes()?;
    print!("{}", sizes.text());
    let run = costs::run(&table_bytes(None)?)?;
    print!("{}", run.text());
    let lookups = lookups::lookups()?;
    print!("{}", lookups.text());
    let checks = [
        sizes.check("sizes.txt", bless),
        run.check("run.txt", bless),
        lookups.check("lookups.txt", bless),
    ];
    for check in checks {
        check?;
    }
    Ok(())
}
