//! What the grid will be when a command begins to act.
//!
//! The fleet answers a whole number n of ticks late. A command that is decided now acts on the
//! state in n ticks. Once the event has begun, phase machine and lookup run on that state:
//!
//! ```text
//! x̂(t + δ) = Φ_δ x̂(t) + Σ_j G_j u(t - j tick) + W        j = 1..=n,  δ = n tick
//! ```
//!
//! u(t - j tick) are the levels that are under way. G_j is what a level of j ticks ago adds until
//! t + δ, which is `exp(A (j-1) tick)` times the response to a tick of one level. W is what the
//! expected loss adds (the middle of its band). Nothing is fed back, so no error of one tick lives
//! longer than δ.
//!
//! **Numbers.** The coefficients are the table's. The device multiplies and adds them in 64-bit
//! integers, so host and device agree to the bit. Φ has [`PHI_FRACTION_BITS`] fractional bits, G
//! has [`RESPONSE_FRACTION_BITS`] of a micro-unit, W has none. The sum is exact and is floored
//! once.
//!
//! With coefficients rounded to the nearest, the result errs by at most the sum of `2^-25 Σ|x̂_e|`
//! for Φ, `2^-9` micro-units for every level under way, half a micro-unit for W, and `Σ|Φ_de|` for
//! the floor of the measured state. The final floor moves no state across a cell edge, for edges
//! are whole micro-units.
//!
//! Measured states are clamped to ±2^29 micro-units (±536 Hz or GW), so no sum can overflow:
//! 4 · 2^29 · 2^31 + 2^31 · 2^24 + 64 · 2^31 · 31 · 2^16 < 2^63.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 16 × 4 | Φ, row by row, i32 with 24 fractional bits |
//! | 64 | 4 × 4 | W, i32 \[µHz, kW\] |
//! | 80 | n × 4 × 4 | G_1 .. G_n, each f, g, l, p, i32 with 8 fractional bits \[µHz, kW a level\] |

use crate::units::{STATES, State};

/// Most ticks of delay: what [`History`] holds.
pub const DELAY_TICKS_MAX: u16 = 64;
/// Fractional bits of Φ.
pub const PHI_FRACTION_BITS: u32 = 24;
/// Fractional bits of G.
pub const RESPONSE_FRACTION_BITS: u32 = 8;
/// Largest magnitude of a measured state that is predicted from; larger ones are clamped
/// \[micro-units\].
pub const MEASURED_MAX: i32 = 1 << 29;
/// Levels that [`History`] can tell apart; a table has no more.
pub const LEVELS_KEPT: u8 = 1 << LEVEL_BITS;
/// Bits of a level.
const LEVEL_BITS: usize = 5;
/// Bytes of a coefficient.
const WORD: usize = 4;
/// Offset of W.
const LOSS_AT: usize = WORD * STATES * STATES;
/// Offset of G_1.
const LEVELS_AT: usize = LOSS_AT + WORD * STATES;

/// Bytes of the prediction part of a table whose commands act so many ticks late; none without a
/// delay.
pub const fn prediction_len(delay_ticks: u16) -> usize {
    if delay_ticks == 0 {
        return 0;
    }
    LEVELS_AT + WORD * STATES * delay_ticks as usize
}

/// The levels of the last 64 ticks: 40 bytes.
///
/// A plane holds one bit of every level in two words, the later ticks first: bit j of plane b is
/// bit b of the level of j + 1 ticks ago.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct History {
    planes: [[u32; 2]; LEVEL_BITS],
}

impl History {
    /// No command is under way.
    pub const NONE: Self = Self {
        planes: [[0; 2]; LEVEL_BITS],
    };

    /// Notes the level that a tick has decided; from then on it is that of one tick ago. Bits past
    /// the fifth are lost.
    #[inline(never)]
    pub fn push(&mut self, level: u8) {
        let mut level = level;
        for [later, earlier] in &mut self.planes {
            *earlier = *earlier << 1 | *later >> 31;
            *later = *later << 1 | u32::from(level & 1);
            level >>= 1;
        }
    }

    /// The level that was noted last (0), or so many before it; past the 63rd that one.
    #[inline(never)]
    pub fn level(&self, before: u16) -> u8 {
        let mut level = 0;
        for [later, earlier] in self.planes.iter().rev() {
            let word = if before < 32 { later } else { earlier };
            let bit = *word >> (before.min(DELAY_TICKS_MAX - 1) & 31) & 1;
            level = level << 1 | bit as u8;
        }
        level
    }
}

/// The prediction part of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PredictionView<'t> {
    words: &'t [[u8; WORD]],
}

impl<'t> PredictionView<'t> {
    /// The part in these bytes: [`prediction_len`] of them, for a delay that is not zero.
    pub(crate) const fn new(bytes: &'t [u8]) -> Self {
        Self {
            words: bytes.as_chunks().0,
        }
    }

