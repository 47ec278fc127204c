//! Every key in turn: names, types, ranges and documentation, by a walk over the reference.

use std::collections::BTreeSet;

use super::super::*;
use super::{leaves, refused};

/// TOML text of `bad` where `doc` takes a number, the other elements of an array taken from the
/// default.
fn with_bad_element(doc: &KeyDoc, bad: &str, element: usize) -> String {
    match doc.allowed {
        Allowed::OptionalNumbers { len, .. } => {
            let mut items = vec!["1"; len];
            items[element] = bad;
            format!("{}=[{}]", doc.key, items.join(", "))
        }
        Allowed::Numbers { len, .. } => {
            let inner = doc.default.trim_matches(['[', ']']);
            let mut items: Vec<&str> = inner.split(", ").collect();
            assert_eq!(items.len(), len, "{}", doc.key);
            items[element] = bad;
            format!("{}=[{}]", doc.key, items.join(", "))
        }
        _ => format!("{}={bad}", doc.key),
    }
}

/// Numbers just outside what a key allows, as TOML writes them; empty where the key takes no
/// number.
fn bad_numbers(doc: &KeyDoc) -> Vec<String> {
    let range = match doc.allowed {
        Allowed::Number(range)
        | Allowed::OptionalNumber(range)
        | Allowed::NumberOrInterval(range)
        | Allowed::OptionalNumbers { each: range, .. }
        | Allowed::Numbers { each: range, .. } => range,
        Allowed::Integer { min, max } => {
            return [i64::from(min) - 1, -1, i64::from(max) + 1, i64::MAX]
                .map(|n| n.to_string())
                .to_vec();
        }
        Allowed::Flag
        | Allowed::Choice(_)
        | Allowed::Name
        | Allowed::OptionalFormula
        | Allowed::OptionalParticipation
        | Allowed::OptionalLoss => {
            return Vec::new();
        }
    };
    let below = if range.min_included {
        range.min.next_down()
    } else {
        range.min
    };
    let above = if range.max_included {
        range.max.next_up()
    } else {
        range.max
    };
    let mut bad: Vec<String> = [below, above, -1e300, 1e300]
        .iter()
        .map(|x| format!("{x:e}"))
        .collect();
    bad.extend(["nan", "inf", "-inf"].map(str::to_owned));
    bad
}

#[test]
fn the_key_table_and_the_structs_have_the_same_keys() {
    // Optional keys are printed where they are there.
    let bands = [
        "preference.always_on=true",
        "uncertainty.inertia_gw_s_per_hz=[2, 4]",
        "uncertainty.governor_gain_gw_per_hz=[-5, -4]",
        "uncertainty.damping_gw_per_hz=[0.8, 1]",
        "uncertainty.governor_time_s=[2, 3]",
        "uncertainty.turbine_time_s=[0.4, 0.6]",
        "uncertainty.lead_time_s=[1, 3]",
        "uncertainty.lag_time_s=[10, 14]",
        "plant.governor.deadband_hz=0.015",
        "plant.governor.rate_gw_per_s=0.2",
        "plant.governor.lower_gw=-1",
        "plant.governor.upper_gw=1",
        "chance.loss=gb-synthetic",
        "chance.participation=exact",
        "chance.draw_interval_s=1.5",
        "chance.noise_hz=0.001",
        "uncertainty.hostile_share=0.01",
        "uncertainty.level_discrepancy=0.04",
        "uncertainty.inertia_lost_s_per_hz=0.1",
        "uncertainty.loss_profile=constant",
        "uncertainty.participation_absolute=0.99",
        "uncertainty.participation_confidence=0.5",
        "requirements.changes_per_300_s=30",
    ];
    let spec = super::with(&bands).unwrap();
    let text = toml::to_string(&spec).unwrap();
    let listed: BTreeSet<String> = reference().iter().map(|doc| doc.key.to_owned()).collect();
    let mut printed = leaves(&toml::from_str(&text).unwrap());
    printed.insert(super::super::keys::FORMULA.to_owned());
    // A law by games alone has this one, a response most of the others.
    let games = super::with(&["preference.recovery_per_s=1"]).unwrap();
    printed.extend(leaves(
        &toml::from_str(&toml::to_string(&games).unwrap()).unwrap(),
    ));
    assert_eq!(printed, listed);
    assert_eq!(Spec::from_toml(&text, "printed", &[]).unwrap(), spec);
}

#[test]
fn the_field_docs_agree_with_the_key_table() {
    let source = [
        include_str!("../schema.rs"),
        include_str!("../plant.rs"),
        include_str!("../governor.rs"),
        include_str!("../grid.rs"),
        include_str!("../sampling.rs"),
        include_str!("../claims.rs"),
        include_str!("../preference.rs"),
        include_str!("../meter.rs"),
        include_str!("../charger.rs"),
        include_str!("../chance.rs"),
    ]
    .concat()
    // Long lines are wrapped.
    .replace("\n    /// ", " ");
    for doc in reference() {
        let field = doc.key.rsplit('.').next().unwrap();
        let line = format!(
            "Unit: {}. Allowed: {}. Default: {}.\n",
            doc.unit, doc.allowed, doc.default
        );
        let follows = |after: &str| {
            after
                .lines()
                .map(str::trim)
                .find(|l| !l.starts_with("#["))
                .is_some_and(|l| l.starts_with(&format!("pub {field}:")))
        };
        assert!(
            source
                .match_indices(&line)
                .any(|(at, _)| follows(&source[at + line.len()..])),
            "{field}: {line}"
        );
    }
}

