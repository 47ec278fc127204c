//! The three layers of a table and a spec, each by itself and all together.

mod certain;
mod laws;
mod response;

use firmware::table::TableView;
use model::spec::Spec;
use serde::Serialize;
use verify::VerifyError;

use crate::bands::{BandProof, Rate};
use crate::chain::Chain;
use crate::closed_loop::{ClosedLoopError, Failures, Settings};
use crate::loss::{LossBand, Losses};
use crate::normal;
use crate::participation::Participation;
use crate::reward::Reward;
use crate::union::{all_within, draws_in, together};

/// What is asked.
#[derive(Debug, Clone)]
pub struct Question {
    /// How the delivered participation is drawn; nothing: as the spec bounds it, with certainty.
    pub participation: Option<Participation>,
    /// Time from one draw to the next \[s\]; laws by games draw once a period.
    pub draw_interval_s: f64,
    /// The sizes of the loss; nothing: the spec's band.
    pub losses: Option<Losses>,
    /// Standard deviation of a normal error of each reading of f \[Hz\], beside what the meter errs
    /// by; nothing: none.
    pub noise_hz: Option<f64>,
    /// Relative errors for which bands are examined beside the spec's.
    pub errors: Vec<f64>,
    /// How finely the chain is built.
    pub settings: Settings,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The table is of another spec.
    #[error("the table is not of this spec: {0}")]
    Table(String),
    /// Proofs of other bands than the question's.
    #[error("the proofs are not those of the question's bands of losses, in their order")]
    Bands,
    /// The chain cannot be built.
    #[error(transparent)]
    Chain(#[from] ClosedLoopError),
    /// The verifier does not cover it.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// Noise that nothing in the spec leaves room for.
    #[error(
        "noise of {sigma_hz} Hz: the spec leaves {room_hz} Hz of its measurement error for it; make \
         uncertainty.measurement larger (laws by games: the other axes at least 5 GW/Hz times that of f)"
    )]
    Noise {
        /// Its standard deviation.
        sigma_hz: f64,
        /// What the spec leaves for it.
        room_hz: f64,
    },
}

/// A layer: its bound, and how it was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layer {
    /// Lower bound of the probability.
    pub lower_bound: f64,
    /// How it was found.
    pub how: String,
}

/// The layers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layers {
    /// The size of the loss, with certainty in everything else.
    pub loss: Layer,
    /// The drawn participation, at the spec's loss.
    pub participation: Option<Layer>,
    /// The noise of the measurement.
    pub noise: Option<Layer>,
}

/// Where a chain was cut: what was not followed counts as failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cut {
    /// Steps that were followed in full.
    pub steps: u32,
    /// Nodes that were reached and not followed.
    pub nodes: usize,
    /// Time for which nothing is lost by the cut \[s\].
    pub until_s: f64,
    /// The bound over that time; nothing where not even a first step was followed.
    pub lower_bound: Option<f64>,
}

/// The answer.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// Lower bound of the probability of ψ over the horizon, all layers together.
    pub lower_bound: f64,
    /// States of the largest chain; 0 without one.
    pub states: usize,
    /// Its transitions.
    pub transitions: usize,
    /// Time over which ψ is claimed \[s\].
    pub horizon_s: f64,
    /// Each layer by itself.
    pub layers: Layers,
    /// What the bound loses most by.
    pub dominates: String,
    /// What every number rests on.
    pub assumptions: Vec<String>,
    /// What is proven for each band of losses.
    pub bands: Vec<BandProof>,
    /// Yearly rates, where the weights are events a year.
    pub rates: Vec<Rate>,
    /// Where a chain was cut, if it was.
    pub cut: Option<Cut>,
    /// Lower bound by time \[s, bound\], from a chain.
    pub over_time: Vec<[f64; 2]>,
    /// What fails in the chain whatever is drawn: decided states, by reason.
    pub failures: Option<Failures>,
    /// How far the sets of the chain reach in f \[Hz\].
    pub reach_hz: Option<f64>,
    /// Upper bound of the expected seconds below 49.5 Hz over the horizon, at the spec's loss, from
    /// a chain; a run that may fail counts as below all the time.
    pub seconds_below_49_5: Option<f64>,
    /// The seconds of the chain's states, to be exported.
    #[serde(skip)]
    pub below: Option<Reward>,
    /// The largest chain, to be exported.
    #[serde(skip)]
    pub chain: Option<Chain>,
    /// Its steps.
    pub steps: u32,
}

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
