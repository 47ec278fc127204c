//! Formula to games: the fragment that the phases of the controller play.
//!
//! A formula in the fragment is a conjunction of these, in any order:
//!
//! | conjunct | becomes | game |
//! |---|---|---|
//! | `G(f >= c)` | `requirements.containment_hz` | avoid, in every reach game |
//! | `G(!(f in A) -> F f in A)`, also `F[<=t s]` | `requirements.outer_hz` | reach I1 |
//! | `G F f in A`, also `F[<=t s]` | the same in other words | reach I1, again and again |
//! | `G((f in A & !(f in B)) -> F f in B)`, also `F[<=t s]` | `requirements.inner_hz` | reach I2 |
//! | `F f in B`, also `F[<=t s]` | the same | reach I2 |
//! | `F G f in B`, `G(f in B -> G f in B)` | `requirements.stay` | reach, then safety |
//! | `(loss <= c) -> φ`, or `>=`, around all | an end of `uncertainty.loss_gw` | adversary |
//!
//! `F G F φ` is read as `G F φ`, and `G F G φ` as `F G φ`, which say the same.
//!
//! Bounds add up: the two reach steps follow each other, and the spec bounds their sum. Everything
//! else is refused with the sub-formula that no game plays.

use serde::Serialize;

use super::Spec;
use crate::logic::{Comparison, Formula, Interval, Signal};

/// What a formula asks of a spec; `None` leaves the spec's own value.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Compiled {
    /// `requirements.containment_hz`.
    pub containment_hz: Option<f64>,
    /// `requirements.outer_hz`.
    pub outer_hz: Option<[f64; 2]>,
    /// `requirements.inner_hz`.
    pub inner_hz: Option<[f64; 2]>,
    /// `requirements.settle_within_s`: the sum of the bounds.
    pub settle_within_s: Option<f64>,
    /// `requirements.stay`.
    pub stay: bool,
    /// Largest loss under which the promise is made \[GW\].
    pub loss_at_most_gw: Option<f64>,
    /// Smallest loss under which the promise is made \[GW\].
    pub loss_at_least_gw: Option<f64>,
}

/// A sub-formula outside the fragment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{part}` is outside the supported fragment: {reason}")]
pub struct NotSupported {
    /// The sub-formula, as it is written.
    pub part: String,
    /// Why.
    pub reason: &'static str,
}

impl NotSupported {
    fn new(part: &Formula, reason: &'static str) -> Self {
        Self {
            part: part.to_string(),
            reason,
        }
    }
}

/// Compiles a formula; the names `I1` and `I2` are the spec's bands.
///
/// # Errors
/// The first sub-formula that no game plays.
pub fn compile(formula: &Formula, spec: &Spec) -> Result<Compiled, NotSupported> {
    let mut out = Compiled::default();
    let mut body = formula;
    // Assumptions on the loss stand around everything else.
    while let Formula::Implies(assumption, promise) = body {
        loss(assumption, &mut out)?;
        body = promise;
    }
    let mut pending = vec![body];
    while let Some(part) = pending.pop() {
        match part {
            Formula::And(a, b) => {
                // The left one is looked at first, so that the first refusal is the first in the
                // text.
                pending.push(b);
                pending.push(a);
            }
            Formula::True => {}
            other => conjunct(other, spec, &mut out)?,
        }
    }
    Ok(out)
}

fn loss(assumption: &Formula, out: &mut Compiled) -> Result<(), NotSupported> {
    match assumption {
        Formula::Compare(Signal::Loss, Comparison::AtMost, value) => {
            out.loss_at_most_gw = Some(*value);
        }
        Formula::Compare(Signal::Loss, Comparison::AtLeast, value) => {
            out.loss_at_least_gw = Some(*value);
        }
        Formula::In(Signal::Loss, Interval::Ends(low, high)) => {
            out.loss_at_least_gw = Some(*low);
            out.loss_at_most_gw = Some(*high);
        }
        Formula::And(a, b) => {
            loss(a, out)?;
            loss(b, out)?;
        }
        other => {
            return Err(NotSupported::new(
                other,
                "around the whole formula only bounds of the loss can be assumed",
            ));
        }
    }
    Ok(())
}

fn conjunct(part: &Formula, spec: &Spec, out: &mut Compiled) -> Result<(), NotSupported> {
    match part {
        Formula::Always(None, of) => always(part, of, spec, out),
        Formula::Eventually(within_s, of) => {
            let target = match of.as_ref() {
                Formula::Always(None, inside) => {
                    if let Formula::Eventually(None, again) = inside.as_ref() {
                        return recurrent(inside, None, again, spec, out);
                    }
                    out.stay = true;
                    inside
                }
                _ => of,
            };
            let band = band(target, spec)?;
            set(&mut out.inner_hz, band, part)?;
            add(&mut out.settle_within_s, *within_s);
            Ok(())
        }
        Formula::Always(Some(_), _) => Err(NotSupported::new(
            part,
            "safety games have no end; use requirements.horizon_s",
        )),
        Formula::Until(..) => Err(NotSupported::new(
            part,
            "until is played only as reach-avoid: write G(f >= c) & F(f in B)",
        )),
        Formula::Or(..) => Err(NotSupported::new(part, "no game chooses between promises")),
        _ => Err(NotSupported::new(
            part,
            "a conjunct must begin with G or F, as in the table of the fragment",
        )),
    }
}

