//! Reach again with a controller in hand: which cells does it win, in how many steps, and what else
//! is then allowed?
//!
//! The least fixed point of a reach game in which a cell may be won only by the inputs that a
//! controller *chose* for it. The ranks are the controller's own worst-case steps. The masks hold
//! *every* input whose box lies in the cells won before, chosen or not: each of them lowers the
//! rank too, so a controller that picks any of them cell by cell still wins. A slower controller
//! leaves more such freedom, which compression lives on.

use rayon::prelude::*;

use super::bitset::BitSet;
use super::inclusion::Inclusion;
use super::levels::widened;
use super::reach::included;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;
use crate::abstraction::guard::Guard;

/// Cells that one task of a sweep handles.
const CELLS_PER_TASK: usize = 4096;

/// Inputs (bits) that a controller may use at a cell, given by dense index and axis indices.
pub type Chosen<'c, const D: usize> = dyn Fn(usize, [u32; D]) -> u32 + Sync + 'c;

/// What helps where the chosen inputs win nothing more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LastResort {
    /// Nothing: the rest is lost.
    None,
    /// A sweep with all inputs.
    All,
    /// Sweeps with the inputs at most 1, 2, 4, … levels from a chosen one, until one wins
    /// something: a cell departs from what was chosen no further than it must.
    Nearest,
}

/// A reach-avoid game for a controller.
#[derive(Clone, Copy)]
pub struct Restricted<'g, const D: usize, A, G> {
    /// The abstraction.
    pub abstraction: &'g A,
    /// Where the game ends.
    pub target: &'g BitSet,
    /// Cells outside domain and target count as lost.
    pub domain: &'g BitSet,
    /// Cells that another controller decides. Only the inputs that it chose count there, even where
    /// no other input wins.
    pub settled: Option<&'g BitSet>,
    /// Forbids inputs.
    pub guard: &'g G,
    /// Told of every sweep.
    pub watch: &'g dyn Watch,
}

impl<const D: usize, A: Abstraction<D, Inputs = u32>, G: Guard<D>> Restricted<'_, D, A, G> {
    /// Solves the game for the inputs that `chosen` gives in each cell. Where those win nothing
    /// more a sweep with what `last_resort` says follows, and then the chosen ones again.
    ///
    /// # Errors
    /// An empty target, too many sweeps, or an interruption.
    pub fn reach(
        &self,
        chosen: &Chosen<'_, D>,
        last_resort: LastResort,
    ) -> Result<Solution, GameError> {
        let Self {
            abstraction,
            target,
            domain,
            settled,
            guard,
            watch,
        } = *self;
        if target.is_empty() {
            return Err(GameError::EmptyTarget);
        }
        let shape = abstraction.shape();
        let cells = shape.cells();
        let all_levels = abstraction.inputs() as u32;
        let all = u32::MAX >> (u32::BITS - all_levels);
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
            .filter(|(_, inputs)| *inputs != 0 || last_resort != LastResort::None)
            .collect();
        let mut winning = 0;
        let mut sweeps = 0u16;
        // Levels by which cells may depart from what was chosen.
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
                        let permitted =
                            |inputs| match included(abstraction, &inclusion, cell, inputs) {
                                0 => 0,
                                mask => guard.permitted(cell, mask),
                            };
                        let is_settled =
                            settled.is_some_and(|cells| cells.contains(*index as usize));
                        let tried = match resort {
                            levels if levels == all_levels && !is_settled => all,
                            levels if !is_settled => widened(*inputs, levels) & all,
                            _ => *inputs,
                        };
                        if permitted(tried) == 0 {
                            left.push((*index, *inputs));
                        } else {
                            found.push((*index, permitted(all)));
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
            let progress = Sweep {
                sweep: sweeps,
                cells: winning,
                changed: new,
                open: left.iter().map(Vec::len).sum(),
            };
            if !watch.sweep(&progress) {
                return Err(GameError::Interrupted);
            }
            // The last resort has no more to give either.
            if new == 0 && (resort == all_levels || last_resort == LastResort::None) {
                break;
            }
            resort = match (new, last_resort, resort) {
                (0, LastResort::Nearest, 0) => 1,
                (0, LastResort::Nearest, levels) => (2 * levels).min(all_levels),
                (0, ..) => all_levels,
                _ => 0,
            };
            open = left.concat();
        }
        Ok(Solution {
            masks,
            ranks,
            winning,
            sweeps,
        })
    }
}
