//! The three layers of a table and a spec, each by itself and all together.

mod answer;
mod certain;
mod laws;
mod response;

use firmware::table::TableView;
use model::spec::Spec;

pub use answer::{AnalysisError, Answer, Cut, Layer, Layers, Question};

use crate::bands::BandProof;
use crate::loss::{LossBand, Losses};
use crate::normal;
use crate::union::{all_within, draws_in, together};

/// Bands of losses whose proofs an answer rests on.
#[must_use]
pub fn bands_of(spec: &Spec, question: &Question) -> Vec<LossBand> {
    match &question.losses {
        Some(losses) => losses.bands.clone(),
        None => Losses::certain(spec.uncertainty.loss_gw).bands,
    }
}

/// What is proven of some of these bands; a band's proof does not depend on the others. `go_on` is
/// told the share that is done.
///
/// # Errors
/// A table of another spec, or one that the verifier does not cover; an end by `go_on`.
pub fn proofs(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    bands: &[LossBand],
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Vec<BandProof>, AnalysisError> {
    let header = verify::header_claim(table.bytes(), spec)?;
    if !header.holds {
        return Err(AnalysisError::Table(header.reason.unwrap_or_default()));
    }
    // What the spec leaves no room for is told before anything is proven.
    noise(table, spec, question)?;
    if table.header().always_on {
        response::proofs(table, spec, question, bands, go_on)
    } else {
        laws::proofs(table, spec, question, bands, go_on)
    }
}

/// Answers, from the [`proofs`] of all [`bands_of`] a question in their order. `go_on` is told how
/// much is done, roughly, and may end it.
///
/// # Errors
/// See [`AnalysisError`].
pub fn answer(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
    proofs: Vec<BandProof>,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Answer, AnalysisError> {
    let proven = proofs.iter().map(|proof| proof.band);
    if !proven.eq(bands_of(spec, question)) {
        return Err(AnalysisError::Bands);
    }
    let noise = noise(table, spec, question)?;
    let mut answer = if table.header().always_on {
        response::of_response(spec, question, proofs)
    } else {
        laws::of_laws(table, spec, question, proofs, go_on)?
    };
    answer.assumptions.extend(of_plant(spec));
    if let Some(noise) = noise {
        answer.lower_bound = together(&[answer.lower_bound, noise.lower_bound]);
        let lost = 1.0 - answer.lower_bound;
        if 1.0 - noise.lower_bound > 0.5 * lost {
            answer.dominates = format!("noise of the measurement: {:.1e}", 1.0 - noise.lower_bound);
        }
        answer.layers.noise = Some(noise);
    }
    Ok(answer)
}

/// What is assumed of the grid.
fn of_plant(spec: &Spec) -> Vec<String> {
    let (plant, initial) = (&spec.plant, &spec.uncertainty.initial);
    vec![
        format!(
            "the plant of the spec `{}`: H {} GW s/Hz, K {} GW/Hz, D {} GW/Hz, linear",
            spec.name,
            plant.inertia_gw_s_per_hz,
            plant.governor_gain_gw_per_hz,
            plant.damping_gw_per_hz
        ),
        format!(
            "the event finds f, g, l, p anywhere in {:?} to {:?} Hz, GW; one event at a time",
            initial.lower, initial.upper
        ),
    ]
}

/// The layer of the noise.
fn noise(
    table: &TableView<'_>,
    spec: &Spec,
    question: &Question,
) -> Result<Option<Layer>, AnalysisError> {
    let Some(sigma_hz) = question.noise_hz else {
        return Ok(None);
    };
    let measurement = spec.uncertainty.measurement;
    let response = table.header().always_on;
    let (room_hz, readers) = if response {
        // Every charger reads at every tick.
        (
            measurement[0] - verify::response::error_hz(spec),
            u64::from(spec.fleet.chargers),
        )
    } else {
        // An observer that is driven by f errs by at most |K| times as much on each of g, l and p.
        let gain = spec.plant.governor_gain_gw_per_hz.abs();
        let chain = measurement[1..]
            .iter()
            .fold(f64::INFINITY, |a, b| a.min(*b))
            / gain;
        (measurement[0].min(chain), 1)
    };
    if room_hz <= 0.0 {
        return Err(AnalysisError::Noise {
            sigma_hz,
            room_hz: room_hz.max(0.0),
        });
    }
    let tick_s = f64::from(table.header().tick_ms) / 1000.0;
    let readings = draws_in(question.settings.horizon_s, tick_s) * readers;
    let outside = normal::outside((room_hz / sigma_hz).next_down());
    Ok(Some(Layer {
        lower_bound: all_within(readings, outside),
        how: format!(
            "all of {readings} readings within {:.2} mHz (normal, {:.2} mHz, independent or not): a union bound",
            1e3 * room_hz,
            1e3 * sigma_hz
        ),
    }))
}