/// `G(of)`.
fn always(
    part: &Formula,
    of: &Formula,
    spec: &Spec,
    out: &mut Compiled,
) -> Result<(), NotSupported> {
    match of {
        Formula::Compare(Signal::Frequency, Comparison::AtLeast, value) => {
            let highest = out.containment_hz.map_or(*value, |other| other.max(*value));
            out.containment_hz = Some(highest);
            Ok(())
        }
        // G of a conjunction is the conjunction of G.
        Formula::And(a, b) => {
            always(part, a, spec, out)?;
            always(part, b, spec, out)
        }
        Formula::Implies(when, then) => triggered(when, then, spec, out),
        Formula::Eventually(None, inside) if matches!(**inside, Formula::Always(None, _)) => {
            conjunct(of, spec, out)
        }
        Formula::Eventually(within_s, again) => recurrent(of, *within_s, again, spec, out),
        Formula::Compare(Signal::Frequency, Comparison::AtMost, _) | Formula::In(..) => {
            Err(NotSupported::new(
                part,
                "chargers cannot hold f down: only G(f >= c) is a containment",
            ))
        }
        _ => Err(NotSupported::new(
            part,
            "under G only f >= c or a triggered reach or stay is played",
        )),
    }
}

/// `G F f in A`, of which `part` is the inside: `G(!(f in A) -> F f in A)` in other words.
fn recurrent(
    part: &Formula,
    within_s: Option<f64>,
    again: &Formula,
    spec: &Spec,
    out: &mut Compiled,
) -> Result<(), NotSupported> {
    let reached = band(again, spec)?;
    add(&mut out.settle_within_s, within_s);
    set(&mut out.outer_hz, reached, part)
}

/// `G(when -> then)`.
fn triggered(
    when: &Formula,
    then: &Formula,
    spec: &Spec,
    out: &mut Compiled,
) -> Result<(), NotSupported> {
    match (when, then) {
        // G(f in B -> G f in B)
        (Formula::In(..), Formula::Always(None, inside)) => {
            let (from, stays) = (band(when, spec)?, band(inside, spec)?);
            if from != stays {
                return Err(NotSupported::new(
                    then,
                    "what is entered and what is kept must agree",
                ));
            }
            out.stay = true;
            set(&mut out.inner_hz, stays, then)
        }
        // G(!(f in A) -> F f in A)
        (Formula::Not(outside), Formula::Eventually(within_s, target)) => {
            let (left, reached) = (band(outside, spec)?, band(target, spec)?);
            if left != reached {
                return Err(NotSupported::new(
                    then,
                    "it must reach the band that was left",
                ));
            }
            add(&mut out.settle_within_s, *within_s);
            set(&mut out.outer_hz, reached, then)
        }
        // G((f in A & !(f in B)) -> F f in B)
        (Formula::And(inside, outside), Formula::Eventually(within_s, target)) => {
            let (Formula::In(..), Formula::Not(outside)) = (inside.as_ref(), outside.as_ref())
            else {
                return Err(NotSupported::new(when, "expected f in A & !(f in B)"));
            };
            let outer = band(inside, spec)?;
            let (left, reached) = (band(outside, spec)?, band(target, spec)?);
            if left != reached {
                return Err(NotSupported::new(
                    then,
                    "it must reach the band that was not reached",
                ));
            }
            add(&mut out.settle_within_s, *within_s);
            set(&mut out.outer_hz, outer, when)?;
            set(&mut out.inner_hz, reached, then)
        }
        (_, Formula::Eventually(..)) => Err(NotSupported::new(
            when,
            "a reach is triggered by !(f in A) or by f in A & !(f in B)",
        )),
        _ => Err(NotSupported::new(
            then,
            "what is triggered must be F or G of a band",
        )),
    }
}

/// The band of `f in ...`.
fn band(formula: &Formula, spec: &Spec) -> Result<[f64; 2], NotSupported> {
    match formula {
        Formula::In(Signal::Frequency, Interval::Ends(low, high)) => Ok([*low, *high]),
        Formula::In(Signal::Frequency, Interval::Named(name)) => match name.as_str() {
            "I1" => Ok(spec.requirements.outer_hz),
            "I2" => Ok(spec.requirements.inner_hz),
            _ => Err(NotSupported::new(
                formula,
                "the named intervals are I1 and I2",
            )),
        },
        other => Err(NotSupported::new(
            other,
            "a target must be f in an interval",
        )),
    }
}

fn set(slot: &mut Option<[f64; 2]>, value: [f64; 2], part: &Formula) -> Result<(), NotSupported> {
    match slot {
        Some(other) if *other != value => Err(NotSupported::new(
            part,
            "another conjunct names another interval for the same step",
        )),
        _ => {
            *slot = Some(value);
            Ok(())
        }
    }
}

