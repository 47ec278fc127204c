//! `prob` as a person runs it: keys, files, exit codes.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;
use std::process::{Command, Output};

fn table(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../firmware/tables")
        .join(name)
}

fn prob(name: &str, rest: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_table-gen"));
    command
        .arg("prob")
        .arg(table(name))
        .args(rest)
        .output()
        .unwrap()
}

#[test]
fn the_first_two_seconds_of_a_flashed_table() {
    let dir = tempfile::tempdir().unwrap();
    let drn = dir.path().join("chain.drn");
    let out = prob(
        "paper-bi.bin",
        &[
            "--spec",
            "paper-bi",
            "--participation",
            "gaussian:0.002",
            "--horizon-s",
            "2",
            "--bin-gw",
            "0.005",
            "--runs",
            "200",
            "--json",
            "--drn",
            drn.to_str().unwrap(),
        ],
    );
    assert_eq!(
        out.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let bound = report["lower_bound"].as_f64().unwrap();
    assert!(bound > 0.99999 && bound < 1.0);
    assert!(report["simulated"]["share"].as_f64().unwrap() >= bound);
    assert!(
        report["states"].as_u64().unwrap() > 100 && report["transitions"].as_u64().unwrap() > 100
    );
    assert_eq!(report["horizon_s"].as_f64(), Some(2.0));
    let text = std::fs::read_to_string(drn).unwrap();
    assert!(text.starts_with("// paper-bi: 1 - Pmax=? [F<="));
}

#[test]
fn a_limit_is_no_and_bad_input_is_named() {
    let spec = ["--spec", "paper-bi"];
    let code = |name: &str, rest: &[&str]| {
        let out = prob(name, &[&spec[..], rest].concat());
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    let (exit, said) = code("paper-bi.bin", &["--nodes-max", "10"]);
    assert!(
        exit == Some(1) && said.contains("more than 10 nodes"),
        "{said}"
    );
    let (exit, said) = code("paper-uni.bin", &[]);
    assert!(
        exit == Some(1) && said.contains("not of this spec"),
        "{said}"
    );
    let (exit, said) = code("paper-bi.bin", &["--bin-gw", "0"]);
    assert!(exit == Some(2) && said.contains("--bin-gw"), "{said}");
    let (exit, said) = code("paper-bi.bin", &["--noise-hz", "0.001"]);
    assert!(
        exit == Some(2) && said.contains("uncertainty.measurement"),
        "{said}"
    );
    let (exit, said) = code("paper-bi.bin", &["--participation", "gauss"]);
    assert!(exit == Some(2) && said.contains("gaussian:SIGMA"), "{said}");
    let (exit, said) = code("paper-bi.bin", &["--loss", "no-such.csv"]);
    assert!(exit == Some(2) && said.contains("no-such.csv"), "{said}");
}
