//! The step `comments`: no comment line is longer than a reader's column.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::process::Failure;
use crate::workspace::root;

/// Most columns of a comment line; rustfmt does not break them.
const COLUMNS_MAX: usize = 100;
/// Folders with source, from the workspace's root.
const FOLDERS: &[&str] = &["firmware", "table-gen", "tests"];
/// Folders that hold what a build writes.
const BUILT: &[&str] = &["target", "corpus", "artifacts", "coverage"];

/// A comment line that is too long: its file, its number from 1, its columns.
#[derive(Debug, PartialEq)]
struct Offender {
    file: PathBuf,
    line: usize,
    columns: usize,
}

/// Reads every `*.rs` file and lists the comment lines that are too long.
pub(crate) fn check() -> Result<(), Failure> {
    let mut files = Vec::new();
    for folder in FOLDERS {
        collect(&root().join(folder), &mut files).map_err(|source| Failure::Read {
            path: root().join(folder),
            source,
        })?;
    }
    files.sort();
    let mut offenders = Vec::new();
    for path in &files {
        let text = fs::read_to_string(path).map_err(|source| Failure::Read {
            path: path.clone(),
            source,
        })?;
        let file = path.strip_prefix(root()).unwrap_or(path);
        offenders.extend(too_long(file, &text));
    }
    for Offender {
        file,
        line,
        columns,
    } in &offenders
    {
        println!("    {}:{line}: {columns} columns", file.display());
    }
    if offenders.is_empty() && !files.is_empty() {
        println!("    {} files", files.len());
        return Ok(());
    }
    Err(Failure::Found(format!(
        "{} comment lines of more than {COLUMNS_MAX} columns in {} files",
        offenders.len(),
        files.len()
    )))
}

/// The `*.rs` files below a folder, without those that a build wrote.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default();
        if path.is_dir() {
            if !BUILT.iter().any(|built| name == *built) {
                collect(&path, files)?;
            }
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// The lines of a text that start with `//` and are too long.
fn too_long(file: &Path, text: &str) -> Vec<Offender> {
    let lines = text.lines().zip(1..);
    lines
        .filter(|(line, _)| line.trim_start().starts_with("//"))
        .map(|(line, number)| (line.chars().count(), number))
        .filter(|(columns, _)| *columns > COLUMNS_MAX)
        .map(|(columns, line)| Offender {
            file: file.to_owned(),
            line,
            columns,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_comment_is_found_with_its_line_and_columns() {
        let fits = format!("// {}", "x".repeat(COLUMNS_MAX - 3));
        let long = format!("    /// {}", "µ".repeat(COLUMNS_MAX - 7));
        let code = format!("let text = \"{}\";", "x".repeat(COLUMNS_MAX));
        let text = [fits, code, long].join("\n");
        let file = Path::new("some.rs");
        let offender = Offender {
            file: file.to_owned(),
            line: 3,
            columns: COLUMNS_MAX + 1,
        };
        assert_eq!(too_long(file, &text), [offender]);
    }

    #[test]
    fn this_file_is_among_those_that_are_read() {
        let mut files = Vec::new();
        collect(&root().join("tests"), &mut files).unwrap();
        assert!(files.iter().any(|file| file.ends_with("comments.rs")));
        assert!(!files.iter().any(|file| file.ends_with("steps.snap")));
    }
}
