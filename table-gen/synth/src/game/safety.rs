//! Safety: the greatest fixed point. Which cells can stay in a set for ever, and by which inputs?
//!
//! A cell needs one input to survive a sweep, so each keeps a *witness*; only when the witness's
//! box loses a cell is another looked for, among those that have not failed yet (a failed input
//! never recovers, because the set shrinks).

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::cells::{Cells, Marks};
use super::exchange::{Alone, Exchange};
use super::inclusion::Inclusion;
use super::inputs::InputSet;
use super::ledger::{Remaining, Witnesses};
use super::reach::included;
use super::state::{State, read_head, write_head};
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;
use crate::abstraction::guard::Guard;

/// Solves: from every cell of the kernel, some input keeps every successor in the kernel; `safe` is
/// where the kernel must lie, and no input is used that `guard` forbids. The masks of the solution
/// hold every such input; ranks are 0 on the kernel.
///
/// # Errors
/// An empty safe set, an interruption by the watch, or too many sweeps. An empty kernel is a
/// result.
pub fn safety<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    safe: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<Solution<A::Inputs>, GameError> {
    safety_shared(abstraction, safe, guard, &Alone, watch)
}

/// The same with other ranks: `abstraction` and `safe` are those of this rank's window.
///
/// # Errors
/// As [`safety`], or a rank that is gone.
pub fn safety_shared<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    safe: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<Solution<A::Inputs>, GameError> {
    let none = BitSet::new(safe.len());
    stay_or_enter(abstraction, (safe, &none), guard, exchange, watch)
}

/// Stays in `safe` for ever, or enters `won` from it: the largest set of cells that have an input
/// whose box lies in the set or in `won`. Ranks are 0 on the set, without `won` itself, whose cells
/// have no inputs.
///
/// # Errors
/// As [`safety`].
pub(super) fn stay_or_enter<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    (safe, won): (&BitSet, &BitSet),
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<Solution<A::Inputs>, GameError> {
    let played = play::<D, A, Cells<A::Inputs>>(abstraction, (safe, won), guard, exchange, watch)?;
    let (masks, kernel) = (played.remaining, played.kernel);
    // The witnesses hold; the inputs above them were never asked since the set shrank. Ask for all
    // of them once.
    let inclusion = Inclusion::new(abstraction.shape(), &kernel, abstraction.extents());
    let blocks = Blocks::new(abstraction);
    blocks.sweep(
        |_| true,
        |_, first, (): &mut ()| {
            blocks.each_cell(first, |cell, index| {
                let mask = masks.get(index);
                if !mask.is_empty() {
                    masks.set(index, included(abstraction, &inclusion, cell, mask));
                }
            });
        },
    );
    let ranks = Cells::new(kernel.len(), NOT_WON);
    for index in kernel.iter().filter(|index| !won.contains(*index)) {
        ranks.set(index, 0);
    }
    Ok(Solution {
        masks: masks.into_vec(),
        ranks: ranks.into_vec(),
        winning: played.left,
        sweeps: played.sweeps,
    })
}

/// A safety game of which little is kept.
#[derive(Debug)]
pub struct LeanSafety {
    /// The kernel.
    pub kernel: BitSet,
    /// One input of each of its cells that keeps every successor in it.
    pub witnesses: Witnesses,
    /// Cells of the kernel.
    pub winning: usize,
    /// Sweeps until nothing changed.
    pub sweeps: u16,
}

/// The same game with a byte a cell: one input. The others are those whose box lies in the kernel.
///
/// # Errors
/// As [`safety`].
pub fn safety_lean<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    safe: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<LeanSafety, GameError> {
    let none = BitSet::new(safe.len());
    let played = play::<D, A, Witnesses>(abstraction, (safe, &none), guard, &Alone, watch)?;
    Ok(LeanSafety {
        kernel: played.kernel,
        witnesses: played.remaining,
        winning: played.left,
        sweeps: played.sweeps,
    })
}

struct Played<R> {
    remaining: R,
    kernel: BitSet,
    left: usize,
    sweeps: u16,
}

