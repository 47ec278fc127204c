//! The firmware's own loop on emitted bytes, against the plant.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::control_loop::{ControlLoop, Source};
use firmware::droop::Droop;
use firmware::phase::Phase;
use firmware::table::{TableError, TableView};
use firmware::units::State;
use lab::simulation::closed_loop::{self, Estimator};
use lab::simulation::scenario::Scenario;
use model::spec::Spec;
use tests::testing::{built, load, shipped};

#[test]
fn the_papers_event_is_contained_and_settles() {
    for name in ["paper-bi", "paper-uni"] {
        let (spec, bytes) = (load(name, &[]), shipped(name));
        let view = TableView::parse_for_spec(&bytes, spec.hash()).unwrap();
        for estimator in [Estimator::FullState, Estimator::Observer] {
            let run = closed_loop::simulate(&spec, &view, &Scenario::of(&spec), estimator).unwrap();
            let summary = &run.summary;
            assert_eq!(
                summary.containment_breached,
                Some(false),
                "{name} {estimator:?}"
            );
            let outer = summary.entered_outer_s.unwrap();
            let inner = summary.entered_inner_s.unwrap();
            assert!(
                outer < inner && inner <= 60.0,
                "{name} {estimator:?}: {outer} {inner}"
            );
            let names: Vec<_> = run.phases.iter().map(|span| span.phase).collect();
            // Each phase comes first in the paper's order; C1 may take over again where f leaves I1
            // once more.
            let mut firsts: Vec<&str> = Vec::new();
            for phase in &names {
                if !firsts.contains(phase) {
                    firsts.push(phase);
                }
            }
            assert_eq!(
                firsts,
                ["no-control", "C1", "C2", "fixed"],
                "{name} {estimator:?}: {names:?}"
            );
            assert!(
                !names.contains(&"fallback"),
                "{name} {estimator:?}: {names:?}"
            );
        }
    }
}

/// A small table (coarse grid) for tests that look at every byte.
fn small() -> (Spec, Vec<u8>) {
    let set = [
        "grid.width=[0.05, 0.25, 0.25, 0.5]",
        "requirements.inner_hz=[-0.2, 0.0]",
        "method.successor=exact-linear",
    ];
    built("paper-bi", &set)
}

#[test]
fn any_damage_is_rejected_and_the_droop_takes_over() {
    let (_, bytes) = small();
    assert!(TableView::parse(&bytes).is_ok());
    println!("{} bytes, each flipped", bytes.len());
    let mut damaged = bytes.clone();
    for at in 0..bytes.len() {
        for bit in [0x01, 0x80, 0xFF] {
            damaged[at] ^= bit;
            assert!(TableView::parse(&damaged).is_err(), "byte {at} ^ {bit:#x}");
            damaged[at] ^= bit;
        }
    }
    for length in 0..bytes.len() {
        assert!(
            TableView::parse(&bytes[..length]).is_err(),
            "cut to {length}"
        );
    }
    damaged[bytes.len() / 2] ^= 1;
    let mut firmware = ControlLoop::new(&damaged);
    assert!(matches!(
        firmware.table_error(),
        Some(TableError::BadCrc { .. })
    ));
    for f_uhz in [
        0,
        -150_000,
        -400_000,
        -2_000_000,
        300_000,
        i32::MIN,
        i32::MAX,
    ] {
        let state = State([f_uhz, 0, 0, 0]);
        let action = firmware.step(state);
        assert_eq!(action.source, Source::DroopNoTable);
        assert_eq!(action.phase, Phase::Fallback);
        assert_eq!(action.participation, Droop::PAPER.participation(state));
    }
}

#[test]
fn a_foreign_table_is_named() {
    let (spec, bytes) = small();
    let other = load("paper-uni", &[]);
    let error = TableView::parse_for_spec(&bytes, other.hash()).unwrap_err();
    assert_eq!(
        error,
        TableError::ForeignSpec {
            found: spec.hash(),
            expected: other.hash()
        }
    );
}

#[test]
fn a_state_outside_the_table_is_answered_by_the_droop() {
    let (_, bytes) = small();
    let mut firmware = ControlLoop::new(&bytes);
    // Far below the grid: no law, so the droop saturates; back inside a law's domain the table
    // takes over again.
    let action = firmware.step(State([-3_000_000, 0, 0, 0]));
    assert_eq!(
        (action.source, action.participation.ppm()),
        (Source::DroopOutside, 1_000_000)
    );
    let action = firmware.step(State([-320_000, 0, 0, 0]));
    assert!(matches!(action.phase, Phase::C1 | Phase::Fallback));
}
