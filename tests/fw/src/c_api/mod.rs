//! The C interface: its static libraries, a bare C program in QEMU against the host, what it costs,
//! and the folder that other builds take.
//!
//! | module | what |
//! |---|---|
//! | [`library`] | the static library of each core |
//! | [`calls`] | a recording: calls, and what the library itself answers to them |
//! | [`chargers`] | scenarios of the processor in the loop as calls from C |
//! | [`program`] | the C program that plays a recording: compiled, run on the host and in QEMU |
//! | [`costs`] | bytes, stack and instructions, compared with what is committed |
//! | [`package`] | the folder with header, libraries and CMake files, built with once |

pub mod calls;
pub mod chargers;
pub mod costs;
mod error;
pub mod library;
pub mod package;
pub mod program;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use sha2::Digest;

use crate::root;
use calls::Recording;
use chargers::Tally;
pub use error::CApiError;
use error::io_error;
use program::{CORTEX_M0, CORTEX_M4, HOST, Place};

/// Tables of the C programs: by games, with commands that act late, responses, both directions.
pub const TABLES: [&str; 6] = [
    "paper-bi",
    "paper-uni",
    "gb-bi",
    "gb-uni",
    "gb-bi-band",
    "gb-bi-delay",
];
/// A table that is none is among them: one scenario in seven runs on the droop.
const REJECTED: [u8; 64] = [0xFF; 64];
/// Random scenarios for code for Cortex-M0+.
const M0_SCENARIOS_MAX: u64 = 200;

/// The shipped table of a name.
///
/// # Errors
/// It cannot be read.
pub fn table(name: &str) -> Result<Vec<u8>, CApiError> {
    let path = root().join(format!("firmware/tables/{name}.bin"));
    fs::read(&path).map_err(io_error(path.display().to_string()))
}

/// The static library of each target, that of the host under the name `host`.
///
/// # Errors
/// As [`library::build`].
pub fn libraries() -> Result<Vec<(&'static str, PathBuf)>, CApiError> {
    let bare = library::CORES.map(|core| (core, Some(core)));
    [("host", None)]
        .into_iter()
        .chain(bare)
        .map(|(name, target)| Ok((name, library::build(target)?)))
        .collect()
}

/// The library of a place among those built.
///
/// # Errors
/// It is not there.
pub fn library_of<'l>(
    place: Place,
    libraries: &'l [(&'static str, PathBuf)],
) -> Result<&'l Path, CApiError> {
    library_for(place.target.unwrap_or("host"), libraries)
}

/// The library of a target among those built.
///
/// # Errors
/// It is not there.
pub fn library_for<'l>(
    name: &str,
    libraries: &'l [(&'static str, PathBuf)],
) -> Result<&'l Path, CApiError> {
    libraries
        .iter()
        .find(|(target, _)| *target == name)
        .map(|(_, path)| path.as_path())
        .ok_or_else(|| CApiError::Failed(format!("no library for {name}")))
}

/// Records the event over each table and so many random scenarios, plays them on the host and on
/// both cores, and compares to the bit.
///
/// # Errors
/// A program cannot be built or run, or an answer differs.
pub fn compare(
    libraries: &[(&'static str, PathBuf)],
    scenarios: u64,
    ticks: u32,
) -> Result<(), CApiError> {
    let mut tables = Vec::new();
    for name in TABLES {
        tables.push(table(name)?);
    }
    tables.push(REJECTED.to_vec());
    for (place, scenarios) in [
        (HOST, scenarios),
        (CORTEX_M4, scenarios),
        (CORTEX_M0, scenarios.min(M0_SCENARIOS_MAX)),
    ] {
        let started = Instant::now();
        let mut recording = Recording::new(&tables, false);
        let mut tally = Tally::default();
        for n in 0..tables.len() {
            chargers::event(&mut recording, &tables, n, &mut tally)?;
        }
        for n in 0..scenarios {
            chargers::random(&mut recording, &tables, n, ticks, &mut tally)?;
        }
        if place == HOST {
            println!("{tally}");
        }
        program::play(place, library_of(place, libraries)?, &recording, false)?;
        let digest = sha2::Sha256::digest(recording.answers());
        let digest: String = digest
            .iter()
            .take(8)
            .map(|byte| format!("{byte:02x}"))
            .collect();
        println!(
            "{}: the event over {} tables and {scenarios} random scenarios, {} ticks, answers {digest}, equal to \
             the bit; {:.1} s",
            place.name,
            tables.len(),
            tally.ticks,
            started.elapsed().as_secs_f64(),
        );
    }
    Ok(())
}
