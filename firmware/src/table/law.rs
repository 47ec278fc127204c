//! One law of the table: a domain part that answers "is this cell covered", an inputs part that
//! answers "which level".

use super::dense::DenseView;
use super::domain::DomainView;
use super::encoding::Encoding;
use super::error::BlockError;
use super::header::{LawEntry, Working};
use super::tree::TreeView;
use crate::grid::{Cell, Grid};
use crate::units::STATES;

/// Encodings of the inputs part, by their number in the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum InputsKind {
    /// Bit-packed array over a box of cells, 0 for "outside".
    Dense = 0,
    /// k-d tree; needs a domain part.
    Tree = 1,
}

#[derive(Debug, Clone)]
enum Inputs<'t> {
    Dense(DenseView<'t>),
    Tree(TreeView<'t>),
}

/// Reader of one law.
#[derive(Debug, Clone)]
pub struct LawView<'t> {
    count: [u16; STATES],
    domain: DomainView<'t>,
    inputs: Inputs<'t>,
}

impl<'t> LawView<'t> {
    /// Checks the two parts of a law.
    pub(super) fn parse(
        entry: &LawEntry,
        domain: &'t [u8],
        inputs: &'t [u8],
        working: &Working,
    ) -> Result<Self, BlockError> {
        let grid: &Grid = &working.grid;
        let domain = DomainView::parse(entry.domain_kind, domain, grid)?;
        let inputs = match entry.inputs_kind {
            kind if kind == InputsKind::Dense as u8 => {
                Inputs::Dense(DenseView::parse(inputs, grid, working.levels)?)
            }
            kind if kind == InputsKind::Tree as u8 => {
                // The tree answers for every cell; only a domain part can say which are covered.
                if matches!(domain, DomainView::InInputs) {
                    return Err(BlockError::NoDomain);
                }
                Inputs::Tree(TreeView::parse(inputs, grid, working.levels)?)
            }
            found => return Err(BlockError::UnknownEncoding { found }),
        };
        let view = Self {
            count: grid.count(),
            domain,
            inputs,
        };
        if view.worst_visits() > entry.worst_visits {
            return Err(BlockError::TooManyVisits);
        }
        Ok(view)
    }

    /// The inputs part.
    pub fn encoding(&self) -> &dyn Encoding {
        match &self.inputs {
            Inputs::Dense(view) => view,
            Inputs::Tree(view) => view,
        }
    }

    /// Input level at a cell; `None` outside the law's domain, and for a cell of another grid.
    pub fn lookup(&self, cell: Cell) -> Option<u8> {
        let [f, g, l, p] = cell.0;
        let [f_count, g_count, l_count, p_count] = self.count;
        let of_grid = f < f_count && g < g_count && l < l_count && p < p_count;
        if !of_grid || !self.domain.contains(cell, self.count).0 {
            return None;
        }
        match &self.inputs {
            Inputs::Dense(view) => view.level(cell),
            Inputs::Tree(view) => view.level(cell),
        }
    }

    /// Half-spaces, nodes and entries that this lookup visits, both parts.
    pub fn visits(&self, cell: Cell) -> u16 {
        let visits = self.domain.visits(cell, self.count);
        if self.domain.contains(cell, self.count).0 {
            visits.saturating_add(self.encoding().visits(cell))
        } else {
            visits
        }
    }

    /// The most that any lookup visits, both parts.
    pub fn worst_visits(&self) -> u16 {
        let domain = self.domain.worst_visits();
        domain.saturating_add(self.encoding().worst_visits())
    }

    /// Leaves and half-spaces of the domain part.
    pub fn domain_entries(&self) -> u32 {
        self.domain.entries()
    }
}
