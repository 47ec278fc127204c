//! Which cells does the closed loop ask the table for?
//!
//! The answer only chooses what a table covers. It is not part of the proof: a cell that the device
//! asks for and that was left out is answered by "outside", and the verifier reports it. So plain
//! arithmetic will do here.
//!
//! | the event | explored as |
//! |---|---|
//! | exactly known: one loss, one initial state, no errors | [`segments`]: states, tick by tick |
//! | uncertain, with `stay` | [`whole_cells`]: cells, from the trigger on |
//!
//! Segments hold the states that the unknown moment of the event within a tick makes possible; they
//! go through the firmware's own phase machine. Cells go through the abstraction, on which the
//! games were won.
//!
//! An uncertain event without `stay` has no bound: in Fixed there is no game, and whole cells there
//! spread over everything.

pub mod segments;
pub mod whole_cells;

use firmware::table::{LAWS, TableView};

use super::CompressError;
use crate::abstraction::affine::AffineAbstraction;
use crate::game::bitset::BitSet;
use crate::problem::Problem;
use model::plant::STATES;
use model::spec::Spec;

/// What the closed loop asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asked {
    /// Cells for which it asks each law, in the order of the directory.
    pub laws: [BitSet; LAWS],
    /// Whether the union of these cells is closed under the abstraction: then any allowed input
    /// whose box stays in it will do, and not only the explored one.
    pub closed: bool,
}

/// Cells for which the closed loop asks each law.
///
/// # Errors
/// A spec whose closed loop cannot be explored, or a loop that leaves the table.
pub fn reachable(
    problem: &Problem,
    abstraction: &AffineAbstraction<STATES>,
    table: &TableView<'_>,
) -> Result<Asked, CompressError> {
    let spec = &problem.spec;
    if exactly_known(spec) {
        let laws = segments::explore(spec, table)?;
        return Ok(Asked {
            laws,
            closed: false,
        });
    }
    if spec.requirements.stay {
        let laws = whole_cells::explore(problem, abstraction, table)?;
        return Ok(Asked { laws, closed: true });
    }
    Err(CompressError::Unbounded)
}

/// Whether nothing about the event is uncertain but its moment within a tick.
fn exactly_known(spec: &Spec) -> bool {
    let uncertainty = &spec.uncertainty;
    uncertainty.loss_gw[0] == uncertainty.loss_gw[1]
        && uncertainty.participation == 0.0
        && uncertainty.hostile() == 0.0
        && uncertainty.measurement == [0.0; STATES]
        && uncertainty.actuation_delay_s.most_s() == 0.0
        && uncertainty.initial.lower == uncertainty.initial.upper
}