#[test]
fn every_number_out_of_range_or_not_finite_is_refused_by_its_key() {
    let mut tried = 0;
    for doc in reference() {
        let elements = match doc.allowed {
            Allowed::Numbers { len, .. } | Allowed::OptionalNumbers { len, .. } => len,
            _ => 1,
        };
        for bad in bad_numbers(&doc) {
            for element in 0..elements {
                let option = with_bad_element(&doc, &bad, element);
                let message = refused(&[&option], doc.key);
                assert!(message.contains(&format!("--set {option}")), "{message}");
                let finite = !bad.contains("nan") && !bad.contains("inf");
                assert!(
                    !finite || message.contains(&doc.allowed.to_string()),
                    "{message}"
                );
                tried += 1;
            }
        }
    }
    assert!(tried > 300, "{tried}");
}

#[test]
fn every_key_refuses_every_other_type() {
    let values = [
        "true",
        "\"text\"",
        "1979-05-27",
        "[]",
        "[true]",
        "{ a = 1 }",
        "[[1.0, 1.0], [1.0, 1.0]]",
        "1.5",
    ];
    for doc in reference() {
        for value in values {
            let fits = match doc.allowed {
                Allowed::Number(_) | Allowed::OptionalNumber(_) | Allowed::NumberOrInterval(_) => {
                    value == "1.5"
                }
                Allowed::Numbers { .. }
                | Allowed::OptionalNumbers { .. }
                | Allowed::Integer { .. } => false,
                Allowed::Flag => value == "true",
                // An override's text serves as a name whatever its type.
                Allowed::Choice(_) => value == "\"text\"",
                Allowed::Name
                | Allowed::OptionalFormula
                | Allowed::OptionalParticipation
                | Allowed::OptionalLoss => continue,
            };
            if !fits {
                let message = refused(&[&format!("{}={value}", doc.key)], doc.key);
                assert!(message.contains("; allowed: "), "{message}");
            }
        }
    }
    let message = refused(&["plant.lag_time_s=\"long\""], "plant.lag_time_s");
    assert_eq!(
        message,
        "shipped spec paper-bi with --set plant.lag_time_s=\"long\": plant.lag_time_s: found \"long\", a string; \
         allowed: a number from 0.001 to 1000 (s)"
    );
    refused(&["fleet.chargers=25000.0"], "fleet.chargers");
    refused(&["grid.width=[0.1, 0.1, 0.1]"], "grid.width");
    let text = "name = 5\n";
    assert_eq!(
        Spec::from_toml(text, "a.toml", &[]).unwrap_err().key(),
        Some("name")
    );
    let text = "plant = 5\n";
    assert_eq!(
        Spec::from_toml(text, "a.toml", &[]).unwrap_err().key(),
        Some("plant")
    );
}

#[test]
fn choices_and_names_are_listed() {
    let message = refused(&["grid.alignment=edge"], "grid.alignment");
    assert!(
        message.ends_with("found \"edge\"; allowed: \"centres\" or \"edges\""),
        "{message}"
    );
    for key in [
        "fleet.direction",
        "meter.kind",
        "uncertainty.loss_profile",
        "table.domain",
        "method.successor",
    ] {
        refused(&[&format!("{key}=other")], key);
    }
    refused(&["name=../up"], "name");
}

#[test]
fn unknown_keys_are_named_with_the_nearest_and_the_allowed() {
    let message = refused(&["plant.inertia=3"], "plant.inertia");
    assert!(
        message.starts_with("--set plant.inertia=3: plant.inertia: unknown key"),
        "{message}"
    );
    assert!(
        message.contains("allowed in [plant]: governor_gain_gw_per_hz, "),
        "{message}"
    );

    let from = |text: &str| {
        Spec::from_toml(text, "a.toml", &[])
            .unwrap_err()
            .to_string()
    };
    let message = from("[sampling]\nperiods_s = 1.0\n");
    assert_eq!(
        message,
        "a.toml: sampling.periods_s: unknown key (did you mean sampling.period_s?); \
         allowed in [sampling]: period_s, watch_s"
    );
    let message = from("[smapling]\nperiod_s = 1.0\n");
    assert!(
        message.contains("(did you mean sampling?)")
            && message.contains("at the top level: name, plant"),
        "{message}"
    );
    let message = from("[uncertainty]\ninitial = { low = [0, 0, 0, 0] }\n");
    assert!(
        message.contains("allowed in [uncertainty.initial]: lower, upper"),
        "{message}"
    );
    refused(&["grid.width.f=1"], "grid.width.f");
}

#[test]
fn none_is_refused_where_a_key_cannot_be_absent() {
    for doc in reference() {
        if !doc.allowed.is_optional() {
            let message = refused(&[&format!("{}=none", doc.key)], doc.key);
            assert!(
                message.contains(
                    "requirements.formula, requirements.containment_hz, requirements.horizon_s"
                ),
                "{message}"
            );
        }
    }
    refused(&["plant=none"], "plant");
    refused(&["plant.zebra=none"], "plant.zebra");
}
