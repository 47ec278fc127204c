//! The spec from outside: shipped specs and overrides here, then every key in turn, then relations
//! between keys.

use std::collections::BTreeSet;

use super::keys::{CHANGES, FORMULA, RECOVERY};
use super::*;

mod formula;
mod keys;
mod relations;

fn with(overrides: &[&str]) -> Result<Spec, SpecError> {
    let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
    Spec::load("paper-bi", &overrides)
}

/// Loads paper-bi with overrides that must be refused for `key`; gives the message.
fn refused(overrides: &[&str], key: &str) -> String {
    let Err(error) = with(overrides) else {
        panic!("{overrides:?} was accepted")
    };
    let message = error.to_string();
    assert_eq!(error.key(), Some(key), "{message}");
    assert!(
        message.contains(key) && message.contains("allowed"),
        "{message}"
    );
    message
}

/// Dotted paths of all keys of a document.
fn leaves(document: &toml::Table) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut pending = vec![(String::new(), document)];
    while let Some((prefix, table)) = pending.pop() {
        for (name, value) in table {
            match value {
                toml::Value::Table(inner) => pending.push((format!("{prefix}{name}."), inner)),
                _ => drop(found.insert(format!("{prefix}{name}"))),
            }
        }
    }
    found
}

#[test]
fn shipped_specs_load_and_have_the_papers_size() {
    assert_eq!(
        Spec::shipped_names(),
        [
            "paper-bi",
            "paper-uni",
            "gb-bi",
            "gb-uni",
            "gb-bi-slow",
            "gb-bi-ade7953",
            "gb-uni-ade7953",
            "gb-2019",
            "gb-uni-cars",
            "gb-low-inertia",
            "gb-bi-band",
            "gb-uni-band",
            "gb-bi-delay",
            "gb-bi-normal"
        ]
    );
    let by_games = ["gb-bi-band", "gb-uni-band", "gb-bi-delay", "gb-bi-normal"];
    for name in Spec::shipped_names() {
        let spec = Spec::load(name, &[]).unwrap();
        assert_eq!(spec.name, *name);
        assert_eq!(spec.input.levels(), 21);
        let containment_hz = match *name {
            "gb-bi-normal" | "gb-bi" | "gb-bi-ade7953" | "gb-2019" => -0.5,
            "gb-low-inertia" | "gb-bi-slow" => -0.6,
            _ => -0.8,
        };
        assert_eq!(spec.requirements.containment_hz, Some(containment_hz));
        let is_response = !name.starts_with("paper") && !by_games.contains(name);
        assert_eq!(spec.preference.always_on, is_response);
        // The paper's loop is examined over a horizon; ours for ever, which needs Hold.
        let paper = name.starts_with("paper");
        assert_eq!(spec.requirements.horizon_s, paper.then_some(120.0));
        assert_eq!(spec.requirements.stay, !paper);
        if paper {
            assert_eq!(spec.grid.cells(), 2_358_443);
        }
    }
    let bi = Spec::load("paper-bi", &[]).unwrap();
    assert_eq!(
        (bi.grid.cell_counts(), bi.sampling.ticks_per_period()),
        ([23, 41, 41, 61], 15)
    );
    let uni = Spec::load("paper-uni", &[]).unwrap();
    assert_eq!(
        (uni.grid.cell_counts(), uni.sampling.ticks_per_period()),
        ([23, 61, 41, 41], 20)
    );
    assert_eq!(
        (uni.fleet_power_gw(), uni.fleet.direction),
        (0.7, Direction::Unidirectional)
    );
}

#[test]
fn the_defaults_are_paper_bi_without_name_containment_and_horizon() {
    let overrides = [
        "name=unnamed",
        "requirements.containment_hz=none",
        "requirements.horizon_s=none",
    ];
    assert_eq!(with(&overrides).unwrap(), Spec::default());
    assert_eq!(Spec::from_toml("", "empty", &[]).unwrap(), Spec::default());
}