fn play<const D: usize, A: Abstraction<D>, R: Remaining<A::Inputs>>(
    abstraction: &A,
    (safe, won): (&BitSet, &BitSet),
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<Played<R>, GameError> {
    let cells = abstraction.shape().cells();
    let owned = exchange.owned(cells);
    let own = |set: &BitSet| set.iter().filter(|index| owned.contains(index)).count();
    if exchange.sum(own(safe) + own(won))? == 0 {
        return Err(GameError::EmptyTarget);
    }
    let blocks = Blocks::new(abstraction);
    let all = A::Inputs::first(abstraction.inputs());
    let (mut sweeps, mut kernel, mut changed, remaining) = match watch.saved() {
        None => {
            let (kernel, remaining) = before(abstraction, (safe, won), guard, exchange, watch)?;
            (0, kernel, BitSet::new(cells), remaining)
        }
        Some(mut from) => {
            let (sweeps, kernel, changed) = read_head(cells, &mut from)?;
            (sweeps, kernel, changed, R::read(cells, &mut from)?)
        }
    };
    let alive = blocks.count_cells(|index| {
        kernel.contains(index) && !won.contains(index) && owned.contains(&index)
    });
    let mut left = exchange.sum(alive.iter().map(|n| usize::from(n.load(Relaxed))).sum())?;
    loop {
        if sweeps > 0 && exchange.sum(changed.count())? == 0 {
            break;
        }
        if sweeps == SWEEPS_MAX {
            return Err(GameError::SweepLimit);
        }
        sweeps += 1;
        let first_sweep = sweeps == 1;
        let dirty = if first_sweep {
            Dirty::everything()
        } else {
            Dirty::after(abstraction, &changed)
        };
        drop(changed);
        let filter = Filter::new(abstraction, &kernel, dirty, false);
        let inclusion = Inclusion::new(abstraction.shape(), &kernel, abstraction.extents());
        let marks = Marks::new(cells);
        let found = blocks.sweep(
            |first| filter.group(abstraction, first),
            |block, first, dead: &mut usize| {
                if alive[block].load(Relaxed) == 0 {
                    return;
                }
                let dirty = if first_sweep {
                    all
                } else {
                    filter.inputs(abstraction, first)
                };
                if dirty.is_empty() {
                    return;
                }
                let mut died = 0;
                blocks.each_cell(first, |cell, index| {
                    // The lowest input that has not failed is the witness.
                    let had = remaining.get(index, all);
                    if had.is_empty() || (A::Inputs::only(had.lowest()) & dirty).is_empty() {
                        return;
                    }
                    let anchor = abstraction.anchor(cell);
                    let holds = |mask: A::Inputs| {
                        abstraction
                            .successor(&anchor, mask.lowest())
                            .is_some_and(|cells| inclusion.includes(&cells))
                    };
                    if holds(had) {
                        return;
                    }
                    let mut mask = had.without_lowest();
                    if R::FORGETS && !mask.is_empty() {
                        mask = guard.permitted(cell, mask);
                    }
                    while !mask.is_empty() && !holds(mask) {
                        mask = mask.without_lowest();
                    }
                    remaining.set(index, mask);
                    if mask.is_empty() {
                        marks.mark(index);
                        died += 1;
                    }
                });
                if died > 0 {
                    alive[block].fetch_sub(died, Relaxed);
                    *dead += usize::from(died);
                }
            },
        );
        drop((filter, inclusion));
        changed = marks.into_set();
        exchange.share(&mut changed)?;
        kernel.subtract(&changed);
        let dead = exchange.sum(found.into_iter().sum())?;
        left -= dead;
        let progress = Sweep {
            sweep: sweeps,
            cells: left,
            changed: dead,
            open: left,
        };
        let go_on = watch.sweep(&progress);
        let write = |to: &mut dyn std::io::Write| {
            write_head(sweeps, &kernel, &changed, to)?;
            remaining.write(to)
        };
        watch.offer(&State::new(sweeps, dead == 0, &write), !go_on);
        if !go_on {
            return Err(GameError::Interrupted);
        }
    }
    Ok(Played {
        remaining,
        kernel,
        left,
        sweeps,
    })
}

/// Blocks between two words about a guard's progress.
const TOLD_EVERY: usize = 4096;

/// Before the first sweep: cells without a permitted input are dead already.
fn before<const D: usize, A: Abstraction<D>, R: Remaining<A::Inputs>>(
    abstraction: &A,
    (safe, won): (&BitSet, &BitSet),
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<(BitSet, R), GameError> {
    let cells = abstraction.shape().cells();
    let all = A::Inputs::first(abstraction.inputs());
    let owned = exchange.owned(cells);
    let remaining = R::new(cells);
    let marks = Marks::new(cells);
    let blocks = Blocks::new(abstraction);
    let asked = AtomicUsize::new(0);
    blocks.sweep(
        |_| true,
        |_, first, (): &mut ()| {
            let before = asked.fetch_add(1, Relaxed);
            if before.is_multiple_of(TOLD_EVERY) {
                watch.guarded(before as f64 / blocks.total() as f64);
            }
            blocks.each_cell(first, |cell, index| {
                if !safe.contains(index) || won.contains(index) || !owned.contains(&index) {
                    return;
                }
                let mask = guard.permitted(cell, all);
                remaining.set(index, mask);
                if mask.is_empty() {
                    marks.mark(index);
                }
            });
        },
    );
    let mut dead = marks.into_set();
    exchange.share(&mut dead)?;
    let mut kernel = safe.clone();
    kernel.subtract(&dead);
    kernel.add(won);
    Ok((kernel, remaining))
}
