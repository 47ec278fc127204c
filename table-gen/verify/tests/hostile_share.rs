//! A share of the fleet that does as it likes: what a table bears is verified, more is refused.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::spec::Spec;
use model::verdict::{ClaimName, Verdict};
use synth::pipeline;
use verify::{VerifyError, verify_assuming};

/// The product at its largest losses: one band, so that a verdict takes seconds.
fn product() -> Spec {
    let set = [
        "uncertainty.loss_gw=[2.16, 2.2]".to_owned(),
        "requirements.inner_hz=[-0.33, 0.1]".to_owned(),
        "requirements.outer_hz=[-0.33, 0.1]".to_owned(),
        "requirements.containment_hz=-0.54".to_owned(),
    ];
    Spec::load("gb-bi", &set).unwrap()
}

fn judged(spec: &Spec, share: f64) -> Verdict {
    let bytes = pipeline::response(spec).unwrap();
    let mut assumed = spec.clone();
    assumed.uncertainty.hostile_share = Some(share);
    verify_assuming(&bytes, spec, &assumed, &|_| true).unwrap()
}

#[test]
fn a_share_that_a_table_bears_is_verified_and_more_is_refused() {
    let spec = product();
    let honest = judged(&spec, 0.0);
    let few = judged(&spec, 0.02);
    assert!(few.verified, "{few:#?}");
    assert_eq!(few.hostile_share, Some(0.02));
    // The table is the one of the spec without the key.
    assert_eq!(few.spec_hash, few.table_spec_hash);
    let lowest = |verdict: &Verdict| {
        let claim = verdict.claim(ClaimName::Containment);
        claim.and_then(|claim| claim.bound).unwrap()
    };
    assert!(lowest(&few) < lowest(&honest));
    let many = judged(&spec, 0.3);
    assert!(!many.verified);
    let failed: Vec<ClaimName> = many
        .claims
        .iter()
        .filter(|claim| !claim.holds)
        .map(|claim| claim.name)
        .collect();
    assert!(failed.contains(&ClaimName::Containment), "{failed:?}");
}

#[test]
fn nothing_else_may_differ_from_what_the_table_was_made_for() {
    let spec = product();
    let bytes = pipeline::response(&spec).unwrap();
    let mut assumed = spec.clone();
    assumed.uncertainty.participation = 0.05;
    let refused = verify_assuming(&bytes, &spec, &assumed, &|_| true);
    assert!(matches!(refused, Err(VerifyError::Unsupported { .. })));
}
