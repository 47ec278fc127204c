//! Recurrence, persistence, and both at once: what must happen again and again, or from some moment
//! on for ever.
//!
//! | promise | formula | game of the literature |
//! |---|---|---|
//! | [`recurrence`] | `G F g_1 & ... & G F g_n` | (generalised) Büchi |
//! | [`persistence`] | `F G b` | co-Büchi |
//! | [`reactive`] | `(G F a_1 & ... & G F a_m) -> (G F g_1 & ... & G F g_n)` | GR(1) |
//!
//! All are one fixed point (Piterman, Pnueli and Sa'ar, VMCAI 2006), with `pre(S)` the cells that
//! have an input whose whole box lies in S:
//!
//! ```text
//! νZ. ⋂_j μY. ⋃_i νX. (g_j ∩ pre(Z)) ∪ pre(Y) ∪ (pre(X) \ a_i)
//! ```
//!
//! A recurrence has no assumption; a persistence is the case of one assumption `G F !b` and a goal
//! that no cell meets. The fixed points inside are the engine's own games: μY is a reach game, νX a
//! safety game that may end in Y.
//!
//! # The strategy
//! For each goal every winning cell has a rank. Rank 0: cells of the goal; their inputs keep to the
//! winning cells, whereupon the next goal is pursued. A *resting* rank: inputs never raise the
//! rank, and may keep it, but only on cells that one and the same assumption does not hold on. Any
//! other rank: every input lowers it. So a play that obeys the inputs meets the goal, or rests for
//! ever where an assumption never holds again.

use super::bitset::BitSet;
use super::blocks::Blocks;
use super::cells::Cells;
use super::exchange::Alone;
use super::inclusion::Inclusion;
use super::inputs::InputSet;
use super::reach::{included, reach};
use super::safety::stay_or_enter;
use super::{GameError, NOT_WON, SWEEPS_MAX, Solution, Sweep, Watch};
use crate::abstraction::Abstraction;
use crate::abstraction::guard::Guard;

/// Inputs and ranks towards one goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Towards<M = u32> {
    /// Inputs and ranks. `winning` counts all winning cells, `sweeps` those of the last round.
    pub solution: Solution<M>,
    /// The resting ranks, ascending.
    pub resting: Vec<u16>,
}

/// A reactive game, solved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reactive<M = u32> {
    /// Cells from which the promise is kept.
    pub won: BitSet,
    /// How, for each goal.
    pub towards: Vec<Towards<M>>,
    /// Rounds of the outermost fixed point.
    pub rounds: u16,
}

/// What is promised, and under which assumptions.
#[derive(Debug, Clone, Copy)]
pub struct Promise<'p> {
    /// Each holds again and again, or nothing is promised.
    pub assumptions: &'p [BitSet],
    /// Each is met again and again.
    pub goals: &'p [BitSet],
    /// Never entered.
    pub avoid: &'p BitSet,
}

/// Solves: every goal is met again and again, and `avoid` never entered.
///
/// # Errors
/// As [`reactive`].
pub fn recurrence<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    goals: &[BitSet],
    avoid: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<Reactive<A::Inputs>, GameError> {
    let promise = Promise {
        assumptions: &[],
        goals,
        avoid,
    };
    reactive(abstraction, promise, guard, watch)
}

/// Solves: from some moment on always in `stay`, and `avoid` never entered. More cells win than
/// those that reach the kernel of `stay`: a play may rest in `stay` and leave it finitely often.
///
/// # Errors
/// As [`reactive`].
pub fn persistence<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    stay: &BitSet,
    avoid: &BitSet,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<Reactive<A::Inputs>, GameError> {
    let promise = Promise {
        assumptions: &[stay.complement()],
        goals: &[BitSet::new(stay.len())],
        avoid,
    };
    reactive(abstraction, promise, guard, watch)
}

/// Solves the game of a promise. An empty answer is a result.
///
/// # Errors
/// No goal, an interruption by the watch, or more ranks than can be counted.
pub fn reactive<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    promise: Promise<'_>,
    guard: &impl Guard<D, A::Inputs>,
    watch: &dyn Watch,
) -> Result<Reactive<A::Inputs>, GameError> {
    if promise.goals.is_empty() {
        return Err(GameError::EmptyTarget);
    }
    let inner = Inner {
        abstraction,
        guard,
        watch: &SweepsOnly(watch),
    };
    let mut won = promise.avoid.complement();
    let mut rounds = 0u16;
    loop {
        rounds = rounds.checked_add(1).ok_or(GameError::SweepLimit)?;
        let mut towards = Vec::with_capacity(promise.goals.len());
        let mut kept = won.clone();
        for goal in promise.goals {
            let found = inner.towards(goal, promise.assumptions, &won)?;
            kept.keep(&found.solution.winning_set(true));
            towards.push(found);
        }
        if kept == won {
            return Ok(Reactive {
                won,
                towards,
                rounds,
            });
        }
        won = kept;
    }
}

