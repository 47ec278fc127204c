//! Safety: the greatest fixed point. Which cells can stay in a set for ever, and by which inputs?
//!
//! A cell needs one input to survive a sweep, so each keeps a *witness*; only when the witness's box loses a cell is
//! another looked for, among those that have not failed yet (a failed input never recovers, because the set shrinks).

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::guard::Guard;
use super::inclusion::Inclusion;
use super::reach::included;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;

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
    let mut masks = vec![0u32; cells];
    for index in safe.iter() {
        masks[index] = all;
    }
    // Cells without a permitted input are dead before the first sweep. Only what differs is collected: a list of all safe
    // cells would be the largest thing in memory.
    let permitted = blocks.sweep(
        |_| true,
        |_, first, out: &mut Changes| {
            blocks.each_cell(first, |cell, index| {
                if safe.contains(index) {
                    let mask = guard.permitted(cell, all);
                    if mask != all {
                        out.masks.push((index as u32, mask));
                    }
                }
            });
        },
    );
    for (index, mask) in permitted.iter().flat_map(|task| &task.masks) {
        masks[*index as usize] = *mask;
        if *mask == 0 {
            kernel.remove(*index as usize);
        }
    }
    drop(permitted);
    let mut alive = blocks.count_cells(|index| kernel.contains(index));
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
        let found = blocks.sweep(
            |first| filter.group(abstraction, first),
            |block, first, out: &mut Changes| {
                if alive[block] == 0 {
                    return;
                }
                let dirty = if first_sweep {
                    all
                } else {
                    filter.inputs(abstraction, first)
                };
                if dirty == 0 {
                    return;
                }
                let before = out.dead.len();
                blocks.each_cell(first, |cell, index| {
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
                let died = out.dead.len() - before;
                if died > 0 {
                    out.blocks.push((block as u32, died as u16));
                }
            },
        );
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
            open: left,
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
    let found = blocks.sweep(
        |_| true,
        |block, first, out: &mut Changes| {
            if alive[block] == 0 {
                return;
            }
            blocks.each_cell(first, |cell, index| {
                if masks[index] != 0 {
                    let mask = included(abstraction, &inclusion, cell, masks[index]);
                    if mask != masks[index] {
                        out.masks.push((index as u32, mask));
                    }
                }
            });
        },
    );
    for (index, mask) in found.iter().flat_map(|task| &task.masks) {
        masks[*index as usize] = *mask;
    }
    drop(found);
    let mut ranks = vec![NOT_WON; cells];
    for index in kernel.iter() {
        ranks[index] = 0;
    }
    Ok(Solution {
        masks,
        ranks,
        winning: left,
        sweeps,
    })
}
