//! Programs outside this one: finding them, running them, and how that can fail.

use std::ffi::{OsStr, OsString};
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
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start { command, source } => write!(f, "cannot start `{command}`: {source}"),
            Self::Status { command, status } => write!(f, "`{command}` ended with {status}"),
            Self::Missing { what, remedy } => write!(f, "missing: {what}\n{remedy}"),
        }
    }
}

/// The cargo that runs this program, or the one on the search path.
pub(crate) fn cargo() -> OsString {
    env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Prints the command, runs it without standard input, and waits for its end.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    let text = shown(command);
    println!("    $ {text}");
    match command.stdin(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Status {
            command: text,
            status,
        }),
        Err(source) => Err(Failure::Start {
            command: text,
            source,
        }),
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
    fn a_program_that_says_no_fails() {
        let mut command = Command::new(cargo());
        command.arg("no-such-subcommand").stderr(Stdio::null());
        assert!(matches!(run(&mut command), Err(Failure::Status { .. })));
    }
}
