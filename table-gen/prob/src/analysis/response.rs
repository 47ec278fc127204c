//! A response: bands of losses that are proven for errors within r, and a union bound for the
//! draws.

use firmware::table::TableView;
use model::spec::Spec;

use super::{AnalysisError, Answer, Layer, Layers, Question};
use crate::bands::{self, Alone};
use crate::loss::Losses;
use crate::participation::Drawn as _;
use crate::union::draws_in;

/// Limits whose yearly rates are shown \[Hz\]: 49.5 and 49.2 Hz.
const LIMITS_HZ: [f64; 2] = [-0.5, -0.8];

/// The layers of a response.
pub(super) fn of_response(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Answer, AnalysisError> {
    let certain = Losses::certain(spec.uncertainty.loss_gw);
    let losses = question.losses.as_ref().unwrap_or(&certain);
    let horizon_s = question.settings.horizon_s;
    let draws = draws_in(horizon_s, question.draw_interval_s);
    let known = spec.uncertainty.participation;
    let mut errors: Vec<f64> = match &question.participation {
        None => vec![known],
        Some(_) => question.errors.clone(),
    };
    errors.push(known);
    errors.sort_by(|a, b| b.total_cmp(a));
    errors.dedup();
    let absolute = spec.uncertainty.participation_absolute;
    let of_draws = |error: f64| match &question.participation {
        None => 1.0,
        Some(drawn) => drawn.all_within(draws, error, absolute),
    };
    let (mut proofs, mut proven, mut drawn) = (Vec::new(), Vec::new(), Vec::new());
    for (index, band) in losses.bands.iter().enumerate() {
        let share = index as f64 / losses.bands.len() as f64;
        let proof = bands::of_response(table, spec, *band, &errors, &|| go_on(share))?;
        let certain = f64::from(u8::from(proof.holds));
        proven.push(certain);
        drawn.push(match proof.participation {
            Some(error) if proof.holds => of_draws(error),
            _ => 0.0,
        });
        proofs.push(proof);
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
    Ok(Answer {
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
        chain: None,
        steps: 0,
    })
}
