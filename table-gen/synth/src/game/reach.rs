//! Reach and reach-avoid: the least fixed point, with worst-case ranks and every allowed input.

use std::sync::atomic::Ordering::Relaxed;

use super::bitset::BitSet;
use super::blocks::{Blocks, Dirty, Filter};
use super::cells::Marks;
use super::exchange::{Alone, Exchange};
use super::inclusion::Inclusion;
use super::inputs::InputSet;
use super::ledger::{FullLedger, Ledger, Ranks};
use super::state::{State, read_head, write_head};
use super::{GameError, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;
use crate::abstraction::guard::Guard;

/// Solves: from every winning cell, whatever the successor within its box, `target` is reached and
/// `avoid` never entered, and no input is used that `guard` forbids. Target cells have rank 0 and
/// no inputs; the inputs of a winning cell are those whose box lies in the cells won before it, so
/// that the rank falls with every step.
///
/// # Errors
/// An empty target, an interruption by the watch, or too many sweeps.
pub fn reach<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    target: &BitSet,
    avoid: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<Solution<A::Inputs>, GameError> {
    reach_shared(abstraction, (target, avoid), guard, &Alone, watch)
}

/// The same with other ranks: `abstraction`, `target` and `avoid` are those of this rank's window.
///
/// # Errors
/// As [`reach`], or a rank that is gone.
pub fn reach_shared<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    (target, avoid): (&BitSet, &BitSet),
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<Solution<A::Inputs>, GameError> {
    let played =
        play::<D, A, FullLedger<A::Inputs>>(abstraction, (target, avoid), guard, exchange, watch)?;
    Ok(Solution {
        masks: played.ledger.masks.into_vec(),
        ranks: played.ledger.ranks.into_vec(),
        winning: played.winning,
        sweeps: played.sweeps,
    })
}

/// A reach game of which little is kept.
#[derive(Debug)]
pub struct LeanReach {
    /// Winning cells, target among them.
    pub won: BitSet,
    /// Worst-case steps of each cell.
    pub ranks: Ranks,
    /// Winning cells, target not counted.
    pub winning: usize,
    /// Sweeps until nothing changed.
    pub sweeps: u16,
}

/// The same game with a byte or two a cell: ranks alone. [`LeanReach::inputs`] finds the inputs
/// again.
///
/// # Errors
/// As [`reach`].
pub fn reach_lean<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    target: &BitSet,
    avoid: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<LeanReach, GameError> {
    let played = play::<D, A, Ranks>(abstraction, (target, avoid), guard, &Alone, watch)?;
    Ok(LeanReach {
        won: played.won,
        ranks: played.ledger,
        winning: played.winning,
        sweeps: played.sweeps,
    })
}

impl LeanReach {
    /// The inputs of a cell: those whose box lies in the cells of lower rank. Empty on target cells
    /// and cells not won.
    pub fn inputs<const D: usize, A: Abstraction<D>>(
        &self,
        abstraction: &A,
        guard: &impl Guard<D, A::Inputs>,
        cell: [u32; D],
    ) -> A::Inputs {
        let shape = abstraction.shape();
        let rank = self.ranks.get(shape.index(cell));
        let anchor = abstraction.anchor(cell);
        let mut mask = A::Inputs::default();
        if rank == 0 || rank == super::NOT_WON {
            return mask;
        }
        for input in 0..abstraction.inputs() {
            let lower = |index| self.ranks.get(index) < rank;
            if let Some(cells) = abstraction.successor(&anchor, input)
                && shape.indices(cells.low, cells.high).all(lower)
            {
                mask = mask | A::Inputs::only(input);
            }
        }
        guard.permitted(cell, mask)
    }
}

struct Played<L> {
    ledger: L,
    won: BitSet,
    winning: usize,
    sweeps: u16,
}

fn play<const D: usize, A: Abstraction<D>, L: Ledger<A::Inputs>>(
    abstraction: &A,
    (target, avoid): (&BitSet, &BitSet),
    guard: &impl Guard<D, A::Inputs>,
    exchange: &dyn Exchange,
    watch: &dyn Watch,
) -> Result<Played<L>, GameError> {
    let cells = abstraction.shape().cells();
    let owned = exchange.owned(cells);
    let own = |set: &BitSet| set.iter().filter(|index| owned.contains(index)).count();
    let targets = exchange.sum(own(target))?;
    if targets == 0 {
        return Err(GameError::EmptyTarget);
    }
    let blocks = Blocks::new(abstraction);
    // Before the first sweep the target is what changed: a box without a cell of it is not
    // included.
    let (mut sweeps, mut won, mut changed, mut ledger) = match watch.saved() {
        None => {
            let ledger = L::new(cells);
            target
                .iter()
                .for_each(|index| ledger.win(index, A::Inputs::default(), 0));
            (0, target.clone(), target.clone(), ledger)
        }
        Some(mut from) => {
            let (sweeps, won, changed) = read_head(cells, &mut from)?;
            let ledger = L::read(cells, sweeps, &mut from)?;
            (sweeps, won, changed, ledger)
        }
    };
    // Cells that no later sweep can win here.
    let mut closed = won.clone();
    closed.add(avoid);
    let open = blocks.count_cells(|index| !closed.contains(index) && owned.contains(&index));
    let count_open = || {
        open.iter()
            .map(|cells| usize::from(cells.load(Relaxed)))
            .sum()
    };
    let mut winning = exchange.sum(own(&won))? - targets;
    let can_be_won = winning + exchange.sum(count_open())?;
    loop {
        if sweeps > 0 && exchange.sum(changed.count())? == 0 {
            break;
        }
        if sweeps == SWEEPS_MAX {
            return Err(GameError::SweepLimit);
        }
        sweeps += 1;
        ledger.prepare(sweeps);
        // Before the first sweep the target is what changed: a box without a cell of it is not
        // included.
        let dirty = Dirty::after(abstraction, &changed);
        drop(changed);
        let filter = Filter::new(abstraction, &won, dirty, true);
        let inclusion = Inclusion::new(abstraction.shape(), &won, abstraction.extents());
        let marks = Marks::new(cells);
        let found = blocks.sweep(
            |first| filter.group(abstraction, first),
            |block, first, new: &mut usize| {
                if open[block].load(Relaxed) == 0 {
                    return;
                }
                let inputs = filter.inputs(abstraction, first);
                if inputs.is_empty() {
                    return;
                }
                let mut won_here = 0;
                blocks.each_cell(first, |cell, index| {
                    if closed.contains(index) || !owned.contains(&index) {
                        return;
                    }
                    let mut mask = included(abstraction, &inclusion, cell, inputs);
                    if !mask.is_empty() {
                        mask = guard.permitted(cell, mask);
                    }
                    if !mask.is_empty() {
                        ledger.win(index, mask, sweeps);
                        marks.mark(index);
                        won_here += 1;
                    }
                });
                if won_here > 0 {
                    open[block].fetch_sub(won_here, Relaxed);
                    *new += usize::from(won_here);
                }
            },
        );
        drop((filter, inclusion));
        changed = marks.into_set();
        exchange.share(&mut changed)?;
        if owned.len() < cells {
            // What others won counts here too, for whom the solution is a target.
            let told = changed.iter().filter(|index| !owned.contains(index));
            told.for_each(|index| ledger.win(index, A::Inputs::default(), sweeps));
        }
        won.add(&changed);
        closed.add(&changed);
        let new = exchange.sum(found.into_iter().sum())?;
        winning += new;
        let progress = Sweep {
            sweep: sweeps,
            cells: winning,
            changed: new,
            open: can_be_won - winning,
        };
        let go_on = watch.sweep(&progress);
        let write = |to: &mut dyn std::io::Write| {
            write_head(sweeps, &won, &changed, to)?;
            ledger.write(to)
        };
        watch.offer(&State::new(sweeps, new == 0, &write), !go_on);
        if !go_on {
            return Err(GameError::Interrupted);
        }
    }
    Ok(Played {
        ledger,
        won,
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
    inputs: A::Inputs,
) -> A::Inputs {
    let anchor = abstraction.anchor(cell);
    let mut mask = A::Inputs::default();
    let mut rest = inputs;
    while !rest.is_empty() {
        let input = rest.lowest();
        rest = rest.without_lowest();
        if let Some(cells) = abstraction.successor(&anchor, input)
            && inclusion.includes(&cells)
        {
            mask = mask | A::Inputs::only(input);
        }
    }
    mask
}

/// Of the cells outside `target` and `avoid`, those that have an input under which *some* successor
/// may lie in the target: how close a game came that wins nothing.
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
