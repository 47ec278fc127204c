//! Tables that are a response: a law of frequency and slope that is always on, on every charger by
//! itself.

use firmware::table::TableView;
use model::spec::Spec;

use super::VerifyError;
use model::verdict::{Claim, ClaimName, Counts, Method};

/// What was found about a response.
#[derive(Debug, Clone, PartialEq)]
pub struct Proof {
    /// The claims of the spec, each with its bound.
    pub claims: Vec<Claim>,
    /// How they were examined.
    pub method: Method,
    /// Sizes of the exploration.
    pub counts: Counts,
}

/// Examines the response of a table against a spec. `go_on` is told how much is done, in \[0, 1\] and
/// roughly, and may end it.
///
/// # Errors
/// A part of the spec that is not covered, or an end by `go_on`. A claim that fails is a result.
pub fn verify(
    table: &TableView<'_>,
    spec: &Spec,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Proof, VerifyError> {
    if !go_on(0.0) {
        return Err(VerifyError::Interrupted);
    }
    let reason = if table.response().is_none() {
        "the spec asks for a response, and the table's laws come from games"
    } else if !spec.preference.always_on {
        "the table is a response, and the spec asks for laws by games"
    } else {
        "not examined: this version has no proof for responses"
    };
    let requirements = &spec.requirements;
    let [low, high] = requirements.inner_hz;
    let mut claims = vec![open(
        ClaimName::Containment,
        requirements.containment_hz,
        "Hz",
        match requirements.containment_hz {
            Some(limit) => format!("f >= {limit} Hz at all times"),
            None => "f has a lower bound at all times".to_owned(),
        },
        reason,
    )];
    let within_s = requirements.settle_within_s;
    claims.push(open(
        ClaimName::Settle,
        Some(within_s),
        "s",
        format!("after leaving I1, f is in I2 within {within_s} s"),
        reason,
    ));
    if requirements.stay {
        claims.push(open(
            ClaimName::Stay,
            Some(low),
            "Hz",
            format!("from then on {low} <= f <= {high} Hz for ever"),
            reason,
        ));
    }
    Ok(Proof {
        claims,
        method: Method::NotExplored,
        counts: Counts::default(),
    })
}

/// A claim that is not proven.
fn open(
    name: ClaimName,
    limit: Option<f64>,
    unit: &'static str,
    statement: String,
    reason: &str,
) -> Claim {
    Claim {
        name,
        holds: false,
        bound: None,
        limit,
        unit: unit.into(),
        statement,
        reason: Some(reason.to_owned()),
    }
}
