//! Relations between keys: each refused on its far side and accepted on its edge.

use super::super::*;
use super::{refused, with};

#[test]
fn intervals_in_the_wrong_order_are_refused() {
    refused(&["grid.upper=[-1.0, 2, 2, 3]"], "grid.upper");
    refused(&["grid.lower=[-1.0, 2.5, 0, 0]"], "grid.upper");
    refused(&["uncertainty.loss_gw=[2.1, 2.0]"], "uncertainty.loss_gw");
    with(&["uncertainty.loss_gw=[1.9, 2.1]"]).unwrap();
    refused(
        &["requirements.outer_hz=[0.0, -0.3]"],
        "requirements.outer_hz",
    );
    refused(
        &["requirements.inner_hz=[-0.1, -0.1]"],
        "requirements.inner_hz",
    );
    refused(
        &["uncertainty.initial.lower=[0.05, 0, 0, 0]"],
        "uncertainty.initial.upper",
    );
}

#[test]
fn targets_nest_and_containment_lies_below_them() {
    refused(
        &["requirements.inner_hz=[-0.35, 0.0]"],
        "requirements.inner_hz",
    );
    refused(
        &["requirements.inner_hz=[-0.15, 0.05]"],
        "requirements.inner_hz",
    );
    with(&["requirements.inner_hz=[-0.3, 0.0]"]).unwrap();
    refused(
        &["requirements.containment_hz=-0.3"],
        "requirements.containment_hz",
    );
    with(&["requirements.containment_hz=-0.31"]).unwrap();
    // Whole cells reach 0.125 Hz with centres.
    with(&["requirements.outer_hz=[-0.3, 0.125]"]).unwrap();
    refused(
        &["requirements.outer_hz=[-0.3, 0.13]"],
        "requirements.outer_hz",
    );
    refused(
        &[
            "requirements.containment_hz=none",
            "requirements.outer_hz=[-1.03, 0.0]",
        ],
        "requirements.outer_hz",
    );
    refused(
        &["requirements.inner_hz=[-0.1500005, 0.0]"],
        "requirements.inner_hz",
    );
}

#[test]
fn a_target_without_a_whole_cell_is_refused() {
    let message = refused(
        &["requirements.inner_hz=[-0.07, 0.0]"],
        "requirements.inner_hz",
    );
    assert!(
        message.contains("empty target: found [-0.07, 0] Hz") && message.contains("0.05 Hz wide"),
        "{message}"
    );
    // With centres the cell around -0.05 reaches from -0.075 to -0.025: one µHz less is too little.
    with(&["requirements.inner_hz=[-0.075, -0.025]"]).unwrap();
    refused(
        &["requirements.inner_hz=[-0.074999, -0.025]"],
        "requirements.inner_hz",
    );
    refused(
        &["requirements.inner_hz=[-0.075, -0.025001]"],
        "requirements.inner_hz",
    );
    refused(
        &[
            "requirements.outer_hz=[-0.04, 0.0]",
            "requirements.inner_hz=[-0.04, 0.0]",
        ],
        "requirements.outer_hz",
    );
}

#[test]
fn the_input_step_divides_one_into_at_most_32_levels() {
    refused(&["input.step=0.3"], "input.step");
    refused(&["input.step=0.050001"], "input.step");
    let message = refused(&["input.step=0.03125"], "input.step");
    assert!(
        message.contains("33 levels") && message.contains("32 bits"),
        "{message}"
    );
    assert_eq!(
        with(&["input.step=0.0322580645161290"])
            .unwrap()
            .input
            .levels(),
        32
    );
    assert_eq!(with(&["input.step=1"]).unwrap().input.levels(), 2);
}

#[test]
fn ticks_are_whole_milliseconds_and_divide_the_period() {
    refused(&["sampling.watch_s=0.0015"], "sampling.watch_s");
    let message = refused(&["sampling.watch_s=0.4"], "sampling.period_s");
    assert!(message.contains("such as 1.6 s"), "{message}");
    refused(&["sampling.period_s=1.5000001"], "sampling.period_s");
    let message = refused(&["sampling.watch_s=2"], "sampling.period_s");
    assert!(message.contains("such as 2 s"), "{message}");
    refused(
        &["sampling.period_s=66", "sampling.watch_s=0.001"],
        "sampling.watch_s",
    );
    assert_eq!(
        with(&["sampling.period_s=65.535", "sampling.watch_s=0.001"])
            .unwrap()
            .sampling
            .ticks_per_period(),
        65_535
    );
}

#[test]
fn cells_are_exact_on_the_device() {
    refused(&["grid.width=[0.0500005, 0.05, 0.05, 0.05]"], "grid.width");
    refused(&["grid.lower=[-1.0000004, 0, 0, 0]"], "grid.lower");
    refused(&["grid.upper=[0.1000004, 2, 2, 3]"], "grid.upper");
    // Half of an odd number of µHz is not a whole one.
    refused(&["grid.width=[0.05, 0.050001, 0.05, 0.05]"], "grid.width");
    refused(&["grid.lower=[-1.02, 0, 0, 0]"], "grid.lower");
    refused(&["grid.upper=[0.1, 2.01, 2, 3]"], "grid.upper");
    let edges = [
        "grid.alignment=edges",
        "grid.lower=[-1.02, 0, 0, 0]",
        "grid.upper=[0.13, 2, 2, 3]",
    ];
    assert_eq!(with(&edges).unwrap().grid.cell_counts(), [23, 40, 40, 60]);
}

#[test]
fn counts_fit_the_device_and_the_machine() {
    let message = refused(&["grid.width=[0.00001, 1, 1, 1]"], "grid.width");
    assert!(
        message.contains("110001 cells") && message.contains("at most 65535"),
        "{message}"
    );
    // 1101 * 2001 * 2001 * 3001 cells need 159 TB: more than any machine that runs this test has.
    let error = with(&["grid.width=[0.001, 0.001, 0.001, 0.001]"]).unwrap_err();
    assert!(
        matches!(
            error,
            SpecError::TooManyCells {
                cells: 13_229_623_708_101,
                ..
            }
        ),
        "{error:?}"
    );
}

#[test]
fn the_event_begins_inside_the_grid() {
    refused(
        &["uncertainty.initial.lower=[0, -0.03, 0, 0]"],
        "uncertainty.initial.lower",
    );
    with(&["uncertainty.initial.lower=[0, -0.025, 0, 0]"]).unwrap();
    refused(
        &["uncertainty.initial.upper=[0.2, 0, 0, 0]"],
        "uncertainty.initial.upper",
    );
}

#[test]
fn a_delay_is_a_whole_number_of_ticks_that_the_device_remembers() {
    let key = "uncertainty.actuation_delay_s";
    with(&["uncertainty.actuation_delay_s=6.4"]).unwrap();
    let message = refused(&["uncertainty.actuation_delay_s=6.5"], key);
    assert!(message.contains("at most 64, such as 6.4 s"), "{message}");
    let message = refused(&["uncertainty.actuation_delay_s=0.15"], key);
    assert!(message.contains("sampling.watch_s = 0.1 s"), "{message}");
    refused(&["uncertainty.actuation_delay_s=0.00005"], key);
    with(&[
        "uncertainty.actuation_delay_s=0.15",
        "sampling.watch_s=0.05",
    ])
    .unwrap();
}
