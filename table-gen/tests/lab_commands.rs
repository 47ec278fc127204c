//! The commands of the laboratory: equal numbers in equal questions, and bad input answered by exit
//! code 2.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::process::{Command, Output};

use model::spec::Spec;
use serde_json::Value;
use synth::game::{Sweep, Watch};
use synth::pipeline::{self, Encoding};
use synth::synthesis;

struct Quiet;

impl Watch for Quiet {
    fn sweep(&self, _: &Sweep) -> bool {
        true
    }
}

fn table_gen(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_table-gen"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = table_gen(arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The command ends with 2 and says each of these words.
fn refused(arguments: &[&str], words: &[&str]) {
    let output = table_gen(arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
    for word in words {
        assert!(errors.contains(word), "{arguments:?}: {errors}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}");
}

#[test]
fn bad_input_is_named() {
    refused(
        &["simulate", "paper-bi", "--duration-s", "-3"],
        &["--duration-s = -3", "above 0"],
    );
    refused(
        &["simulate", "paper-bi", "--duration-s", "nan"],
        &["--duration-s"],
    );
    refused(&["simulate", "paper-bi", "--runs", "0"], &["--runs = 0"]);
    refused(
        &[
            "simulate",
            "paper-bi",
            "--runs",
            "9",
            "--controller",
            "baseline",
        ],
        &["--runs"],
    );
    refused(
        &["simulate", "paper-bi", "--loss-gw", "1,2"],
        &["--loss-gw", "--runs"],
    );
    refused(
        &["simulate", "paper-bi", "--runs", "9", "--loss-gw", "2,1"],
        &["upside down"],
    );
    refused(
        &["simulate", "paper-bi", "--measurement-error", "1"],
        &["four numbers"],
    );
    refused(
        &["simulate", "paper-bi", "--scenario", "none-such"],
        &["none-such", "gb-2019"],
    );
    refused(
        &["fleet", "paper-bi", "--chargers", "0"],
        &["--chargers = 0", "1 to"],
    );
    refused(
        &["fleet", "paper-bi", "--failed", "1.5"],
        &["--failed = 1.5"],
    );
    refused(
        &["fleet", "paper-bi", "--duration-s", "0"],
        &["--duration-s = 0"],
    );
    refused(
        &["counterfactual", "none-such.csv", "paper-bi"],
        &["none-such.csv"],
    );
    refused(
        &[
            "counterfactual",
            "none-such.csv",
            "paper-bi",
            "--draws",
            "0",
        ],
        &["--draws = 0"],
    );
    refused(&["report", "paper-bi", "--runs", "0"], &["--runs = 0"]);
    refused(
        &["compare", "paper-bi", "--chargers", "0"],
        &["--chargers = 0", "1 to"],
    );
    refused(
        &["compare", "paper-bi", "--loss-gw", "2,1"],
        &["upside down"],
    );
    refused(
        &["compare", "paper-bi", "--inertia", "4,0"],
        &["--inertia = 0"],
    );
    refused(
        &["report", "paper-bi", "--trace", "none-such.csv"],
        &["none-such.csv"],
    );
    refused(&["replay", "none-such.csv", "paper-bi"], &["none-such.csv"]);
}

#[test]
fn bad_scenario_files_are_named_by_line_or_key() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scenario.toml");
    let cases = [
        ("name = 3", "line 1"),
        ("name = \"a\"\n[[loss]]\nat_s = 0.0\npower = 1", "line 4"),
        (
            "name = \"a\"\n[[loss]]\nat_s = -1.0\npower_gw = 1",
            "loss[0].at_s: found -1",
        ),
        (
            "name = \"a\"\n[[loss]]\nat_s = 0.0005\npower_gw = 1",
            "whole milliseconds",
        ),
        (
            "name = \"a\"\n[[loss]]\nat_s = 2.0\npower_gw = 1\n[[loss]]\nat_s = 1.0\npower_gw = 1",
            "in order",
        ),
        (
            "name = \"a\"\n[[loss]]\nat_s = 0.0\npower_gw = nan",
            "loss[0].power_gw: found NaN",
        ),
        (
            "name = \"a\"\n[[loss]]\nat_s = 0.0\npower_gw = 1\ninertia_gw_s_per_hz = 4",
            "inertia",
        ),
        ("name = \"a\"\nduration_s = -5", "duration_s: found -5"),
        (
            "name = \"a\"\n[governor]\noutput_gw = [1.0, 0.0]",
            "governor.output_gw",
        ),
        ("name = \"a\"\n[demand]\nnoise_gw = -1", "demand.noise_gw"),
        (
            "name = \"a\"\n[errors]\nparticipation = 2",
            "errors.participation",
        ),
    ];
    for (text, word) in cases {
        std::fs::write(&path, text).unwrap();
        let name = path.to_str().unwrap();
        let baseline = [
            "simulate",
            "paper-bi",
            "--controller",
            "baseline",
            "--scenario",
            name,
        ];
        refused(&baseline, &[word]);
    }
}

#[test]
fn baselines_answer_without_a_table() {
    let one = json(&["simulate", "paper-bi", "--controller", "baseline", "--json"]);
    assert_eq!(
        format!("{:.4}", one["nadir_hz"].as_f64().unwrap()),
        "49.4923"
    );
    assert_eq!(one["satisfies_psi"], false);
    let scenario = [
        "simulate",
        "paper-bi",
        "--controller",
        "baseline",
        "--scenario",
        "gb-2019",
        "--json",
    ];
    let staged = json(&scenario);
    assert_eq!(
        staged["loss_gw"].as_f64().map(|gw| (1000.0 * gw).round()),
        Some(1878.0)
    );
    assert_eq!(staged["outside_proof"].as_array().unwrap().len(), 6);
    let plot = table_gen(&["simulate", "paper-bi", "--controller", "baseline", "--plot"]);
    let text = String::from_utf8(plot.stdout).unwrap();
    assert!(text.contains("300 s") && text.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)));
}

