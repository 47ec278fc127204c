//! Guarantee against bytes: variants of a spec, each synthesised and compressed, and which of them
//! nothing beats.

use serde::{Deserialize, Serialize};

use crate::compress::{CompressError, Options};
use crate::game::{GameError, Watch};
use crate::pipeline::{self, Encoding, PipelineError};
use crate::synthesis::{self, SynthesisError};
use model::spec::Spec;

/// A variant of a spec.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// Factor on every cell width.
    pub width_factor: f64,
    /// Period \[s\].
    pub period_s: f64,
    /// Relative error of participation.
    pub participation: f64,
}

/// How a variant came out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The variant.
    #[serde(flatten)]
    pub variant: Variant,
    /// Bytes of the table; absent where there is none.
    pub table_bytes: Option<usize>,
    /// Worst-case time from outside I1 into I2 \[s\]: steps of C1 and C2.
    pub settle_s: Option<f64>,
    /// Winning cells of C1.
    pub winning_cells: Option<usize>,
    /// Why there is no table.
    pub reason: Option<String>,
    /// Whether no variant with at least this participation error is both smaller and faster.
    pub pareto: bool,
}

/// The spec of a variant.
fn spec_of(spec: &Spec, variant: &Variant) -> Spec {
    let mut spec = spec.clone();
    for width in &mut spec.grid.width {
        *width *= variant.width_factor;
    }
    spec.sampling.period_s = variant.period_s;
    spec.uncertainty.participation = variant.participation;
    spec
}

/// Synthesises and compresses a variant. What makes a variant impossible is part of its outcome.
///
/// # Errors
/// An interruption.
pub fn try_variant<'w>(
    spec: &Spec,
    variant: Variant,
    options: &Options,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<Outcome, GameError> {
    let mut outcome = Outcome {
        variant,
        table_bytes: None,
        settle_s: None,
        winning_cells: None,
        reason: None,
        pareto: false,
    };
    let spec = spec_of(spec, &variant);
    let synthesis = match synthesis::synthesise(&spec, watch) {
        Ok(synthesis) => synthesis,
        Err(SynthesisError::Game {
            error: GameError::Interrupted,
            ..
        }) => return Err(GameError::Interrupted),
        Err(error) => {
            outcome.reason = Some(error.to_string());
            return Ok(outcome);
        }
    };
    outcome.winning_cells = Some(synthesis.c1.solution.winning);
    match pipeline::emit(&synthesis, Encoding::Tree(*options), watch) {
        Ok(emitted) => {
            let laws = emitted.laws.iter();
            let steps: u32 = laws.map(|law| u32::from(law.report.steps)).sum();
            outcome.table_bytes = Some(emitted.bytes.len());
            outcome.settle_s = Some(f64::from(steps) * variant.period_s);
        }
        Err(PipelineError::Compress(CompressError::Game(GameError::Interrupted))) => {
            return Err(GameError::Interrupted);
        }
        Err(error) => outcome.reason = Some(error.to_string()),
    }
    Ok(outcome)
}

/// Marks the outcomes that no other beats: one that bears at least as much participation error, is
/// no larger and no slower, and better in one of the three.
pub fn mark_pareto(outcomes: &mut [Outcome]) {
    let keys: Vec<Option<(f64, usize, f64)>> = outcomes
        .iter()
        .map(|o| Some((o.variant.participation, o.table_bytes?, o.settle_s?)))
        .collect();
    for (outcome, key) in outcomes.iter_mut().zip(&keys) {
        let Some(mine) = key else { continue };
        outcome.pareto = !keys.iter().flatten().any(|other| {
            other.0 >= mine.0 && other.1 <= mine.1 && other.2 <= mine.2 && other != mine
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(participation: f64, bytes: usize, settle_s: f64) -> Outcome {
        Outcome {
            variant: Variant {
                width_factor: 1.0,
                period_s: 1.0,
                participation,
            },
            table_bytes: Some(bytes),
            settle_s: Some(settle_s),
            winning_cells: None,
            reason: None,
            pareto: false,
        }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let mut outcomes = [
            outcome(0.0, 100, 20.0),
            outcome(0.0, 200, 10.0),
            outcome(0.0, 200, 20.0),
            outcome(0.1, 300, 30.0),
        ];
        mark_pareto(&mut outcomes);
        assert_eq!(outcomes.map(|o| o.pareto), [true, true, false, true]);
    }
}
