//! Integer affine functions of a cell: pieces that a leaf of an inputs tree names, and half-spaces
//! of a domain.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 4 × 2 | factor of each cell index, f g l p (i16) |
//! | 8 | 4 | constant (i32) |
//!
//! The value is `constant + Σ factor·index`. The reader checks once that no cell of the grid takes
//! a partial sum out of 32 bits; after that the arithmetic cannot overflow.

use super::bytes::array_at;
use crate::grid::{Cell, Grid};
use crate::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P, STATES};

/// Bytes of a function.
pub const AFFINE_LEN: usize = 2 * STATES + 4;

/// Fractional bits of a piece's value: the level is the value shifted right by these, clamped.
pub const AFFINE_FRACTION_BITS: u32 = 10;

/// An integer affine function of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct AffineFunction {
    /// Factor of each cell index.
    pub factors: [i16; STATES],
    /// Value at the first cell.
    pub constant: i32,
}

impl AffineFunction {
    /// Reads a function; the slice must hold [`AFFINE_LEN`] bytes (all is zero if it is shorter).
    pub fn read(bytes: &[u8]) -> Self {
        let bytes: [u8; AFFINE_LEN] = array_at(bytes, 0).unwrap_or_default();
        let factor = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
        Self {
            factors: [factor(0), factor(2), factor(4), factor(6)],
            constant: i32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]),
        }
    }

    /// The function's bytes.
    pub fn write(&self) -> [u8; AFFINE_LEN] {
        let mut out = [0u8; AFFINE_LEN];
        for (axis, factor) in self.factors.iter().enumerate() {
            out[2 * axis..2 * axis + 2].copy_from_slice(&factor.to_le_bytes());
        }
        out[2 * STATES..].copy_from_slice(&self.constant.to_le_bytes());
        out
    }

    /// Whether every partial sum over the grid's cells fits 32 bits.
    pub fn fits(&self, grid: &Grid) -> bool {
        let mut largest = self.constant.unsigned_abs();
        for (factor, count) in self.factors.iter().zip(grid.count()) {
            // At most 2^15 · 2^16; a sum that saturates is too large anyway.
            let term = u32::from(factor.unsigned_abs()) * u32::from(count - 1);
            largest = largest.saturating_add(term);
        }
        largest <= i32::MAX as u32
    }

    /// Value at a cell; wraps for a cell of another grid.
    pub fn value(&self, cell: Cell) -> i32 {
        let term = |axis: usize| i32::from(self.factors[axis]).wrapping_mul(cell.0[axis].into());
        // Not a loop, which would go through memory.
        self.constant
            .wrapping_add(term(AXIS_F))
            .wrapping_add(term(AXIS_G))
            .wrapping_add(term(AXIS_L))
            .wrapping_add(term(AXIS_P))
    }

    /// The value as an input level: without its fraction, clamped to `0..levels`.
    pub fn level(&self, cell: Cell, levels: u8) -> u8 {
        let whole = self.value(cell) >> AFFINE_FRACTION_BITS;
        whole.clamp(0, i32::from(levels.saturating_sub(1))) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_both_ways() {
        let function = AffineFunction {
            factors: [1, -2, 0x0304, i16::MIN],
            constant: -5,
        };
        let bytes = [
            0x01, 0x00, 0xFE, 0xFF, 0x04, 0x03, 0x00, 0x80, 0xFB, 0xFF, 0xFF, 0xFF,
        ];
        assert_eq!(function.write(), bytes);
        assert_eq!(AffineFunction::read(&bytes), function);
    }

    #[test]
    fn level_is_the_floor_clamped() {
        let function = AffineFunction {
            factors: [512, 0, 0, 0],
            constant: -1024,
        };
        // Value in levels: i/2 - 1.
        let level = |i| function.level(Cell([i, 9, 9, 9]), 3);
        assert_eq!(
            [0, 1, 2, 3, 4, 5, 6, 7].map(level),
            [0, 0, 0, 0, 1, 1, 2, 2]
        );
    }

    proptest! {
        #[test]
        fn a_function_that_fits_never_overflows(
            factors in any::<[i16; 4]>(), constant in any::<i32>(), at in any::<[u16; 4]>(),
        ) {
            let count = [300u16, 40, 7, 1];
            let grid = Grid::new([0; 4], [1; 4], count).unwrap();
            let cell = Cell(core::array::from_fn(|d| at[d] % count[d]));
            let function = AffineFunction { factors, constant };
            let exact = (0..4).fold(i64::from(constant), |sum, d| sum + i64::from(factors[d]) * i64::from(cell.0[d]));
            if function.fits(&grid) {
                prop_assert_eq!(i64::from(function.value(cell)), exact);
            }
        }
    }
}
