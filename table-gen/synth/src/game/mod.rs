//! Games on an abstraction, solved by fixed point.
//!
//! | game | fixed point | module |
//! |---|---|---|
//! | reach, reach-avoid | least: `W := T ∪ { c : some u takes c into W }` | [`reach`] |
//! | safety | greatest: `K := { c ∈ K : some u takes c into K }` | [`safety`] |
//! | reach and stay | reach the kernel of safety | [`reach`] on the result of [`safety`] |
//! | recurrence, persistence, reactivity | nested | [`reactive`] |
//!
//! "u takes c into W" means that the whole box of successors lies in W; a pair whose box leaves the
//! grid never does.
//!
//! # Why this way
//!
//! Transitions are never stored: a box is recomputed from a few table entries each time it is
//! needed, and [`inclusion::Inclusion`] answers for it from one eroded bit string. Most cells are
//! not looked at in most sweeps ([`blocks`]). From the coarse to the fine:
//!
//! 1. a *group* of some hundred cells is passed over if nothing changed in the hull of all its
//!    successors since the last sweep (before the first sweep of a reach game, what changed is the
//!    target);
//! 2. so is a *block* of 8 to 64 cells, by its own hull;
//! 3. and an input of a block, if some cell that *all* its boxes share (their *core*) is not won
//!    (reach only), or if nothing changed in the input's hull.
//!
//! Blocks are small enough that their boxes share a cell, because the core rejects far more than
//! the hull; groups are as large as the hulls' growth allows. Sweeps are Jacobi sweeps (every box
//! is held against the set as it was when the sweep began), so ranks are worst-case numbers of
//! steps, and the result does not depend on the order in which threads work. Passing over never
//! changes an answer: what is passed over would have failed, or not have changed.
//!
//! # What was tried and lost
//!
//! Numbers are nanoseconds of processor time per cell and sweep, safety and reach together, of
//! `examples/growth.rs` on 2.25 million cells unless something else is said; now it is about 12.
//!
//! - Blocks alone, without groups, and only blocks whose boxes share half a cell: 50. On fine grids
//!   with a short period such blocks have a single cell, and the filters cost more than what they
//!   save. With groups: 34.
//! - Blocks of 16 to 64 cells without a core: 15; the reach game alone goes from 7 to 12, because
//!   every cell near the front has all its boxes looked at.
//! - Groups of 512, 1024 and 4096 cells do not differ by more than the noise (3 %).
//! - Everything counts as changed before the first sweep of a reach game: 6 more, all of it in that
//!   sweep.
//! - Prefix sums (sixteen reads a box): `paper-bi` took 3.95 s against 0.38 s.
//! - Another witness than the lowest input in safety, runs of cells of one row at once (boxes move
//!   by other than whole cells, so runs would be four to six cells long), and predecessor lists
//!   with counters as in SCOTS (memory for every pair) were weighed, but not tried.

pub mod bitset;
pub mod blocks;
pub mod cells;
pub mod exchange;
pub mod inclusion;
pub mod inputs;
pub mod ledger;
pub mod levels;
pub mod reach;
pub mod reactive;
pub mod restricted;
pub mod safety;
pub mod state;

use bitset::BitSet;

/// Rank of a cell that is not won.
pub const NOT_WON: u16 = u16::MAX;
/// Most sweeps of a game: the largest rank.
pub const SWEEPS_MAX: u16 = u16::MAX - 1;

/// What a game allows: every input that keeps the promise, cell by cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Solution<M = u32> {
    /// Allowed inputs of each cell, bit u for input u; 0 on target cells of a reach game and on
    /// cells that are not won.
    pub masks: Vec<M>,
    /// Worst-case steps to the target: 0 on target cells, [`NOT_WON`] elsewhere outside the winning
    /// set. In a safety game 0 on the kernel.
    pub ranks: Vec<u16>,
    /// Winning cells, target not counted.
    pub winning: usize,
    /// Sweeps until nothing changed.
    pub sweeps: u16,
}

impl<M> Solution<M> {
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
    #[error(
        "the target holds no whole cell, less the error of the estimate: widen the interval, refine the grid or lower the error"
    )]
    EmptyTarget,
    /// Interrupted by the observer.
    #[error("interrupted")]
    Interrupted,
    /// More sweeps than ranks can count.
    #[error("no fixed point after {SWEEPS_MAX} sweeps")]
    SweepLimit,
    /// A saved state that cannot be read.
    #[error("the saved state of the game cannot be read: {0}")]
    Saved(String),
    /// Another rank is gone.
    #[error(transparent)]
    Lost(#[from] exchange::Lost),
}

impl From<std::io::Error> for GameError {
    fn from(error: std::io::Error) -> Self {
        Self::Saved(error.to_string())
    }
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
    /// Cells that later sweeps can still win (reach) or lose (safety), at most.
    pub open: usize,
}

/// Watches a game; returns `false` to interrupt it.
pub trait Watch: Sync {
    /// Called after every sweep.
    fn sweep(&self, sweep: &Sweep) -> bool;

    /// Told, now and then and from any thread, which share of the cells a guard has been asked
    /// about before the first sweep.
    fn guarded(&self, share: f64) {
        let _ = share;
    }

    /// Offered the game's state after every sweep, the last and one that the watch ends among them.
    fn offer(&self, state: &state::State<'_>, interrupted: bool) {
        let _ = (state, interrupted);
    }

    /// A state to go on from, as [`state::State::write`] wrote it for the same game.
    fn saved(&self) -> Option<Box<dyn std::io::Read + '_>> {
        None
    }
}

/// Watches nothing.
#[derive(Debug, Clone, Copy)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn sweep(&self, _sweep: &Sweep) -> bool {
        true
    }
}

/// An observer of any game for whom nobody watches.
pub fn unwatched(_game: &'static str) -> Box<dyn Watch> {
    Box::new(Unwatched)
}

/// Passes every sweep on and remembers the last cells of a safety game: how close one came that
/// keeps nothing.
pub struct LastCells<'w> {
    watch: &'w dyn Watch,
    last: std::sync::atomic::AtomicUsize,
}

impl<'w> LastCells<'w> {
    /// Passes on to a watch.
    pub fn new(watch: &'w dyn Watch) -> Self {
        Self {
            watch,
            last: std::sync::atomic::AtomicUsize::new(0),
        }
    }

    /// Cells that the last sweep found alive: those that died in it, if it left none.
    pub fn last(&self) -> usize {
        self.last.load(std::sync::atomic::Ordering::Relaxed)
    }
}

impl Watch for LastCells<'_> {
    fn sweep(&self, sweep: &Sweep) -> bool {
        // The sweep after the last death changes nothing and is not told apart: it has no cells.
        if sweep.cells + sweep.changed > 0 {
            self.last.store(
                sweep.cells + sweep.changed,
                std::sync::atomic::Ordering::Relaxed,
            );
        }
        self.watch.sweep(sweep)
    }

    fn guarded(&self, share: f64) {
        self.watch.guarded(share);
    }

    fn offer(&self, state: &state::State<'_>, interrupted: bool) {
        self.watch.offer(state, interrupted);
    }

    fn saved(&self) -> Option<Box<dyn std::io::Read + '_>> {
        self.watch.saved()
    }
}
