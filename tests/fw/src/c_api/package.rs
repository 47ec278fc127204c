//! The folder that other builds take: header, libraries, and files for CMake, Zephyr and ESP-IDF;
//! and a CMake project on the host that is built with it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::error::{CApiError, io_error, sources};
use super::library::FILE;
use super::program::run;
use crate::root;

/// Files of the package's folder, from its sources to their places.
const FILES: [(&str, &str); 8] = [
    ("include/holdfast.h", "include/holdfast.h"),
    (
        "cmake/holdfast-config.cmake",
        "lib/cmake/holdfast/holdfast-config.cmake",
    ),
    (
        "cmake/holdfast-config-version.cmake",
        "lib/cmake/holdfast/holdfast-config-version.cmake",
    ),
    ("zephyr/module.yml", "zephyr/module.yml"),
    ("zephyr/CMakeLists.txt", "zephyr/CMakeLists.txt"),
    ("zephyr/Kconfig", "zephyr/Kconfig"),
    ("esp-idf/CMakeLists.txt", "CMakeLists.txt"),
    ("esp-idf/idf_component.yml", "idf_component.yml"),
];

/// Writes the folder: the libraries stand under their targets, that of the host under `host`.
///
/// # Errors
/// A file cannot be read or written.
pub fn write(libraries: &[(&str, PathBuf)], out: &Path) -> Result<(), CApiError> {
    let copy = |from: &Path, to: &Path| {
        let folder = to.parent().unwrap_or(out);
        fs::create_dir_all(folder).map_err(io_error(folder.display().to_string()))?;
        let what = format!("{} to {}", from.display(), to.display());
        fs::copy(from, to).map_err(io_error(what)).map(drop)
    };
    for (from, to) in FILES {
        copy(&sources().join(from), &out.join(to))?;
    }
    for (target, library) in libraries {
        copy(library, &out.join("lib").join(target).join(FILE))?;
    }
    Ok(())
}

/// Configures and builds the example's CMake project with the package, and runs it with a table;
/// what it printed.
///
/// # Errors
/// CMake is missing, or the project is not built or does not run.
pub fn build_with_cmake(package: &Path, table: &str) -> Result<String, CApiError> {
    let folder = tempfile::tempdir().map_err(io_error("temporary folder"))?;
    let build = folder.path();
    let mut configure = Command::new("cmake");
    configure
        .arg("-S")
        .arg(sources().join("examples"))
        .arg("-B")
        .arg(build)
        .arg(format!("-DCMAKE_PREFIX_PATH={}", package.display()));
    run(&mut configure, "cmake")?;
    run(
        Command::new("cmake").arg("--build").arg(build),
        "cmake --build",
    )?;
    let mut program = Command::new(build.join("limit_chain"));
    run(program.arg(root().join(table)), "limit_chain")
}
