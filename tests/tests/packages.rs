//! Who may depend on whom: the compiler keeps the verifier independent, as long as its manifest
//! does not change.
#![allow(clippy::expect_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// The packages of this workspace that each package's own code names as dependencies; those of its
/// tests are left out.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--offline",
            "--no-deps",
        ])
        .current_dir(tests::root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{output:?}");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo prints JSON");
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let packages = list(&metadata["packages"]);
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let of = |package: &Value| {
        list(&package["dependencies"])
            .iter()
            .filter(|dependency| dependency["kind"] != "dev")
            .map(name)
            .filter(|name| ours.contains(name))
            .collect()
    };
    packages.iter().map(|p| (name(p), of(p))).collect()
}

/// What `package` reaches, over any number of steps.
fn reached(package: &str) -> BTreeSet<String> {
    let dependencies = dependencies();
    let mut reached = BTreeSet::new();
    let mut open = vec![package.to_owned()];
    while let Some(name) = open.pop() {
        for next in &dependencies[&name] {
            if reached.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    reached
}

fn names(of: &[&str]) -> BTreeSet<String> {
    of.iter().map(|&name| name.to_owned()).collect()
}

#[test]
fn the_verifier_depends_on_model_and_firmware_alone() {
    assert_eq!(reached("verify"), names(&["firmware", "model"]));
}

/// `cargo fw` must not wait for synthesis, simulation and report, nor `cargo test-all` for
/// anything.
#[test]
fn the_runners_are_built_without_the_engine() {
    let device = [
        "c-api", "firmware", "product", "service", "settings", "update",
    ];
    assert_eq!(reached("fw"), names(&[&device[..], &["model"]].concat()));
    assert_eq!(reached("test-all"), names(&[]));
}

#[test]
fn nothing_flows_back() {
    assert_eq!(reached("firmware"), names(&[]));
    assert_eq!(reached("c-api"), names(&["firmware"]));
    assert_eq!(reached("settings"), names(&["firmware"]));
    assert_eq!(reached("service"), names(&["firmware", "settings"]));
    assert_eq!(reached("update"), names(&["firmware"]));
    let parts = ["firmware", "service", "settings", "update"];
    assert_eq!(reached("product"), names(&parts));
    assert_eq!(reached("model"), names(&["firmware"]));
    assert_eq!(reached("synth"), names(&["firmware", "model"]));
    assert_eq!(reached("lab"), names(&["firmware", "model"]));
}
