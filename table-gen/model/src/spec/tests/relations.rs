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
    let message = refused(&["sampling.watch_s=0.2"], "sampling.period_s");
    assert!(message.contains("such as 1.6 s"), "{message}");
    refused(&["sampling.period_s=1.5000001"], "sampling.period_s");
    let message = refused(&["sampling.period_s=0.05"], "sampling.period_s");
    assert!(message.contains("such as 0.1 s"), "{message}");
    // A charger's watchdog would bite: the reader refuses such a table too.
    refused(&["sampling.watch_s=0.201"], "sampling.watch_s");
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

/// A response on the paper's fleet, with these keys besides.
fn response(more: &[&str]) -> Vec<String> {
    std::iter::once("preference.always_on=true")
        .chain(more.iter().copied())
        .map(str::to_owned)
        .collect()
}

#[test]
fn what_games_do_not_cover_is_refused_by_its_key_and_taken_for_a_response() {
    let only_responses = [
        "uncertainty.own_clocks=true",
        "uncertainty.participation_absolute=0.01",
        "meter.kind=zero-crossing",
    ];
    for option in only_responses {
        let key = option.split('=').next().unwrap();
        let message = refused(&[option], key);
        assert!(message.contains("which games do not cover"), "{message}");
        assert!(message.contains("preference.always_on"), "{message}");
        Spec::load("paper-bi", &response(&[option])).unwrap();
    }
    // Plants in bands, if f has a limit.
    for option in [
        "uncertainty.inertia_gw_s_per_hz=[3.9, 4.1]",
        "uncertainty.inertia_lost_s_per_hz=0.05",
        "uncertainty.governor_gain_gw_per_hz=[-5, -4.9]",
        "uncertainty.damping_gw_per_hz=[0.9, 1]",
        "uncertainty.governor_time_s=[2, 3]",
        "uncertainty.turbine_time_s=[0.4, 0.6]",
        "uncertainty.lead_time_s=[1, 3]",
        "uncertainty.lag_time_s=[10, 14]",
    ] {
        with(&[option]).unwrap();
        let unlimited = [option, "requirements.containment_hz=none"];
        refused(&unlimited, "requirements.containment_hz");
    }
    // A range of delays up to a period.
    with(&["uncertainty.actuation_delay_s=[0.1, 0.5]"]).unwrap();
    // Games cover any loss in the band, so the gentler profiles too.
    with(&["uncertainty.loss_profile=constant"]).unwrap();
    // A response need not predict, so its delay need not be whole ticks.
    Spec::load(
        "paper-bi",
        &response(&["uncertainty.actuation_delay_s=0.15"]),
    )
    .unwrap();
}

#[test]
fn intervals_are_the_right_way_round() {
    for option in [
        "uncertainty.actuation_delay_s=[0.5, 0.1]",
        "uncertainty.inertia_gw_s_per_hz=[5, 2]",
        "uncertainty.governor_gain_gw_per_hz=[-4, -5]",
        "uncertainty.damping_gw_per_hz=[1, 0.8]",
        "uncertainty.governor_time_s=[3, 2]",
        "uncertainty.turbine_time_s=[0.6, 0.4]",
        "uncertainty.lead_time_s=[3, 1]",
        "uncertainty.lag_time_s=[14, 10]",
    ] {
        let key = option.split('=').next().unwrap();
        let error = Spec::load("paper-bi", &response(&[option])).unwrap_err();
        assert!(
            matches!(&error, SpecError::Inverted { key: found, .. } if *found == key),
            "{error:?}"
        );
    }
}

#[test]
fn a_response_fits_the_device() {
    let of = |option: &str| Spec::load("paper-bi", &response(&[option]));
    let refused = |option: &str, key: &str| {
        let error = of(option).unwrap_err();
        assert_eq!(error.key(), Some(key), "{error}");
        error.to_string()
    };
    let window = "preference.slope_window_s";
    let message = refused("preference.slope_window_s=0.25", window);
    assert!(message.contains("1 to 32 whole watch ticks"), "{message}");
    refused("preference.slope_window_s=3.3", window);
    of("preference.slope_window_s=3.2").unwrap();
    let message = refused("preference.slope_most_gw=1.5", "preference.slope_most_gw");
    assert!(message.contains("at most the fleet's 1.4 GW"), "{message}");
    of("preference.slope_most_gw=1.4").unwrap();
    // The whole fleet within 1 mHz: 1.4 GW / 0.001 Hz, more than the key's own range.
    let small = "fleet.chargers=250";
    let error = Spec::load(
        "paper-bi",
        &response(&[
            small,
            "preference.slope_most_gw=0.01",
            "preference.droop_gw_per_hz=15",
        ]),
    )
    .unwrap_err();
    assert_eq!(error.key(), Some("preference.droop_gw_per_hz"), "{error}");
    // 0.014 GW: 1000 GW s/Hz are 71 thousand fleets, past 31 bits of ppm.
    let error = Spec::load(
        "paper-bi",
        &response(&[
            small,
            "preference.slope_most_gw=0.01",
            "preference.slope_gain_gw_s_per_hz=1000",
        ]),
    )
    .unwrap_err();
    assert_eq!(
        error.key(),
        Some("preference.slope_gain_gw_s_per_hz"),
        "{error}"
    );
}

