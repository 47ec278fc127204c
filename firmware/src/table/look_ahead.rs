//! Look-ahead: is a cell covered, by where a held input would take it?
//!
//! Past one step ahead the edge of a winning set is ragged, because every step of the abstraction
//! rounds to whole cells. A look-ahead rounds in the same way: it holds one input (the strongest or
//! none) and follows the *near* corner of the successor boxes, the one that comes closest to a
//! limit, and beside it the *far* bounds of g, l and p, step by step, in whole cells. The cell is
//! covered if f comes into a band before a bound leaves its range, or if the steps run out.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 1 | fractional bits s of the factors, 0..=15 |
//! | 1 | 1 | most steps, 1..=15 |
//! | 2 | 2 | reserved, 0 |
//! | 4 | 2 × 2 | cells of f in which the run ends well: first, last |
//! | 8 | 2 × 2 | cells of f that a step must not leave: first, last |
//! | 12 | 16 × 2 | factors F (i16): of the indices f, g, l, p on the next f, then g, l, p |
//! | 44 | 4 × 4 | near offsets a of f, g, l, p (i32) |
//! | 60 | 3 × 4 | far offsets b of g, l, p (i32) |
//!
//! ```text
//! near'_d = floor((Σ_j F_dj near_j + a_d) / 2^s)
//! far'_d  = floor((Σ_j F_dj near_j + Σ_{g <= j <= d} F_dj (far_j - near_j) + b_d) / 2^s)
//! ```
//!
//! Both begin at the cell's indices, of which f must lie in its range already. After each step g, l
//! and p must lie on the grid.
//!
//! The device trusts it no further than any other byte of the table: whether the answers are right
//! is for the generator and the verifier, which ask for every cell.

use core::hint::black_box;

use super::bytes::{array_at, i32_at, u16_at};
use crate::grid::{Cell, Grid};
use crate::units::{AXIS_F, AXIS_G, AXIS_L, AXIS_P, STATES};

/// Bytes of a look-ahead.
pub const LOOK_AHEAD_LEN: usize = 72;
/// Most fractional bits.
pub const LOOK_AHEAD_SHIFT_MAX: u8 = 15;
/// Most steps.
pub const LOOK_AHEAD_STEPS_MAX: u8 = 15;

const DONE_AT: usize = 4;
const LIMIT_AT: usize = 8;
const FACTORS_AT: usize = 12;
const NEAR_AT: usize = 44;
const FAR_AT: usize = 60;

/// A look-ahead, decoded: for the writer. The reader works on the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LookAhead {
    /// Fractional bits of factors and offsets, 0..=15.
    pub shift: u8,
    /// Most steps, 1..=15.
    pub steps: u8,
    /// Cells of f in which the run ends well: first, last.
    pub done: [u16; 2],
    /// Cells of f that a step must not leave: first, last.
    pub limit: [u16; 2],
    /// `factors[d][j]`: of index j on the next index d.
    pub factors: [[i16; STATES]; STATES],
    /// Offsets of the near corner.
    pub near: [i32; STATES],
    /// Offsets of the far bounds of g, l and p.
    pub far: [i32; 3],
}

impl LookAhead {
    /// The bytes.
    pub fn write(&self) -> [u8; LOOK_AHEAD_LEN] {
        let mut out = [0u8; LOOK_AHEAD_LEN];
        out[0] = self.shift;
        out[1] = self.steps;
        let bands = self.done.iter().chain(&self.limit);
        for (slot, index) in out[4..].chunks_exact_mut(2).zip(bands) {
            slot.copy_from_slice(&index.to_le_bytes());
        }
        for (slot, factor) in out[FACTORS_AT..]
            .chunks_exact_mut(2)
            .zip(self.factors.as_flattened())
        {
            slot.copy_from_slice(&factor.to_le_bytes());
        }
        let offsets = self.near.iter().chain(&self.far);
        for (slot, offset) in out[NEAR_AT..].chunks_exact_mut(4).zip(offsets) {
            slot.copy_from_slice(&offset.to_le_bytes());
        }
        out
    }