#[test]
fn the_report_the_runs_and_the_replays_agree() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    // One table for all commands: the dense one takes no time to make.
    let spec = Spec::load("paper-bi", &[]).unwrap();
    let quiet = |_| Box::new(Quiet) as Box<dyn Watch>;
    let laws = synthesis::synthesise(&spec, &quiet).unwrap();
    let emitted = pipeline::emit(&laws, Encoding::Dense, &quiet).unwrap();
    let path = dir.path().join("dense.bin");
    std::fs::write(&path, emitted.bytes).unwrap();
    let table = ["--table", path.to_str().unwrap(), "--json"];
    let json = |arguments: &[&str]| json(&[arguments, &table[..]].concat());
    let report = [
        "report", "paper-bi", "--alone", "--runs", "50", "--out", out,
    ];
    let report = json(&report);
    let study = &report["studies"][0];
    let page = std::fs::read_to_string(dir.path().join("report.html")).unwrap();
    for file in report["files"].as_array().unwrap() {
        let length = std::fs::metadata(dir.path().join(file.as_str().unwrap()))
            .unwrap()
            .len();
        assert!(length > 1000, "{file}");
    }
    let simulate = json(&["simulate", "paper-bi"]);
    for (key, value) in study["symbolic"].as_object().unwrap() {
        assert_eq!(&simulate[key], value, "{key}");
    }
    let nadir = simulate["nadir_hz"].as_f64().unwrap();
    assert!(page.contains(&format!("<td>{nadir:.3}")));
    let runs = [
        "simulate",
        "paper-bi",
        "--runs",
        "50",
        "--participation-error",
        "0.1",
    ];
    let runs = json(&runs);
    assert_eq!(runs["psi"], study["robustness"]["psi"]);
    assert_eq!(runs["worst"], study["robustness"]["worst"]);
    let seed = runs["worst"]["seed"].to_string();
    let again = [
        "simulate",
        "paper-bi",
        "--runs",
        "1",
        "--participation-error",
        "0.1",
        "--seed",
        &seed,
    ];
    assert_eq!(json(&again)["nadir_hz"], runs["worst"]["nadir_hz"]);
    compare_agrees(dir.path(), &json);
}

/// The scorecard has a row for each controller, loss and inertia, and the numbers of `simulate`
/// where nobody errs: without a response, exactly the same plant.
fn compare_agrees(dir: &Path, json: &dyn Fn(&[&str]) -> Value) {
    let csv = dir.join("compare.csv");
    let figures = dir.join("figures");
    let found = json(&[
        "compare",
        "paper-bi",
        "--loss-gw",
        "1.9,2.1",
        "--inertia",
        "2.8,4",
        "--csv",
        csv.to_str().unwrap(),
        "--figures",
        figures.to_str().unwrap(),
    ]);
    let rows = found["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3 * 2 * 4);
    assert_eq!(found["compared"], 6);
    // What the runs were watched for: the most changes of any row of the table, and no limit.
    let claim = &found["claims"][0];
    let of_table = rows.iter().filter(|row| row["controller"] == "table");
    let most = of_table
        .filter_map(|row| row["changes_most"].as_u64())
        .max();
    assert_eq!(claim["name"], "quiet");
    assert_eq!(claim["bound"].as_f64(), most.map(|n| n as f64));
    assert_eq!(claim["limit"], Value::Null);
    let row = |controller: &str| {
        let is = |row: &&Value| {
            row["loss_gw"] == 2.0
                && row["inertia_gw_s_per_hz"] == 4.0
                && row["controller"] == controller
        };
        rows.iter().find(is).unwrap()
    };
    let without = crate::json(&["simulate", "paper-bi", "--controller", "none", "--json"]);
    for key in ["nadir_hz", "final_hz", "seconds_below_49_5"] {
        // 1 ms of Runge-Kutta against exact steps of 10 ms: the printed digits.
        let (exact, other) = (row("none")[key].as_f64(), without[key].as_f64());
        assert!((exact.unwrap() - other.unwrap()).abs() < 1e-4, "{key}");
    }
    assert!(row("limit")["nadir_hz"].as_f64() > row("droop")["nadir_hz"].as_f64());
    let lines = std::fs::read_to_string(csv).unwrap().lines().count();
    assert_eq!(lines, 1 + rows.len());
    // Two figures for each inertia, as .svg and .csv, and the page.
    assert_eq!(std::fs::read_dir(figures).unwrap().count(), 2 * 2 * 2 + 1);
}