fn add(sum: &mut Option<f64>, within_s: Option<f64>) {
    if let Some(s) = within_s {
        *sum = Some(sum.unwrap_or(0.0) + s);
    }
}

impl Compiled {
    /// The spec with these requirements in the place of its own. It should pass [`Spec::validate`]
    /// before use.
    #[must_use]
    pub fn applied(&self, spec: &Spec) -> Spec {
        let mut out = spec.clone();
        let requirements = &mut out.requirements;
        requirements.containment_hz = self.containment_hz;
        if let Some(inner) = self.inner_hz.or(self.outer_hz) {
            requirements.inner_hz = inner;
            requirements.outer_hz = self.outer_hz.unwrap_or(inner);
        }
        if let Some(s) = self.settle_within_s {
            requirements.settle_within_s = s;
        }
        requirements.stay = self.stay;
        let [low, high] = &mut out.uncertainty.loss_gw;
        if let Some(most) = self.loss_at_most_gw {
            *high = high.min(most);
            *low = low.min(*high);
        }
        if let Some(least) = self.loss_at_least_gw {
            *low = low.max(least);
            *high = high.max(*low);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::logic::parse;

    fn paper() -> Spec {
        Spec::load("paper-bi", &[]).unwrap()
    }

    #[test]
    fn the_papers_specification_is_its_games() {
        let text = "G(f >= -0.8) & G(!(f in I1) -> F[<=40s] f in I1) \
                    & G((f in I1 & !(f in I2)) -> F[<=20s] f in I2)";
        let compiled = compile(&parse(text).unwrap(), &paper()).unwrap();
        assert_eq!(
            compiled,
            Compiled {
                containment_hz: Some(-0.8),
                outer_hz: Some([-0.3, 0.0]),
                inner_hz: Some([-0.15, 0.0]),
                settle_within_s: Some(60.0),
                ..Compiled::default()
            }
        );
        assert_eq!(compiled.applied(&paper()), paper());
    }

    #[test]
    fn reach_and_stay_under_an_assumed_loss() {
        let text = "loss <= 2.2 -> G(f >= -0.8) & F[<=60s] G f in [-0.3, 0.1]";
        let compiled = compile(&parse(text).unwrap(), &paper()).unwrap();
        assert!(compiled.stay);
        assert_eq!(compiled.loss_at_most_gw, Some(2.2));
        let spec = compiled.applied(&paper());
        assert_eq!(spec.requirements.inner_hz, [-0.3, 0.1]);
        assert_eq!(spec.requirements.outer_hz, [-0.3, 0.1]);
        let text = "G(f in I2 -> G f in I2)";
        assert!(compile(&parse(text).unwrap(), &paper()).unwrap().stay);
    }

    #[test]
    fn again_and_again_is_a_reach_whenever_it_was_left() {
        let of = |text: &str| compile(&parse(text).unwrap(), &paper()).unwrap();
        for (short, long) in [
            ("G F f in I1", "G(!(f in I1) -> F f in I1)"),
            ("G F[<=40s] f in I1", "G(!(f in I1) -> F[<=40s] f in I1)"),
            ("F G F f in I1", "G F f in I1"),
            ("G F G f in I2", "F G f in I2"),
            ("G(F f in I1 & f >= -0.8)", "G(f >= -0.8) & G F f in I1"),
        ] {
            assert_eq!(of(short), of(long), "{short}");
        }
        assert_eq!(of("G F f in [-0.2, 0]").outer_hz, Some([-0.2, 0.0]));
        assert!(!of("G F f in I1").stay && of("G F G f in I1").stay);
    }

    #[test]
    fn what_no_game_plays_is_named() {
        let refused = |text: &str| compile(&parse(text).unwrap(), &paper()).unwrap_err().part;
        assert_eq!(refused("G(f >= -0.8) & G(f <= 0.5)"), "G(f <= 0.5)");
        assert_eq!(
            refused("G(f >= -0.8) | F f in I1"),
            "G(f >= -0.8) | F(f in I1)"
        );
        assert_eq!(refused("G F f >= -0.2"), "f >= -0.2");
        assert_eq!(refused("G F f in I1 & G F f in I2"), "F(f in I2)");
        assert_eq!(refused("G F[<=5s] G f in I2"), "G(f in I2)");
        assert_eq!(refused("f in I1 U f in I2"), "f in I1 U f in I2");
        assert_eq!(refused("G(f <= -0.4 -> F f in I1)"), "f <= -0.4");
        assert_eq!(refused("G(!(f in I1) -> F f in I2)"), "F(f in I2)");
        assert_eq!(refused("f >= 0 -> G(f >= -0.8)"), "f >= 0");
        assert_eq!(refused("F f in I3"), "f in I3");
        assert_eq!(refused("G[<=10s] f >= -0.8"), "G[<=10s](f >= -0.8)");
    }
}
