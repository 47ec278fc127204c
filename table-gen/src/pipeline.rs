//! The whole way from a spec to a table, as the commands use it.

use std::path::{Path, PathBuf};

use firmware::table::{TableError, TableView};

use crate::emit::{self, EmitError, dense};
use crate::game::Watch;
use crate::spec::Spec;
use crate::synthesis::{self, Synthesis, SynthesisError};

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// No laws.
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
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
    #[error("{path}: not a table for this spec: {error:?}", path = path.display())]
    Rejected {
        /// The file.
        path: PathBuf,
        /// Why.
        error: TableError,
    },
}

/// The table of a spec's laws.
///
/// # Errors
/// Numbers that do not fit the format.
pub fn emit(spec: &Spec, synthesis: &Synthesis) -> Result<Vec<u8>, EmitError> {
    let header = emit::header(spec, synthesis.grid)?;
    let shape = synthesis::grid_shape(&synthesis.grid);
    let encode = |law: &synthesis::SolvedLaw| {
        dense::encode(&shape, header.levels, &law.solution, &dense::lowest)
    };
    let laws = [
        Some(encode(&synthesis.c1)),
        synthesis.c2.as_ref().map(encode),
        synthesis.hold.as_ref().map(encode),
    ];
    emit::assemble(header, &laws)
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
        let synthesis = synthesis::synthesise(spec, watch)?;
        return Ok(emit(spec, &synthesis)?);
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
