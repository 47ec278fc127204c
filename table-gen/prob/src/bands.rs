//! What the verifier proves for each band of losses, and how often a year a limit is passed.

use firmware::table::TableView;
use firmware::units::AXIS_F;
use model::flow::{Flow, apply, product, tube};
use model::interval::Interval;
use model::plant::Plant;
use model::spec::Spec;
use serde::{Deserialize, Serialize};
use verify::VerifyError;
use verify::response::{Found, LOSS_BAND_GW, examine_all};

use crate::loss::LossBand;

/// What is proven for a band of losses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BandProof {
    /// The band.
    #[serde(flatten)]
    pub band: LossBand,
    /// Largest relative error of the participation for which it is proven.
    pub participation: Option<f64>,
    /// f is never lower \[Hz\]; nothing if no bound was found.
    pub lowest_hz: Option<f64>,
    /// All claims of the spec hold.
    pub holds: bool,
}

/// Examines a band for a response, with each of these participation errors in turn until all claims
/// hold.
///
/// # Errors
/// A table that is no response, or an end by `go_on`.
pub fn of_response(
    table: &TableView<'_>,
    spec: &Spec,
    band: LossBand,
    errors: &[f64],
    go_on: &dyn Fn() -> bool,
) -> Result<BandProof, VerifyError> {
    let requirements = &spec.requirements;
    let inner = Interval::hull(requirements.inner_hz[0], requirements.inner_hz[1]);
    let low = requirements.containment_hz;
    let good = |found: &Found| {
        let settled = found
            .inside_from_s(inner)
            .is_some_and(|s| s <= requirements.settle_within_s);
        low.is_none_or(|limit| found.f.low >= limit) && settled
    };
    let mut best: Option<BandProof> = None;
    for error in errors {
        let mut case = verify::response::case_of(table, spec)?;
        case.assumed.loss = Interval::hull(band.low_gw, band.high_gw);
        case.last = case.assumed.loss;
        case.assumed.participation = *error;
        let summary = examine_all(&case, LOSS_BAND_GW, &good, &|_| go_on())
            .ok_or(VerifyError::Interrupted)?;
        let found: Option<Vec<Found>> = summary.found.into_iter().map(|(_, found)| found).collect();
        let lowest = |found: &Vec<Found>| {
            found
                .iter()
                .map(|found| found.f.low)
                .fold(f64::INFINITY, f64::min)
        };
        let proof = BandProof {
            band,
            participation: Some(*error),
            lowest_hz: found.as_ref().map(lowest),
            holds: found.is_some_and(|found| found.iter().all(good)),
        };
        if proof.holds {
            return Ok(proof);
        }
        // The smallest error comes last and has the best bound.
        best = Some(proof);
    }
    Ok(best.unwrap_or(BandProof {
        band,
        participation: None,
        lowest_hz: None,
        holds: false,
    }))
}

/// How low f falls with no fleet, for a unit of loss from rest \[Hz/GW\]: f is as low as `reaches`,
/// and never lower than `never_below`. The plant is linear, so a loss of w GW falls w times as low.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alone {
    /// A value that is reached.
    pub reaches: f64,
    /// A lower bound.
    pub never_below: f64,
}

/// Time in which the fall is sought \[s\], and its steps. The paper's plant turns after 7 s.
const FALL_S: f64 = 60.0;
const STEP_S: f64 = 0.02;

impl Alone {
    /// Follows the plant of a spec for a minute.
    pub fn new(spec: &Spec) -> Self {
        let (a, b) = Plant::new(spec).matrices();
        let step = Flow::over(&a, &b, STEP_S);
        let within = tube(&a, STEP_S);
        let time = Interval {
            low: 0.0,
            high: STEP_S,
        };
        let mut at = Flow::identity();
        let (mut reaches, mut never_below) = (0.0f64, 0.0f64);
        for _ in 0..(FALL_S / STEP_S).ceil() as u32 {
            let f = -at.gamma[AXIS_F];
            let between = f - time * apply(&product(&within, &at.phi), &b)[AXIS_F];
            reaches = reaches.min(f.high);
            never_below = never_below.min(between.low);
            at = at.then(&step);
        }
        Self {
            reaches,
            never_below,
        }
    }
}

/// How often a year f leaves a limit, at least and at most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// The limit \[Hz\], as a deviation.
    pub limit_hz: f64,
    /// Without the fleet, at least.
    pub alone_at_least: f64,
    /// Without the fleet, at most.
    pub alone_at_most: f64,
    /// With the fleet, at most: of losses for which it is not proven that f stays above.
    pub fleet_at_most: f64,
}

/// The rates for a limit; weights are events a year, and losses larger than all bands leave every
/// limit.
pub fn rate(proofs: &[BandProof], larger: f64, alone: Alone, limit_hz: f64) -> Rate {
    let sum = |leaves: &dyn Fn(&BandProof) -> bool| -> f64 {
        let weights = proofs
            .iter()
            .filter(|proof| leaves(proof))
            .map(|proof| proof.band.weight);
        // An empty sum of doubles is -0.
        weights.fold(0.0, |sum, weight| sum + weight)
    };
    let above = |proof: &BandProof| proof.lowest_hz.is_some_and(|f| f >= limit_hz);
    Rate {
        limit_hz,
        alone_at_least: sum(&|proof| proof.band.low_gw * alone.reaches < limit_hz),
        alone_at_most: larger + sum(&|proof| proof.band.high_gw * alone.never_below < limit_hz),
        fleet_at_most: larger + sum(&|proof| !above(proof)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plant_alone_falls_as_is_known() {
        // 2 GW fall to 49.1285 Hz, four digits given.
        let alone = Alone::new(&Spec::load("paper-bi", &[]).unwrap());
        assert!((2.0 * alone.reaches + 0.8715).abs() < 1e-4, "{alone:?}");
        // Between samples: 0.02 s at the bottom, where the slope is small; the tube of 0.08² adds
        // at most 1e-3.
        assert!(alone.never_below <= alone.reaches && alone.never_below > alone.reaches - 4e-3);
    }

    #[test]
    fn rates_count_what_is_not_proven() {
        let proof = |low_gw: f64, lowest_hz| BandProof {
            band: LossBand {
                low_gw,
                high_gw: low_gw + 0.1,
                weight: 2.0,
            },
            participation: Some(0.1),
            lowest_hz,
            holds: true,
        };
        let alone = Alone {
            reaches: -0.4,
            never_below: -0.41,
        };
        let proofs = [
            proof(1.0, Some(-0.3)),
            proof(1.2, Some(-0.55)),
            proof(1.5, None),
        ];
        let rate = rate(&proofs, 0.5, alone, -0.5);
        assert_eq!(
            (rate.alone_at_least, rate.alone_at_most, rate.fleet_at_most),
            (2.0, 4.5, 4.5)
        );
    }
}
