//! The dense encoding: the oracle. One bit-packed entry for every cell of a box.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 4 × 2 | first cell of the box, f g l p |
//! | 8 | 4 × 2 | cells of the box, f g l p |
//! | 16 | | entries, f fastest, [`bits_per_entry`] bits each, lowest bit first |
//!
//! The last byte is padded with zeros. An entry is 0 outside the law's domain, else the level plus
//! one.

use super::bytes::u16_at;
use super::encoding::Encoding;
use super::error::BlockError;
use crate::grid::{Cell, Grid};
use crate::units::STATES;

/// Bytes before the entries.
pub const DENSE_HEADER_LEN: usize = 4 * STATES;

/// Bits of an entry: enough for 0..=levels.
pub const fn bits_per_entry(levels: u8) -> u32 {
    u8::BITS - levels.leading_zeros()
}

/// Reader of the dense encoding.
#[derive(Debug, Clone)]
pub struct DenseView<'t> {
    first: [u16; STATES],
    count: [u16; STATES],
    bits: u32,
    entries: &'t [u8],
}

impl<'t> DenseView<'t> {
    /// Checks shape and every entry.
    ///
    /// # Errors
    /// A box outside the grid, a length that does not fit the box, or a level that does not exist.
    pub fn parse(block: &'t [u8], grid: &Grid, levels: u8) -> Result<Self, BlockError> {
        if block.len() < DENSE_HEADER_LEN {
            return Err(BlockError::BadShape);
        }
        let (shape, entries) = block.split_at(DENSE_HEADER_LEN);
        let mut first = [0u16; STATES];
        let mut count = [0u16; STATES];
        let mut cells = 1u64;
        for axis in 0..STATES {
            first[axis] = u16_at(shape, 2 * axis);
            count[axis] = u16_at(shape, 2 * STATES + 2 * axis);
            let end = u32::from(first[axis]) + u32::from(count[axis]);
            if count[axis] == 0 || end > u32::from(grid.count()[axis]) {
                return Err(BlockError::BadShape);
            }
            // The box lies in the grid, whose cells fit u32.
            cells *= u64::from(count[axis]);
        }
        let bits = bits_per_entry(levels);
        if (cells * u64::from(bits)).div_ceil(8) != entries.len() as u64 {
            return Err(BlockError::BadShape);
        }
        let view = Self {
            first,
            count,
            bits,
            entries,
        };
        for index in 0..cells {
            if view.entry(index) > levels {
                return Err(BlockError::BadLevel);
            }
        }
        Ok(view)
    }

    /// Entry at a position of the box; 0 past the end.
    fn entry(&self, index: u64) -> u8 {
        let bit = index * u64::from(self.bits);
        let at = (bit / 8) as usize;
        let byte = |at: usize| u16::from(self.entries.get(at).copied().unwrap_or(0));
        let pair = byte(at) | (byte(at + 1) << 8);
        let mask = (1u16 << self.bits) - 1;
        ((pair >> (bit % 8)) & mask) as u8
    }

    /// Position of a cell in the box.
    fn position(&self, cell: Cell) -> Option<u64> {
        let mut index = 0u64;
        for axis in (0..STATES).rev() {
            let offset = cell.0[axis].checked_sub(self.first[axis])?;
            if offset >= self.count[axis] {
                return None;
            }
            index = index * u64::from(self.count[axis]) + u64::from(offset);
        }
        Some(index)
    }
}

impl Encoding for DenseView<'_> {
    fn level(&self, cell: Cell) -> Option<u8> {
        self.entry(self.position(cell)?).checked_sub(1)
    }

    fn visits(&self, _cell: Cell) -> u16 {
        1
    }

    fn worst_visits(&self) -> u16 {
        1
    }

    fn entries(&self) -> u32 {
        self.count.iter().map(|c| u32::from(*c)).product()
    }
}
