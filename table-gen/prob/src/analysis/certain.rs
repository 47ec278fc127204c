//! Laws by games, with certainty: what the verifier proves for a band of losses and an error of the
//! participation that is an adversary's choice.

use firmware::table::TableView;
use model::spec::Spec;
use model::verdict::{Claim, ClaimName, Verdict};
use verify::VerifyError;

use crate::bands::BandProof;
use crate::loss::LossBand;

/// Examines a band with each of these errors in turn, smallest first, until one is not proven. The
/// answer is the largest that is; where the first is not, what was found of it.
///
/// # Errors
/// A spec that the verifier does not cover, or an end by `go_on`.
pub(super) fn of_laws(
    table: &TableView<'_>,
    spec: &Spec,
    band: LossBand,
    errors: &[f64],
    horizon_s: f64,
    go_on: &dyn Fn() -> bool,
) -> Result<BandProof, VerifyError> {
    let mut best: Option<BandProof> = None;
    for error in errors {
        let mut case = spec.clone();
        case.uncertainty.loss_gw = [band.low_gw, band.high_gw];
        case.uncertainty.participation = *error;
        if !case.requirements.stay {
            case.requirements.horizon_s = Some(horizon_s);
        }
        let verdict = verify::verify(table.bytes(), &case, &|_| go_on())?;
        let found = BandProof {
            band,
            participation: Some(*error),
            lowest_hz: lowest(&verdict),
            holds: verdict.claims.iter().all(kept),
        };
        if !found.holds {
            return Ok(best.unwrap_or(found));
        }
        best = Some(found);
    }
    Ok(best.unwrap_or(BandProof {
        band,
        participation: None,
        lowest_hz: None,
        holds: false,
    }))
}

/// Whether a claim holds, or is none about the closed loop. The header is that of the spec, which
/// was compared before; here it is asked about another loss. Which product the table fits is no
/// matter of the closed loop.
fn kept(claim: &Claim) -> bool {
    claim.holds || matches!(claim.name, ClaimName::Header | ClaimName::Image)
}

/// The lower bound of f \[Hz\], where every state was followed.
fn lowest(verdict: &Verdict) -> Option<f64> {
    let claim = |name| verdict.claims.iter().find(|claim| claim.name == name);
    let followed = claim(ClaimName::Table).is_some_and(|claim| claim.holds);
    claim(ClaimName::Containment)
        .filter(|_| followed)
        .and_then(|claim| claim.bound)
}
