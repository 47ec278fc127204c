//! What is done in Python: the dependencies' licences, the package for notebooks, and OCPP's
//! published schemas, which a Python package ships.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::process::{Failure, run};
use crate::workspace::{program, root};

/// What the environment gets from PyPI, each at a version that is known to do.
const PACKAGES: &[&str] = &[
    "maturin>=1.9,<2",
    "numpy>=1.24",
    "matplotlib>=3.8",
    "ocpp==2.1.0",
];
/// A key that signs nothing but the test's table: 32 bytes in Base64.
const KEY: &str = "AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=";

/// A Python program in the workspace's root.
fn python(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Result<(), Failure> {
    let mut command = Command::new(program);
    run(command.args(arguments).current_dir(root())).map(|_| ())
}

/// The step `licences`.
pub(crate) fn licences() -> Result<(), Failure> {
    python("python3", &["tests/release/licences.py"])?;
    python(
        "python3",
        &["tests/release/sbom.py", "out/firmware/holdfast.cdx.json"],
    )
}

/// The step `python`: builds the wheel, installs it into an environment of its own, tests it there,
/// and checks OCPP's messages against the published schemas.
pub(crate) fn package() -> Result<(), Failure> {
    let folder = root().join("target/python");
    let environment = folder.join("environment");
    let wheels = fresh(&folder.join("wheels"))?;
    let messages = fresh(&folder.join("ocpp"))?;
    python("python3", &["-m", "venv", &text(&environment)])?;
    let interpreter = environment.join("bin/python");
    let pip = [
        "-m",
        "pip",
        "--disable-pip-version-check",
        "install",
        "--quiet",
    ];
    python(&interpreter, &[&pip[..], PACKAGES].concat())?;
    let manifest = "table-gen/python/Cargo.toml";
    let build = ["build", "--release", "--manifest-path", manifest, "--out"];
    python(
        environment.join("bin/maturin"),
        &[&build[..], &[&text(&wheels)]].concat(),
    )?;
    let found = [
        "--force-reinstall",
        "--no-deps",
        "--no-index",
        "--find-links",
    ];
    let folder_of_wheels = text(&wheels);
    let wheel = [&pip[..], &found, &[&folder_of_wheels, "holdfast"]].concat();
    python(&interpreter, &wheel)?;
    python(&interpreter, &["table-gen/python/tests/test_package.py"])?;
    python(
        &interpreter,
        &["table-gen/python/examples/winning_counts.py"],
    )?;
    let picture = text(&folder.join("winning-set.png"));
    python(
        &interpreter,
        &["table-gen/python/examples/winning_set.py", &picture],
    )?;

    let key = folder.join("test.key");
    std::fs::write(&key, KEY).map_err(|source| Failure::Read {
        path: key.clone(),
        source,
    })?;
    let export = "ocpp export gb-bi --table firmware/tables/gb-bi.bin";
    let mut command = program("table-gen")?;
    command
        .args(export.split_whitespace())
        .arg("--key")
        .arg(&key);
    run(command.arg("--out").arg(&messages).current_dir(root()))?;
    let check = "table-gen/ocpp/tests/published_schemas.py";
    python(&interpreter, &[check, &text(&messages)])
}

/// An empty folder.
fn fresh(folder: &Path) -> Result<PathBuf, Failure> {
    let failed = |source| Failure::Read {
        path: folder.to_owned(),
        source,
    };
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(failed(error)),
        _ => {}
    }
    std::fs::create_dir_all(folder).map_err(failed)?;
    Ok(folder.to_owned())
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
