//! The C program that plays a recording: compiled with a static library, run on the host or in
//! QEMU.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::calls::{FACTS, Recording};
use super::error::{CApiError, io_error, sources};
use crate::pil::qemu::ICOUNT_SHIFT;

/// Compiler of the Arm programs.
const ARM_COMPILER: &str = "arm-none-eabi-gcc";
/// What a C program of ours must compile with.
const STRICT: [&str; 5] = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"];
/// Clock of the emulated board, which its system timer counts \[MHz\].
const CLOCK_MHZ: u64 = 25;

/// Where the program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// What a person calls it.
    pub name: &'static str,
    /// Target of the library; `None` for the host.
    pub target: Option<&'static str>,
    /// The core, for the compiler.
    core: &'static [&'static str],
    /// The emulated board.
    board: &'static str,
}

/// The host.
pub const HOST: Place = Place {
    name: "C on the host",
    target: None,
    core: &[],
    board: "",
};

/// Arm's MPS2 board with a Cortex-M4F.
pub const CORTEX_M4: Place = Place {
    name: "bare C on Cortex-M4F",
    target: Some("thumbv7em-none-eabihf"),
    core: &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
    board: "mps2-an386",
};

/// The same board with code for Cortex-M0+, whose instructions are a subset: floating point is
/// software.
pub const CORTEX_M0: Place = Place {
    name: "bare C in code for Cortex-M0+",
    target: Some("thumbv6m-none-eabi"),
    core: &["-mcpu=cortex-m0plus", "-mfloat-abi=soft"],
    board: "mps2-an386",
};

/// What a target measured.
#[derive(Debug, Clone, Copy, Default)]
pub struct Measured {
    /// Bytes of a provider.
    pub state: u32,
    /// Stack of the dearest start \[bytes\].
    pub start_stack: u32,
    /// Stack of the dearest tick \[bytes\].
    pub tick_stack: u32,
    /// Instructions of the dearest start.
    pub start_instructions: u32,
    /// Instructions of the dearest tick.
    pub tick_instructions: u32,
}

impl Measured {
    fn of([state, start_stack, tick_stack, start, tick]: [u32; FACTS]) -> Self {
        // One instruction lasts 2^shift ns; rounded to the nearest.
        let instructions = |ticks: u32| {
            let nanoseconds = u64::from(ticks) * 1000 / CLOCK_MHZ;
            ((nanoseconds + (1 << (ICOUNT_SHIFT - 1))) >> ICOUNT_SHIFT) as u32
        };
        Self {
            state,
            start_stack,
            tick_stack,
            start_instructions: instructions(start),
            tick_instructions: instructions(tick),
        }
    }
}

/// Runs a program to its end; what it said where it fails.
pub fn run(command: &mut Command, what: &str) -> Result<String, CApiError> {
    let output = command
        .stdin(Stdio::null())
        .output()
        .map_err(io_error(what))?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if output.status.success() {
        return Ok(said);
    }
    let complaint = String::from_utf8_lossy(&output.stderr);
    let status = output.status;
    Err(CApiError::Failed(format!(
        "{what}: {status}\n{said}{complaint}"
    )))
}

/// Compiles C files for a bare Cortex-M and links them with the library.
///
/// # Errors
/// The compiler is missing, or does not take them.
pub fn link_bare(
    place: Place,
    files: &[&str],
    library: &Path,
    out: &Path,
) -> Result<(), CApiError> {
    let replay = sources().join("examples/replay");
    let mut compiler = Command::new(ARM_COMPILER);
    compiler
        .args(STRICT)
        .args(["-Os", "-mthumb", "-ffreestanding", "-nostdlib"])
        // Without a compiler's library either: whatever the library needs, it brings.
        .args([
            "-fno-jump-tables",
            "-ffunction-sections",
            "-Wl,--gc-sections",
        ])
        .args([
            "-Wl,-z,noexecstack",
            "-Wl,--fatal-warnings",
            "-Wl,--no-warn-rwx-segments",
        ])
        .args(place.core)
        .arg("-I")
        .arg(sources().join("include"))
        .args(files.iter().map(|file| replay.join(file)))
        .arg(library)
        .arg("-T")
        .arg(replay.join("mps2.ld"))
        .arg("-o")
        .arg(out);
    run(&mut compiler, ARM_COMPILER).map(drop)
}

