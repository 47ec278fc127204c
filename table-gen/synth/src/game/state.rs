//! The state of a game between two sweeps: what a checkpoint holds, and what a game goes on from.
//!
//! In the file's order, little-endian: sweeps (u16), the set of cells won or alive, the cells that
//! the last sweep changed (both as words of 64 cells), and what the game keeps of each cell. After
//! the last sweep nothing is changed, by which a finished game is known.

use std::io::{self, Read, Write};

use super::bitset::BitSet;
use super::cells::{Cells, Word};

/// A game's state, to be written by whoever wants to.
pub struct State<'s> {
    /// Sweeps done.
    pub sweeps: u16,
    /// Whether no sweep will follow.
    pub finished: bool,
    write: &'s dyn Fn(&mut dyn Write) -> io::Result<()>,
}

impl<'s> State<'s> {
    pub(super) fn new(
        sweeps: u16,
        finished: bool,
        write: &'s dyn Fn(&mut dyn Write) -> io::Result<()>,
    ) -> Self {
        Self {
            sweeps,
            finished,
            write,
        }
    }

    /// Writes the state.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        (self.write)(to)
    }
}

/// Writes what every game has.
pub(super) fn write_head(
    sweeps: u16,
    set: &BitSet,
    changed: &BitSet,
    to: &mut dyn Write,
) -> io::Result<()> {
    to.write_all(&sweeps.to_le_bytes())?;
    for words in [set.words(), changed.words()] {
        for chunk in words.chunks(8192) {
            let bytes: Vec<u8> = chunk.iter().flat_map(|word| word.to_le_bytes()).collect();
            to.write_all(&bytes)?;
        }
    }
    Ok(())
}

/// Reads what every game has.
pub(super) fn read_head(cells: usize, from: &mut dyn Read) -> io::Result<(u16, BitSet, BitSet)> {
    let mut sweeps = [0; 2];
    from.read_exact(&mut sweeps)?;
    let mut set = || {
        let words = Cells::<u64>::read(BitSet::words_for(cells), from)?;
        Ok::<_, io::Error>(BitSet::of_words(words.into_vec(), cells))
    };
    let (set, changed) = (set()?, set()?);
    Ok((u16::of_bytes(&sweeps), set, changed))
}
