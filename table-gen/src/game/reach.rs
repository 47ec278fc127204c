//! Reach and reach-avoid: the least fixed point, with worst-case ranks and every allowed input.

use rayon::prelude::*;

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::guard::Guard;
use super::inclusion::Inclusion;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;

/// Blocks that one task of a sweep handles.
const BLOCKS_PER_TASK: usize = 256;

/// Cells that a task of a sweep won, and the blocks they are in.
#[derive(Debug, Default)]
struct Won {
    /// Dense index and allowed inputs.
    cells: Vec<(u32, u32)>,
    /// Block and how many of its cells were won.
    blocks: Vec<(u32, u16)>,
}

/// Solves: from every winning cell, whatever the successor within its box, `target` is reached and `avoid` never
/// entered, and no input is used that `guard` forbids. Target cells have rank 0 and no inputs; the inputs of a winning cell are those whose box lies in the
/// cells won before it, so that the rank falls with every step.
///
/// # Errors
/// An empty target, an interruption by the watch, or too many sweeps.
pub fn reach<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    target: &BitSet,
    avoid: &BitSet,
    guard: &impl Guard<D>,
    watch: &dyn Watch,
) -> Result<Solution, GameError> {
    let cells = abstraction.shape().cells();
    if target.is_empty() {
        return Err(GameError::EmptyTarget);
    }
    let blocks = Blocks::new(abstraction);
    let mut won = target.clone();
    let mut changed = target.clone();
    let mut ranks = vec![NOT_WON; cells];
    for index in target.iter() {
        ranks[index] = 0;
    }
    let mut masks = vec![0u32; cells];
    let mut open = open_cells(&blocks, |index| {
        !target.contains(index) && !avoid.contains(index)
    });
    let mut winning = 0;
    let mut sweeps = 0u16;
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
        let filter = Filter::new(abstraction, &won, dirty, true);
        let inclusion = Inclusion::new(abstraction.shape(), &won, abstraction.extents());
        let tasks = blocks.total().div_ceil(BLOCKS_PER_TASK);
        let found: Vec<Won> = (0..tasks)
            .into_par_iter()
            .map(|task| {
                let first = task * BLOCKS_PER_TASK;
                let last = (first + BLOCKS_PER_TASK).min(blocks.total());
                let mut out = Won::default();
                for block in first..last {
                    if open[block] == 0 {
                        continue;
                    }
                    let before = out.cells.len();
                    let start = blocks.first(block);
                    let inputs = filter.inputs(abstraction, start);
                    if inputs == 0 {
                        continue;
                    }
                    blocks.each_cell(start, |cell, index| {
                        if ranks[index] != NOT_WON || avoid.contains(index) {
                            return;
                        }
                        let mut mask = included(abstraction, &inclusion, cell, inputs);
                        if mask != 0 {
                            mask = guard.permitted(cell, mask);
                        }
                        if mask != 0 {
                            out.cells.push((index as u32, mask));
                        }
                    });
                    if out.cells.len() > before {
                        out.blocks
                            .push((block as u32, (out.cells.len() - before) as u16));
                    }
                }
                out
            })
            .collect();
        changed = BitSet::new(cells);
        let mut new = 0;
        for task in &found {
            for (index, mask) in &task.cells {
                let index = *index as usize;
                masks[index] = *mask;
                ranks[index] = sweeps;
                won.insert(index);
                changed.insert(index);
            }
            for (block, count) in &task.blocks {
                open[*block as usize] -= count;
            }
            new += task.cells.len();
        }
        winning += new;
        let progress = Sweep {
            sweep: sweeps,
            cells: winning,
            changed: new,
        };
        if !watch.sweep(&progress) {
            return Err(GameError::Interrupted);
        }
        if new == 0 {
            break;
        }
    }
    Ok(Solution {
        masks,
        ranks,
        winning,
        sweeps,
    })
}

/// Those of the inputs whose box from a cell is included.
#[inline]
pub(crate) fn included<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    inclusion: &Inclusion<D>,
    cell: [u32; D],
    inputs: u32,
) -> u32 {
    let anchor = abstraction.anchor(cell);
    let mut mask = 0;
    let mut rest = inputs;
    while rest != 0 {
        let input = rest.trailing_zeros();
        rest &= rest - 1;
        if let Some(cells) = abstraction.successor(&anchor, input as usize)
            && inclusion.includes(&cells)
        {
            mask |= 1 << input;
        }
    }
    mask
}

/// Cells of each block for which the predicate holds.
pub(super) fn open_cells<const D: usize>(
    blocks: &Blocks<D>,
    open: impl Fn(usize) -> bool + Sync,
) -> Vec<u16> {
    (0..blocks.total())
        .into_par_iter()
        .map(|block| {
            let mut count = 0u16;
            blocks.each_cell(blocks.first(block), |_, index| {
                count += u16::from(open(index));
            });
            count
        })
        .collect()
}
