//! What is written beside a container: complete, tried, confirmed.
//!
//! A slot begins with eight cells of 32 bytes. The container follows. A cell is blank (all bytes
//! 0xFF) until its mark is written, and again after the slot was erased.
//!
//! | cell | mark | written |
//! |---:|---|---|
//! | 0 | complete | when the container behind it was written, read back and verified |
//! | 1 | confirmed | when its table has run well |
//! | 2 | settled | after confirmed, so that it says: confirmed is whole |
//! | 3 | | spare |
//! | 4 to 7 | trial | one before each start on trial; any bit of it counts |

use core::ops::Range;

/// Bytes of a cell: a multiple of what any flash here writes at once.
pub const CELL_LEN: usize = 32;
/// Starts that a new table gets in which to prove itself.
pub const TRIALS: u8 = 4;
/// Bytes before the container.
pub const MARKS_LEN: usize = 8 * CELL_LEN;

/// First of the cells of the trials.
const FIRST_TRIAL: usize = 4;
/// What a cell reads as before its mark is written.
const BLANK: u8 = 0xFF;

const _: () = assert!(FIRST_TRIAL + TRIALS as usize == MARKS_LEN / CELL_LEN);

/// A mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// The container is whole and was verified.
    Complete,
    /// The same, no longer valid: the slot is about to be erased.
    Void,
    /// The table has run well.
    Confirmed,
    /// The mark before was written to its end.
    Settled,
    /// A start on trial, 0..[`TRIALS`].
    Trial(u8),
}

impl Mark {
    /// Offset of the mark's cell in the slot.
    pub(crate) const fn offset(self) -> u32 {
        let cell = match self {
            Self::Complete | Self::Void => 0,
            Self::Confirmed => 1,
            Self::Settled => 2,
            Self::Trial(n) => FIRST_TRIAL + n as usize,
        };
        (cell * CELL_LEN) as u32
    }

    /// The mark's bytes. Those that are compared are long, so that a cell in any state of decay
    /// reads as them only if it was written as them.
    pub(crate) const fn bytes(self) -> &'static [u8; CELL_LEN] {
        match self {
            Self::Complete => b"holdfast: complete and verified\0",
            Self::Confirmed => b"holdfast: has run, is confirmed\0",
            Self::Settled => b"holdfast: confirmed is settled\0\0",
            Self::Void | Self::Trial(_) => &[0; CELL_LEN],
        }
    }
}

/// The marks of a slot, as they read at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Marks {
    pub(crate) complete: bool,
    pub(crate) confirmed: bool,
    pub(crate) settled: bool,
    /// Trials whose cells are not blank.
    pub(crate) tried: u8,
    /// The first trial whose cell is blank, if one is left.
    pub(crate) next: Option<u8>,
}

impl Marks {
    /// Of a slot's bytes; one that is too short has none.
    pub(crate) fn read(slot: &[u8]) -> Self {
        let reads = |mark: Mark| {
            let start = mark.offset() as usize;
            let cell: Range<usize> = start..start + CELL_LEN;
            slot.get(cell).unwrap_or_default()
        };
        let is = |mark: Mark| reads(mark) == mark.bytes();
        let blank = |n: &u8| reads(Mark::Trial(*n)).iter().all(|byte| *byte == BLANK);
        let left = (0..TRIALS).filter(blank).count() as u8;
        Self {
            complete: is(Mark::Complete),
            confirmed: is(Mark::Confirmed),
            settled: is(Mark::Settled),
            tried: TRIALS - left,
            next: (0..TRIALS).find(blank),
        }
    }
}

/// Whether every cell of a slot is blank.
pub(crate) fn all_blank(slot: &[u8]) -> bool {
    let marks = slot.get(..MARKS_LEN);
    marks.is_some_and(|marks| marks.iter().all(|byte| *byte == BLANK))
}
