//! One small number for each cell, written by all threads at once.
//!
//! In a sweep every cell is visited by one task only, so plain relaxed loads and stores are enough;
//! the end of the sweep orders them before what follows. Writing in place saves lists of what
//! changed, which would be the largest thing in memory.

use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicU64, Ordering::Relaxed};

use super::bitset::BitSet;

/// A number that a cell can hold.
pub trait Word: Copy + Default + Send + Sync + 'static {
    /// The same, shared between threads.
    type Atomic: Debug + Send + Sync;

    /// To be shared.
    fn shared(self) -> Self::Atomic;
    /// No longer shared.
    fn owned(shared: Self::Atomic) -> Self;
    /// Reads.
    fn load(from: &Self::Atomic) -> Self;
    /// Writes.
    fn store(self, to: &Self::Atomic);
    /// Eight bytes that hold it.
    fn widened(self) -> u64;
    /// From bytes in little-endian order, as many as the word has.
    fn of_bytes(bytes: &[u8]) -> Self;
}

macro_rules! word {
    ($word:ty, $atomic:ty) => {
        impl Word for $word {
            type Atomic = $atomic;

            fn shared(self) -> $atomic {
                <$atomic>::new(self)
            }
            fn owned(shared: $atomic) -> Self {
                shared.into_inner()
            }
            #[inline]
            fn load(from: &$atomic) -> Self {
                from.load(Relaxed)
            }
            #[inline]
            fn store(self, to: &$atomic) {
                to.store(self, Relaxed);
            }
            fn widened(self) -> u64 {
                u64::from(self)
            }
            fn of_bytes(bytes: &[u8]) -> Self {
                bytes
                    .iter()
                    .rev()
                    .fold(0u64, |sum, byte| sum << 8 | u64::from(*byte)) as Self
            }
        }
    };
}

word!(u8, AtomicU8);
word!(u16, AtomicU16);
word!(u32, AtomicU32);
word!(u64, AtomicU64);

/// Bytes that are read or written at a time.
const CHUNK: usize = 1 << 16;

/// A number for each cell.
#[derive(Debug)]
pub struct Cells<W: Word>(Vec<W::Atomic>);

impl<W: Word> Cells<W> {
    /// The same number in each of so many cells.
    pub fn new(cells: usize, value: W) -> Self {
        let mut all = Vec::new();
        all.resize_with(cells, || value.shared());
        Self(all)
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What a cell holds.
    #[inline]
    pub fn get(&self, index: usize) -> W {
        W::load(&self.0[index])
    }

    /// Puts a number into a cell.
    #[inline]
    pub fn set(&self, index: usize, value: W) {
        value.store(&self.0[index]);
    }

    /// As plain numbers.
    pub fn into_vec(self) -> Vec<W> {
        self.0.into_iter().map(W::owned).collect()
    }

    /// Every number, widened or narrowed by a function.
    pub fn map<V: Word>(self, by: impl Fn(W) -> V) -> Cells<V> {
        Cells(
            self.0
                .into_iter()
                .map(|word| by(W::owned(word)).shared())
                .collect(),
        )
    }

    /// Writes all numbers in little-endian order.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        let size = size_of::<W>();
        let mut bytes = Vec::with_capacity(CHUNK);
        for cells in self.0.chunks(CHUNK / size) {
            bytes.clear();
            for word in cells {
                bytes.extend_from_slice(&W::load(word).widened().to_le_bytes()[..size]);
            }
            to.write_all(&bytes)?;
        }
        Ok(())
    }

    /// Reads as many numbers as there are cells.
    ///
    /// # Errors
    /// Those of the reader, an early end among them.
    pub fn read(cells: usize, from: &mut dyn Read) -> io::Result<Self> {
        let size = size_of::<W>();
        let mut all = Vec::with_capacity(cells);
        let mut bytes = vec![0; CHUNK];
        while all.len() < cells {
            let part = &mut bytes[..size * (cells - all.len()).min(CHUNK / size)];
            from.read_exact(part)?;
            all.extend(part.chunks(size).map(|word| W::of_bytes(word).shared()));
        }
        Ok(Self(all))
    }
}

/// Cells that a sweep marks.
#[derive(Debug)]
pub struct Marks {
    words: Cells<u64>,
    cells: usize,
}

impl Marks {
    /// No cell is marked.
    pub fn new(cells: usize) -> Self {
        let words = Cells::new(BitSet::words_for(cells), 0);
        Self { words, cells }
    }

    /// Marks a cell.
    #[inline]
    pub fn mark(&self, index: usize) {
        self.words.0[index / 64].fetch_or(1 << (index % 64), Relaxed);
    }

    /// The marked cells.
    pub fn into_set(self) -> BitSet {
        BitSet::of_words(self.words.into_vec(), self.cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_were_written() {
        fn check<W: Word + PartialEq + std::fmt::Debug>(of: impl Fn(usize) -> W) {
            // More than one chunk, and not a multiple of it.
            let cells = CHUNK + 77;
            let numbers = Cells::new(cells, W::default());
            (0..cells).for_each(|index| numbers.set(index, of(index)));
            let mut bytes = Vec::new();
            numbers.write(&mut bytes).unwrap();
            assert_eq!(bytes.len(), cells * size_of::<W>());
            let read = Cells::<W>::read(cells, &mut &bytes[..]).unwrap();
            assert_eq!(numbers.into_vec(), read.into_vec());
            assert!(Cells::<W>::read(cells + 1, &mut &bytes[..]).is_err());
        }
        check(|index| index as u8);
        check(|index| index as u16);
        check(|index| (index as u32).wrapping_mul(0x9E37_79B9));
        check(|index| (index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    }

    #[test]
    fn marks_become_a_set() {
        let marks = Marks::new(130);
        for index in [0, 63, 64, 129] {
            marks.mark(index);
        }
        assert_eq!(
            marks.into_set().iter().collect::<Vec<_>>(),
            [0, 63, 64, 129]
        );
    }
}
