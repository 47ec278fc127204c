//! Link arguments, memory map and table of the images.
//!
//! Nothing here applies to the host or to a build of the library alone. The memory map is copied
//! into the build's own folder, so that the linker finds it from whatever folder cargo was started
//! in.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// The table that `holdfast` carries unless `HOLDFAST_TABLE` names another, from the workspace's
/// root.
const TABLE_DEFAULT: &str = "firmware/tables/paper-bi.bin";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=HOLDFAST_TABLE");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if !is("CARGO_CFG_TARGET_OS", "none") {
        return Ok(());
    }
    // The reference board's map, and that of the emulated RISC-V board. The linker looks into the
    // folder it is started in first, which may hold the other, so the names differ.
    let (map, name) = if is("CARGO_CFG_TARGET_ARCH", "arm") {
        ("memory.x", "memory.x")
    } else {
        ("firmware/images/memory/riscv-virt.x", "riscv-virt.x")
    };
    let folder = |name: &str| env::var_os(name).map(PathBuf::from).unwrap_or_default();
    let root = folder("CARGO_MANIFEST_DIR").join("..");
    let out = folder("OUT_DIR");
    let memory = root.join(map);
    println!("cargo::rerun-if-changed={}", memory.display());
    fs::copy(&memory, out.join(name))?;
    println!("cargo::rustc-link-search={}", out.display());
    // Sections must not be padded to pages; the runtime's script comes from cortex-m-rt or
    // riscv-rt, and the latter leaves it to us to include the map.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    if name != "memory.x" {
        println!("cargo::rustc-link-arg-bins=-T{name}");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    table(&root, &out)
}

/// Copies the table to where the image includes it. Without a table the section stays empty: the
/// charger then starts with the droop until a table is flashed.
fn table(root: &Path, out: &Path) -> io::Result<()> {
    let named = env::var_os("HOLDFAST_TABLE");
    let path = root.join(named.clone().unwrap_or_else(|| TABLE_DEFAULT.into()));
    println!("cargo::rerun-if-changed={}", path.display());
    let bytes = if named.is_none() && !path.exists() {
        println!("cargo::warning={TABLE_DEFAULT} is missing: the image carries no table");
        Vec::new()
    } else {
        fs::read(&path).map_err(|error| {
            let message = format!("table {}: {error}", path.display());
            io::Error::new(error.kind(), message)
        })?
    };
    fs::write(out.join("table.bin"), bytes)
}
