//! Laws by games: a chain for each size of the loss.

use firmware::table::TableView;
use model::spec::Spec;

use super::{AnalysisError, Answer, Layer, Layers, Question};
use crate::bands::BandProof;
use crate::closed_loop::{self, ClosedLoop};
use crate::loss::{LossBand, Losses};
use crate::participation::Participation;
use crate::value;

/// The layers of laws by games.
pub(super) fn of_laws(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Answer, AnalysisError> {
    let kind = question.participation.unwrap_or(Participation::Exact);
    let build = |spec: &Spec, kind: &Participation, share: f64| {
        closed_loop::build(table, spec, kind, &question.settings, &|_, _| go_on(share))
    };
    let own = build(spec, &kind, 0.1)?;
    let bounds = value::bounds(&own.chain, own.steps);
    let at_own = bounds.last().copied().unwrap_or(0.0);
    let (mut proofs, mut exact, mut drawn) = (Vec::new(), Vec::new(), Vec::new());
    let certain = Losses::certain(spec.uncertainty.loss_gw);
    let losses = question.losses.as_ref().unwrap_or(&certain);
    for (index, band) in losses.bands.iter().enumerate() {
        let share = 0.1 + 0.9 * index as f64 / losses.bands.len() as f64;
        let mut spec = spec.clone();
        spec.uncertainty.loss_gw = [band.low_gw, band.high_gw];
        let of = |kind: &Participation| -> Result<f64, AnalysisError> {
            let found = build(&spec, kind, share)?;
            Ok(value::bounds(&found.chain, found.steps)
                .last()
                .copied()
                .unwrap_or(0.0))
        };
        let known = of(&Participation::Exact)?;
        exact.push(known);
        drawn.push(if kind == Participation::Exact {
            known
        } else if question.losses.is_none() {
            at_own
        } else {
            of(&kind)?
        });
        proofs.push(proof(*band, known));
    }
    let (loss, all) = (losses.mean(&exact), losses.mean(&drawn));
    let all = if question.losses.is_none() {
        drawn[0]
    } else {
        all
    };
    let (tail, dominates) = lost(table, &own, &kind, question, (loss, all));
    let period_s = f64::from(table.header().tick_ms) * f64::from(table.header().period_ticks) / 1e3;
    let tick_s = f64::from(table.header().tick_ms) / 1e3;
    // Two steps of the chain last a period and a tick at least.
    let over_time = bounds
        .iter()
        .enumerate()
        .skip(2)
        .step_by(2)
        .map(|(n, bound)| [(n as f64 / 2.0 - 1.0) * (period_s + tick_s), *bound]);
    Ok(Answer {
        lower_bound: all,
        states: own.chain.states(),
        transitions: own.chain.transitions(),
        horizon_s: question.settings.horizon_s,
        layers: Layers {
            loss: Layer {
                lower_bound: if question.losses.is_none() { exact[0] } else { loss },
                how: "chains with the participation exact".to_owned(),
            },
            participation: question.participation.map(|kind| Layer {
                lower_bound: at_own,
                how: format!("a chain of {} states at the spec's loss, {kind}{tail}", own.chain.states()),
            }),
            noise: None,
        },
        dominates,
        assumptions: vec![
            losses.assumption.clone(),
            "the fleet acts as one, at once; the estimate errs within uncertainty.measurement as an adversary likes".to_owned(),
            format!(
                "the participation's error is drawn as {kind}, independently, at every decision and in Fixed every {period_s} s"
            ),
        ],
        bands: proofs,
        rates: Vec::new(),
        over_time: over_time.collect(),
        failures: Some(own.failures),
        reach_hz: Some(own.reach_hz),
        steps: own.steps,
        chain: Some(own.chain),
    })
}

fn proof(band: LossBand, known: f64) -> BandProof {
    BandProof {
        band,
        participation: None,
        lowest_hz: None,
        holds: known == 1.0,
    }
}

/// What the bound loses by the draws outside all bins, and what by the rest.
fn lost(
    table: &TableView<'_>,
    own: &ClosedLoop,
    kind: &Participation,
    question: &Question,
    (loss, all): (f64, f64),
) -> (String, String) {
    let header = table.header();
    let outside = (1..header.levels).map(|level| {
        let command = f64::from(header.participation(level).ppm()) / 1e6;
        let bins = kind.bins(command, question.settings.bin_gw);
        1.0 - bins.iter().map(|bin| bin.probability).sum::<f64>()
    });
    let most = outside.fold(0.0, f64::max).max(0.0);
    let by_draws = (f64::from(own.steps) * most).min(1.0);
    let text = format!(
        "; draws outside all bins are at most {by_draws:.1e} of {} steps",
        own.steps
    );
    let rest = 1.0 - all;
    let dominates = if 1.0 - loss > 0.5 * rest && rest > 0.0 {
        format!("what is not certain without any draw: {:.1e}", 1.0 - loss)
    } else if by_draws >= 0.5 * rest {
        format!("draws outside all bins: {by_draws:.1e} of {rest:.1e}")
    } else {
        format!(
            "the adversary's choices inside sets and bins: {:.1e} of {rest:.1e}",
            rest - by_draws
        )
    };
    (text, dominates)
}
