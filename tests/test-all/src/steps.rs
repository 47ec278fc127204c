//! The steps of `test-all`, in the order in which they run: what is cheap and likely to fail comes
//! first.

use std::process::Command;
use std::time::Duration;

use crate::process::{self, Failure, Tests};
use crate::workspace::{program, root};
use crate::{comments, python, tools};

/// One thing that must hold.
pub(crate) struct Step {
    /// The name by which `cargo test-all STEP` runs it.
    pub(crate) name: &'static str,
    /// Time that it may take on two quiet cores, with empty build folders \[s\].
    budget_s: u64,
    /// What it checks, in one line.
    pub(crate) about: &'static str,
    action: Action,
}

#[derive(Clone, Copy)]
enum Action {
    /// Arguments of one cargo command, separated by spaces, and what it needs in its environment.
    Cargo {
        arguments: &'static str,
        environment: &'static [(&'static str, &'static str)],
    },
    /// A program of the workspace and its arguments, separated by spaces.
    Program(&'static str),
    Call(fn() -> Result<(), Failure>),
}

/// Every step. To add one, add a line: `Step::cargo` for a cargo command, `Step::program` for a
/// program of the workspace, `Step::call` for a function. The number is its budget in seconds;
/// together they stay within [`TOTAL_MAX`].
///
/// Everything on the host is built in the release profile: the tests play whole games (hundreds of
/// thousands of cells, and closed loops over minutes of grid time), and so macros and build scripts
/// are compiled once for lints, documentation and tests. Everything for a board is built in the
/// profile `firmware`.
#[rustfmt::skip] // One step, one line.
pub(crate) const STEPS: &[Step] = &[
    Step::call("prerequisites", 60, "tools that the other steps need; installs what is missing", tools::prerequisites),
    Step::cargo("format", 5, "the source is formatted by rustfmt", "fmt --all --check"),
    Step::call("comments", 5, "no comment line is longer than 100 columns", comments::check),
    Step::call("licences", 5, "the dependencies' licences and sources are allowed; the image's bill of materials is written", python::licences),
    Step::cargo("clippy", 90, "no lint warns on the host", "clippy --workspace --all-targets --release -- -D warnings"),
    Step::cargo("clippy-arm", 15, "no lint warns in the firmware for Cortex-M4F, with defmt", "clippy -p firmware --lib --features defmt --profile firmware --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-images", 30, "no lint warns in the Arm images", "clippy -p product --bins --features board,log,pil,bare --profile firmware --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-variants", 5, "no lint warns in the product with ADE7953 and signed set-point", "clippy -p product --bin holdfast --features board,ade7953,bidirectional --profile firmware --target thumbv7em-none-eabihf -- -D warnings"),
    Step::cargo("clippy-riscv", 15, "no lint warns in the pil image for RV32IMC", "clippy -p product --bin pil --features pil --profile firmware --target riscv32imc-unknown-none-elf -- -D warnings"),
    Step::cargo("docs", 30, "the documentation builds without warnings", "doc --workspace --no-deps --release").with(&[("RUSTDOCFLAGS", "-D warnings")]),
    Step::cargo("build-cores", 30, "the firmware library and the update build for Cortex-M4F (the reference board), Cortex-M0+ and RV32IMC (no FPU)", "build -p firmware -p update --lib --profile firmware --target thumbv7em-none-eabihf --target thumbv6m-none-eabi --target riscv32imc-unknown-none-elf"),
    Step::cargo("host-tests", 480, "unit, property, documentation and cross-crate tests", "test --workspace --release"),
    Step::cargo("ranks", 60, "games, scorecards and sweeps on two and three ranks of an MPI job are those of one process, to the bit", "test --workspace --release --features table-gen/mpi --test ranks"),
    Step::call("python", 70, "the Python package builds, installs and gives the paper's counts; OCPP's messages fit the published schemas", python::package),
    Step::program("images", 120, "the images link, every build of the product too; ELF, BIN and HEX are written", "fw images"),
    Step::program("board", 180, "the unmodified images on an emulated board: what is energised when, resets, clocks, events; the host acts alike, to the bit", "fw board"),
    Step::program("pil", 90, "the emulated processor and the host act alike, to the bit", "fw pil"),
    Step::program("pil-m0", 60, "code for Cortex-M0+, with floating point in software, acts alike to the bit", "fw pil --core m0 --scenarios 200"),
    Step::program("pil-riscv", 60, "RV32IMC, with floating point in software, acts alike to the bit", "fw pil --core riscv --scenarios 200"),
    Step::program("c-api", 45, "bare C on emulated Cortex-M and the host act alike to the bit; size, stack and instructions are as committed; CMake builds with the package", "fw c-api"),
    Step::program("costs", 60, "flash, RAM, stack and instructions are within their goals and as committed", "fw costs"),
];

/// Time that the whole run may take on two quiet cores.
pub(crate) const TOTAL_MAX: Duration = Duration::from_secs(26 * 60);

const _: () = {
    let (mut sum_s, mut n) = (0, 0);
    while n < STEPS.len() {
        sum_s += STEPS[n].budget_s;
        n += 1;
    }
    assert!(
        sum_s <= TOTAL_MAX.as_secs(),
        "the steps' budgets exceed the whole run's"
    );
};

impl Step {
    const fn cargo(
        name: &'static str,
        budget_s: u64,
        about: &'static str,
        arguments: &'static str,
    ) -> Self {
        let environment = &[];
        let action = Action::Cargo {
            arguments,
            environment,
        };
        Self {
            name,
            budget_s,
            about,
            action,
        }
    }

    const fn program(
        name: &'static str,
        budget_s: u64,
        about: &'static str,
        command: &'static str,
    ) -> Self {
        let action = Action::Program(command);
        Self {
            name,
            budget_s,
            about,
            action,
        }
    }

    const fn call(
        name: &'static str,
        budget_s: u64,
        about: &'static str,
        function: fn() -> Result<(), Failure>,
    ) -> Self {
        let action = Action::Call(function);
        Self {
            name,
            budget_s,
            about,
            action,
        }
    }

    /// The same step with these variables in its environment; a step that is a function has none.
    const fn with(self, environment: &'static [(&'static str, &'static str)]) -> Self {
        let action = match &self.action {
            Action::Cargo { arguments, .. } => Action::Cargo {
                arguments,
                environment,
            },
            other => *other,
        };
        Self { action, ..self }
    }

    /// Time that it may take on two quiet cores, with empty build folders.
    pub(crate) const fn budget(&self) -> Duration {
        Duration::from_secs(self.budget_s)
    }

    /// Runs the step in the workspace's root; its output goes where `test-all`'s goes.
    pub(crate) fn run(&self) -> Result<Tests, Failure> {
        match &self.action {
            Action::Call(function) => function().map(|()| Tests::default()),
            Action::Program(command) => {
                let mut words = command.split_whitespace();
                let name = words.next().unwrap_or_default();
                process::run(program(name)?.args(words).current_dir(root()))
            }
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
        let mut targets = HashSet::new();
        for step in STEPS {
            let Action::Cargo { arguments, .. } = step.action else {
                continue;
            };
            let words: Vec<&str> = arguments.split_whitespace().collect();
            let named = words.windows(2).filter(|pair| pair[0] == "--target");
            targets.extend(named.map(|pair| pair[1]));
        }
        assert_eq!(targets, HashSet::from_iter(tools::TARGETS.iter().copied()));
    }
}
