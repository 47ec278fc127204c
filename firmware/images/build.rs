//! Link arguments, memory map, table and identity of the images.
//!
//! Nothing here applies to the host or to a build of the library alone. The memory map is copied
//! into the build's own folder, so that the linker finds it from whatever folder cargo was started
//! in.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// The table that `holdfast` carries unless `HOLDFAST_TABLE` names another, from the workspace's
/// root: for its direction, and for its meter.
fn shipped_table() -> String {
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let direction = if has("BIDIRECTIONAL") { "bi" } else { "uni" };
    let chip = if has("ADE7953") { "-ade7953" } else { "" };
    format!("firmware/tables/gb-{direction}{chip}.bin")
}

/// Boards and their memory maps, from the package's folder.
const BOARDS: &str = "boards";
/// The map of the board that is built, in the build's own folder.
const MAP: &str = "board.x";
/// Map of the reference board, which is built unless a feature has the name of another map.
const REFERENCE_MAP: &str = "stm32f405.x";
/// Map of the emulated RISC-V board.
const RISCV_MAP: &str = "riscv-virt.x";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=HOLDFAST_TABLE");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if !is("CARGO_CFG_TARGET_OS", "none") {
        return Ok(());
    }
    let folder = |name: &str| env::var_os(name).map(PathBuf::from).unwrap_or_default();
    let package = folder("CARGO_MANIFEST_DIR");
    let root = package.join("../..");
    let out = folder("OUT_DIR");
    let arm = is("CARGO_CFG_TARGET_ARCH", "arm");
    let map = package.join(BOARDS).join(if arm {
        board(&package)?
    } else {
        RISCV_MAP.to_owned()
    });
    println!("cargo::rerun-if-changed={}", map.display());
    // The linker looks into the folder it is started in first, so no map may lie there by this
    // name.
    fs::copy(&map, out.join(MAP))?;
    println!("cargo::rustc-link-search={}", out.display());
    if arm {
        let memory = root.join("memory.x");
        println!("cargo::rerun-if-changed={}", memory.display());
        fs::copy(&memory, out.join("memory.x"))?;
    }
    // Sections must not be padded to pages; the runtime's script comes from cortex-m-rt or
    // riscv-rt, and the latter leaves it to us to include the map.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    if !arm {
        println!("cargo::rustc-link-arg-bins=-T{MAP}");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    table(&root, &out)?;
    let (trusted, note) = trusted(&root)?;
    let build = format!("{} {}{note}", env!("CARGO_PKG_VERSION"), commit(&root));
    let built = format!(
        "pub(crate) const BUILD: &str = {build:?};\n\
         pub(crate) const TRUSTED: update::key::PublicKey = update::key::PublicKey{trusted};\n"
    );
    fs::write(out.join("built.rs"), built)
}

/// What git says in the workspace's root.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .current_dir(root)
        .args(arguments)
        .output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// The commit that is built: eight digits, seven and a `+` where what the images are made of
/// differs from it, `unknown` outside a checkout.
fn commit(root: &Path) -> String {
    let Some(commit) = git(root, &["rev-parse", "--short=8", "HEAD"]) else {
        return "unknown".to_owned();
    };
    // Asked again when a commit is made or left, and when sources change.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(root, &["rev-parse", "--git-path", name]) {
            let path = root.join(path);
            if path.exists() {
                println!("cargo::rerun-if-changed={}", path.display());
            }
        }
    }
    let made_of = ["firmware", "memory.x", "Cargo.toml", "Cargo.lock"];
    for name in made_of {
        println!("cargo::rerun-if-changed={}", root.join(name).display());
    }
    let changed = ["status", "--porcelain", "--untracked-files=no", "--"];
    match git(root, &[&changed[..], &made_of].concat()) {
        Some(text) if text.is_empty() => commit,
        _ => format!("{}+", commit.get(..7).unwrap_or(&commit)),
    }
}

/// The public key whose tables the charger takes by update, as Rust, and what the build's name says
/// of it: that in the file that `HOLDFAST_TRUST` names, or the key of experiments, which is told.
fn trusted(root: &Path) -> io::Result<(String, &'static str)> {
    println!("cargo::rerun-if-env-changed=HOLDFAST_TRUST");
    let Some(path) = env::var_os("HOLDFAST_TRUST") else {
        println!(
            "cargo::warning=the image trusts the key of experiments, whose private half everybody \
             has; HOLDFAST_TRUST=FILE names another"
        );
        return Ok(("::DEVELOPMENT".to_owned(), " dev-key"));
    };
    let path = root.join(path);
    println!("cargo::rerun-if-changed={}", path.display());
    let bad = |what: String| {
        let message = format!("HOLDFAST_TRUST {}: {what}", path.display());
        io::Error::new(io::ErrorKind::InvalidData, message)
    };
    let text = fs::read_to_string(&path).map_err(|error| bad(error.to_string()))?;
    let bytes = STANDARD.decode(text.trim());
    let bytes = bytes.map_err(|error| bad(error.to_string()))?;
    let key: [u8; 32] = bytes
        .try_into()
        .map_err(|_| bad("a public key has 32 bytes".to_owned()))?;
    Ok((format!("({key:?})"), ""))
}

/// The map of the board that is built: that with the name of an enabled feature, or the reference
/// board's.
fn board(package: &Path) -> io::Result<String> {
    for entry in fs::read_dir(package.join(BOARDS))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if let Some(feature) = name.strip_suffix(".x") {
            let variable = feature.to_uppercase().replace('-', "_");
            if env::var_os(format!("CARGO_FEATURE_{variable}")).is_some() {
                return Ok(name);
            }
        }
    }
    Ok(REFERENCE_MAP.to_owned())
}

/// Copies the table to where the image includes it. Without a table the section stays empty: the
/// charger then starts with the droop until a table is flashed.
fn table(root: &Path, out: &Path) -> io::Result<()> {
    let named = env::var_os("HOLDFAST_TABLE");
    let default = shipped_table();
    let path = root.join(named.clone().unwrap_or_else(|| default.clone().into()));
    println!("cargo::rerun-if-changed={}", path.display());
    let bytes = if named.is_none() && !path.exists() {
        println!(
            "cargo::warning={default} is missing: the image carries NO TABLE and runs on the droop"
        );
        Vec::new()
    } else {
        fs::read(&path).map_err(|error| {
            let message = format!("table {}: {error}", path.display());
            io::Error::new(error.kind(), message)
        })?
    };
    fs::write(out.join("table.bin"), bytes)
}