/// Passes sweeps on, and no states: they would be those of the games inside.
struct SweepsOnly<'w>(&'w dyn Watch);

impl Watch for SweepsOnly<'_> {
    fn sweep(&self, sweep: &Sweep) -> bool {
        self.0.sweep(sweep)
    }

    fn guarded(&self, share: f64) {
        self.0.guarded(share);
    }
}

/// The fixed points inside.
struct Inner<'g, A, G> {
    abstraction: &'g A,
    guard: &'g G,
    watch: &'g dyn Watch,
}

impl<A, G> Inner<'_, A, G> {
    /// `μY. ⋃_i νX. (goal ∩ pre(Z)) ∪ pre(Y) ∪ (pre(X) \ a_i)` within Z.
    fn towards<const D: usize>(
        &self,
        goal: &BitSet,
        assumptions: &[BitSet],
        z: &BitSet,
    ) -> Result<Towards<A::Inputs>, GameError>
    where
        A: Abstraction<D>,
        G: Guard<D, A::Inputs>,
    {
        let outside = z.complement();
        let mut first = goal.clone();
        first.keep(z);
        let mut out = self.entering(&first, z);
        let mut won = out.solution.winning_set(true);
        let mut next_rank = 1;
        loop {
            let mut grown = false;
            if !won.is_empty() {
                let found = reach(self.abstraction, &won, &outside, self.guard, self.watch)?;
                out.solution.sweeps = out.solution.sweeps.saturating_add(found.sweeps);
                // The last sweep wins nothing: the largest rank is one less.
                let largest = found.sweeps - 1;
                grown |= out.add(&found, next_rank - 1)?;
                next_rank = room(next_rank, largest)?;
                won.add(&found.winning_set(false));
            }
            for assumption in assumptions {
                let mut rest = z.clone();
                rest.subtract(assumption);
                rest.subtract(&won);
                if rest.is_empty() {
                    continue;
                }
                let sets = (&rest, &won);
                let found = stay_or_enter(self.abstraction, sets, self.guard, &Alone, self.watch)?;
                out.solution.sweeps = out.solution.sweeps.saturating_add(found.sweeps);
                if out.add(&found, next_rank)? {
                    grown = true;
                    out.resting.push(next_rank);
                    next_rank = room(next_rank, 1)?;
                    won.add(&found.winning_set(true));
                }
            }
            if !grown || assumptions.is_empty() {
                out.solution.winning = won.count();
                return Ok(out);
            }
        }
    }

    /// The cells of a set that have an input whose box lies in another, with rank 0.
    fn entering<const D: usize>(&self, cells: &BitSet, set: &BitSet) -> Towards<A::Inputs>
    where
        A: Abstraction<D>,
        G: Guard<D, A::Inputs>,
    {
        let (abstraction, guard) = (self.abstraction, self.guard);
        let inclusion = Inclusion::new(abstraction.shape(), set, abstraction.extents());
        let all = A::Inputs::first(abstraction.inputs());
        let masks = Cells::new(cells.len(), A::Inputs::default());
        let ranks = Cells::new(cells.len(), NOT_WON);
        let blocks = Blocks::new(abstraction);
        blocks.sweep(
            |_| true,
            |_, first, (): &mut ()| {
                blocks.each_cell(first, |cell, index| {
                    if !cells.contains(index) {
                        return;
                    }
                    let mut mask = included(abstraction, &inclusion, cell, all);
                    if !mask.is_empty() {
                        mask = guard.permitted(cell, mask);
                    }
                    if !mask.is_empty() {
                        masks.set(index, mask);
                        ranks.set(index, 0);
                    }
                });
            },
        );
        Towards {
            solution: Solution {
                masks: masks.into_vec(),
                ranks: ranks.into_vec(),
                winning: 0,
                sweeps: 0,
            },
            resting: Vec::new(),
        }
    }
}

/// The first rank that is free after some more.
fn room(rank: u16, more: u16) -> Result<u16, GameError> {
    rank.checked_add(more)
        .filter(|rank| *rank <= SWEEPS_MAX)
        .ok_or(GameError::SweepLimit)
}

impl<M: InputSet> Towards<M> {
    /// Adds the cells that have inputs in a solution, their ranks raised by `base`; whether there
    /// are any.
    fn add(&mut self, found: &Solution<M>, base: u16) -> Result<bool, GameError> {
        let mut any = false;
        for (index, mask) in found.masks.iter().enumerate() {
            if !mask.is_empty() {
                self.solution.masks[index] = *mask;
                self.solution.ranks[index] = room(found.ranks[index], base)?;
                any = true;
            }
        }
        Ok(any)
    }
}
