//! Why a command did not end with 0.

use model::spec::SpecError;
use serde::{Deserialize, Serialize};

/// Why a command did not end with 0.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) enum Failure {
    /// The answer is "no".
    No(String),
    /// The input is bad, or a file cannot be read or written.
    BadInput(String),
}

impl Failure {
    /// Bad input, told by an error.
    pub(super) fn bad(error: impl std::fmt::Display) -> Self {
        Self::BadInput(error.to_string())
    }
}

impl From<SpecError> for Failure {
    fn from(error: SpecError) -> Self {
        Self::bad(error)
    }
}

impl From<::synth::pipeline::PipelineError> for Failure {
    fn from(error: ::synth::pipeline::PipelineError) -> Self {
        match error {
            ::synth::pipeline::PipelineError::Synthesis(error) => error.into(),
            ::synth::pipeline::PipelineError::Compress(error) => Self::No(error.to_string()),
            other => Self::bad(other),
        }
    }
}

impl From<::synth::synthesis::SynthesisError> for Failure {
    fn from(error: ::synth::synthesis::SynthesisError) -> Self {
        use ::synth::game::GameError;
        use ::synth::synthesis::SynthesisError as E;
        match &error {
            E::Problem(_) | E::Abstraction(_) | E::Response => Self::bad(error),
            E::Game {
                error: GameError::EmptyTarget,
                ..
            } => Self::bad(error),
            E::Game { .. } | E::NoController { .. } => Self::No(error.to_string()),
        }
    }
}