/// Sections of a library that is linked alone, named as `mps2.ld` names them.
const ALONE: &str = "SECTIONS {
  .holdfast_text : { *(.text .text.*) }
  .holdfast_rodata : { *(.rodata .rodata.* .srodata .srodata.*) }
  /DISCARD/ : { *(.eh_frame .eh_frame.*) }
}
ASSERT(SIZEOF(.data) + SIZEOF(.sdata) + SIZEOF(.bss) + SIZEOF(.sbss) == 0, \"the library has variables\")
";

/// Links what these functions of a library need, and nothing else, where no C compiler is at hand:
/// by the linker that comes with the Rust compiler. What they call is all in the library.
///
/// # Errors
/// The linker is missing, or something that is called is.
pub fn link_alone(library: &Path, functions: &[&str], out: &Path) -> Result<(), CApiError> {
    let mut rustc = Command::new("rustc");
    let place = run(rustc.args(["--print", "target-libdir"]), "rustc")?;
    let linker = Path::new(place.trim()).join("../bin/rust-lld");
    let script = out.with_extension("ld");
    fs::write(&script, ALONE).map_err(io_error("linker script"))?;
    let mut linker = Command::new(linker);
    linker
        .args(["-flavor", "gnu", "--gc-sections", "--no-undefined"])
        .args(functions.iter().map(|name| format!("--undefined={name}")))
        .args(functions.first().map(|name| format!("--entry={name}")))
        .arg("--script")
        .args([script.as_path(), library])
        .arg("-o")
        .arg(out);
    run(&mut linker, "rust-lld").map(drop)
}

/// Compiles the replay for a place and says where it is.
///
/// # Errors
/// A compiler is missing, or does not take it.
pub fn replay(place: Place, library: &Path, folder: &Path) -> Result<PathBuf, CApiError> {
    let out = folder.join("replay");
    if place.target.is_some() {
        link_bare(place, &["replay.c", "cortex_m.c"], library, &out)?;
        return Ok(out);
    }
    let replay = sources().join("examples/replay");
    let mut compiler = Command::new("cc");
    compiler
        .args(STRICT)
        .args(["-O2", "-I"])
        .arg(sources().join("include"))
        .args(["replay.c", "host.c"].map(|file| replay.join(file)))
        .arg(library)
        // What the standard library under a host's static library asks for.
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&out);
    run(&mut compiler, "cc")?;
    Ok(out)
}

/// Plays a recording and compares; what the target measured. `count` makes the emulator's clock
/// follow the instructions.
///
/// # Errors
/// The program does not run, or its answers differ.
pub fn play(
    place: Place,
    library: &Path,
    recording: &Recording<'_>,
    count: bool,
) -> Result<Measured, CApiError> {
    let folder = tempfile::tempdir().map_err(io_error("temporary folder"))?;
    let program = replay(place, library, folder.path())?;
    fs::write(folder.path().join("calls"), recording.calls()).map_err(io_error("calls"))?;
    let mut command = if place.target.is_some() {
        let mut qemu = Command::new("qemu-system-arm");
        qemu.args(["-machine", place.board, "-display", "none"])
            .args(["-monitor", "none", "-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native"]);
        if count {
            qemu.args(["-icount", &format!("shift={ICOUNT_SHIFT},sleep=off")]);
        }
        qemu.arg("-kernel").arg(&program);
        qemu
    } else {
        Command::new(&program)
    };
    run(command.current_dir(folder.path()), place.name)?;
    let found = fs::read(folder.path().join("answers")).map_err(io_error("answers"))?;
    recording.compare(&found).map(Measured::of)
}
