//! One game on several ranks, each with a slab of the grid: past what one machine's memory and
//! cores can do.
//!
//! The grid is cut along its last axis, the slowest of the dense order, so that a slab is one run
//! of cells. A rank holds its own slab and a halo: all layers in which a successor of an own cell
//! may lie. After a sweep it sends to every rank what changed in the part of its slab that lies in
//! that rank's window, one bit a cell ([`Slabs`]). All boxes are computed from the whole grid's
//! tables ([`slab::Slab`]), and every box is held against the same set as on one rank: the solution
//! is the same, bit for bit, for any number of ranks.
//!
//! How bits travel is a [`Transport`]: [`threads`] for tests in one process; the package
//! `mpi-ranks` has the one for many machines.

pub mod shares;
pub mod slab;
pub mod threads;

use std::cell::Cell;
use std::ops::Range;

use crate::game::bitset::BitSet;
use crate::game::exchange::{Exchange, Lost};

/// Carries words between ranks.
pub trait Transport {
    /// This rank, from 0.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn ranks(&self) -> usize;

    /// Sends words to some ranks, and receives from others as many as named. Every rank calls it at
    /// the same moment, and what one sends another expects.
    ///
    /// # Errors
    /// A rank that is gone.
    fn swap(
        &self,
        outgoing: &[(usize, Vec<u64>)],
        incoming: &[(usize, usize)],
    ) -> Result<Vec<Vec<u64>>, Lost>;

    /// The sum over all ranks, told to all.
    ///
    /// # Errors
    /// A rank that is gone.
    fn sum(&self, count: u64) -> Result<u64, Lost>;
}

/// Cells in the dense order of the whole grid that a rank owns, and that it holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Own cells.
    pub own: Range<usize>,
    /// Own cells and halo.
    pub window: Range<usize>,
}

/// The exchange between slabs.
pub struct Slabs<'t, T> {
    transport: &'t T,
    parts: Vec<Part>,
    sent_bytes: Cell<u64>,
}

impl<'t, T: Transport> Slabs<'t, T> {
    /// The exchange of a rank with this part; every rank learns of all the others'.
    ///
    /// # Errors
    /// A rank that is gone.
    pub fn new(transport: &'t T, part: &Part) -> Result<Self, Lost> {
        let mine = [
            part.own.start,
            part.own.end,
            part.window.start,
            part.window.end,
        ];
        let words = mine.map(|at| at as u64).to_vec();
        let others: Vec<usize> = others(transport).collect();
        let outgoing: Vec<_> = others.iter().map(|rank| (*rank, words.clone())).collect();
        let incoming: Vec<_> = others.iter().map(|rank| (*rank, words.len())).collect();
        let mut parts = vec![part.clone(); transport.ranks()];
        for (rank, words) in others
            .into_iter()
            .zip(transport.swap(&outgoing, &incoming)?)
        {
            let at = |i: usize| words.get(i).copied().unwrap_or(0) as usize;
            parts[rank] = Part {
                own: at(0)..at(1),
                window: at(2)..at(3),
            };
        }
        Ok(Self {
            transport,
            parts,
            sent_bytes: Cell::new(0),
        })
    }

    fn mine(&self) -> &Part {
        &self.parts[self.transport.rank()]
    }

    /// Bytes that this rank has sent in exchanges so far.
    pub fn sent_bytes(&self) -> u64 {
        self.sent_bytes.get()
    }
}

/// Words of all ranks in their order on the first rank; `None` on the others.
///
/// # Errors
/// A rank that is gone.
pub fn gather(transport: &impl Transport, words: &[u64]) -> Result<Option<Vec<u64>>, Lost> {
    let first = transport.rank() == 0;
    let (mut sizes_out, mut sizes_in, mut out) = (Vec::new(), Vec::new(), Vec::new());
    if first {
        sizes_in = others(transport).map(|rank| (rank, 1)).collect();
    } else {
        sizes_out.push((0, vec![words.len() as u64]));
        out.push((0, words.to_vec()));
    }
    let sizes = transport.swap(&sizes_out, &sizes_in)?;
    let incoming: Vec<_> = others(transport)
        .zip(&sizes)
        .map(|(rank, size)| (rank, size[0] as usize))
        .collect();
    let rest = transport.swap(&out, &incoming)?;
    Ok(first.then(|| [words.to_vec(), rest.concat()].concat()))
}

fn others(transport: &impl Transport) -> impl Iterator<Item = usize> {
    let rank = transport.rank();
    (0..transport.ranks()).filter(move |other| *other != rank)
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

impl<T: Transport> Exchange for Slabs<'_, T> {
    fn share(&self, changed: &mut BitSet) -> Result<(), Lost> {
        let me = self.transport.rank();
        let mine = self.mine();
        let local = |cells: &Range<usize>| (cells.start - mine.window.start, cells.len());
        let (mut outgoing, mut incoming, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for (rank, part) in self
            .parts
            .iter()
            .enumerate()
            .filter(|(rank, _)| *rank != me)
        {
            let told = overlap(&mine.own, &part.window);
            if !told.is_empty() {
                let (from, len) = local(&told);
                outgoing.push((rank, changed.part(from, len)));
            }
            let heard = overlap(&part.own, &mine.window);
            if !heard.is_empty() {
                let (from, len) = local(&heard);
                incoming.push((rank, len.div_ceil(64)));
                places.push(from);
            }
        }
        let bytes: usize = outgoing.iter().map(|(_, words)| 8 * words.len()).sum();
        self.sent_bytes.set(self.sent_bytes.get() + bytes as u64);
        for (from, words) in places
            .into_iter()
            .zip(self.transport.swap(&outgoing, &incoming)?)
        {
            changed.add_part(from, &words);
        }
        Ok(())
    }

    fn sum(&self, count: usize) -> Result<usize, Lost> {
        Ok(self.transport.sum(count as u64)? as usize)
    }

    fn owned(&self, _cells: usize) -> Range<usize> {
        let mine = self.mine();
        let from = mine.own.start - mine.window.start;
        from..from + mine.own.len()
    }
}
