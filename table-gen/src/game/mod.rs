//! Games on an abstraction, solved by fixed point.
//!
//! | game | fixed point | module |
//! |---|---|---|
//! | reach, reach-avoid | least: `W := T ∪ { c : some u takes c into W }` | [`reach`] |
//! | safety | greatest: `K := { c ∈ K : some u takes c into K }` | [`safety`] |
//! | reach and stay | reach the kernel of safety | [`reach`] on the result of [`safety`] |
//!
//! "u takes c into W" means that the whole box of successors lies in W; a pair whose box leaves the grid never does.
//!
//! # Why this way
//!
//! Transitions are never stored: a box is recomputed from a few table entries each time it is needed, and
//! [`inclusion::Inclusion`] answers for it from one eroded bit string. Two filters keep most cells from being looked at
//! in most sweeps ([`blocks`]): a block of neighbouring cells is passed over for an input if nothing changed in the hull
//! of its successors since the last sweep, or if some cell that *all* its successor boxes share is not won. Sweeps are
//! Jacobi sweeps (every box is held against the set as it was when the sweep began), so ranks are worst-case numbers of
//! steps, and the result does not depend on the order in which threads work.

pub mod bitset;
pub mod blocks;
pub mod guard;
pub mod inclusion;
pub mod reach;
pub mod restricted;
pub mod safety;

use bitset::BitSet;

/// Rank of a cell that is not won.
pub const NOT_WON: u16 = u16::MAX;
/// Most sweeps of a game: the largest rank.
pub const SWEEPS_MAX: u16 = u16::MAX - 1;

/// What a game allows: every input that keeps the promise, cell by cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Solution {
    /// Allowed inputs of each cell, bit u for input u; 0 on target cells of a reach game and on cells that are not won.
    pub masks: Vec<u32>,
    /// Worst-case steps to the target: 0 on target cells, [`NOT_WON`] elsewhere outside the winning set. In a safety
    /// game 0 on the kernel.
    pub ranks: Vec<u16>,
    /// Winning cells, target not counted.
    pub winning: usize,
    /// Sweeps until nothing changed.
    pub sweeps: u16,
}

impl Solution {
    /// The winning cells, with or without the target (rank 0).
    pub fn winning_set(&self, with_target: bool) -> BitSet {
        let mut set = BitSet::new(self.ranks.len());
        let from = u16::from(!with_target);
        for (index, rank) in self.ranks.iter().enumerate() {
            if *rank != NOT_WON && *rank >= from {
                set.insert(index);
            }
        }
        set
    }
}

/// Why a game has no result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GameError {
    /// The target has no cell.
    #[error("the target holds no whole cell: widen the interval or refine the grid")]
    EmptyTarget,
    /// Interrupted by the observer.
    #[error("interrupted")]
    Interrupted,
    /// More sweeps than ranks can count.
    #[error("no fixed point after {SWEEPS_MAX} sweeps")]
    SweepLimit,
}

/// Progress of a game after a sweep.
#[derive(Debug, Clone, Copy)]
pub struct Sweep {
    /// Sweeps done.
    pub sweep: u16,
    /// Cells won (reach) or still alive (safety).
    pub cells: usize,
    /// Cells that changed in this sweep.
    pub changed: usize,
}

/// Watches a game; returns `false` to interrupt it.
pub trait Watch: Sync {
    /// Called after every sweep.
    fn sweep(&self, sweep: &Sweep) -> bool;
}

/// Watches nothing.
#[derive(Debug, Clone, Copy)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn sweep(&self, _sweep: &Sweep) -> bool {
        true
    }
}
