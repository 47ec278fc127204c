//! The steps of `test-all`, in the order in which they run: what is cheap and likely to fail comes first.

use std::path::PathBuf;
use std::process::Command;

use crate::process::{self, Failure};
use crate::tools;

/// One thing that must hold.
pub(crate) struct Step {
    /// The name by which `cargo test-all STEP` runs it.
    pub(crate) name: &'static str,
    /// What it checks, in one line.
    pub(crate) about: &'static str,
    action: Action,
}

enum Action {
    /// Arguments of one cargo command, separated by spaces, and what it needs in its environment.
    Cargo {
        arguments: &'static str,
        environment: &'static [(&'static str, &'static str)],
    },
    Call(fn() -> Result<(), Failure>),
}

/// Every step. To add one, add a line: `Step::cargo` for a cargo command, `Step::call` for a function.
///
/// The host tests run in the release profile because they play whole games (hundreds of thousands of cells, and closed
/// loops over minutes of grid time) that take many times as long unoptimised.
#[rustfmt::skip] // One step, one line.
pub(crate) const STEPS: &[Step] = &[
    Step::call("prerequisites", "tools that the other steps need; installs what is missing", tools::prerequisites),
    Step::cargo("format", "the source is formatted by rustfmt", "fmt --all --check"),
    Step::cargo("clippy", "no lint warns on the host", "clippy --workspace --all-targets -- -D warnings"),
    Step::cargo("clippy-arm", "no lint warns in the firmware for Cortex-M4F, with defmt", "clippy -p firmware --lib --features defmt --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-images", "no lint warns in the Arm images", "clippy -p firmware --bins --features board,log,pil,bare --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-variants", "no lint warns in the product with ADE7953 and signed set-point", "clippy -p firmware --bin holdfast --features board,ade7953,bidirectional --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-riscv", "no lint warns in the pil image for RV32IMC", "clippy -p firmware --bin pil --features pil --target riscv32imc-unknown-none-elf -- -D warnings"),
    Step::cargo("docs", "the documentation builds without warnings", "doc --workspace --no-deps").with(&[("RUSTDOCFLAGS", "-D warnings")]),
    Step::cargo("build-m4", "the firmware library builds for Cortex-M4F (the reference board)", "build -p firmware --lib --release --target thumbv7em-none-eabihf"),
    Step::cargo("build-m0", "the firmware library builds for Cortex-M0+ (no FPU)", "build -p firmware --lib --release --target thumbv6m-none-eabi"),
    Step::cargo("build-riscv", "the firmware library builds for RV32IMC", "build -p firmware --lib --release --target riscv32imc-unknown-none-elf"),
    Step::cargo("host-tests", "unit, property, documentation and cross-crate tests", "test --workspace --release"),
    Step::cargo("images", "the images link, every build of the product too; ELF, BIN and HEX are written", "run -p tests --release --bin fw -- images"),
    Step::cargo("pil", "the emulated processor and the host act alike, to the bit", "run -p tests --release --bin fw -- pil"),
    Step::cargo("pil-m0", "code for Cortex-M0+, with floating point in software, acts alike to the bit", "run -p tests --release --bin fw -- pil --core m0 --scenarios 200"),
    Step::cargo("pil-riscv", "RV32IMC, with floating point in software, acts alike to the bit", "run -p tests --release --bin fw -- pil --core riscv --scenarios 200"),
    Step::cargo("costs", "flash, RAM, stack and instructions are within their goals and as committed", "run -p tests --release --bin fw -- costs"),
];

impl Step {
    const fn cargo(name: &'static str, about: &'static str, arguments: &'static str) -> Self {
        let environment = &[];
        let action = Action::Cargo {
            arguments,
            environment,
        };
        Self {
            name,
            about,
            action,
        }
    }

    const fn call(
        name: &'static str,
        about: &'static str,
        function: fn() -> Result<(), Failure>,
    ) -> Self {
        let action = Action::Call(function);
        Self {
            name,
            about,
            action,
        }
    }

    /// The same step with these variables in its environment; a step that is a function has none.
    const fn with(self, environment: &'static [(&'static str, &'static str)]) -> Self {
        let action = match self.action {
            Action::Cargo { arguments, .. } => Action::Cargo {
                arguments,
                environment,
            },
            Action::Call(function) => Action::Call(function),
        };
        Self {
            name: self.name,
            about: self.about,
            action,
        }
    }

    /// Runs the step in the workspace's root; its output goes where `test-all`'s goes.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        match &self.action {
            Action::Call(function) => function(),
            Action::Cargo {
                arguments,
                environment,
            } => process::run(
                Command::new(process::cargo())
                    .args(arguments.split_whitespace())
                    .envs(environment.iter().copied())
                    .current_dir(root()),
            ),
        }
    }
}

/// The workspace's root: the folder above this package. `cargo run` says where the package is now; a binary started by
/// hand only knows where it was built.
fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    package
        .parent()
        .map_or_else(|| package.clone(), PathBuf::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_distinct_words() {
        let names: HashSet<_> = STEPS.iter().map(|step| step.name).collect();
        assert_eq!(names.len(), STEPS.len());
        for step in STEPS {
            let word = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(step.name.chars().all(word), "{}", step.name);
            assert!(!step.name.starts_with('-'), "{}", step.name);
        }
    }

    #[test]
    fn prerequisites_come_first_and_cover_every_target_built() {
        assert_eq!(STEPS[0].name, "prerequisites");
        for step in STEPS {
            let Action::Cargo { arguments, .. } = step.action else {
                continue;
            };
            let mut words = arguments.split_whitespace();
            if words.any(|word| word == "--target") {
                let target = words.next().unwrap_or("nothing");
                assert!(tools::TARGETS.contains(&target), "{}: {target}", step.name);
            }
        }
    }

    #[test]
    fn the_root_holds_this_package() {
        assert!(root().join("tests").join("Cargo.toml").is_file());
    }
}
