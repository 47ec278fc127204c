//! A response: bands of losses that are proven for errors within r, and a union bound for the
//! draws.

use firmware::table::TableView;
use model::spec::Spec;

use super::answer::{AnalysisError, Answer, Layer, Layers, Question};
use crate::bands::{self, Alone, BandProof};
use crate::loss::{LossBand, Losses};
use crate::participation::Drawn as _;
use crate::union::draws_in;

/// Limits whose yearly rates are shown \[Hz\]: 49.5 and 49.2 Hz.
const LIMITS_HZ: [f64; 2] = [-0.5, -0.8];

/// What is proven of some bands. The largest error comes first.
pub(super) fn proofs(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    bands: &[LossBand],
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Vec<BandProof>, AnalysisError> {
    let known = spec.uncertainty.participation;
    let mut errors: Vec<f64> = match &question.participation {
        None => vec![known],
        Some(_) => question.errors.clone(),
    };
    errors.push(known);
    errors.sort_by(|a, b| b.total_cmp(a));
    errors.dedup();
    let mut proofs = Vec::with_capacity(bands.len());
    for (index, band) in bands.iter().enumerate() {
        let share = index as f64 / bands.len() as f64;
        proofs.push(bands::of_response(table, spec, *band, &errors, &|| {
            go_on(share)
        })?);
    }
    Ok(proofs)
}

/// The layers of a response.
pub(super) fn of_response(spec: &Spec, question: &Question, proofs: Vec<BandProof>) -> Answer {
    let certain = Losses::certain(spec.uncertainty.loss_gw);
    let losses = question.losses.as_ref().unwrap_or(&certain);
    let horizon_s = question.settings.horizon_s;
    let draws = draws_in(horizon_s, question.draw_interval_s);
    let known = spec.uncertainty.participation;
    let absolute = spec.uncertainty.participation_absolute;
    let of_draws = |error: f64| match &question.participation {
        None => 1.0,
        Some(drawn) => drawn.all_within(draws, error, absolute),
    };
    let (mut proven, mut drawn) = (Vec::new(), Vec::new());
    for proof in &proofs {
        proven.push(f64::from(u8::from(proof.holds)));
        drawn.push(match proof.participation {
            Some(error) if proof.holds => of_draws(error),
            _ => 0.0,
        });
    }
    let (loss, all) = (losses.mean(&proven), losses.mean(&drawn));
    let participation = question.participation.map(|kind| {
        let held = proofs.iter().zip(&drawn).filter(|(proof, _)| proof.holds);
        let least = held.map(|(_, p)| *p).fold(1.0, f64::min);
        Layer {
            lower_bound: least,
            how: format!(
                "{kind}, drawn {draws} times: all draws within the error for which the band is proven; the worst band that is proven"
            ),
        }
    });
    let by_draws = loss - all;
    let dominates = if 1.0 - loss >= by_draws {
        format!(
            "losses for which the claims are not proven: {:.1e}",
            1.0 - loss
        )
    } else {
        format!("draws outside what is proven with certainty: {by_draws:.1e}")
    };
    let alone = Alone::new(spec);
    let rates = question.losses.iter().flat_map(|losses| {
        LIMITS_HZ.map(|limit| bands::rate(&proofs, losses.larger, alone, limit))
    });
    Answer {
        lower_bound: all,
        states: 0,
        transitions: 0,
        horizon_s,
        layers: Layers {
            loss: Layer {
                lower_bound: loss,
                how: "share of the losses in bands for which all claims are proven".to_owned(),
            },
            participation,
            noise: None,
        },
        dominates,
        assumptions: vec![
            losses.assumption.clone(),
            "each charger: own clock, own meter, own delay, as the table's header says".to_owned(),
            match &question.participation {
                None => format!("the fleet delivers within {known} of what it was told, as an adversary likes"),
                Some(kind) => format!(
                    "the fleet's error is drawn as {kind} every {} s; within what is proven it moves as an adversary likes",
                    question.draw_interval_s
                ),
            },
            "rates without the fleet: from rest; with the fleet: within the proven bands, from anywhere in the initial box".to_owned(),
        ],
        rates: rates.collect(),
        bands: proofs,
        cut: None,
        over_time: Vec::new(),
        failures: None,
        reach_hz: None,
        seconds_below_49_5: None,
        below: None,
        chain: None,
        no_chain: Some(
            "a response is on at all times, and its errors are bounded by a union of draws"
                .to_owned(),
        ),
        steps: 0,
    }
}
