//! Safety: the greatest fixed point. Which cells can stay in a set for ever, and by which inputs?
//!
//! A cell needs one input to survive a sweep, so each keeps a *witness*; only when the witness's box loses a cell is
//! another looked for, among those that have not failed yet (a failed input never recovers, because the set shrinks).

use rayon::prelude::*;

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::guard::Guard;
use super::inclusion::Inclusion;
use super::reach::{included, open_cells};
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;

/// Blocks that one task of a sweep handles.
const BLOCKS_PER_TASK: usize = 256;

/// What a task of a sweep found.
#[derive(Debug, Default)]
struct Changes {
    /// Cells that lost every input.
    dead: Vec<u32>,
    /// Cells whose inputs shrank, and what is left.
    masks: Vec<(u32, u32)>,
    /// Block and how many of its cells died.
    blocks: Vec<(u32, u16)>,
}

/// Solves: from every cell of the kernel, some input keeps every successor in the kernel; `safe` is where the kernel
/// must lie, and no input is used that `guard` forbids. The masks of the solution hold every such input; ranks are 0 on the kernel.
///
/// # Errors
/// An empty safe set, an interruption by the watch, or too many sweeps. An empty kernel is a result.
pub fn safety<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    safe: &BitSet,
    guard: &impl Guard<D>,
    watch: &dyn Watch,
) -> Result<Solution, GameError> {
    let cells = abstraction.shape().cells();
    if safe.is_empty() {
        return Err(GameError::EmptyTarget);
    }
    let blocks = Blocks::new(abstraction);
    let all = u32::MAX >> (32 - abstraction.inputs());
    let mut kernel = safe.clone();
    // Cells without a permitted input are dead before the first sweep.
    let permitted = tasks(&blocks, |block, out: &mut Changes| {
        blocks.each_cell(blocks.first(block), |cell, index| {
            if safe.contains(index) {
                let mask = guard.permitted(cell, all);
                out.masks.push((index as u32, mask));
            }
        });
    });
    let mut masks = vec![0u32; cells];
    for (index, mask) in permitted.iter().flat_map(|task| &task.masks) {
        masks[*index as usize] = *mask;
        if *mask == 0 {
            kernel.remove(*index as usize);
        }
    }
    drop(permitted);
    let mut alive = open_cells(&blocks, |index| kernel.contains(index));
    let mut changed = BitSet::new(cells);
    let mut sweeps = 0u16;
    let mut left = kernel.count();
    loop {
        if sweeps == SWEEPS_MAX {
            return Err(GameError::SweepLimit);
        }
        sweeps += 1;
        let dirty = if sweeps == 1 {
            Dirty::everything()
        } else {
            Dirty::after(abstraction, &changed)
        };
        let first_sweep = sweeps == 1;
        let filter = Filter::new(abstraction, &kernel, dirty, false);
        let inclusion = Inclusion::new(abstraction.shape(), &kernel, abstraction.extents());
        let found = tasks(&blocks, |block, out: &mut Changes| {
            if alive[block] == 0 {
                return;
            }
            let start = blocks.first(block);
            let dirty = if first_sweep {
                all
            } else {
                filter.inputs(abstraction, start)
            };
            if dirty == 0 {
                return;
            }
            let before = out.dead.len();
            blocks.each_cell(start, |cell, index| {
                // The lowest input that has not failed is the witness.
                let mut mask = masks[index];
                if mask == 0 || (mask & mask.wrapping_neg()) & dirty == 0 {
                    return;
                }
                let anchor = abstraction.anchor(cell);
                while mask != 0 {
                    let input = mask.trailing_zeros();
                    let holds = abstraction
                        .successor(&anchor, input as usize)
                        .is_some_and(|cells| inclusion.includes(&cells));
                    if holds {
                        break;
                    }
                    mask &= mask - 1;
                }
                if mask == 0 {
                    out.dead.push(index as u32);
                } else if mask != masks[index] {
                    out.masks.push((index as u32, mask));
                }
            });
            if out.dead.len() > before {
                out.blocks
                    .push((block as u32, (out.dead.len() - before) as u16));
            }
        });
        changed = BitSet::new(cells);
        let mut dead = 0;
        for task in &found {
            for (index, mask) in &task.masks {
                masks[*index as usize] = *mask;
            }
            for index in &task.dead {
                masks[*index as usize] = 0;
                kernel.remove(*index as usize);
                changed.insert(*index as usize);
            }
            for (block, count) in &task.blocks {
                alive[*block as usize] -= count;
            }
            dead += task.dead.len();
        }
        left -= dead;
        let progress = Sweep {
            sweep: sweeps,
            cells: left,
            changed: dead,
        };
        if !watch.sweep(&progress) {
            return Err(GameError::Interrupted);
        }
        if dead == 0 {
            break;
        }
    }
    // The witnesses hold; the inputs above them were never asked since the set shrank. Ask for all of them once.
    let inclusion = Inclusion::new(abstraction.shape(), &kernel, abstraction.extents());
    let found = tasks(&blocks, |block, out: &mut Changes| {
        if alive[block] == 0 {
            return;
        }
        blocks.each_cell(blocks.first(block), |cell, index| {
            if masks[index] != 0 {
                let mask = included(abstraction, &inclusion, cell, masks[index]);
                out.masks.push((index as u32, mask));
            }
        });
    });
    let mut ranks = vec![NOT_WON; cells];
    for (index, mask) in found.iter().flat_map(|task| &task.masks) {
        masks[*index as usize] = *mask;
        ranks[*index as usize] = 0;
    }
    Ok(Solution {
        masks,
        ranks,
        winning: left,
        sweeps,
    })
}

/// Runs a task over all blocks in parallel; the results are in the order of the blocks.
fn tasks<const D: usize>(
    blocks: &Blocks<D>,
    run: impl Fn(usize, &mut Changes) + Sync,
) -> Vec<Changes> {
    (0..blocks.total().div_ceil(BLOCKS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let first = task * BLOCKS_PER_TASK;
            let last = (first + BLOCKS_PER_TASK).min(blocks.total());
            let mut out = Changes::default();
            for block in first..last {
                run(block, &mut out);
            }
            out
        })
        .collect()
}
