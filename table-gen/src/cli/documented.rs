//! Every command that README and docs show is one that this binary takes, and names files that
//! exist.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::fs;
use std::path::{Path, PathBuf};

use clap::CommandFactory as _;

/// How a command of this binary begins in an indented line of a document.
const CALL: &str = "cargo run --release -- ";
/// Folders of the repository that commands read from.
const KEPT: &[&str] = &["docs/", "firmware/", "table-gen/", "tests/"];

/// A command as it stands in a document.
#[derive(Debug)]
struct Shown {
    /// The document and its line, from 1.
    place: String,
    /// The command's words, without comment and redirection.
    words: Vec<String>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The commands of a document: indented calls, and code spans that begin with a command's name and
/// what it is about; `synth --json` names an option and is none.
fn commands(place: &str, text: &str) -> Vec<Shown> {
    let names: Vec<String> = super::Cli::command()
        .get_subcommands()
        .map(|command| command.get_name().to_owned())
        .collect();
    let mut shown = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let calls = line.split_once(CALL).map(|(_, rest)| rest);
        let spans = line.split('`').skip(1).step_by(2);
        let spans = spans.filter(|span| {
            let mut words = span.split_whitespace();
            let named = words
                .next()
                .is_some_and(|word| names.iter().any(|n| n == word));
            named
                && words
                    .next()
                    .is_some_and(|word| !word.starts_with(['-', '.']))
        });
        for command in calls.into_iter().chain(spans) {
            let command = command.split(" #").next().unwrap();
            // No word has a space in it, so that quotes are all at words' ends.
            let words = command.split_whitespace();
            // A capital stands for a number.
            let words = words.map(|word| match word.trim_matches(['"', '\'']) {
                "N" | "X" => "1".to_owned(),
                word => word.to_owned(),
            });
            shown.push(Shown {
                place: format!("{place}:{number}"),
                words: words.collect(),
            });
        }
    }
    shown
}

/// README and every page of docs.
fn documents() -> Vec<(String, String)> {
    let pages = fs::read_dir(root().join("docs")).unwrap();
    let pages = pages.map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = pages
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .collect();
    paths.push(root().join("README.md"));
    paths.sort();
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    paths
        .iter()
        .map(|path| (name(path), fs::read_to_string(path).unwrap()))
        .collect()
}

#[test]
fn every_command_shown_is_one_that_is_taken() {
    let (mut tried, mut wrong) = (0, Vec::new());
    for (name, text) in documents() {
        for Shown { place, words } in commands(&name, &text) {
            tried += 1;
            let all = std::iter::once("table-gen").chain(words.iter().map(String::as_str));
            if let Err(error) =
                super::groups::grouped(super::Cli::command()).try_get_matches_from(all)
                && error.exit_code() != 0
            {
                wrong.push(format!("{place}: {}\n    {error}", words.join(" ")));
            }
            let kept = words
                .iter()
                .filter(|word| KEPT.iter().any(|k| word.starts_with(k)) && !word.contains("NAME"));
            wrong.extend(
                kept.filter(|path| !root().join(path).exists())
                    .map(|path| format!("{place}: there is no {path}")),
            );
        }
    }
    assert!(tried > 60, "only {tried} commands were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn calls_and_spans_are_found_and_others_are_not() {
    let text = "    cargo run --release -- synth paper-bi   # games\nsee `verify`, `synth --json` and `verify A --spec 'B'`, `x y`";
    let found = commands("page", text);
    let words: Vec<_> = found.iter().map(|shown| shown.words.join(" ")).collect();
    assert_eq!(words, ["synth paper-bi", "verify A --spec B"]);
    assert_eq!(found[1].place, "page:2");
}
