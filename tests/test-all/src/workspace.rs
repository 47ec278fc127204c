//! The workspace that is tested: where it is, and its programs.

use std::env;
use std::path::PathBuf;
use std::process::Command;

use crate::process::{Failure, cargo, run};

/// The workspace's root: two folders above this package. `cargo run` says where the package is now;
/// a binary started by hand only knows where it was built.
pub(crate) fn root() -> PathBuf {
    let package = env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    package
        .ancestors()
        .nth(2)
        .map_or_else(|| package.clone(), PathBuf::from)
}

/// A program of the workspace, as the whole workspace's build makes it.
///
/// `cargo run -p` would choose the dependencies' features for that package alone, and compile most
/// of them once more.
pub(crate) fn program(name: &str) -> Result<Command, Failure> {
    let build = ["build", "--workspace", "--release", "--bins", "--quiet"];
    run(Command::new(cargo()).args(build).current_dir(root()))?;
    let missing = || Failure::Missing {
        what: format!("the program {name}"),
        remedy: "it is built beside this one".to_owned(),
    };
    let own = env::current_exe().map_err(|_| missing())?;
    let file = format!("{name}{}", env::consts::EXE_SUFFIX);
    let program = own.with_file_name(file);
    if program.is_file() {
        Ok(Command::new(program))
    } else {
        Err(missing())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_holds_this_package() {
        assert!(root().join("tests/test-all/Cargo.toml").is_file());
    }
}
