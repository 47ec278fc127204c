//! What the steps need installed: parts of the Rust toolchain and programs beside it.

use std::path::Path;
use std::process::Command;

use crate::process::{Failure, answer, cargo, on_path, run};

/// Rust targets for which the firmware library is built.
pub(crate) const TARGETS: &[&str] = &[
    "thumbv7em-none-eabihf",
    "thumbv6m-none-eabi",
    "riscv32imc-unknown-none-elf",
];

/// Components of the Rust toolchain, each with the cargo subcommand that it brings.
const COMPONENTS: &[(&str, &str)] = &[("rustfmt", "fmt"), ("clippy", "clippy")];

/// A program that some step runs.
struct Tool {
    /// Names under which it may be found; the first on the search path will do.
    programs: &'static [&'static str],
    /// Debian packages that bring it. Recommended packages are left out, so name what it cannot do
    /// without. Of `a|b` the first that the system's release has is taken.
    packages: &'static [&'static str],
    /// Why it is needed.
    why: &'static str,
}

/// Every program that the steps need beside the Rust toolchain. To add or remove one, edit here
/// alone.
const TOOLS: &[Tool] = &[
    Tool {
        programs: &["qemu-system-arm"],
        packages: &["qemu-system-arm"],
        why: "runs the firmware on an emulated Cortex-M4",
    },
    Tool {
        programs: &["qemu-system-riscv32"],
        packages: &["qemu-system-riscv|qemu-system-misc"],
        why: "runs the firmware on an emulated RISC-V core",
    },
    Tool {
        // `ensurepip` comes with the second package, and without it there is no environment.
        programs: &["python3"],
        packages: &["python3", "python3-venv"],
        why: "checks licences, and builds and tests the Python package",
    },
    Tool {
        programs: &["arm-none-eabi-gcc"],
        packages: &["gcc-arm-none-eabi"],
        why: "builds the bare C program for the C interface",
    },
    Tool {
        programs: &["c++"],
        packages: &["g++"],
        why: "compiles the C interface's header as C++",
    },
    Tool {
        programs: &["cmake"],
        packages: &["cmake", "make"],
        why: "builds a C program with the C interface's package",
    },
    Tool {
        programs: &["chromium", "chromium-browser", "google-chrome"],
        packages: &["chromium", "fonts-liberation"],
        why: "opens the HTML report and checks what a reader sees",
    },
    Tool {
        programs: &["mpicc"],
        packages: &["libopenmpi-dev", "openmpi-bin", "libclang-dev"],
        why: "builds table-gen with the feature mpi; mpirun runs its ranks",
    },
];

/// The step `prerequisites`: installs what is missing where that is allowed, and otherwise says how
/// to.
pub(crate) fn prerequisites() -> Result<(), Failure> {
    for (component, subcommand) in COMPONENTS {
        if answer(cargo(), &[subcommand, "--version"]).is_none() {
            rustup("component", component)?;
        }
    }
    for target in TARGETS {
        if !target_is_installed(target) {
            rustup("target", target)?;
        }
    }
    let missing: Vec<&Tool> = TOOLS.iter().filter(|tool| !tool.is_installed()).collect();
    if missing.is_empty() {
        println!("    all are here");
        return Ok(());
    }
    install(&missing)
}

/// `rustup component add` or `rustup target add`, for the toolchain in use.
fn rustup(kind: &str, name: &str) -> Result<(), Failure> {
    println!("    Rust {kind} {name} is missing: installing it");
    if on_path("rustup").is_none() {
        return Err(Failure::Missing {
            what: format!("the Rust {kind} {name}, and rustup to install it"),
            remedy: format!("install rustup (https://rustup.rs), then: rustup {kind} add {name}"),
        });
    }
    run(Command::new("rustup").args([kind, "add", name])).map(|_| ())
}

/// Whether the toolchain has the target's standard library, whoever installed it.
fn target_is_installed(target: &str) -> bool {
    answer("rustc", &["--print", "target-libdir", "--target", target])
        .is_some_and(|folder| Path::new(&folder).is_dir())
}

impl Tool {
    fn is_installed(&self) -> bool {
        self.programs
            .iter()
            .any(|program| on_path(program).is_some())
    }
}

/// Installs the packages of `missing` by apt-get as root or with passwordless sudo, and looks
/// again.
fn install(missing: &[&Tool]) -> Result<(), Failure> {
    for tool in missing {
        println!("    {} is missing: it {}", tool.programs[0], tool.why);
    }
    let packages = || -> Vec<&str> {
        let all = missing.iter().flat_map(|tool| tool.packages);
        all.map(|choice| of_this_release(choice)).collect()
    };
    let Some(prefix) = administrator() else {
        return Err(cannot_install(missing, &packages()));
    };
    let apt_get = |words: &[&str]| {
        let (program, rest) = (prefix[0], &prefix[1..]);
        run(Command::new(program).args(rest).arg("apt-get").args(words))
    };
    apt_get(&["update"])?;
    let packages = packages();
    println!("    installing {} with apt-get", packages.join(", "));
    apt_get(&[&["install", "-y", "--no-install-recommends"], &*packages].concat())?;
    match missing.iter().find(|tool| !tool.is_installed()) {
        None => Ok(()),
        Some(tool) => {
            let packages: Vec<&str> = tool.packages.iter().map(|p| of_this_release(p)).collect();
            Err(cannot_install(&[tool], &packages))
        }
    }
}

/// The package of `a|b` that the package lists know; the last if none is known.
fn of_this_release(choice: &str) -> &str {
    let known = |package: &&str| {
        answer("apt-cache", &["show", package]).is_some_and(|text| !text.is_empty())
    };
    choice
        .split('|')
        .find(known)
        .or_else(|| choice.split('|').next_back())
        .unwrap_or(choice)
}

/// How to call apt-get without being asked anything; `None` where there is no apt-get or no right
/// to use it.
fn administrator() -> Option<&'static [&'static str]> {
    on_path("apt-get")?;
    if answer("id", &["-u"]).as_deref() == Some("0") {
        return Some(&["env", "DEBIAN_FRONTEND=noninteractive"]);
    }
    answer("sudo", &["-n", "true"])?;
    Some(&["sudo", "-n", "env", "DEBIAN_FRONTEND=noninteractive"])
}

fn cannot_install(missing: &[&Tool], packages: &[&str]) -> Failure {
    let programs: Vec<&str> = missing.iter().map(|tool| tool.programs[0]).collect();
    let packages = packages.join(" ");
    Failure::Missing {
        what: programs.join(", "),
        remedy: format!(
            "install it with: sudo apt-get update && sudo apt-get install -y --no-install-recommends {packages}\n\
             (where there is no apt-get: with the system's own package manager, so that it is on PATH)"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invented_target_is_not_installed() {
        assert!(!target_is_installed("no-such-target"));
    }

    #[test]
    fn the_remedy_is_a_command_that_names_every_package() {
        let all: Vec<&Tool> = TOOLS.iter().collect();
        let text = cannot_install(&all, &["qemu-system-arm", "chromium"]).to_string();
        assert!(
            text.contains("apt-get install -y --no-install-recommends qemu-system-arm chromium")
        );
        assert!(
            text.contains(
                "missing: qemu-system-arm, qemu-system-riscv32, python3, arm-none-eabi-gcc"
            )
        );
        // Where no list knows either, the last is named.
        assert_eq!(of_this_release("no-such-package|nor-this"), "nor-this");
    }
}
