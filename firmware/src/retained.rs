//! What a controller keeps over a reset: one word, in memory that a reset leaves alone.
//!
//! The word holds the number of starts and how the last run ended. Its upper half is the complement
//! of its lower half, so that a memory that lost its supply is not taken for a record.

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

/// What is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Starts since the memory had its supply; wraps at 256.
    pub starts: u8,
    /// How the run ended.
    pub ending: Ending,
}

impl Record {
    /// Before the first start.
    const NEW: Self = Self {
        starts: 0,
        ending: Ending::Unnoted,
    };

    fn of_word(word: u32) -> Self {
        let [starts, ending, not_starts, not_ending] = word.to_le_bytes();
        if starts == !not_starts && ending == !not_ending {
            let ending = Ending::of_number(ending);
            Self { starts, ending }
        } else {
            Self::NEW
        }
    }

    const fn word(self) -> u32 {
        let (starts, ending) = (self.starts, self.ending as u8);
        u32::from_le_bytes([starts, ending, !starts, !ending])
    }
}

/// A start: counts it, and says what the last run left.
pub fn start<R: Retained>(memory: &mut R) -> Record {
    let last = Record::of_word(memory.load());
    let now = Record {
        starts: last.starts.wrapping_add(1),
        ending: Ending::Unnoted,
    };
    memory.store(now.word());
    last
}

/// The end of a run, noted by whoever stops it.
pub fn end<R: Retained>(memory: &mut R, ending: Ending) {
    let Record { starts, .. } = Record::of_word(memory.load());
    memory.store(Record { starts, ending }.word());
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

    #[test]
    fn starts_are_counted_and_an_ending_is_told_once() {
        let mut memory = Word(0);
        assert_eq!(start(&mut memory), Record::NEW);
        for n in 1..=600u32 {
            let ending = Ending::ALL[n as usize % 4];
            if ending != Ending::Unnoted {
                end(&mut memory, ending);
            }
            let starts = n as u8;
            assert_eq!(start(&mut memory), Record { starts, ending });
        }
    }

    #[test]
    fn the_word_by_hand() {
        let mut memory = Word(0);
        start(&mut memory);
        assert_eq!(memory.0, 0xFFFE_0001);
        end(&mut memory, Ending::HardFault);
        assert_eq!(memory.0, 0xFDFE_0201);
    }

    proptest! {
        /// One bit that flips is no record; neither is erased or empty memory.
        #[test]
        fn what_is_damaged_is_a_first_start(starts: u8, number in 0usize..4, bit in 0u32..32) {
            let record = Record { starts, ending: Ending::ALL[number] };
            prop_assert_eq!(Record::of_word(record.word()), record);
            prop_assert_eq!(Record::of_word(record.word() ^ (1 << bit)), Record::NEW);
            prop_assert_eq!(Record::of_word(0), Record::NEW);
            prop_assert_eq!(Record::of_word(u32::MAX), Record::NEW);
        }
    }
}
