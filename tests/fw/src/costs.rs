//! What the firmware costs, measured and compared with what is committed.
//!
//! | file in firmware/expected | holds | measured by |
//! |---|---|---|
//! | `sizes.txt` | flash and static RAM by section, panics, allocation, float text | ELF files |
//! | `run.txt` | stack, instructions of a lookup and of a tick | QEMU: paint, timer by `-icount` |
//! | `lookups.txt` | the dearest lookup of every shipped table: [`crate::lookups`] | QEMU |
//! | `board.txt` | stack of the product's images: `cargo fw board` | emulated board: paint |
//! | `c-api.txt` | the same of the C interface: `cargo fw c-api` | C programs, linked and run |
//!
//! What a figure is held against: [`crate::figures`].

use std::fs;
use std::io::Write as _;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use firmware::link::Request;
use firmware::link::session::{Session, Wires};

use crate::figures::{CostError, Figures, compiler, io_error};
use crate::images::{self, BARE, Elf, HOLDFAST, PIL, PRODUCTS};
use crate::lookups::{self, LOOKUP_MAX};
use crate::pil::machine::CORTEX_M4;
use crate::pil::qemu::{Target, instructions};
use crate::pil::run::{Pair, closed_loop};
use crate::pil::scenario;

/// Goal for code and constants of the charger without a HAL \[bytes\].
const CORE_MAX: u32 = 16 * 1024;
/// Goal for variables and stack \[bytes\].
const RAM_MAX: u32 = 4 * 1024;
/// Goal for a tick \[instructions\].
const TICK_MAX: u32 = 3_500;
/// What the runtime paints unused stack with.
const PAINT: [u8; 4] = [0xCC; 4];
/// How long the charger without a HAL runs before its stack is read: many rounds of what it plays.
const PAINTED_RUN: Duration = Duration::from_secs(4);
/// Random scenarios with faults for the worst tick.
const SCENARIOS: u64 = 60;

/// Demangled enough to search in: the path parts are in the mangled name as they are.
pub(crate) fn count(symbols: &[String], parts: &[&str]) -> u32 {
    let hit = |name: &&String| parts.iter().any(|part| name.contains(part));
    symbols.iter().filter(hit).count() as u32
}

/// Flash and static RAM, and what must not be in the charger at all.
///
/// # Errors
/// An image cannot be built or read.
pub fn sizes() -> Result<Figures, CostError> {
    let mut figures = Figures::default();
    figures.note(&compiler());
    for image in PRODUCTS.into_iter().chain([BARE]) {
        let elf = Elf::read(&images::build(image, images::TARGET)?)?;
        let (mut ram, mut code) = (0, 0);
        // The product's other builds differ in a driver: their sums say it.
        let by_section = image == BARE || image == HOLDFAST;
        for section in elf.sections()? {
            // The table is the spec's business, not the code's: `table-gen budget` tells its size.
            if section.name == ".holdfast_table" {
                continue;
            }
            let name = format!("{} {}", image.name, section.name);
            if by_section {
                figures.line(&name, section.size, "bytes", None);
            }
            if section.in_ram {
                ram += section.size;
            }
            // The vectors belong to the processor; a charger beside other code has them already.
            if section.in_flash && section.name != ".vector_table" {
                code += section.size;
            }
        }
        let bare = image == BARE;
        let name = format!("{} code and constants", image.name);
        figures.line(&name, code, "bytes", bare.then_some(CORE_MAX));
        let name = format!("{} static RAM", image.name);
        figures.line(&name, ram, "bytes", Some(RAM_MAX));
        let symbols = elf.symbols()?;
        let checks = [
            (
                "panic functions",
                &["panicking", "panic_fmt", "unwrap_failed", "expect_failed"][..],
            ),
            (
                "allocation functions",
                &["__rust_alloc", "__rg_alloc", "5alloc"],
            ),
            (
                "float formatting functions",
                &["flt2dec", "float_to_decimal", "float_to_general"],
            ),
        ];
        for (what, parts) in checks {
            let name = format!("{} {what}", image.name);
            figures.line(&name, count(&symbols, parts), "symbols", Some(0));
        }
    }
    Ok(figures)
}

