//! Programs outside this one: finding them, running them, and how that can fail.

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::{env, fmt, io};

/// Why a step failed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The program could not be started.
    Start { command: String, source: io::Error },
    /// The program ran and said no.
    Status { command: String, status: ExitStatus },
    /// Something is missing and cannot be installed from here; `remedy` says what a person can do.
    Missing { what: String, remedy: String },
    /// A file or folder of the source cannot be read.
    Read { path: PathBuf, source: io::Error },
    /// The source is not as it must be; what is wrong is printed above.
    Found(String),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start { command, source } => write!(f, "cannot start `{command}`: {source}"),
            Self::Status { command, status } => write!(f, "`{command}` ended with {status}"),
            Self::Missing { what, remedy } => write!(f, "missing: {what}\n{remedy}"),
            Self::Read { path, source } => write!(f, "{}: {source}", path.display()),
            Self::Found(what) => f.write_str(what),
        }
    }
}

/// The cargo that runs this program, or the one on the search path.
pub(crate) fn cargo() -> OsString {
    env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Tests that a command ran, by what it printed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Tests {
    pub(crate) passed: u32,
    /// Left out by `#[ignore]`.
    pub(crate) ignored: u32,
}

impl Tests {
    /// Adds what a line says, if it closes a test program:
    /// `test result: ok. 5 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; ...`.
    fn note(&mut self, line: &str) {
        let Some(counts) = line.strip_prefix("test result: ") else {
            return;
        };
        let words: Vec<&str> = counts.split_whitespace().collect();
        for pair in words.windows(2) {
            let count = pair[0].parse().unwrap_or(0);
            match pair[1] {
                "passed;" => self.passed += count,
                "ignored;" => self.ignored += count,
                _ => {}
            }
        }
    }
}

/// Prints the command, runs it without standard input, passes on what it prints, and waits for its
/// end.
pub(crate) fn run(command: &mut Command) -> Result<Tests, Failure> {
    let text = shown(command);
    println!("    $ {text}");
    let start = |source| Failure::Start {
        command: text.clone(),
        source,
    };
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(start)?;
    let mut tests = Tests::default();
    if let Some(output) = child.stdout.take() {
        // A line that is no text ends the reading, not the command; its status still counts.
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            println!("{line}");
            tests.note(&line);
        }
    }
    let status = child.wait().map_err(start)?;
    if status.success() {
        Ok(tests)
    } else {
        Err(Failure::Status {
            command: text,
            status,
        })
    }
}

/// The command as a person would type it: programs by name rather than by path.
fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_stem().unwrap_or(program.as_os_str());
    let mut words = Vec::new();
    for (key, value) in command.get_envs() {
        let value = value.unwrap_or_default().to_string_lossy();
        words.push(format!("{}='{value}'", key.to_string_lossy()));
    }
    words.push(name.to_string_lossy().into_owned());
    words.extend(
        command
            .get_args()
            .map(|word| word.to_string_lossy().into_owned()),
    );
    words.join(" ")
}

/// What a command prints, if it starts and succeeds; nothing of it is shown.
pub(crate) fn answer(program: impl AsRef<OsStr>, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    output.status.success().then(|| text.trim().to_string())
}

/// The first file of this name on the search path.
pub(crate) fn on_path(program: &str) -> Option<PathBuf> {
    find(program, &env::var_os("PATH")?)
}

fn find(program: &str, path: &OsStr) -> Option<PathBuf> {
    let file = format!("{program}{}", env::consts::EXE_SUFFIX);
    env::split_paths(path)
        .map(|folder| folder.join(&file))
        .find(|candidate| candidate.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_found_on_the_path_and_an_invented_one_is_not() {
        assert!(on_path("cargo").is_some_and(|file| file.is_file()));
        assert_eq!(on_path("no-such-program"), None);
        assert_eq!(find("cargo", OsStr::new("/nowhere")), None);
    }

    #[test]
    fn a_program_that_is_not_there_cannot_start() {
        let outcome = run(&mut Command::new("no-such-program"));
        assert!(matches!(outcome, Err(Failure::Start { .. })));
    }

    #[test]
    fn a_command_is_shown_as_it_would_be_typed() {
        let mut command = Command::new("/usr/bin/cargo");
        command
            .args(["doc", "--no-deps"])
            .env("RUSTDOCFLAGS", "-D warnings");
        assert_eq!(
            shown(&command),
            "RUSTDOCFLAGS='-D warnings' cargo doc --no-deps"
        );
    }

    #[test]
    fn tests_are_counted_by_their_programs_last_lines() {
        let mut tests = Tests::default();
        for line in [
            "running 5 tests",
            "test result: ok. 5 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s",
            "test result: FAILED. 1 passed; 7 failed; 2 ignored; 0 measured; 0 filtered out",
            "3 passed; 4 ignored;",
        ] {
            tests.note(line);
        }
        let expected = Tests {
            passed: 6,
            ignored: 3,
        };
        assert_eq!(tests, expected);
    }

    #[test]
    fn a_program_that_says_no_fails() {
        let mut command = Command::new(cargo());
        command.arg("no-such-subcommand").stderr(Stdio::null());
        assert!(matches!(run(&mut command), Err(Failure::Status { .. })));
    }
}
