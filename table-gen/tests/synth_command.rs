//! `synth` as a person meets it: bad input, the answer "no", progress and Ctrl-C.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A grid of 0.3 million cells, on which the games of `paper-bi` end within a blink.
const COARSE: &str = "grid.width=[0.05,0.1,0.1,0.1]";

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_table-gen"));
    command.args(arguments);
    command
}

fn synth(overrides: &[&str]) -> Output {
    let mut command = command(&["synth", "paper-bi"]);
    for value in overrides {
        command.args(["--set", value]);
    }
    command.output().unwrap()
}

/// `synth` ends with a code, says each of these words on stderr and nothing on stdout.
fn ends(overrides: &[&str], code: i32, words: &[&str]) {
    let output = synth(overrides);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{overrides:?}: {errors}");
    for word in words {
        assert!(errors.contains(word), "{overrides:?}: no {word}: {errors}");
    }
    assert!(output.stdout.is_empty(), "{overrides:?}");
}

#[test]
fn an_empty_target_is_bad_input() {
    ends(
        &["requirements.inner_hz=[-0.05,-0.04]"],
        2,
        &[
            "requirements.inner_hz",
            "empty target",
            "whole cell",
            "grid.width",
        ],
    );
    // Cells there are, but the error of the estimate takes them.
    ends(
        &["uncertainty.measurement=[0.1,0,0,0]"],
        2,
        &["C2", "no whole cell", "error of the estimate"],
    );
    ends(
        &[
            "requirements.outer_hz=[0.2,0.3]",
            "requirements.inner_hz=[0.2,0.3]",
        ],
        2,
        &[
            "requirements.outer_hz",
            "inside the grid",
            "-1.025",
            "0.125",
        ],
    );
}

#[test]
fn a_plant_that_outgrows_a_step_is_bad_input() {
    ends(
        &[
            COARSE,
            "plant.governor_gain_gw_per_hz=-100",
            "plant.damping_gw_per_hz=0",
            "plant.inertia_gw_s_per_hz=0.1",
            "sampling.period_s=20",
        ],
        2,
        &["cells away", "grows too fast", "shorten the period"],
    );
}

/// Without damping, and with a governor that does nothing, A is singular but for 1e-12: the
/// enclosures need no inverse.
#[test]
fn a_nearly_singular_plant_is_solved() {
    let output = synth(&[
        COARSE,
        "plant.governor_gain_gw_per_hz=-1e-12",
        "plant.damping_gw_per_hz=0",
    ]);
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn cells_without_width_and_too_many_inputs_are_bad_input() {
    ends(
        &["grid.width=[0.05,0,0.05,0.05]"],
        2,
        &["grid.width", "0.000001 to 100"],
    );
    ends(
        &["input.step=0.02"],
        2,
        &["input.step", "51 levels", "at most 32"],
    );
}

/// 13 trillion cells need 318 TB: more than any machine that runs this test has.
#[test]
fn a_grid_that_does_not_fit_is_refused_with_its_bytes() {
    let start = Instant::now();
    ends(
        &["grid.width=[0.001,0.001,0.001,0.001]"],
        2,
        &[
            "13229623708101 cells",
            "317510985771640 bytes",
            "memory available",
        ],
    );
    assert!(
        start.elapsed() < Duration::from_secs(60),
        "before it starts"
    );
}

#[test]
fn no_controller_names_the_requirement_and_the_closest_cells() {
    ends(
        &[COARSE, "requirements.stay=true"],
        1,
        &[
            "no: Hold",
            "requirements.stay fails",
            "came closest, with",
            "periods",
        ],
    );
    ends(
        &[COARSE, "uncertainty.loss_gw=[0,4]"],
        1,
        &[
            "no: C2",
            "requirements.inner_hz fails",
            "cells came closest",
        ],
    );
}

#[test]
fn a_short_game_is_silent_where_nobody_watches() {
    let output = synth(&[COARSE]);
    assert!(output.status.success());
    assert!(output.stderr.is_empty());
}

/// Whether a process catches SIGINT (2): bit 1 of the mask in its status.
fn catches_interrupts(id: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & 2 != 0)
}

/// Sends SIGINT as soon as the process catches it: the games are then still to come.
fn interrupt(mut child: Child) -> Output {
    let start = Instant::now();
    while !catches_interrupts(child.id()) {
        assert!(start.elapsed() < Duration::from_secs(60));
        assert!(child.try_wait().unwrap().is_none(), "ended by itself");
        std::thread::sleep(Duration::from_millis(1));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    child.wait_with_output().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out_text = out.to_str().unwrap();
    // 9.2 million cells: seconds of work, of which the first sweep is a small part.
    let fine = "grid.width=[0.05,0.05,0.025,0.025]";
    for arguments in [
        vec!["synth", "paper-bi", "--set", fine],
        vec!["build", "paper-bi", "--set", fine, "--out", out_text],
    ] {
        let child = command(&arguments)
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let output = interrupt(child);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(errors.contains("interrupted"), "{arguments:?}: {errors}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(is_empty(folder.path()), "{arguments:?}");
    }
}

fn is_empty(folder: &Path) -> bool {
    std::fs::read_dir(folder).unwrap().next().is_none()
}