/// Stack and instructions.
///
/// # Errors
/// An image cannot be built, QEMU cannot run it, or it disagrees with the host.
pub fn run(table: &[u8]) -> Result<Figures, CostError> {
    let mut figures = Figures::default();
    figures.note(&compiler());
    // The CRC that the table carries: that of bytes with their own CRC behind them is the same for
    // every table.
    let crc = table
        .last_chunk::<4>()
        .map_or(0, |crc| u32::from_le_bytes(*crc));
    figures.note(&format!("table of {} bytes, CRC {crc:08x}", table.len()));
    let bare = Elf::read(&images::build(BARE, images::TARGET)?)?;
    let stack = painted_stack(&bare, table)?;
    let ram: u32 = bare
        .sections()?
        .iter()
        .filter(|s| s.in_ram)
        .map(|s| s.size)
        .sum();
    figures.line("bare stack, whole program", stack, "bytes", None);
    figures.line(
        "bare stack and static RAM",
        stack + ram,
        "bytes",
        Some(RAM_MAX),
    );

    let pil = images::build(PIL, images::TARGET)?;
    let mut target = Target::start(CORTEX_M4, &pil, table, true)?;
    let wires = Wires::default();
    let mut host = Session::new(&wires, table);
    let mut pair = Pair::new(&mut host, &mut target)?;
    for bidirectional in [false, true] {
        closed_loop(&mut pair, &scenario::event(bidirectional))?;
    }
    let event = std::mem::take(&mut pair.worst);
    figures.line(
        "tick, the paper's event",
        instructions(event.0),
        "instructions",
        Some(TICK_MAX),
    );
    for n in 0..SCENARIOS {
        closed_loop(&mut pair, &scenario::random(n, 600))?;
    }
    let worst = pair.worst;
    figures.line(
        "tick, random scenarios with faults",
        instructions(worst.0),
        "instructions",
        Some(TICK_MAX),
    );
    figures.line(
        "stack of a tick, random scenarios with faults",
        worst.1.max(event.1),
        "bytes",
        None,
    );
    let lookup = lookups::dearest(&mut target, table)?;
    figures.line(
        "lookup with quantiser",
        lookup,
        "instructions",
        Some(LOOKUP_MAX),
    );
    target.ask(&Request::Stop)?;
    Ok(figures)
}

/// Bytes of stack that the charger without a HAL ever used, from a dump of the emulator's RAM.
fn painted_stack(elf: &Elf, table: &[u8]) -> Result<u32, CostError> {
    let bottom = elf
        .symbol("_stack_end")?
        .ok_or(CostError::Symbol("_stack_end"))?;
    let top = elf
        .symbol("_stack_start")?
        .ok_or(CostError::Symbol("_stack_start"))?;
    let folder = tempfile::tempdir().map_err(io_error("temporary folder"))?;
    let (image, table_file) = (
        folder.path().join("bare.elf"),
        folder.path().join("table.bin"),
    );
    elf.save(&image)?;
    fs::write(&table_file, table).map_err(io_error("table.bin"))?;
    let dump = folder.path().join("stack.bin");
    let loader = format!(
        "loader,file={},addr={:#x},force-raw=on",
        table_file.display(),
        elf.table_start()?
    );
    emulate(&image, &loader, &dump, bottom..top)?;
    let stack = fs::read(&dump).map_err(io_error("dump of the emulator's stack"))?;
    let untouched = stack.chunks_exact(4).take_while(|word| **word == PAINT);
    Ok((stack.len() - 4 * untouched.count()) as u32)
}

/// Runs an image with a table for a while, then dumps a stretch of memory.
fn emulate(image: &Path, loader: &str, dump: &Path, memory: Range<u32>) -> Result<(), CostError> {
    let mut qemu = Command::new("qemu-system-arm")
        .args([
            "-machine",
            "netduinoplus2",
            "-display",
            "none",
            "-serial",
            "none",
        ])
        .args(["-monitor", "stdio", "-device", loader, "-kernel"])
        .arg(image)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .map_err(io_error("qemu-system-arm"))?;
    std::thread::sleep(PAINTED_RUN);
    if let Some(monitor) = &mut qemu.stdin {
        let commands = format!(
            "pmemsave {} {} \"{}\"\nquit\n",
            memory.start,
            memory.len(),
            dump.display()
        );
        monitor
            .write_all(commands.as_bytes())
            .map_err(io_error("QEMU's monitor"))?;
    }
    qemu.wait().map_err(io_error("qemu-system-arm"))?;
    Ok(())
}
