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

/// What is drawn may stand in the spec: the table's hash does not depend on it, and an option is
/// stronger. A chain that has too many nodes is cut, the command says so, and the bound is one.
#[test]
fn the_spec_says_what_is_drawn_and_a_cut_chain_says_so() {
    let json = |rest: &[&str]| -> serde_json::Value {
        let out = prob("paper-bi.bin", &[&["--spec", "paper-bi"], rest].concat());
        assert_eq!(out.status.code(), Some(0), "{out:?}");
        serde_json::from_slice(&out.stdout).unwrap()
    };
    let certain = json(&["--json"]);
    assert_eq!(certain["lower_bound"].as_f64(), Some(1.0));
    assert_eq!(certain["states"].as_u64(), Some(0));
    let drawn = ["--set", "chance.participation=uniform:0.0005", "--json"];
    // All draws within what the verifier proves: no chain is needed, and this one is cut at once.
    let union = json(&[&drawn[..], &["--errors", "0.0005", "--nodes-max", "10"]].concat());
    assert_eq!(union["lower_bound"].as_f64(), Some(1.0));
    assert!(union["cut"]["nodes"].as_u64().unwrap() > 0);
    let dir = tempfile::tempdir().unwrap();
    let svg = dir.path().join("lost.svg");
    let normal = ["--participation", "gaussian:0.0001", "--errors", "0.0005"];
    let drawn_as = ["--nodes-max", "10", "--json", "--figure"];
    let asked = [&normal[..], &drawn_as, &[svg.to_str().unwrap()]].concat();
    // Five deviations: 152 draws, each outside with 5.74e-7.
    let bound = json(&asked)["lower_bound"].as_f64().unwrap();
    assert!((1.0 - bound - 152.0 * 5.733e-7).abs() < 1e-8, "{bound}");
    let svg = std::fs::read_to_string(svg).unwrap();
    assert!(svg.contains("gaussian:0.0001,5 within 0.0500 %") && svg.contains("chain"));
    let cut = json(&[&drawn[..], &["--nodes-max", "10"]].concat());
    assert_eq!(cut["lower_bound"].as_f64(), Some(0.0));
    let option = json(&[&drawn[..], &["--participation", "exact"]].concat());
    assert_eq!(option["lower_bound"].as_f64(), Some(1.0));
    assert!(option["states"].as_u64().unwrap() > 10_000 && option["cut"].is_null());
}

/// Hold, and commands that act a second late: a chain is made (and cut here), with one step a
/// period; the union has one draw for each, eleven of which begin in ten seconds.
#[test]
fn a_table_whose_commands_act_late_has_a_chain() {
    let asked = ["--participation", "gaussian:0.02", "--horizon-s", "10"];
    let cut = ["--spec", "gb-bi-delay", "--nodes-max", "10", "--json"];
    let out = prob("gb-bi-delay.bin", &[&cut[..], &asked].concat());
    assert_eq!(out.status.code(), Some(0), "{out:?}");
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let bound = report["lower_bound"].as_f64().unwrap();
    assert!((1.0 - bound - 11.0 * 5.733e-7).abs() < 1e-9, "{bound}");
    assert_eq!(report["steps"].as_u64(), Some(11));
    assert!(report["states"].as_u64().unwrap() > 100);
}

#[test]
fn bad_input_is_named() {
    let spec = ["--spec", "paper-bi"];
    let code = |name: &str, rest: &[&str]| {
        let out = prob(name, &[&spec[..], rest].concat());
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    let (exit, said) = code("paper-bi.bin", &["--set", "chance.participation=gauss"]);
    assert!(
        exit == Some(2) && said.contains("chance.participation: found \"gauss\"; allowed: "),
        "{said}"
    );
    let (exit, said) = code("paper-bi.bin", &["--set", "chance.loss=no-such.csv"]);
    assert!(
        exit == Some(2) && said.contains("chance.loss: no-such.csv"),
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
