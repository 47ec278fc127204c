//! What a game keeps of each cell: all inputs that win and the rank, or as little as the answer
//! needs.
//!
//! | game | full | lean |
//! |---|---|---|
//! | reach | inputs (4 or 8 bytes) and rank (2 bytes) | rank (1 byte, 2 past 254 sweeps) |
//! | safety | inputs (4 or 8 bytes) | witness: an input that keeps the cell (1 byte) |
//!
//! The inputs of a cell of rank r are those whose box lies in the cells of lower rank, so they can
//! be found again from the ranks; those of a cell of the kernel from the kernel.

use std::io::{self, Read, Write};

use super::cells::Cells;
use super::inputs::InputSet;
use super::{NOT_WON, SWEEPS_MAX};

/// What a reach game keeps.
pub trait Ledger<M: InputSet>: Sync + Sized {
    /// Nothing is won yet.
    fn new(cells: usize) -> Self;
    /// Makes room for the ranks of a sweep.
    fn prepare(&mut self, sweep: u16);
    /// A cell is won in a sweep by some inputs; target cells in sweep 0 by none.
    fn win(&self, index: usize, inputs: M, sweep: u16);
    /// Writes all of it.
    ///
    /// # Errors
    /// Those of the writer.
    fn write(&self, to: &mut dyn Write) -> io::Result<()>;
    /// Reads what was written after a sweep.
    ///
    /// # Errors
    /// Those of the reader.
    fn read(cells: usize, sweep: u16, from: &mut dyn Read) -> io::Result<Self>;
}

/// Inputs and ranks.
#[derive(Debug)]
pub struct FullLedger<M: InputSet> {
    /// Inputs of each cell.
    pub masks: Cells<M>,
    /// Rank of each cell, or [`NOT_WON`].
    pub ranks: Cells<u16>,
}

impl<M: InputSet> Ledger<M> for FullLedger<M> {
    fn new(cells: usize) -> Self {
        Self {
            masks: Cells::new(cells, M::default()),
            ranks: Cells::new(cells, NOT_WON),
        }
    }

    fn prepare(&mut self, _sweep: u16) {}

    #[inline]
    fn win(&self, index: usize, inputs: M, sweep: u16) {
        self.masks.set(index, inputs);
        self.ranks.set(index, sweep);
    }

    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.masks.write(to)?;
        self.ranks.write(to)
    }

    fn read(cells: usize, _sweep: u16, from: &mut dyn Read) -> io::Result<Self> {
        Ok(Self {
            masks: Cells::read(cells, from)?,
            ranks: Cells::read(cells, from)?,
        })
    }
}

/// Ranks alone.
#[derive(Debug)]
pub enum Ranks {
    /// In a byte, 255 for cells that are not won.
    Narrow(Cells<u8>),
    /// In two, as in the full ledger.
    Wide(Cells<u16>),
}

/// Largest rank that a byte holds.
const NARROW_MAX: u16 = 254;

impl Ranks {
    /// Rank of a cell, or [`NOT_WON`].
    pub fn get(&self, index: usize) -> u16 {
        match self {
            Self::Narrow(ranks) => match ranks.get(index) {
                u8::MAX => NOT_WON,
                rank => u16::from(rank),
            },
            Self::Wide(ranks) => ranks.get(index),
        }
    }
}

impl<M: InputSet> Ledger<M> for Ranks {
    fn new(cells: usize) -> Self {
        Self::Narrow(Cells::new(cells, u8::MAX))
    }

    fn prepare(&mut self, sweep: u16) {
        if sweep > NARROW_MAX
            && let Self::Narrow(ranks) = self
        {
            let narrow = std::mem::replace(ranks, Cells::new(0, 0));
            *self = Self::Wide(narrow.map(|rank| match rank {
                u8::MAX => NOT_WON,
                rank => u16::from(rank),
            }));
        }
    }

    #[inline]
    fn win(&self, index: usize, _inputs: M, sweep: u16) {
        match self {
            Self::Narrow(ranks) => ranks.set(index, sweep as u8),
            Self::Wide(ranks) => ranks.set(index, sweep),
        }
    }

    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Narrow(ranks) => ranks.write(to),
            Self::Wide(ranks) => ranks.write(to),
        }
    }

    fn read(cells: usize, sweep: u16, from: &mut dyn Read) -> io::Result<Self> {
        Ok(if sweep > NARROW_MAX {
            Self::Wide(Cells::read(cells, from)?)
        } else {
            Self::Narrow(Cells::read(cells, from)?)
        })
    }
}

