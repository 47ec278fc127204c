//! The paper's own cases, over their horizon.

use model::verdict::{ClaimName, Verdict};
use tests::testing::{dense_of, load};

use super::{PAPER_BI, judge};

#[test]
fn the_papers_bidirectional_case_is_proven() {
    let spec = load("paper-bi", &[]);
    let verdict = judge(&PAPER_BI, &spec);
    assert!(verdict.verified, "{:#?}", verdict.claims);
    assert_eq!(verdict.counterexample, None);
    assert_eq!(verdict.spec_hash, verdict.table_spec_hash);
    let bound = |name| verdict.claim(name).unwrap().bound.unwrap();
    // A simulation of the event from one moment is one of the trajectories: the bounds must not be
    // tighter.
    assert!(bound(ClaimName::Containment) < -0.45 && bound(ClaimName::Containment) > -0.5);
    assert!(bound(ClaimName::Settle) >= 10.5 && bound(ClaimName::Settle) <= 15.0);
}

#[test]
fn the_papers_unidirectional_case_is_proven() {
    let spec = load("paper-uni", &[]);
    let verdict = judge(&dense_of(&spec), &spec);
    assert!(verdict.verified, "{:#?}", verdict.claims);
    let bound = |name| verdict.claim(name).unwrap().bound.unwrap();
    // Measured independently for one moment of the event: lowest f -0.640 Hz, I2 13.45 s after the
    // event.
    assert!(bound(ClaimName::Containment) < -0.640 && bound(ClaimName::Containment) > -0.67);
    assert!(verdict.counts.event_to_inner_s.unwrap() >= 13.45);
}

#[test]
fn the_same_table_gives_the_same_verdict() {
    let spec = load("paper-bi", &[]);
    assert_eq!(judge(&PAPER_BI, &spec), judge(&PAPER_BI, &spec));
}

#[test]
fn the_verdict_serialises_with_its_documented_keys() {
    let spec = load("paper-bi", &[]);
    let verdict = judge(&PAPER_BI, &spec);
    let json = serde_json::to_value(&verdict).unwrap();
    let text = serde_json::to_string(&verdict).unwrap();
    assert_eq!(serde_json::from_str::<Verdict>(&text).unwrap(), verdict);
    for key in [
        "verified",
        "claims",
        "reachable_cells",
        "counterexample",
        "spec_hash",
        "table_sha256",
    ] {
        assert!(json.get(key).is_some(), "{key}");
    }
    let claim = &json["claims"][0];
    for key in ["name", "holds", "bound"] {
        assert!(claim.get(key).is_some(), "{key}");
    }
}
