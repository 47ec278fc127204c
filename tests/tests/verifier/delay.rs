//! Tables whose commands act with a delay.

use std::sync::LazyLock;

use firmware::table::HEADER_LEN;
use lab::falsify::falsify;
use model::spec::Spec;
use model::verdict::ClaimName;
use tests::testing::{dense_of, load};

use super::judge;

/// A spec with Hold, a delay of half a period, and a little of every other uncertainty, on a grid
/// of 492,480 cells.
const DELAYED: [&str; 9] = [
    "name=delayed",
    "grid={lower=[-0.9,-0.4,-0.2,-0.2],upper=[0.3,3.4,2.2,2.2],width=[0.02,0.2,0.1,0.1],alignment=\"edges\"}",
    "sampling.period_s=2.0",
    "uncertainty.measurement=[0.0005,0.001,0.001,0.001]",
    "uncertainty.participation=0.01",
    "uncertainty.loss_gw=[1.995,2.005]",
    "uncertainty.actuation_delay_s=1.0",
    "requirements.outer_hz=[-0.4,0.2]",
    "requirements.inner_hz=[-0.4,0.2]",
];

fn delayed(more: &[&str]) -> Spec {
    load("gb-bi-band", &[&DELAYED, more].concat())
}

static DELAYED_TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| dense_of(&delayed(&[])));

#[test]
fn a_delayed_table_is_proven_and_stands() {
    let spec = delayed(&[]);
    let verdict = judge(&DELAYED_TABLE, &spec);
    assert!(verdict.verified, "{:#?}", verdict.claims);
    let [low, high] = verdict.counts.held_hz.unwrap();
    assert!(low >= -0.4 && high <= 0.2);
    let stands = falsify(&DELAYED_TABLE, &spec, 200_000, 1).unwrap();
    assert_eq!(stands.violation, None);
    // Three times the uncertainty of the loss, and much more of the participation: a real
    // trajectory breaks it.
    let wider = delayed(&[
        "uncertainty.loss_gw=[1.8,2.2]",
        "uncertainty.participation=0.3",
    ]);
    assert!(!judge(&DELAYED_TABLE, &wider).verified);
    let falls = falsify(&DELAYED_TABLE, &wider, 1_000_000, 1).unwrap();
    assert!(falls.violation.is_some(), "{falls:?}");
}

#[test]
fn a_changed_coefficient_and_another_delay_are_rejected() {
    let spec = delayed(&[]);
    let with = |word: usize, change: &dyn Fn(i32) -> i32| {
        let mut image = DELAYED_TABLE.clone();
        let at = HEADER_LEN + 4 * word;
        let value = i32::from_le_bytes(image[at..at + 4].try_into().unwrap());
        image[at..at + 4].copy_from_slice(&change(value).to_le_bytes());
        firmware::table::seal(&mut image).unwrap();
        image
    };
    // A hundredth of Φ_ff, of W on f, and a tenth of G_3 on f: each moves the prediction by a few
    // mHz.
    let third = 20 + 4 * 2;
    for (word, share) in [(0, 100), (16, 50), (third, 5)] {
        let mutant = with(word, &|value| value + value / share);
        let verdict = judge(&mutant, &spec);
        assert!(!verdict.verified, "word {word}");
    }
    // One unit in the last place is within what the exploration has room for, and it says so; but
    // the table is not the one that the spec asks for.
    let nearly = judge(&with(third, &|value| value + 1), &spec);
    let open: Vec<ClaimName> = nearly
        .claims
        .iter()
        .filter(|claim| !claim.holds)
        .map(|claim| claim.name)
        .collect();
    assert_eq!(open, [ClaimName::Header]);
    let longer = delayed(&["uncertainty.actuation_delay_s=1.1"]);
    let none = delayed(&["uncertainty.actuation_delay_s=0"]);
    for other in [longer, none] {
        let verdict = judge(&DELAYED_TABLE, &other);
        assert!(!verdict.verified);
        assert!(!verdict.claim(ClaimName::Header).unwrap().holds);
        assert!(!verdict.claim(ClaimName::Containment).unwrap().holds);
    }
}

#[test]
fn the_papers_table_is_proven_with_half_a_second() {
    let spec = load("paper-bi", &["uncertainty.actuation_delay_s=0.5"]);
    let bytes = dense_of(&spec);
    let verdict = judge(&bytes, &spec);
    assert!(verdict.verified, "{:#?}", verdict.claims);
    let lowest = verdict
        .claim(ClaimName::Containment)
        .unwrap()
        .bound
        .unwrap();
    // Real trajectories stay above the bound, and one comes near it.
    let found = falsify(&bytes, &spec, 200_000, 3).unwrap();
    assert_eq!(found.violation, None);
    let nearest = -0.8 + found.smallest_margin_hz;
    assert!(
        lowest <= nearest && nearest < lowest + 0.05,
        "{lowest} {nearest}"
    );
}

/// Each charger follows after a delay of its own, anywhere within 0.1 to 0.5 s and changing.
#[test]
fn a_table_for_a_range_of_delays_is_proven_and_stands() {
    let key = "uncertainty.actuation_delay_s";
    let spec = delayed(&[&format!("{key}=[0.1,0.5]")]);
    let bytes = dense_of(&spec);
    let verdict = judge(&bytes, &spec);
    assert!(verdict.verified, "{:#?}", verdict.claims);
    let stands = falsify(&bytes, &spec, 200_000, 1).unwrap();
    assert_eq!(stands.violation, None);
    // With the most that a period allows, the same table is not proven.
    let longer = delayed(&[&format!("{key}=[0.1,2]")]);
    let verdict = judge(&bytes, &longer);
    assert!(!verdict.claim(ClaimName::Header).unwrap().holds);
    assert!(!verdict.claim(ClaimName::Stay).unwrap().holds);
    // And a real fleet breaks it.
    let falls = falsify(&bytes, &longer, 1_000_000, 1).unwrap();
    assert!(falls.violation.is_some(), "{falls:?}");
}
