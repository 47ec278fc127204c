//! Reach again with a controller in hand: which cells does it win, in how many steps, and what else is then allowed?
//!
//! The least fixed point of a reach game in which a cell may be won only by the inputs that a controller *chose* for it.
//! The ranks are the controller's own worst-case steps. The masks hold *every* input whose box lies in the cells won
//! before, chosen or not: each of them lowers the rank too, so a controller that picks any of them cell by cell still
//! wins. A slower controller leaves more such freedom, which compression lives on.

use rayon::prelude::*;

use super::bitset::BitSet;
use super::inclusion::Inclusion;
use super::reach::included;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution};
use crate::abstraction::Abstraction;

/// Cells that one task of a sweep handles.
const CELLS_PER_TASK: usize = 4096;

/// Inputs (bits) that a controller may use at a cell, given by dense index and axis indices.
pub type Chosen<'c, const D: usize> = dyn Fn(usize, [u32; D]) -> u32 + Sync + 'c;

/// Solves reach-avoid for a controller: `chosen` gives the inputs that it may use at a cell of `domain`; cells outside
/// domain and target count as lost. Where those win nothing more and `last_resort` is set, a sweep with all inputs
/// follows, and then the chosen ones again.
///
/// # Errors
/// An empty target, or too many sweeps.
pub fn reach_restricted<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    target: &BitSet,
    domain: &BitSet,
    chosen: &Chosen<'_, D>,
    last_resort: bool,
) -> Result<Solution, GameError> {
    if target.is_empty() {
        return Err(GameError::EmptyTarget);
    }
    let shape = abstraction.shape();
    let cells = shape.cells();
    let all = u32::MAX >> (32 - abstraction.inputs());
    let mut won = target.clone();
    let mut ranks = vec![NOT_WON; cells];
    for index in target.iter() {
        ranks[index] = 0;
    }
    let mut masks = vec![0u32; cells];
    let mut open: Vec<(u32, u32)> = domain
        .iter()
        .filter(|index| !target.contains(*index))
        .map(|index| (index as u32, chosen(index, shape.cell(index))))
        .filter(|(_, inputs)| *inputs != 0 || last_resort)
        .collect();
    let mut winning = 0;
    let mut sweeps = 0u16;
    let mut resort = 0u32;
    loop {
        if sweeps == SWEEPS_MAX {
            return Err(GameError::SweepLimit);
        }
        sweeps += 1;
        let inclusion = Inclusion::new(shape, &won, abstraction.extents());
        let (found, left): (Vec<Vec<_>>, Vec<Vec<_>>) = open
            .par_chunks(CELLS_PER_TASK)
            .map(|task| {
                let (mut found, mut left) = (Vec::new(), Vec::new());
                for (index, inputs) in task {
                    let cell = shape.cell(*index as usize);
                    if included(abstraction, &inclusion, cell, *inputs | resort) == 0 {
                        left.push((*index, *inputs));
                    } else {
                        found.push((*index, included(abstraction, &inclusion, cell, all)));
                    }
                }
                (found, left)
            })
            .unzip();
        let mut new = 0;
        for (index, mask) in found.into_iter().flatten() {
            masks[index as usize] = mask;
            ranks[index as usize] = sweeps;
            won.insert(index as usize);
            new += 1;
        }
        winning += new;
        if new == 0 && (resort == all || !last_resort) {
            break;
        }
        resort = if new == 0 { all } else { 0 };
        open = left.concat();
    }
    Ok(Solution {
        masks,
        ranks,
        winning,
        sweeps,
    })
}
