//! The static library of each core, built by cargo with whole-program optimisation; that of the
//! host without.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::error::{CApiError, io_error};
use crate::root;

/// Target of RISC-V cores without floating point.
pub const RV32IMC: &str = "riscv32imc-unknown-none-elf";
/// Cores that the library is built for, beside the host.
pub const CORES: [&str; 3] = ["thumbv7em-none-eabihf", "thumbv6m-none-eabi", RV32IMC];
/// Name of the library's file.
pub const FILE: &str = "libholdfast.a";

/// Builds the library for a target, or for the host, and says where it is.
///
/// # Errors
/// Cargo is not there, or does not build it.
pub fn build(target: Option<&str>) -> Result<PathBuf, CApiError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["rustc", "--package", "c-api", "--lib"])
        .args(["--crate-type", "staticlib"])
        // The host's is for tests: the profile of everything else on the host.
        .args(match target {
            Some(target) => vec!["--profile", "firmware", "--target", target],
            None => vec!["--release"],
        })
        .args(["--message-format", "json-render-diagnostics"])
        .current_dir(root())
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(io_error("cargo rustc"))?;
    let failed = || CApiError::Failed(format!("cargo did not build {FILE} for {target:?}"));
    if !output.status.success() {
        return Err(failed());
    }
    let files = String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| message["filenames"].as_array().cloned())
        .flatten()
        .filter_map(|file| Some(PathBuf::from(file.as_str()?)))
        .filter(|file| file.ends_with(FILE))
        .collect::<Vec<_>>();
    files.into_iter().next().ok_or_else(failed)
}
