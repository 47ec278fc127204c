//! What is asked, and what an answer holds.

use serde::Serialize;
use verify::VerifyError;

use crate::bands::{BandProof, Rate};
use crate::chain::Chain;
use crate::closed_loop::{ClosedLoopError, Failures, Settings};
use crate::loss::Losses;
use crate::participation::Participation;
use crate::reward::Reward;

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
    /// Why there is no chain, where one was asked for.
    #[serde(skip)]
    pub no_chain: Option<String>,
    /// Its steps.
    pub steps: u32,
}
