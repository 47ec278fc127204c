//! The whole way from a spec to a table, as the commands use it.

use std::path::{Path, PathBuf};

use firmware::table::{TableError, TableView};

use crate::compress::{self, CompressError, CompressedLaw, Options};
use crate::emit::{self, EmitError, dense};
use crate::game::Watch;
use crate::problem;
use crate::synthesis::{self, Synthesis, SynthesisError};
use model::hex::hex;
use model::spec::Spec;

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// No laws.
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    /// No compressed laws.
    #[error(transparent)]
    Compress(#[from] CompressError),
    /// No bytes.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// A table file cannot be read.
    #[error("{path}: {error}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A table file is refused by the firmware's reader.
    #[error("{path}: not a table for this spec: {}", rejection(*error), path = path.display())]
    Rejected {
        /// The file.
        path: PathBuf,
        /// Why.
        error: TableError,
    },
}

/// Why the firmware refused a table, for people.
fn rejection(error: TableError) -> String {
    match error {
        TableError::ForeignSpec { found, expected } => {
            format!(
                "it was made from the spec with hash {}, this one has {}",
                hex(&found),
                hex(&expected)
            )
        }
        other => format!("{other:?}"),
    }
}

/// How the laws become bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Bit-packed arrays, the lowest allowed input of each cell: the oracle of the other.
    Dense,
    /// Trees, compressed with these options.
    Tree(Options),
}

impl Default for Encoding {
    fn default() -> Self {
        Self::Tree(Options {
            keep_minimal_time: false,
            exact_domain: false,
        })
    }
}

/// A table and what compression cost.
#[derive(Debug, Clone)]
pub struct Emitted {
    /// The image.
    pub bytes: Vec<u8>,
    /// Law by law; empty for the dense encoding.
    pub laws: Vec<CompressedLaw>,
}

/// The table of the laws.
///
/// # Errors
/// Numbers that do not fit the format, or an interruption.
pub fn emit<'w>(
    synthesis: &Synthesis,
    encoding: Encoding,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<Emitted, PipelineError> {
    let head = emit::head(&synthesis.problem)?;
    let options = match encoding {
        Encoding::Tree(options) => options,
        Encoding::Dense => {
            let shape = synthesis.problem.shape;
            let encode = |law: &synthesis::SolvedLaw| {
                dense::encode(&shape, head.header.levels, &law.solution, &dense::lowest)
            };
            let laws = [
                Some(encode(&synthesis.c1)),
                synthesis.c2.as_ref().map(encode),
                synthesis.hold.as_ref().map(encode),
            ];
            return Ok(Emitted {
                bytes: emit::assemble(head, &laws)?,
                laws: Vec::new(),
            });
        }
    };
    let compressed = compress::compress(synthesis, &options, watch)?;
    Ok(Emitted {
        bytes: emit::assemble(head, &compressed.encoded())?,
        laws: compressed.laws,
    })
}

/// The table of a spec whose preferred law is always on. No game is played.
///
/// # Errors
/// A spec whose laws come from games, or numbers that do not fit the format.
pub fn response(spec: &Spec) -> Result<Vec<u8>, PipelineError> {
    let grid = problem::device_grid(spec).map_err(SynthesisError::from)?;
    Ok(emit::response(spec, grid)?)
}

/// A table for a spec: from a file, which must have been made for it, or synthesised.
///
/// # Errors
/// An unreadable or foreign file, or no controller.
pub fn table_bytes<'w>(
    spec: &Spec,
    file: Option<&Path>,
    watch: &dyn Fn(&'static str) -> Box<dyn Watch + 'w>,
) -> Result<Vec<u8>, PipelineError> {
    let Some(path) = file else {
        if spec.preference.always_on {
            return response(spec);
        }
        let synthesis = synthesis::synthesise(spec, watch)?;
        return Ok(emit(&synthesis, Encoding::default(), watch)?.bytes);
    };
    let bytes = std::fs::read(path).map_err(|error| PipelineError::Read {
        path: path.to_owned(),
        error,
    })?;
    TableView::parse_for_spec(&bytes, spec.hash()).map_err(|error| PipelineError::Rejected {
        path: path.to_owned(),
        error,
    })?;
    Ok(bytes)
}
