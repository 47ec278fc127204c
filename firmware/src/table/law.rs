//! One law of the table: a domain part that answers "is this cell covered", an inputs part that answers "which level".

use super::BlockError;
use super::dense::DenseView;
use super::header::{Header, LawEntry};
use crate::grid::Cell;

/// What every encoding of a law's inputs can do.
pub trait Encoding {
    /// Input level at a cell, or `None` where the encoding has no entry. Total: any cell is allowed.
    fn level(&self, cell: Cell) -> Option<u8>;

    /// Entries or nodes that this lookup visits.
    fn visits(&self, cell: Cell) -> u16;

    /// The most that any lookup visits.
    fn worst_visits(&self) -> u16;

    /// Entries (dense) or leaves (tree) stored.
    fn entries(&self) -> u32;
}

/// Encodings of the inputs part, by their number in the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum InputsKind {
    /// Bit-packed array over a box of cells, 0 for "outside".
    Dense = 0,
}

/// Domain kind: the inputs part answers membership itself.
pub(super) const DOMAIN_IN_INPUTS: u8 = 0;

#[derive(Debug, Clone)]
enum Inputs<'t> {
    Dense(DenseView<'t>),
}

/// Reader of one law.
#[derive(Debug, Clone)]
pub struct LawView<'t> {
    inputs: Inputs<'t>,
}

impl<'t> LawView<'t> {
    /// Checks the two parts of a law.
    pub(super) fn parse(
        entry: &LawEntry,
        domain: &'t [u8],
        inputs: &'t [u8],
        header: &Header,
    ) -> Result<Self, BlockError> {
        if entry.domain_kind != DOMAIN_IN_INPUTS {
            return Err(BlockError::UnknownEncoding {
                found: entry.domain_kind,
            });
        }
        if !domain.is_empty() {
            return Err(BlockError::BadShape);
        }
        let inputs = match entry.inputs_kind {
            kind if kind == InputsKind::Dense as u8 => {
                Inputs::Dense(DenseView::parse(inputs, &header.grid, header.levels)?)
            }
            found => return Err(BlockError::UnknownEncoding { found }),
        };
        let view = Self { inputs };
        if view.encoding().worst_visits() > entry.worst_visits {
            return Err(BlockError::TooManyVisits);
        }
        Ok(view)
    }

    /// The inputs part.
    pub fn encoding(&self) -> &dyn Encoding {
        match &self.inputs {
            Inputs::Dense(view) => view,
        }
    }

    /// Input level at a cell; `None` outside the law's domain.
    pub fn lookup(&self, cell: Cell) -> Option<u8> {
        match &self.inputs {
            Inputs::Dense(view) => view.level(cell),
        }
    }
}