    /// Φ from a state (column) to a state (row), with [`PHI_FRACTION_BITS`] fractional bits; 0 past
    /// the last.
    pub fn phi(&self, row: usize, column: usize) -> i32 {
        self.word(STATES * row + column)
    }

    /// W: what the expected loss adds to a state \[micro-units\]; 0 past the last.
    pub fn loss(&self, row: usize) -> i32 {
        self.word(STATES * STATES + row)
    }

    /// What one level of `ago` ticks ago (1..=n) adds to a state, with [`RESPONSE_FRACTION_BITS`]
    /// fractional bits of a micro-unit; 0 past the last.
    pub fn level(&self, ago: usize, row: usize) -> i32 {
        self.word(LEVELS_AT / WORD + STATES * ago.saturating_sub(1) + row)
    }

    /// Ticks of delay.
    pub fn ticks(&self) -> usize {
        self.words.len().saturating_sub(LEVELS_AT / WORD) / STATES
    }

    /// The state in n ticks, from what is measured now and what is under way. What does not fit
    /// becomes `i32::MAX`, which lies in no grid.
    #[must_use]
    #[inline(never)]
    pub fn predict(&self, measured: State, history: &History) -> State {
        let mut sums: [i64; STATES] = core::array::from_fn(|row| {
            let mut sum = i64::from(self.loss(row)) << PHI_FRACTION_BITS;
            for (column, value) in measured.0.iter().enumerate() {
                let value = (*value).clamp(-MEASURED_MAX, MEASURED_MAX);
                sum += i64::from(self.phi(row, column)) * i64::from(value);
            }
            sum
        });
        let up = PHI_FRACTION_BITS - RESPONSE_FRACTION_BITS;
        for ago in 1..=self.ticks() {
            let level = history.level(ago as u16 - 1);
            if level == 0 {
                continue;
            }
            for (row, sum) in sums.iter_mut().enumerate() {
                *sum += (i64::from(self.level(ago, row)) * i64::from(level)) << up;
            }
        }
        State(sums.map(|sum| i32::try_from(sum >> PHI_FRACTION_BITS).unwrap_or(i32::MAX)))
    }

    fn word(&self, index: usize) -> i32 {
        self.words
            .get(index)
            .map_or(0, |word| i32::from_le_bytes(*word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_history_gives_back_what_it_was_told() {
        let mut history = History::NONE;
        let told: [u8; 70] = core::array::from_fn(|i| (i * 7 % 32) as u8);
        for level in told {
            history.push(level);
        }
        for (before, level) in told.iter().rev().take(64).enumerate() {
            assert_eq!(history.level(before as u16), *level, "{before}");
        }
        // 64 of the 70 were kept.
        assert_eq!(history.level(64), told[6]);
    }

    /// Two ticks of delay: Φ = 2 on f, -1/2 from g to f; W = 100; G_1 = 3.5, G_2 = -1/256 on f.
    fn part() -> [u8; prediction_len(2)] {
        let mut bytes = [0; prediction_len(2)];
        let mut put = |word: usize, value: i32| {
            bytes[4 * word..4 * word + 4].copy_from_slice(&value.to_le_bytes());
        };
        put(0, 2 << 24);
        put(1, -(1 << 23));
        put(16, 100);
        put(20, 7 << 7);
        put(24, -1);
        bytes
    }

    #[test]
    fn a_prediction_by_hand() {
        let bytes = part();
        let view = PredictionView::new(&bytes);
        assert_eq!(view.ticks(), 2);
        let mut history = History::NONE;
        // The oldest of three no longer counts.
        for level in [31, 4, 2] {
            history.push(level);
        }
        // 2·1000 - 301/2 + 100 + 2·3.5 - 4/256 = 1956.48
        let state = view.predict(State([1000, 301, 0, 0]), &history);
        assert_eq!(state, State([1956, 0, 0, 0]));
        // Floors, also below zero: -1/2 becomes -1.
        let none = History::NONE;
        assert_eq!(view.predict(State([-50, 1, 0, 0]), &none).0[0], -1);
    }

    #[test]
    fn what_does_not_fit_lies_in_no_grid() {
        let mut bytes = [0; prediction_len(64)];
        for word in bytes.chunks_exact_mut(4) {
            word.copy_from_slice(&i32::MAX.to_le_bytes());
        }
        let view = PredictionView::new(&bytes);
        let mut history = History::NONE;
        for _ in 0..64 {
            history.push(31);
        }
        let high = view.predict(State([i32::MAX; 4]), &history);
        assert_eq!(high, State([i32::MAX; 4]));
        for word in bytes.chunks_exact_mut(4) {
            word.copy_from_slice(&i32::MIN.to_le_bytes());
        }
        let view = PredictionView::new(&bytes);
        let low = view.predict(State([i32::MAX; 4]), &history);
        assert_eq!(low, State([i32::MAX; 4]));
    }
}
