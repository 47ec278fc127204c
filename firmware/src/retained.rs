//! What a controller keeps over a reset: one word, in memory that a reset leaves alone.
//!
//! The word holds the number of starts, how the last run ended and how many starts in a row did not
//! come to a run. Its upper half is the complement of its lower half, so that a memory that lost
//! its supply is not taken for a record.
//!
//! # Starts that do not come to a run
//! Whatever stops a charger at every start, in the same place, would restart it for ever, with its
//! contactor open and not a word on its line. So a start counts as unfinished until it has
//! completed [`PROOF_TICKS`] ticks ([`Proof`]). After [`GUARD_AFTER`] unfinished ones in a row the
//! next leaves out what flash can make fail: settings, keys, slots. It is *guarded*. After
//! [`DEAF_AFTER`] it takes nothing from its line either ([`Care`]).
//!
//! **Why ten ticks are enough.** What is guarded against is silence. The parts that run once, at
//! the start, have run before the first tick: settings read, slots verified, the table parsed. The
//! parts that run again and again have run ten times: a reading, the law, a set-point that the
//! hardware took, a frame. Ten ticks outlast the watchdog's time twice, so what hung at the first
//! of them is not counted. And ten frames were sent, with what the last run left. A charger that is
//! stopped later, by whatever comes later, has said so, and says so at every start: it is not
//! silent, and not guarded.
//!
//! **The way out.** A guarded run that has completed its ticks leaves the count one below
//! [`GUARD_AFTER`]: the start after it tries everything, once, and if that is unfinished too the
//! next one is guarded again. The caller ends a guarded run after a while. A reset that is not the
//! watchdog's, by the supply or by a person, begins at none.

use crate::fault::ResetCause;

/// Completed ticks after which a start counts as a run: a second at 100 ms.
pub const PROOF_TICKS: u8 = 10;
/// Unfinished starts in a row after which a start is guarded.
pub const GUARD_AFTER: u8 = 3;
/// Unfinished starts in a row, the guarded ones among them, after which it is deaf.
pub const DEAF_AFTER: u8 = 6;
/// Most that is counted.
const UNFINISHED_MAX: u8 = 15;
const _: () = assert!(GUARD_AFTER > 0 && GUARD_AFTER < DEAF_AFTER && DEAF_AFTER < UNFINISHED_MAX);

/// A word of memory that a reset leaves alone, as a backup register does.
///
/// The implementation need not keep it without supply.
pub trait Retained {
    /// The word.
    fn load(&self) -> u32;

    /// Replaces the word.
    fn store(&mut self, word: u32);
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Ending {
    /// Nothing was noted: the supply went, a person pressed reset, or a tick was not completed.
    Unnoted = 0,
    /// The program panicked.
    Panic = 1,
    /// The processor found a fault: an address, an instruction or a stack that cannot be.
    HardFault = 2,
    /// The crystal failed while the program ran.
    Clock = 3,
}

impl Ending {
    /// Endings in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Unnoted, Self::Panic, Self::HardFault, Self::Clock];

    fn of_number(number: u8) -> Self {
        let found = Self::ALL.get(usize::from(number)).copied();
        found.unwrap_or(Self::Unnoted)
    }
}

/// What a start dares to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Care {
    /// Everything.
    None,
    /// Nothing that depends on what is in flash but for the program and its table.
    Guarded,
    /// Nor anything that depends on what comes on the line.
    Deaf,
}

/// What is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Starts since the memory had its supply; wraps at 256.
    pub starts: u8,
    /// How the run ended.
    pub ending: Ending,
    /// Starts in a row that did not come to a run, up to 15.
    pub unfinished: u8,
}

impl Record {
    /// Before the first start.
    const NEW: Self = Self {
        starts: 0,
        ending: Ending::Unnoted,
        unfinished: 0,
    };

    /// What the start that found this record dares.
    pub const fn care(&self) -> Care {
        match self.unfinished {
            DEAF_AFTER.. => Care::Deaf,
            GUARD_AFTER.. => Care::Guarded,
            _ => Care::None,
        }
    }

    fn of_word(word: u32) -> Self {
        let [starts, run, not_starts, not_run] = word.to_le_bytes();
        if starts == !not_starts && run == !not_run {
            Self {
                starts,
                ending: Ending::of_number(run & 0x0F),
                unfinished: run >> 4,
            }
        } else {
            Self::NEW
        }
    }

    const fn word(self) -> u32 {
        let (starts, run) = (self.starts, self.unfinished << 4 | self.ending as u8);
        u32::from_le_bytes([starts, run, !starts, !run])
    }
}

/// A start: counts it, as one that has yet to come to a run, and says what the last run left.
pub fn start<R: Retained>(memory: &mut R, cause: ResetCause) -> Record {
    let mut last = Record::of_word(memory.load());
    if cause != ResetCause::Watchdog {
        last.unfinished = 0;
    }
    let now = Record {
        starts: last.starts.wrapping_add(1),
        ending: Ending::Unnoted,
        unfinished: (last.unfinished + 1).min(UNFINISHED_MAX),
    };
    memory.store(now.word());
    last
}

/// The end of a run, noted by whoever stops it.
pub fn end<R: Retained>(memory: &mut R, ending: Ending) {
    let last = Record::of_word(memory.load());
    memory.store(Record { ending, ..last }.word());
}

/// Follows a start until it has come to a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Proof {
    ticks_left: u8,
}

impl Proof {
    /// Before the first tick.
    pub const NEW: Self = Self {
        ticks_left: PROOF_TICKS,
    };