#[test]
fn shipped_specs_state_every_key() {
    for (name, text) in super::shipped::SHIPPED {
        let document: toml::Table = toml::from_str(text).unwrap();
        let mut stated: BTreeSet<String> = leaves(&document);
        if text.contains("\nstay = true") {
            // For ever is the absence of a horizon, which TOML cannot state.
            stated.insert("requirements.horizon_s".to_owned());
        }
        let is_response = text.contains("\nalways_on = true");
        stated.remove(RECOVERY);
        // A formula is another way to state the requirements, and a band that is absent is the
        // plant's number. What only a response has is not stated in a spec for games.
        let only_of_responses = |key: &str| {
            ["preference.", "meter."]
                .iter()
                .any(|section| key.starts_with(section))
                || [
                    "uncertainty.loss_profile",
                    "uncertainty.participation_absolute",
                    "uncertainty.own_clocks",
                ]
                .contains(&key)
        };
        let all: BTreeSet<String> = reference()
            .iter()
            .filter(|doc| !matches!(doc.allowed, Allowed::OptionalNumbers { .. }))
            // Absent unless they are asked about.
            .filter(|doc| {
                ![
                    "uncertainty.participation_confidence",
                    "uncertainty.hostile_share",
                    "uncertainty.level_discrepancy",
                    "uncertainty.inertia_lost_s_per_hz",
                ]
                .contains(&doc.key)
            })
            .map(|doc| doc.key.to_owned())
            // The laboratory's cars are ideal unless a spec says otherwise, governors have no
            // limits, and nothing is drawn.
            .filter(|key| {
                let sections = ["charger.", "plant.governor.", "chance."];
                !sections.iter().any(|section| key.starts_with(section))
            })
            .filter(|key| ![FORMULA, CHANGES, RECOVERY].contains(&key.as_str()))
            .filter(|key| is_response || !only_of_responses(key))
            .collect();
        stated.retain(|key| !key.ends_with("_per_hz") || !key.starts_with("uncertainty."));
        stated.retain(|key| !key.starts_with("plant.governor."));
        stated.retain(|key| !key.starts_with("charger."));
        stated.remove("uncertainty.level_discrepancy");
        assert_eq!(stated, all, "{name}");
    }
}

#[test]
fn overrides_apply_in_order_and_none_removes_an_optional_key() {
    let spec = with(&[
        "plant.inertia_gw_s_per_hz=3",
        "plant.inertia_gw_s_per_hz=3.5",
        "grid.alignment=edges",
        "requirements.containment_hz=none",
        "uncertainty.initial={ lower = [-0.02, 0, 0, 0] }",
        "uncertainty.initial.upper=[0.02, 0, 0, 0]",
        "name=trial",
    ])
    .unwrap();
    assert_eq!(spec.plant.inertia_gw_s_per_hz, 3.5);
    assert_eq!(spec.grid.alignment, Alignment::Edges);
    assert_eq!(spec.requirements.containment_hz, None);
    assert_eq!(spec.uncertainty.initial.lower[0], -0.02);
    assert_eq!(spec.uncertainty.initial.upper[0], 0.02);
    assert_eq!(spec.name, "trial");
    // Removing what is absent is no error.
    with(&["requirements.horizon_s=none", "requirements.horizon_s=none"]).unwrap();
}

