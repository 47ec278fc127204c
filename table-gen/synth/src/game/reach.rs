//! Reach and reach-avoid: the least fixed point, with worst-case ranks and every allowed input.

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::guard::Guard;
use super::inclusion::Inclusion;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;

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
    let mut open = blocks.count_cells(|index| !target.contains(index) && !avoid.contains(index));
    let can_be_won: usize = open.iter().map(|cells| usize::from(*cells)).sum();
    let mut winning = 0;
    let mut sweeps = 0u16;
    loop {
        if sweeps == SWEEPS_MAX {
            return Err(GameError::SweepLimit);
        }
        sweeps += 1;
        // Before the first sweep the target is what changed: a box without a cell of it is not included.
        let dirty = Dirty::after(abstraction, &changed);
        let filter = Filter::new(abstraction, &won, dirty, true);
        let inclusion = Inclusion::new(abstraction.shape(), &won, abstraction.extents());
        let found = blocks.sweep(
            |first| filter.group(abstraction, first),
            |block, first, out: &mut Won| {
                if open[block] == 0 {
                    return;
                }
                let inputs = filter.inputs(abstraction, first);
                if inputs == 0 {
                    return;
                }
                let before = out.cells.len();
                blocks.each_cell(first, |cell, index| {
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
                let won = out.cells.len() - before;
                if won > 0 {
                    out.blocks.push((block as u32, won as u16));
                }
            },
        );
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
            open: can_be_won - winning,
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

/// Of the cells outside `target` and `avoid`, those that have an input under which *some* successor may lie in the target: how
/// close a game came that wins nothing.
pub fn may_reach<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    target: &BitSet,
    avoid: &BitSet,
) -> usize {
    let blocks = Blocks::new(abstraction);
    // A box misses the target if it lies in what the target does not hold.
    let inclusion = Inclusion::new(
        abstraction.shape(),
        &target.complement(),
        abstraction.extents(),
    );
    let found = blocks.sweep(
        |_| true,
        |_, first, count: &mut usize| {
            blocks.each_cell(first, |cell, index| {
                if target.contains(index) || avoid.contains(index) {
                    return;
                }
                let anchor = abstraction.anchor(cell);
                let hits = |input| {
                    abstraction
                        .successor(&anchor, input)
                        .is_some_and(|cells| !inclusion.includes(&cells))
                };
                *count += usize::from((0..abstraction.inputs()).any(hits));
            });
        },
    );
    found.into_iter().sum()
}
