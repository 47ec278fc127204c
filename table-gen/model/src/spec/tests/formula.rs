//! `requirements.formula`: what it gives, what it refuses, and that it is part of the spec's name.

use super::super::*;

const PAPER: &str = "G(f >= -0.8) & G(!(f in I1) -> F[<=40s] f in I1) & G((f in I1 & !(f in I2)) -> F[<=20s] f in I2)";

fn load(requirements: &str) -> Result<Spec, SpecError> {
    Spec::from_toml(requirements, "a.toml", &[])
}

fn with_formula(formula: &str, keys: &str) -> Result<Spec, SpecError> {
    load(&format!("[requirements]\nformula = {formula:?}\n{keys}"))
}

fn refused(formula: &str, keys: &str, key: &str) -> String {
    let error = with_formula(formula, keys).unwrap_err();
    assert_eq!(error.key(), Some(key), "{error}");
    error.to_string()
}

#[test]
fn the_papers_requirements_by_formula_are_those_by_keys() {
    let by_keys = load("requirements = { containment_hz = -0.8 }").unwrap();
    let mut by_formula = with_formula(PAPER, "").unwrap();
    assert_ne!(by_formula.hash(), by_keys.hash());
    assert!(by_formula.requirements.formula.take().is_some());
    assert_eq!(by_formula, by_keys);
    assert_eq!(by_formula.hash(), by_keys.hash());
}

#[test]
fn every_conjunct_sets_its_key() {
    let text = "loss in [1.8, 2.2] -> G(f >= -0.7) & F[<=30s] G f in [-0.25, 0.1] \
                & G((f in [-0.35, 0.1] & !(f in [-0.25, 0.1])) -> F[<=15s] f in [-0.25, 0.1])";
    let spec = with_formula(text, "").unwrap();
    let requirements = &spec.requirements;
    assert_eq!(requirements.containment_hz, Some(-0.7));
    assert_eq!(requirements.outer_hz, [-0.35, 0.1]);
    assert_eq!(requirements.inner_hz, [-0.25, 0.1]);
    assert_eq!(requirements.settle_within_s, 45.0);
    assert!(requirements.stay);
    assert_eq!(spec.uncertainty.loss_gw, [1.8, 2.2]);
    // One band is both.
    let spec = with_formula("F G f in [-0.25, 0.1]", "").unwrap();
    assert_eq!(spec.requirements.outer_hz, [-0.25, 0.1]);
    assert_eq!(spec.requirements.inner_hz, [-0.25, 0.1]);
    // What it does not speak of keeps its key or its default.
    let spec = with_formula("G(f >= -0.7)", "settle_within_s = 50").unwrap();
    assert_eq!(spec.requirements.settle_within_s, 50.0);
    assert_eq!(spec.requirements.outer_hz, [-0.3, 0.0]);
}

#[test]
fn names_are_the_keys_bands() {
    let keys = "outer_hz = [-0.35, 0.05]\ninner_hz = [-0.2, 0.0]";
    let spec = with_formula(PAPER, keys).unwrap();
    assert_eq!(spec.requirements.outer_hz, [-0.35, 0.05]);
    assert_eq!(spec.requirements.inner_hz, [-0.2, 0.0]);
}

#[test]
fn a_key_that_disagrees_is_named() {
    let message = refused(
        PAPER,
        "containment_hz = -0.7",
        "requirements.containment_hz",
    );
    assert_eq!(
        message,
        "a.toml: requirements.containment_hz: found -0.7 beside a formula that says -0.8; \
         allowed: -0.8, or no such key: requirements.formula gives it"
    );
    refused(
        PAPER,
        "settle_within_s = 30",
        "requirements.settle_within_s",
    );
    let settled = "F G f in [-0.2, 0.0]";
    refused(settled, "stay = false", "requirements.stay");
    refused(settled, "inner_hz = [-0.1, 0.0]", "requirements.inner_hz");
    // The same value is no conflict, whether written 1 or 1.0.
    with_formula(PAPER, "settle_within_s = 60\ncontainment_hz = -0.80").unwrap();
    // An override after the file is told as one, and removing the formula leaves the keys.
    let text = format!("[requirements]\nformula = {PAPER:?}\n");
    let set = |item: &str| Spec::from_toml(&text, "a.toml", &[item.to_owned()]);
    let message = set("requirements.containment_hz=-0.7")
        .unwrap_err()
        .to_string();
    assert!(
        message.starts_with("a.toml with --set requirements.containment_hz=-0.7: "),
        "{message}"
    );
    assert_eq!(set("requirements.formula=none").unwrap(), Spec::default());
    // Shipped specs state every key; a formula that says the same is accepted, another is not.
    let paper =
        |formula: &str| Spec::load("paper-bi", &[format!("requirements.formula={formula}")]);
    assert!(paper(PAPER).is_ok());
    let error = paper("G(f >= -0.7)").unwrap_err();
    assert_eq!(error.key(), Some("requirements.containment_hz"));
}

#[test]
fn what_is_outside_the_fragment_is_named() {
    let key = "requirements.formula";
    let message = refused("G(f >= -0.8) & G(f <= 0.5)", "", key);
    assert!(
        message.contains("`G(f <= 0.5)` is outside the supported fragment"),
        "{message}"
    );
    refused("G(f >= ", "", key);
    refused("", "", key);
    refused("F f in I3", "", key);
    let message = refused("loss <= 2.2 -> G(f >= -0.8)", "", key);
    assert!(message.contains("on one side"), "{message}");
    let spec = load(
        "uncertainty.loss_gw = [1.8, 2.2]\nrequirements.formula = \"loss <= 2.2 -> G(f >= -0.8)\"",
    );
    assert_eq!(spec.unwrap().uncertainty.loss_gw, [1.8, 2.2]);
    // The games have checks of their own.
    refused("F f in [-0.2, 5]", "", "requirements.outer_hz");
    let keys = "outer_hz = [-0.1, 0]";
    refused("F f in [-0.2, 0]", keys, "requirements.inner_hz");
    let wrong_type = load("requirements.formula = true").unwrap_err();
    assert_eq!(wrong_type.key(), Some(key));
}

#[test]
fn the_hash_knows_the_formula_but_not_its_spelling() {
    let one = with_formula("G(f >= -0.8) & F f in I2", "").unwrap();
    let two = with_formula("always (f >= -0.80)   and eventually f in I2", "").unwrap();
    assert_eq!(one, two);
    assert_eq!(one.hash(), two.hash());
    // The printed spec is the same spec.
    let text = toml::to_string(&one).unwrap();
    assert_eq!(load(&text).unwrap(), one);
}

#[test]
fn a_spec_changed_in_code_is_checked_against_its_formula() {
    let mut spec = with_formula(PAPER, "").unwrap();
    spec.validate("here").unwrap();
    spec.requirements.containment_hz = Some(-0.7);
    let error = spec.validate("here").unwrap_err();
    assert_eq!(error.key(), Some("requirements.containment_hz"));
}
