//! The emitted bytes, checked again: do they answer where they must, and does the controller that
//! they are still win?
//!
//! This asks the firmware's reader for every cell of the grid; what the bytes were made from plays
//! no part but for the targets of the games. (The verifier proves more, and from the spec alone;
//! this check is cheap and names the cell.)

use firmware::grid::Cell;
use firmware::table::{Law, LawView, TableView};
use rayon::prelude::*;

use super::CompressError;
use crate::abstraction::Abstraction;
use crate::abstraction::affine::AffineAbstraction;
use crate::game::bitset::BitSet;
use crate::game::restricted::{LastResort, Restricted};
use crate::game::{Solution, Unwatched};
use crate::synthesis::OptionalGuard;
use model::grid_shape::GridShape;
use model::plant::STATES;

/// Levels of a law in every cell, as the firmware's reader gives them; `None` outside its domain.
pub fn levels(shape: &GridShape<STATES>, law: &LawView<'_>) -> Vec<Option<u8>> {
    (0..shape.cells())
        .into_par_iter()
        .map(|index| law.lookup(Cell(shape.cell(index).map(|i| i as u16))))
        .collect()
}

/// The cells that a law of a table answers for.
pub fn domain_of(levels: &[Option<u8>]) -> BitSet {
    let mut set = BitSet::new(levels.len());
    for (index, level) in levels.iter().enumerate() {
        if level.is_some() {
            set.insert(index);
        }
    }
    set
}

/// What the bytes of a law win.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recheck {
    /// Cells that the law answers for.
    pub answered: usize,
    /// Of those, cells from which the law provably does its duty.
    pub won: usize,
    /// Worst-case steps to the target; 0 for Hold.
    pub steps: u16,
}

/// Plays the game with the law's own answers, and C1's in its place where C2 has none. For C1 and
/// C2 `target` is where it ends; Hold has none: every answer must keep all successors in the
/// domain.
///
/// # Errors
/// A game without a result.
pub fn recheck(
    abstraction: &AffineAbstraction<STATES>,
    guard: &OptionalGuard,
    table: &TableView<'_>,
    law: Law,
    target: Option<&BitSet>,
) -> Result<Recheck, CompressError> {
    let shape = abstraction.shape();
    let of = |law| match table.law(law) {
        Some(view) => levels(shape, view),
        None => vec![None; shape.cells()],
    };
    let mut levels = of(law);
    if law == Law::C2 {
        for (level, before) in levels.iter_mut().zip(of(Law::C1)) {
            *level = level.or(before);
        }
    }
    let domain = domain_of(&levels);
    let answer = |index: usize, _: [u32; STATES]| levels[index].map_or(0, |level| 1u32 << level);
    // Staying is one step of "reach the domain from the domain", with every cell of it won or none.
    let (target, domain) = match target {
        Some(target) => (target, domain),
        None => return stays(abstraction, guard, &domain, &answer),
    };
    let game = Restricted {
        abstraction,
        target,
        domain: &domain,
        settled: None,
        guard,
        watch: &Unwatched,
    };
    let Solution { ranks, winning, .. } = game.reach(&answer, LastResort::None)?;
    let steps = domain.iter().map(|index| ranks[index]).max().unwrap_or(0);
    Ok(Recheck {
        answered: domain.count(),
        won: winning,
        steps,
    })
}

/// Counts the cells of a domain whose answer keeps every successor in it.
fn stays(
    abstraction: &AffineAbstraction<STATES>,
    guard: &OptionalGuard,
    domain: &BitSet,
    answer: &(dyn Fn(usize, [u32; STATES]) -> u32 + Sync),
) -> Result<Recheck, CompressError> {
    use crate::abstraction::guard::Guard;
    use crate::game::inclusion::Inclusion;
    let shape = abstraction.shape();
    let inclusion = Inclusion::new(shape, domain, abstraction.extents());
    let cells: Vec<usize> = domain.iter().collect();
    let won = cells
        .par_iter()
        .filter(|index| {
            let cell = shape.cell(**index);
            let inputs = answer(**index, cell);
            let anchor = abstraction.anchor(cell);
            let kept = abstraction
                .successor(&anchor, inputs.trailing_zeros() as usize % 32)
                .is_some_and(|cells| inclusion.includes(&cells));
            kept && guard.permitted(cell, inputs) != 0
        })
        .count();
    Ok(Recheck {
        answered: cells.len(),
        won,
        steps: 0,
    })
}
