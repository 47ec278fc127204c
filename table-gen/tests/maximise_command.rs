//! `maximise` as a person runs it, and what `prob` says of the table that it writes.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use firmware::table::TableView;
use model::spec::Spec;
use prob::maximise;
use prob::participation::Participation;
use synth::chosen::Chosen;
use synth::problem::Problem;

/// More than paper-bi's own levels keep: they fall to -0.41 Hz.
const CONTAINMENT: &str = "requirements.containment_hz=-0.4";

/// The chain of the tests: four seconds, sets of ±12 mHz.
const CHAIN: [&str; 8] = [
    "--spec",
    "paper-bi",
    "--set",
    CONTAINMENT,
    "--bin-gw",
    "0.005",
    "--horizon-s",
    "4",
];

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../firmware/tables")
        .join(name)
}

fn run(command: &str, table: &Path, rest: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_table-gen"))
        .arg(command)
        .arg(table)
        .args(CHAIN)
        .args(rest)
        .arg("--json")
        .output()
        .unwrap()
}

fn json(out: &Output) -> serde_json::Value {
    let errors = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(0), "{errors}");
    serde_json::from_slice(&out.stdout).unwrap()
}

/// The new table's bound is larger than that of the old levels, `prob` finds the same from its
/// bytes, for a drawn error too, and runs do not contradict it. Then there is nothing to better,
/// and nothing is written.
#[test]
fn a_better_table_is_found_and_bounded_from_its_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let new = dir.path().join("better.bin");
    let options = ["--participation", "exact", "--back", "1", "--rounds", "2"];
    let to = ["--nodes-max", "5000", "--out", new.to_str().unwrap()];
    let asked = [&options[..], &to].concat();
    let found = json(&run("maximise", &shipped("paper-bi.bin"), &asked));
    assert_eq!(found["before"].as_f64(), Some(0.0));
    assert_eq!(found["lower_bound"].as_f64(), Some(1.0));
    assert!(found["changed_cells"].as_u64().unwrap() > 0);
    // The firmware's reader takes it as a table of this spec.
    let bytes = std::fs::read(&new).unwrap();
    let spec = Spec::load("paper-bi", &[CONTAINMENT.to_owned()]).unwrap();
    assert!(TableView::parse_for_spec(&bytes, spec.hash()).is_ok());
    let drawn = ["--participation", "gaussian:0.002,3", "--runs", "300"];
    let again = json(&run("prob", &new, &drawn));
    let bound = again["layers"]["participation"]["lower_bound"].as_f64();
    // Six draws, each past three deviations with at most 0.0027.
    assert!(bound.unwrap() > 1.0 - 6.0 * 0.0027, "{bound:?}");
    assert!(again["simulated"]["interval_95"][1].as_f64() >= bound);
    let same = dir.path().join("same.bin");
    let to = ["--nodes-max", "5000", "--out", same.to_str().unwrap()];
    let out = run("maximise", &new, &[&options[..], &to].concat());
    assert_eq!(out.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&out.stderr).contains("no other levels"));
    assert!(!same.exists());
}

/// One level in every cell keeps the promise under errors of 5 %. The bound that is told is that
/// of `prob` from the written bytes, and runs do not contradict it.
#[test]
fn even_levels_are_bounded_under_large_errors() {
    let dir = tempfile::tempdir().unwrap();
    let new = dir.path().join("even.bin");
    let drawn = ["--participation", "uniform:0.05", "--nodes-max", "50000"];
    let even = [
        "--first",
        "1",
        "--rounds",
        "0",
        "--out",
        new.to_str().unwrap(),
    ];
    let found = json(&run(
        "maximise",
        &shipped("paper-bi.bin"),
        &[&drawn[..], &even].concat(),
    ));
    assert!(found["before"].is_null());
    assert_eq!(found["first"].as_f64(), Some(1.0));
    let bound = found["lower_bound"].as_f64().unwrap();
    assert!(bound > 0.999, "{bound}");
    let runs = [&drawn[..], &["--runs", "300"]].concat();
    let again = json(&run("prob", &new, &runs));
    assert_eq!(
        again["layers"]["participation"]["lower_bound"].as_f64(),
        Some(bound)
    );
    assert!(again["simulated"]["interval_95"][1].as_f64() >= Some(bound));
    let none = ["--first", "0.33", "--rounds", "0", "--out", "none.bin"];
    let out = run(
        "maximise",
        &shipped("paper-bi.bin"),
        &[&drawn[..], &none].concat(),
    );
    assert_eq!(out.status.code(), Some(2));
}

/// paper-uni's fleet must respond in full to bring f back into I2: of even levels the highest keeps
/// most runs, half of it few, none of it nothing.
#[test]
fn runs_rank_even_levels() {
    let spec = Spec::load("paper-uni", &[]).unwrap();
    let problem = Problem::new(&spec).unwrap();
    let bytes = std::fs::read(shipped("paper-uni.bin")).unwrap();
    let mut chosen = Chosen::of(&problem, &TableView::parse(&bytes).unwrap()).unwrap();
    let kept = [0, 10, 20].map(|level| {
        chosen.fill(level);
        let dense = chosen.dense(&problem).unwrap();
        let table = TableView::parse(&dense).unwrap();
        let kind = Participation::Uniform { bound: 0.2 };
        maximise::kept(&table, &spec, kind, 120.0, &|| true).unwrap()
    });
    assert!(kept[0] == 0 && kept[1] < kept[2] && kept[2] > 0, "{kept:?}");
}