    /// A tick was completed. The last one that is needed is noted.
    pub fn tick<R: Retained>(&mut self, memory: &mut R) {
        if self.ticks_left == 1 {
            let last = Record::of_word(memory.load());
            // This start is among those counted.
            let unfinished = if last.unfinished > GUARD_AFTER {
                GUARD_AFTER - 1
            } else {
                0
            };
            memory.store(Record { unfinished, ..last }.word());
        }
        self.ticks_left = self.ticks_left.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Word(u32);

    impl Retained for Word {
        fn load(&self) -> u32 {
            self.0
        }

        fn store(&mut self, word: u32) {
            self.0 = word;
        }
    }

    fn run(memory: &mut Word, ticks: u32) {
        let mut proof = Proof::NEW;
        for _ in 0..ticks {
            proof.tick(memory);
        }
    }

    #[test]
    fn starts_are_counted_and_an_ending_is_told_once() {
        let mut memory = Word(0);
        assert_eq!(start(&mut memory, ResetCause::Watchdog), Record::NEW);
        for n in 1..=600u32 {
            run(&mut memory, 1_000);
            let ending = Ending::ALL[n as usize % 4];
            if ending != Ending::Unnoted {
                end(&mut memory, ending);
            }
            let expected = Record {
                starts: n as u8,
                ending,
                unfinished: 0,
            };
            assert_eq!(start(&mut memory, ResetCause::Watchdog), expected);
        }
    }

    #[test]
    fn the_word_by_hand() {
        let mut memory = Word(0);
        start(&mut memory, ResetCause::PowerOn);
        assert_eq!(memory.0, 0xEFFE_1001);
        end(&mut memory, Ending::HardFault);
        assert_eq!(memory.0, 0xEDFE_1201);
        start(&mut memory, ResetCause::Watchdog);
        assert_eq!(memory.0, 0xDFFD_2002);
        run(&mut memory, 10);
        assert_eq!(memory.0, 0xFFFD_0002);
    }

    /// What each of so many starts dares, all of which complete so many ticks.
    fn cares<const N: usize>(memory: &mut Word, ticks: u32) -> [Care; N] {
        core::array::from_fn(|_| {
            let care = start(memory, ResetCause::Watchdog).care();
            run(memory, ticks);
            care
        })
    }

    #[test]
    fn three_unfinished_starts_are_followed_by_guarded_ones_and_three_of_those_by_deaf_ones() {
        use Care::{Deaf, Guarded, None};
        let mut memory = Word(0);
        let found = cares(&mut memory, 9);
        let g = Guarded;
        assert_eq!(found, [None, None, None, g, g, g, Deaf, Deaf]);
        // The count does not go round.
        assert_eq!(cares(&mut memory, 0), [Deaf; 300]);
        // A deaf run that lasts is followed by a start that tries all.
        assert_eq!(cares(&mut memory, 10), [Deaf, None, None]);
    }

    #[test]
    fn a_guarded_run_is_followed_by_one_try() {
        let mut memory = Word(0);
        assert_eq!(cares(&mut memory, 0), [Care::None; 3]);
        for _ in 0..20 {
            assert_eq!(cares(&mut memory, 6_000), [Care::Guarded]);
            assert_eq!(cares(&mut memory, 9), [Care::None]);
        }
        assert_eq!(cares(&mut memory, 6_000), [Care::Guarded]);
        // The cause is gone: the try comes to a run, and the count is at none.
        assert_eq!(cares(&mut memory, 6_000), [Care::None]);
        assert_eq!(cares(&mut memory, 0), [Care::None; 3]);
        assert_eq!(cares(&mut memory, 0), [Care::Guarded]);
    }

    #[test]
    fn a_reset_by_the_supply_or_a_person_is_a_new_beginning() {
        for cause in [ResetCause::PowerOn, ResetCause::BrownOut] {
            let mut memory = Word(0);
            cares::<9>(&mut memory, 0);
            assert_eq!(start(&mut memory, cause).care(), Care::None);
            assert_eq!(cares(&mut memory, 0), [Care::None; 2]);
            assert_eq!(cares(&mut memory, 0), [Care::Guarded]);
        }
    }

    proptest! {
        /// One bit that flips is no record; neither is erased or empty memory.
        #[test]
        fn what_is_damaged_is_a_first_start(
            starts: u8, number in 0usize..4, unfinished in 0u8..16, bit in 0u32..32,
        ) {
            let record = Record { starts, ending: Ending::ALL[number], unfinished };
            prop_assert_eq!(Record::of_word(record.word()), record);
            prop_assert_eq!(Record::of_word(record.word() ^ (1 << bit)), Record::NEW);
            prop_assert_eq!(Record::of_word(0), Record::NEW);
            prop_assert_eq!(Record::of_word(u32::MAX), Record::NEW);
        }

        /// Whatever the word is and however runs end: of any four starts in a row by the watchdog
        /// one is guarded or came to a run, so no charger is silent for a fourth. And what follows
        /// a run that lasted is not guarded.
        #[test]
        fn nobody_is_silent_for_long_and_nobody_is_guarded_without_cause(
            word: u32, runs in proptest::collection::vec((0u32..20, 0usize..4), 1..60),
        ) {
            let mut memory = Word(word);
            let (mut silent, mut lasted) = (0, false);
            for (ticks, number) in runs {
                let care = start(&mut memory, ResetCause::Watchdog).care();
                prop_assert!(!lasted || care == Care::None);
                run(&mut memory, ticks);
                end(&mut memory, Ending::ALL[number]);
                lasted = ticks >= u32::from(PROOF_TICKS);
                silent = if lasted || care != Care::None { 0 } else { silent + 1 };
                prop_assert!(silent <= GUARD_AFTER);
            }
        }
    }
}