    /// Reads the bytes; `None` if a field is out of its range.
    #[inline(never)]
    pub fn read(bytes: &[u8; LOOK_AHEAD_LEN]) -> Option<Self> {
        let [shift, steps] = array_at(bytes, 0)?;
        let factor = |at: usize| u16_at(bytes, FACTORS_AT + 2 * at).cast_signed();
        let found = Self {
            shift,
            steps,
            done: [u16_at(bytes, 4), u16_at(bytes, 6)],
            limit: [u16_at(bytes, 8), u16_at(bytes, 10)],
            factors: core::array::from_fn(|d| core::array::from_fn(|j| factor(STATES * d + j))),
            near: core::array::from_fn(|d| i32_at(bytes, NEAR_AT + 4 * d)),
            far: core::array::from_fn(|d| i32_at(bytes, FAR_AT + 4 * d)),
        };
        let sound = shift <= LOOK_AHEAD_SHIFT_MAX
            && (1..=LOOK_AHEAD_STEPS_MAX).contains(&steps)
            && u16_at(bytes, 2) == 0
            && found.done[0] <= found.done[1]
            && found.limit[0] <= found.limit[1];
        sound.then_some(found)
    }

    /// Whether the look-ahead of these bytes covers a cell of its grid with `count` cells. It must
    /// fit the grid.
    #[inline]
    pub fn covers(bytes: &[u8; LOOK_AHEAD_LEN], cell: Cell, count: [u16; STATES]) -> bool {
        covers(bytes, cell, count).0
    }

    /// Whether no partial sum leaves 32 bits while the bounds are on the grid.
    #[inline(never)]
    pub fn fits(&self, grid: &Grid) -> bool {
        let count = grid.count();
        // g, l and p have a far bound, in this order.
        let far = |d: usize| d.checked_sub(1).and_then(|at| self.far.get(at));
        (0..STATES).all(|d| {
            let near = self.near[d].unsigned_abs();
            let mut sum = near.max(far(d).map_or(0, |far| far.unsigned_abs()));
            for (factor, count) in self.factors[d].iter().zip(count) {
                // At most 2^15 · 2^16; a sum that saturates is too large anyway.
                let reach = u32::from(factor.unsigned_abs()) * u32::from(count - 1);
                // Far rows add a second share of the indices, at most all of them.
                sum = sum.saturating_add(reach).saturating_add(reach);
            }
            sum <= i32::MAX as u32
        }) && self.limit[1] < count[AXIS_F]
    }
}

/// Runs a look-ahead that was read and fits, from a cell of its grid with `count` cells: whether
/// the cell is covered, and the steps taken.
///
/// Written over the bytes as they lie in flash, with every index known when it is compiled.
#[inline]
pub(super) fn covers(
    bytes: &[u8; LOOK_AHEAD_LEN],
    cell: Cell,
    count: [u16; STATES],
) -> (bool, u16) {
    let [f, g, l, p] = cell.0;
    let (mut f, mut g): (i32, i32) = (f.into(), g.into());
    let (mut l, mut p): (i32, i32) = (l.into(), p.into());
    let (mut g_far, mut l_far, mut p_far) = (g, l, p);
    if !within(f, bytes, LIMIT_AT) {
        return (false, 0);
    }
    let steps = u16::from(bytes[1]);
    for step in 0..steps {
        // Read anew at every step: kept over the steps, the factors would only go from flash to the
        // stack.
        let bytes = black_box(bytes);
        if within(f, bytes, DONE_AT) {
            return (true, step);
        }
        let shift = u32::from(bytes[0] & LOOK_AHEAD_SHIFT_MAX);
        let factor = |d: usize, j: usize| {
            let at = FACTORS_AT + 2 * (STATES * d + j);
            i32::from(i16::from_le_bytes([bytes[at], bytes[at + 1]]))
        };
        // Sums cannot overflow while the bounds are on the grid, which `fits` checked; wrapping
        // says so to the compiler.
        let sum = |d: usize| {
            factor(d, 0)
                .wrapping_mul(f)
                .wrapping_add(factor(d, 1).wrapping_mul(g))
                .wrapping_add(factor(d, 2).wrapping_mul(l))
                .wrapping_add(factor(d, 3).wrapping_mul(p))
        };
        let near = |d: usize, sum: i32| sum.wrapping_add(word(bytes, NEAR_AT + 4 * d)) >> shift;
        let far = |d: usize, sum: i32| sum.wrapping_add(word(bytes, FAR_AT + 4 * d - 4)) >> shift;
        let on_grid = |index: i32, axis: usize| index.cast_unsigned() < u32::from(count[axis]);
        let f_next = near(AXIS_F, sum(AXIS_F));
        if !within(f_next, bytes, LIMIT_AT) {
            return (false, step + 1);
        }
        let g_sum = sum(AXIS_G);
        let l_sum = sum(AXIS_L);
        let p_sum = sum(AXIS_P);
        let apart = g_far.wrapping_sub(g);
        let mut g_apart = factor(1, 1).wrapping_mul(apart);
        let mut l_apart = factor(2, 1).wrapping_mul(apart);
        let mut p_apart = factor(3, 1).wrapping_mul(apart);
        let apart = l_far.wrapping_sub(l);
        l_apart = l_apart.wrapping_add(factor(2, 2).wrapping_mul(apart));
        p_apart = p_apart.wrapping_add(factor(3, 2).wrapping_mul(apart));
        let apart = p_far.wrapping_sub(p);
        p_apart = p_apart.wrapping_add(factor(3, 3).wrapping_mul(apart));
        g_apart = g_apart.wrapping_add(g_sum);
        f = f_next;
        (g, g_far) = (near(AXIS_G, g_sum), far(AXIS_G, g_apart));
        if !on_grid(g, AXIS_G) || !on_grid(g_far, AXIS_G) {
            return (false, step + 1);
        }
        (l, l_far) = (
            near(AXIS_L, l_sum),
            far(AXIS_L, l_apart.wrapping_add(l_sum)),
        );
        if !on_grid(l, AXIS_L) || !on_grid(l_far, AXIS_L) {
            return (false, step + 1);
        }
        (p, p_far) = (
            near(AXIS_P, p_sum),
            far(AXIS_P, p_apart.wrapping_add(p_sum)),
        );
        if !on_grid(p, AXIS_P) || !on_grid(p_far, AXIS_P) {
            return (false, step + 1);
        }
    }
    (true, steps)
}

