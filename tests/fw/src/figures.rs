//! Figures of the firmware as `firmware/expected` holds them: one a line, with its goal.
//!
//! A figure past its goal fails, but for the misses that the committed file already states: those
//! are told at every run. The text itself must be equal as well, as long as compiler and table are
//! those that the file names; with others a difference is only shown.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::process::Command;

use crate::images::ImageError;
use crate::pil::qemu::PilError;
use crate::root;

/// Why nothing was measured, or the figures are not as they must be.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    /// An image.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The link.
    #[error(transparent)]
    Pil(#[from] PilError),
    /// A file or QEMU.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// A symbol of the image is missing.
    #[error("the image has no symbol {0}")]
    Symbol(&'static str),
    /// A figure misses its goal for the first time, or differs.
    #[error("{0}")]
    Wrong(String),
}

pub(crate) fn io_error(what: impl Into<String>) -> impl FnOnce(io::Error) -> CostError {
    let what = what.into();
    |source| CostError::Io { what, source }
}

/// A list of figures as it is committed.
#[derive(Debug, Default)]
pub struct Figures {
    text: String,
    missed: Vec<String>,
}

impl Figures {
    pub(crate) fn line(&mut self, name: &str, value: u32, unit: &str, goal: Option<u32>) {
        let goal_text = match goal {
            None => String::new(),
            Some(goal) if value <= goal => format!("  goal at most {goal}"),
            Some(goal) => format!("  goal at most {goal}: MISSED by {}", value - goal),
        };
        let line = format!("{name:<60}{value:>8} {unit}{goal_text}");
        if goal.is_some_and(|goal| value > goal) {
            self.missed.push(line.clone());
        }
        self.text.push_str(&line);
        self.text.push('\n');
    }

    pub(crate) fn note(&mut self, text: &str) {
        let _ = writeln!(self.text, "# {text}");
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Compares with the committed file, or replaces it.
    ///
    /// # Errors
    /// A goal is missed that the file does not show as missed, or a figure differs although
    /// compiler and table are the file's.
    pub fn check(&self, file: &str, bless: bool) -> Result<(), CostError> {
        let path = root().join("firmware/expected").join(file);
        if bless {
            fs::write(&path, &self.text).map_err(io_error(path.display().to_string()))?;
        }
        let committed = fs::read_to_string(&path).map_err(io_error(path.display().to_string()))?;
        // A goal that the committed figures miss already is told every time; a new miss fails,
        // whatever the table.
        let known = |line: &&String| committed.lines().any(|old| old == line.as_str());
        for line in self.missed.iter().filter(known) {
            println!("    {file}: known miss: {line}");
        }
        let new: Vec<&str> = self
            .missed
            .iter()
            .filter(|line| !known(line))
            .map(String::as_str)
            .collect();
        if !new.is_empty() {
            return Err(CostError::Wrong(new.join("\n")));
        }
        let notes = |text: &str| -> Vec<String> {
            let lines = text.lines().filter(|line| line.starts_with('#'));
            lines.map(str::to_owned).collect()
        };
        let differs = difference(&committed, &self.text);
        if differs.is_empty() {
            println!("    {file}: as committed");
            Ok(())
        } else if notes(&committed) == notes(&self.text) {
            let message =
                format!("{file} differs; `cargo fw costs --bless` takes it over:\n{differs}");
            Err(CostError::Wrong(message))
        } else {
            println!(
                "    {file}: other compiler or table than committed; no new goal is missed:\n{differs}"
            );
            Ok(())
        }
    }
}

fn difference(old: &str, new: &str) -> String {
    let mut text = String::new();
    for line in old.lines().filter(|line| !new.lines().any(|n| n == *line)) {
        let _ = writeln!(text, "  - {line}");
    }
    for line in new.lines().filter(|line| !old.lines().any(|o| o == *line)) {
        let _ = writeln!(text, "  + {line}");
    }
    text
}

pub(crate) fn compiler() -> String {
    let output = Command::new("rustc").arg("--version").output();
    output.map_or_else(
        |_| "unknown compiler".into(),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    )
}