#[test]
fn the_hash_changes_with_every_key() {
    // A value other than the default that is valid beside the others.
    let changes = [
        "name=other",
        "plant.governor_gain_gw_per_hz=-4",
        "plant.governor_time_s=2",
        "plant.turbine_time_s=1",
        "plant.lead_time_s=1",
        "plant.lag_time_s=11",
        "plant.damping_gw_per_hz=2",
        "plant.inertia_gw_s_per_hz=3",
        "plant.governor.deadband_hz=0.015",
        "plant.governor.rate_gw_per_s=0.2",
        "plant.governor.lower_gw=-1",
        "plant.governor.upper_gw=1",
        "fleet.chargers=25001",
        "fleet.power_per_charger_kw=28",
        "fleet.direction=unidirectional",
        "baseline.deadband_hz=0.1",
        "baseline.droop_hz=0.4",
        "baseline.time_s=0.03",
        "grid.lower=[-1, -0.05, 0, 0]",
        "grid.upper=[0.1, 2, 2, 2.95]",
        "grid.width=[0.05, 0.05, 0.05, 0.1]",
        "grid.alignment=edges",
        "input.step=0.1",
        "sampling.period_s=1.6",
        "sampling.watch_s=0.05",
        "preference.always_on=true",
        "preference.droop_gw_per_hz=5",
        "preference.setpoint_hz=-0.06",
        "preference.slope_gain_gw_s_per_hz=1",
        "preference.slope_threshold_hz_per_s=0.04",
        "preference.slope_window_s=0.4",
        "preference.slope_most_gw=0.8",
        "preference.slope_release_gw_per_s=0.04",
        "preference.smallest_change=0.04",
        "preference.recovery_per_s=1",
        "meter.kind=zero-crossing",
        "meter.jitter_us=1",
        "meter.clock_ppm=20",
        "meter.resolution_hz=0.001",
        "meter.window_cycles=5",
        "meter.latest_age_ms=20",
        "meter.bias_hz=0.001",
        "uncertainty.loss_gw=[1.9, 2]",
        "uncertainty.loss_profile=constant",
        "uncertainty.participation=0.1",
        "uncertainty.participation_absolute=0.01",
        "uncertainty.participation_confidence=0.5",
        "uncertainty.hostile_share=0.01",
        "uncertainty.level_discrepancy=0.04",
        "uncertainty.measurement=[0, 0, 0, 0.01]",
        "uncertainty.actuation_delay_s=[0.1, 0.5]",
        "uncertainty.inertia_gw_s_per_hz=[2.04, 5]",
        "uncertainty.inertia_lost_s_per_hz=0.1",
        "uncertainty.governor_gain_gw_per_hz=[-5, -4]",
        "uncertainty.damping_gw_per_hz=[0.8, 1]",
        "uncertainty.governor_time_s=[2, 3]",
        "uncertainty.turbine_time_s=[0.4, 0.6]",
        "uncertainty.lead_time_s=[1, 3]",
        "uncertainty.lag_time_s=[10, 14]",
        "uncertainty.own_clocks=true",
        "uncertainty.initial.lower=[-0.01, 0, 0, 0]",
        "uncertainty.initial.upper=[0.01, 0, 0, 0]",
        "requirements.formula=G(f >= -0.8)",
        "requirements.containment_hz=none",
        "requirements.outer_hz=[-0.35, 0]",
        "requirements.inner_hz=[-0.2, 0]",
        "requirements.settle_within_s=59",
        "requirements.stay=true",
        "requirements.horizon_s=none",
        "requirements.changes_per_300_s=30",
        "table.domain=reachable",
        "table.version=2",
        "method.successor=exact-linear",
        "method.between_samples=true",
    ];
    let changed: Vec<&str> = changes
        .iter()
        .map(|text| text.split('=').next().unwrap())
        .collect();
    let all: Vec<&str> = reference().iter().map(|doc| doc.key).collect();
    // The laboratory's cars and what is drawn are no part of what a table was made for.
    let (apart, rest): (Vec<&str>, Vec<&str>) = all
        .iter()
        .partition(|key| key.starts_with("charger.") || key.starts_with("chance."));
    assert_eq!(changed, rest);
    assert_eq!(apart.len(), 14);
    let other = with(&[
        "charger.dead_time_s=[0, 6]",
        "charger.draw=[0.5, 1]",
        "chance.participation=gaussian:0.05",
        "chance.loss=gb-synthetic",
    ]);
    assert_eq!(other.unwrap().hash(), with(&[]).unwrap().hash());

    let mut hashes = BTreeSet::from([with(&[]).unwrap().hash()]);
    for change in changes {
        // Some keys go with a response only.
        let response = ["preference.always_on=true", change];
        let covered = [&response[..], &["uncertainty.participation_absolute=0.99"]].concat();
        let changed = with(&[change])
            .or_else(|_| with(&response))
            .or_else(|_| with(&covered));
        assert!(
            hashes.insert(changed.unwrap().hash()),
            "{change} gives a hash that was there before"
        );
    }
}