#[test]
fn a_preferred_law_of_games_goes_with_every_winning_cell() {
    let law = "preference.recovery_per_s=1";
    with(&[law]).unwrap();
    refused(
        &[law, "table.domain=reachable"],
        "preference.recovery_per_s",
    );
    let set = [law.to_owned()];
    let error = Spec::load("gb-bi", &set).unwrap_err();
    assert_eq!(error.key(), Some("preference.recovery_per_s"), "{error}");
}

#[test]
fn a_band_of_the_plant_holds_the_plants_own_number() {
    for option in [
        "uncertainty.inertia_gw_s_per_hz=[2, 2]",
        "uncertainty.governor_gain_gw_per_hz=[-4.9, -1]",
        "uncertainty.damping_gw_per_hz=[1.1, 2]",
        "uncertainty.governor_time_s=[2.6, 3]",
        "uncertainty.turbine_time_s=[0.1, 0.4]",
        "uncertainty.lead_time_s=[2.5, 3]",
        "uncertainty.lag_time_s=[40, 41]",
    ] {
        let key = option.split('=').next().unwrap();
        for base in ["gb-bi", "paper-bi"] {
            let error = Spec::load(base, &[option.to_owned()]).unwrap_err();
            let message = error.to_string();
            assert_eq!(error.key(), Some(key), "{message}");
            assert!(message.contains("beside plant."), "{message}");
        }
    }
}

/// A response's proof knows an H that stays after the event; games let it move.
#[test]
fn inertia_goes_with_a_loss_that_stays_unless_it_may_move() {
    let lost = "uncertainty.inertia_lost_s_per_hz=0.1";
    for profile in ["band", "non-decreasing"] {
        let profile = format!("uncertainty.loss_profile={profile}");
        let error = Spec::load("gb-bi", &[lost.to_owned(), profile]).unwrap_err();
        assert_eq!(
            error.key(),
            Some("uncertainty.inertia_lost_s_per_hz"),
            "{error}"
        );
    }
    Spec::load("gb-bi", &[lost.to_owned()]).unwrap();
    with(&[lost, "uncertainty.loss_profile=band"]).unwrap();
}

/// 4 GW s/Hz less 2.2 GW times what goes with each.
#[test]
fn inertia_that_goes_with_the_loss_leaves_some() {
    let set = |lost: f64| {
        let set = [format!("uncertainty.inertia_lost_s_per_hz={lost}")];
        crate::spec::Spec::load("gb-bi", &set)
    };
    let [low, high] = set(0.1).unwrap().inertia_band();
    assert!(
        (low - 3.78).abs() < 2e-6 && low <= 3.78 && high == 4.0,
        "{low}"
    );
    assert!(set(1.7).is_ok());
    let error = set(1.8).unwrap_err().to_string();
    assert!(
        error.contains("uncertainty.inertia_lost_s_per_hz"),
        "{error}"
    );
}

#[test]
fn a_range_of_delays_for_games_ends_within_a_period_and_begins_at_a_tick() {
    let key = "uncertainty.actuation_delay_s";
    // The paper's period is 1.5 s, its tick 0.1 s.
    with(&["uncertainty.actuation_delay_s=[0, 1.5]"]).unwrap();
    with(&["uncertainty.actuation_delay_s=[0.1, 0.123]"]).unwrap();
    for option in ["[0.1, 1.6]", "[0.1, 0.1234]"] {
        let set = format!("{key}={option}");
        let message = refused(&[&set], key);
        assert!(message.contains("sampling.period_s = 1.5 s"), "{message}");
        assert!(message.contains("preference.always_on"), "{message}");
        Spec::load("paper-bi", &response(&[&set])).unwrap();
    }
    let message = refused(&["uncertainty.actuation_delay_s=[0.15, 0.3]"], key);
    assert!(message.contains("as the least of a range"), "{message}");
}
