//! The unmodified images on an emulated board: `cargo fw board`.
//!
//! The model of the board and its scenarios are a Python program beside this package
//! (`tests/fw/board`), which runs the emulator `unicorn` from its wheel: a process of its own, so
//! that nothing of the emulator's licence reaches these packages. What an image asked of its
//! hardware and was told comes back as tapes, and [`repeat`] plays them to the same code on the
//! host.

pub mod repeat;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use ed25519_dalek::{Signer as _, SigningKey};
use update::class::DeviceClass;
use update::container::{Header, Validity};
use update::key::DEVELOPMENT_SEED;

use crate::figures::{CostError, Figures, compiler};
use crate::images::{self, ImageError, TARGET};
use crate::root;
use crate::table_fit::Built;

/// What the environment gets from PyPI, each at a version that is known to do.
const PACKAGES: [&str; 2] = ["unicorn==2.1.4", "pyelftools==0.33"];
/// The program, from the workspace's root.
const PROGRAM: &str = "tests/fw/board/main.py";

/// Why the board says no.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// Scenarios do not hold; they are printed above.
    #[error("scenarios of the board do not hold")]
    Fails,
    /// Host and image differ.
    #[error("{tape}: host and image differ: {what}")]
    Differs {
        /// The tape.
        tape: String,
        /// Where.
        what: String,
    },
    /// An image.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A figure differs from what is committed.
    #[error(transparent)]
    Cost(#[from] CostError),
    /// A tool or a file.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// A tool said no, or the command line was wrong; its message is above.
    #[error("{0} failed")]
    Tool(String),
}

fn io_error(what: impl Into<String>) -> impl FnOnce(io::Error) -> BoardError {
    let what = what.into();
    |source| BoardError::Io { what, source }
}

/// Runs a program and says with which code it ended; -1 for a signal.
fn run(program: &Path, arguments: &[&str]) -> Result<i32, BoardError> {
    let mut command = Command::new(program);
    let status = command.args(arguments).current_dir(root()).status();
    let status = status.map_err(io_error(program.display().to_string()))?;
    Ok(status.code().unwrap_or(-1))
}

fn must(program: &Path, arguments: &[&str]) -> Result<(), BoardError> {
    match run(program, arguments)? {
        0 => Ok(()),
        _ => Err(BoardError::Tool(format!(
            "{} {}",
            program.display(),
            arguments.join(" ")
        ))),
    }
}

/// An environment with the emulator; made once.
fn environment(folder: &Path) -> Result<PathBuf, BoardError> {
    let python = folder.join("bin/python");
    let packages = "import unicorn, elftools; assert unicorn.__version__ == '2.1.4'";
    if python.exists() && run(&python, &["-c", packages])? == 0 {
        return Ok(python);
    }
    must(
        Path::new("python3"),
        &["-m", "venv", "--clear", &folder.to_string_lossy()],
    )?;
    let pip = [
        "-m",
        "pip",
        "--disable-pip-version-check",
        "install",
        "--quiet",
    ];
    must(&python, &[&pip[..], &PACKAGES].concat())?;
    Ok(python)
}

/// The folder with every image of the product as ELF, built with its shipped table.
fn built(folder: PathBuf) -> Result<PathBuf, BoardError> {
    fs::create_dir_all(&folder).map_err(io_error("folder of the images"))?;
    for Built { image, .. } in Built::all() {
        let elf = images::build(image, TARGET)?;
        let copy = folder.join(format!("{}.elf", image.name));
        fs::copy(&elf, copy).map_err(io_error(elf.display().to_string()))?;
    }
    Ok(folder)
}

/// Containers that the scenarios send: name, table, class, version.
const CONTAINERS: [(&str, &str, DeviceClass, u32); 3] = [
    (
        "first",
        "gb-uni-ade7953",
        DeviceClass::reference(false, false),
        1,
    ),
    ("second", "gb-uni", DeviceClass::reference(false, false), 2),
    ("foreign", "gb-bi", DeviceClass::reference(true, false), 3),
];