/// What a safety game keeps: the inputs of a cell that have not failed yet.
pub trait Remaining<M: InputSet>: Sync + Sized {
    /// Whether it forgets what the guard forbids.
    const FORGETS: bool;
    /// No cell has an input.
    fn new(cells: usize) -> Self;
    /// What is left of all inputs; none for a cell that is lost or not played.
    fn get(&self, index: usize, all: M) -> M;
    /// Sets what is left.
    fn set(&self, index: usize, inputs: M);
    /// Writes all of it.
    ///
    /// # Errors
    /// Those of the writer.
    fn write(&self, to: &mut dyn Write) -> io::Result<()>;
    /// Reads what was written.
    ///
    /// # Errors
    /// Those of the reader.
    fn read(cells: usize, from: &mut dyn Read) -> io::Result<Self>;
}

impl<M: InputSet> Remaining<M> for Cells<M> {
    const FORGETS: bool = false;

    fn new(cells: usize) -> Self {
        Self::new(cells, M::default())
    }

    #[inline]
    fn get(&self, index: usize, _all: M) -> M {
        self.get(index)
    }

    #[inline]
    fn set(&self, index: usize, inputs: M) {
        self.set(index, inputs);
    }

    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.write(to)
    }

    fn read(cells: usize, from: &mut dyn Read) -> io::Result<Self> {
        Self::read(cells, from)
    }
}

/// The lowest input of each cell that has not failed.
#[derive(Debug)]
pub struct Witnesses(Cells<u8>);

impl Witnesses {
    /// The witness of a cell; `None` outside the kernel.
    pub fn get(&self, index: usize) -> Option<usize> {
        match self.0.get(index) {
            u8::MAX => None,
            input => Some(usize::from(input)),
        }
    }
}

impl<M: InputSet> Remaining<M> for Witnesses {
    const FORGETS: bool = true;

    fn new(cells: usize) -> Self {
        Self(Cells::new(cells, u8::MAX))
    }

    #[inline]
    fn get(&self, index: usize, all: M) -> M {
        match self.0.get(index) {
            u8::MAX => M::default(),
            input => all & M::from_on(usize::from(input)),
        }
    }

    #[inline]
    fn set(&self, index: usize, inputs: M) {
        // INPUTS_MAX is at most 64, so an input never looks like a lost cell.
        let witness = if inputs.is_empty() {
            u8::MAX
        } else {
            inputs.lowest() as u8
        };
        self.0.set(index, witness);
    }

    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.0.write(to)
    }

    fn read(cells: usize, from: &mut dyn Read) -> io::Result<Self> {
        Ok(Self(Cells::read(cells, from)?))
    }
}

const _: () = assert!(NARROW_MAX < u8::MAX as u16 && SWEEPS_MAX < NOT_WON);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_widen_when_a_byte_is_too_small() {
        let mut ranks = <Ranks as Ledger<u32>>::new(4);
        Ledger::<u32>::win(&ranks, 0, 0, 0);
        Ledger::<u32>::win(&ranks, 1, 1, NARROW_MAX);
        Ledger::<u32>::prepare(&mut ranks, NARROW_MAX);
        assert!(matches!(ranks, Ranks::Narrow(_)));
        Ledger::<u32>::prepare(&mut ranks, NARROW_MAX + 1);
        Ledger::<u32>::win(&ranks, 2, 1, NARROW_MAX + 1);
        let all: Vec<_> = (0..4).map(|index| ranks.get(index)).collect();
        assert_eq!(all, [0, NARROW_MAX, NARROW_MAX + 1, NOT_WON]);
    }

    #[test]
    fn witnesses_are_the_lowest_inputs_left() {
        let left = <Witnesses as Remaining<u32>>::new(2);
        Remaining::<u32>::set(&left, 1, 0b10100);
        assert_eq!((left.get(0), left.get(1)), (None, Some(2)));
        // What failed below the witness stays failed; what is above counts as left.
        assert_eq!(Remaining::<u32>::get(&left, 1, 0b111_1111), 0b111_1100);
        Remaining::<u32>::set(&left, 1, 0);
        assert_eq!(Remaining::<u32>::get(&left, 1, 0b111_1111), 0);
    }
}