/// Whether an index lies in the band of two cells at an offset: first, last.
#[inline(always)]
fn within(index: i32, bytes: &[u8; LOOK_AHEAD_LEN], at: usize) -> bool {
    let ends = word(bytes, at).cast_unsigned();
    let (first, last) = (ends & 0xFFFF, ends >> 16);
    index.cast_unsigned().wrapping_sub(first) <= last.wrapping_sub(first)
}

/// A word at an offset that is known when it is compiled.
#[inline(always)]
fn word(bytes: &[u8; LOOK_AHEAD_LEN], at: usize) -> i32 {
    i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_look_ahead() -> impl Strategy<Value = LookAhead> {
        let band = || (0u16..30, 0u16..30).prop_map(|(a, b)| [a.min(b), a.max(b)]);
        let offset = || -200_000i32..400_000;
        (
            (0u8..=15, 1u8..=15, band(), band()),
            proptest::array::uniform4(proptest::array::uniform4(-9000i16..9000)),
            proptest::array::uniform4(offset()),
            proptest::array::uniform3(offset()),
        )
            .prop_map(
                |((shift, steps, done, limit), factors, near, far)| LookAhead {
                    shift,
                    steps,
                    done,
                    limit,
                    factors,
                    near,
                    far,
                },
            )
    }

    /// The same in 128 bits with floor division, straight from the formulas of the module's docs.
    fn slowly(ahead: &LookAhead, cell: [u16; 4], count: [u16; 4]) -> bool {
        let mut near = cell.map(i128::from);
        let mut far = near;
        let unit = 1i128 << ahead.shift;
        let in_band = |x: i128, [a, b]: [u16; 2]| i128::from(a) <= x && x <= i128::from(b);
        if !in_band(near[0], ahead.limit) {
            return false;
        }
        for _ in 0..ahead.steps {
            if in_band(near[0], ahead.done) {
                return true;
            }
            let sum = |d: usize| -> i128 {
                (0..4)
                    .map(|j| i128::from(ahead.factors[d][j]) * near[j])
                    .sum()
            };
            let mut next = [0; 4];
            let mut next_far = [0; 4];
            for d in 0..4 {
                next[d] = (sum(d) + i128::from(ahead.near[d])).div_euclid(unit);
                next_far[d] = match d {
                    1..=3 => {
                        let of = |j: usize| i128::from(ahead.factors[d][j]) * (far[j] - near[j]);
                        let apart: i128 = (1..=d).map(of).sum();
                        (sum(d) + apart + i128::from(ahead.far[d - 1])).div_euclid(unit)
                    }
                    _ => next[d],
                };
            }
            (near, far) = (next, next_far);
            let on_grid = |d: usize, x: i128| 0 <= x && x < i128::from(count[d]);
            let kept = in_band(near[0], ahead.limit)
                && (1..4).all(|d| on_grid(d, near[d]) && on_grid(d, far[d]));
            if !kept {
                return false;
            }
        }
        true
    }

    #[test]
    fn a_run_by_hand() {
        // f falls by one a step, g rises by two, its far bound by three; all else stays.
        let mut ahead = LookAhead {
            shift: 4,
            steps: 3,
            done: [0, 1],
            limit: [0, 9],
            factors: [[16, 0, 0, 0], [0, 16, 0, 0], [0, 0, 16, 0], [0, 0, 0, 16]],
            near: [-16, 32, 0, 0],
            far: [48, 0, 0],
        };
        let count = [10, 10, 10, 10];
        let run = |ahead: &LookAhead, f, g| covers(&ahead.write(), Cell([f, g, 5, 5]), count);
        assert_eq!(run(&ahead, 1, 9), (true, 0), "there already");
        assert_eq!(run(&ahead, 3, 0), (true, 2), "two steps");
        assert_eq!(run(&ahead, 9, 0), (true, 3), "the steps run out");
        assert_eq!(
            run(&ahead, 9, 1),
            (false, 3),
            "the far bound is at 10 in the third"
        );
        ahead.far[0] = 32;
        assert_eq!(run(&ahead, 9, 1), (true, 3));
        ahead.limit = [7, 9];
        assert_eq!(run(&ahead, 9, 1), (false, 3), "f is at 6 in the third");
    }

    #[test]
    fn fields_out_of_range_are_refused() {
        let good = LookAhead {
            shift: 13,
            steps: 4,
            done: [2, 3],
            limit: [1, 5],
            factors: [[1; 4]; 4],
            near: [0; 4],
            far: [0; 3],
        };
        assert_eq!(LookAhead::read(&good.write()), Some(good));
        for (at, value) in [(0, 16), (1, 0), (1, 16), (2, 1), (3, 1), (4, 4), (8, 6)] {
            let mut bytes = good.write();
            bytes[at] = value;
            assert_eq!(LookAhead::read(&bytes), None, "byte {at} = {value}");
        }
        let grid = |f| Grid::new([0; 4], [1; 4], [f, 4, 4, 4]).unwrap();
        assert!(good.fits(&grid(6)));
        assert!(!good.fits(&grid(5)), "the limit is past the grid");
        let far = [i32::MAX - 23, 0, 0];
        assert!(!LookAhead { far, ..good }.fits(&grid(6)));
    }

    proptest! {
        #[test]
        fn bytes_survive_the_trip(ahead in any_look_ahead()) {
            prop_assert_eq!(LookAhead::read(&ahead.write()), Some(ahead));
        }

        #[test]
        fn agrees_with_the_formulas(
            ahead in any_look_ahead(),
            cell in proptest::array::uniform4(0u16..30),
        ) {
            let count = [30; 4];
            let grid = Grid::new([0; 4], [1; 4], count).unwrap();
            prop_assert!(ahead.fits(&grid));
            let (covered, steps) = covers(&ahead.write(), Cell(cell), count);
            prop_assert_eq!(covered, slowly(&ahead, cell, count));
            prop_assert!(steps <= u16::from(ahead.steps));
        }

        /// A contraction stays on the grid for many steps, so that later steps are compared as
        /// well.
        #[test]
        fn agrees_over_many_steps(
            cell in proptest::array::uniform4(0u16..30), near in proptest::array::uniform4(0i32..60_000),
            spread in proptest::array::uniform3(0i32..9000), mixed in proptest::array::uniform4(-900i16..900),
        ) {
            let mut factors = [[0i16; 4]; 4];
            for d in 0..4 {
                factors[d][d] = 5000;
                factors[d][(d + 1) % 4] = mixed[d];
            }
            let ahead = LookAhead {
                shift: 13, steps: 8, done: [0, 2], limit: [0, 29], factors, near,
                far: [near[1] + spread[0], near[2] + spread[1], near[3] + spread[2]],
            };
            let (covered, _) = covers(&ahead.write(), Cell(cell), [30; 4]);
            prop_assert_eq!(covered, slowly(&ahead, cell, [30; 4]));
        }
    }
}