/// Writes the containers, signed with the key of experiments, which the images trust.
fn containers(folder: &Path) -> Result<(), BoardError> {
    fs::create_dir_all(folder).map_err(io_error("folder of the containers"))?;
    let key = SigningKey::from_bytes(&DEVELOPMENT_SEED);
    for (name, table, class, version) in CONTAINERS {
        let path = root().join(format!("firmware/tables/{table}.bin"));
        let table = fs::read(&path).map_err(io_error(path.display().to_string()))?;
        let header = Header {
            table_len: table.len() as u32,
            class,
            version,
            validity: Validity::ALWAYS,
        };
        let mut bytes = [&header.write()[..], &table].concat();
        let signature = key.sign(&bytes);
        bytes.extend(signature.to_bytes());
        let path = folder.join(format!("{name}.hfsc"));
        fs::write(&path, bytes).map_err(io_error(path.display().to_string()))?;
    }
    Ok(())
}

/// Plays scenarios, all that run by themselves unless some are named, and repeats them on the host.
/// `images` is a folder of ELF files in place of what is built now. `bless` takes over the deepest
/// stacks, which all scenarios that run by themselves give.
///
/// # Errors
/// A scenario does not hold, host and image differ, or a tool is missing.
pub fn play(scenarios: &[String], images: Option<PathBuf>, bless: bool) -> Result<(), BoardError> {
    let folder = root().join("target/board");
    let tapes = folder.join("tapes");
    match fs::remove_dir_all(&tapes) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(io_error("folder of the tapes")(error));
        }
        _ => {}
    }
    fs::create_dir_all(&tapes).map_err(io_error("folder of the tapes"))?;
    let python = environment(&folder.join("environment"))?;
    let own = images.is_none();
    let images = match images {
        Some(images) => images,
        None => built(folder.join("images"))?,
    };
    containers(&tapes.join("containers"))?;
    let (images, tapes_text) = (images.to_string_lossy(), tapes.to_string_lossy());
    let mut arguments = vec![PROGRAM, &images, "firmware/tables", &tapes_text];
    arguments.extend(scenarios.iter().map(String::as_str));
    match run(&python, &arguments)? {
        0 => {}
        1 => return Err(BoardError::Fails),
        _ => return Err(BoardError::Tool(PROGRAM.to_owned())),
    }
    if !own {
        return Ok(());
    }
    if scenarios.is_empty() {
        stacks(&tapes, bless)?;
    }
    compare(&tapes)
}

/// Compares the deepest stack of each image with what is committed, or takes it over.
fn stacks(folder: &Path, bless: bool) -> Result<(), BoardError> {
    let path = folder.join("stacks");
    let text = fs::read_to_string(&path).map_err(io_error(path.display().to_string()))?;
    let mut figures = Figures::default();
    figures.note(&compiler());
    for (image, bytes) in text.lines().filter_map(|line| line.split_once(' ')) {
        let name = format!("{image} stack, deepest of all scenarios");
        figures.line(&name, bytes.parse().unwrap_or(u32::MAX), "bytes", None);
    }
    print!("{}", figures.text());
    Ok(figures.check("board.txt", bless)?)
}

/// Repeats every tape of a folder on the host.
fn compare(tapes: &Path) -> Result<(), BoardError> {
    let mut repeated = 0;
    let (mut bytes, mut turns) = (0, 0);
    for entry in fs::read_dir(tapes).map_err(io_error("folder of the tapes"))? {
        let path = entry.map_err(io_error("folder of the tapes"))?.path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if path.extension().is_none_or(|extension| extension != "tape") {
            continue;
        }
        let image = name.rsplit('.').next().unwrap_or_default();
        let Some(product) = Built::all().into_iter().find(|b| b.image.name == image) else {
            continue;
        };
        let told = fs::read(&path).map_err(io_error(path.display().to_string()))?;
        let table = product.default_table();
        let table = fs::read(&table).map_err(io_error(table.display().to_string()))?;
        let done =
            repeat::repeat(&told, &table, image.contains("bidirectional")).map_err(|what| {
                BoardError::Differs {
                    tape: name.to_string(),
                    what,
                }
            })?;
        repeated += 1;
        bytes += done.bytes;
        turns += done.turns;
    }
    if repeated == 0 {
        println!("no scenario to repeat on the host");
    } else {
        println!(
            "{repeated} runs repeated on the host: {turns} turns of the loop, {bytes} bytes of \
             telemetry, equal to the bit"
        );
    }
    Ok(())
}
