//! What the C interface costs: bytes of the linked library, of a provider and of the stack,
//! instructions of a tick. Compared with `firmware/expected/c-api.txt`, by the rules of
//! [`crate::costs`].

use std::path::Path;

use super::calls::Recording;
use super::chargers::{self, Tally};
use super::error::{CApiError, io_error};
use super::program::{self, CORTEX_M0, CORTEX_M4, Place};
use crate::costs::count;
use crate::figures::{Figures, compiler};
use crate::images::Elf;

/// Goal for code and constants on a Cortex-M4F \[bytes\].
const M4_CODE_MAX: u32 = 14 * 1024;
/// Goal for code and constants on a Cortex-M0+ \[bytes\].
const M0_CODE_MAX: u32 = 18 * 1024;
/// Goal for a provider \[bytes\].
const STATE_MAX: u32 = 1024;
/// Goal for a tick on a Cortex-M4F \[instructions\].
const TICK_MAX: u32 = 3_500;
/// Random scenarios with faults for the worst tick.
const SCENARIOS: u64 = 60;
/// Ticks of each.
const TICKS: u32 = 600;

/// Sections of the library in a linked program, by `mps2.ld`.
const SECTIONS: [&str; 2] = [".holdfast_text", ".holdfast_rodata"];

/// What `size.c` calls of the library, and what `replay.c` calls beside.
const PROVIDER: [&str; 5] = [
    "holdfast_init",
    "holdfast_tick",
    "holdfast_tick_ms",
    "holdfast_read_table",
    "holdfast_default_config",
];
const CROSSINGS: [&str; 3] = [
    "holdfast_captures_init",
    "holdfast_captures_add",
    "holdfast_captures_read",
];

/// A core, its library, and its goal for code.
struct Core<'p> {
    name: &'static str,
    place: Place,
    library: &'p Path,
    code_max: u32,
}

/// Measures all; the libraries are those of the M4F, the M0+ and RV32IMC.
///
/// # Errors
/// A program cannot be linked or run, or its answers differ from the library's.
pub fn measure(
    [m4, m0, riscv]: [&Path; 3],
    tables: &[(&str, Vec<u8>)],
) -> Result<Figures, CApiError> {
    let mut figures = Figures::default();
    figures.note(&compiler());
    let folder = tempfile::tempdir().map_err(io_error("temporary folder"))?;
    let cores = [
        Core {
            name: "Cortex-M4F",
            place: CORTEX_M4,
            library: m4,
            code_max: M4_CODE_MAX,
        },
        Core {
            name: "Cortex-M0+",
            place: CORTEX_M0,
            library: m0,
            code_max: M0_CODE_MAX,
        },
    ];
    for core in &cores {
        code(core, folder.path(), &mut figures)?;
    }
    code_alone(riscv, folder.path(), &mut figures)?;
    let [m4, _] = &cores;
    let mut first = true;
    for (name, bytes) in tables {
        let one = [bytes.clone()];
        let mut recording = Recording::new(&one, true);
        let mut tally = Tally::default();
        chargers::event(&mut recording, &one, 0, &mut tally)?;
        for n in 0..SCENARIOS {
            chargers::random(&mut recording, &one, n, TICKS, &mut tally)?;
        }
        let measured = program::play(m4.place, m4.library, &recording, true)?;
        if first {
            let line = "provider, Cortex-M4F";
            figures.line(line, measured.state, "bytes", Some(STATE_MAX));
            first = false;
        }
        let mut line = |what: &str, value, unit, goal| {
            figures.line(&format!("{name} {what}, Cortex-M4F"), value, unit, goal);
        };
        line(
            "stack of holdfast_init",
            measured.start_stack,
            "bytes",
            None,
        );
        line("stack of holdfast_tick", measured.tick_stack, "bytes", None);
        let start = measured.start_instructions;
        line("holdfast_init", start, "instructions", None);
        let tick = measured.tick_instructions;
        line("holdfast_tick", tick, "instructions", Some(TICK_MAX));
    }
    Ok(figures)
}

/// Code and constants of a program that uses the provider alone, and of one that uses the window of
/// crossings too; and what must not be in either.
fn code(core: &Core<'_>, folder: &Path, figures: &mut Figures) -> Result<(), CApiError> {
    let programs = [
        ("provider", "size.c", Some(core.code_max)),
        ("provider and crossings", "replay.c", None),
    ];
    for (what, file, goal) in programs {
        let out = folder.join("linked");
        program::link_bare(core.place, &[file, "cortex_m.c"], core.library, &out)?;
        let name = format!("{what}, {}", core.name);
        measured(&name, &Elf::read(&out)?, goal, figures)?;
    }
    Ok(())
}

/// The same for RV32IMC, where no C compiler is at hand: the functions that those programs call.
fn code_alone(library: &Path, folder: &Path, figures: &mut Figures) -> Result<(), CApiError> {
    let both = [&PROVIDER[..], &CROSSINGS].concat();
    for (what, functions) in [
        ("provider", &PROVIDER[..]),
        ("provider and crossings", &both),
    ] {
        let out = folder.join("alone");
        program::link_alone(library, functions, &out)?;
        measured(
            &format!("{what}, RV32IMC"),
            &Elf::read(&out)?,
            None,
            figures,
        )?;
    }
    Ok(())
}

/// The library's bytes in a linked program, and what must not be in it.
fn measured(
    name: &str,
    elf: &Elf,
    goal: Option<u32>,
    figures: &mut Figures,
) -> Result<(), CApiError> {
    let sections = elf.sections()?;
    let sections = sections.iter();
    let bytes = sections
        .filter(|section| SECTIONS.contains(&section.name.as_str()))
        .map(|section| section.size)
        .sum();
    figures.line(&format!("{name}: code and constants"), bytes, "bytes", goal);
    let symbols = elf.symbols()?;
    let forbidden = [
        (
            "panic functions",
            &["panicking", "panic_fmt", "unwrap_failed", "expect_failed"][..],
        ),
        (
            "allocation functions",
            &["__rust_alloc", "__rg_alloc", "5alloc"],
        ),
    ];
    for (kind, parts) in forbidden {
        let found = count(&symbols, parts);
        figures.line(&format!("{name}: {kind}"), found, "symbols", Some(0));
    }
    Ok(())
}
