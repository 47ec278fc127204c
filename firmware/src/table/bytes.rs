//! Little-endian fields of a byte slice, without panics.

use super::field::{self, Field};

/// Words of the header.
pub(super) const HEADER_WORDS: usize = field::DIRECTORY.end / WORD;
/// Bytes of a word.
pub(super) const WORD: usize = 4;

// No field crosses words, but for those that are made of words.
const _: () = {
    let mut index = 0;
    while index < field::ALL.len() {
        let Field { start, end } = field::ALL[index];
        let of_words = start.is_multiple_of(WORD) && end.is_multiple_of(WORD);
        assert!(of_words || start / WORD == (end - 1) / WORD);
        index += 1;
    }
};

/// The header as little-endian words, read once: a core that cannot load a word from any address
/// then puts none together byte by byte.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeaderWords(pub(super) [u32; HEADER_WORDS]);

impl HeaderWords {
    /// The words of the bytes that begin the image; 0 past their end.
    pub(super) fn read(bytes: &[u8]) -> Self {
        let mut words = [0; HEADER_WORDS];
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        Self(words)
    }

    /// The word at an offset that is known when it is compiled.
    #[inline(always)]
    pub(super) const fn word(&self, at: usize) -> u32 {
        self.0[at / WORD]
    }

    /// Four words in a row. Not a loop, whose index would be checked.
    #[inline(always)]
    pub(super) const fn four(&self, at: usize) -> [u32; 4] {
        [
            self.word(at),
            self.word(at + WORD),
            self.word(at + 2 * WORD),
            self.word(at + 3 * WORD),
        ]
    }

    /// The word at an offset as a signed number.
    #[inline(always)]
    pub(super) const fn signed(&self, at: usize) -> i32 {
        self.word(at).cast_signed()
    }

    /// The half word at an offset.
    #[inline(always)]
    pub(super) const fn half(&self, at: usize) -> u16 {
        (self.word(at) >> (8 * (at % WORD))) as u16
    }

    /// The byte at an offset.
    #[inline(always)]
    pub(super) const fn byte(&self, at: usize) -> u8 {
        (self.word(at) >> (8 * (at % WORD))) as u8
    }
}

/// The `N` bytes at an offset, or `None` past the end.
pub(crate) fn array_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk::<N>().copied()
}

/// A `u16` at an offset; 0 past the end (callers check the length first).
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}

/// A `u32` at an offset; 0 past the end (callers check the length first).
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}

/// An `i32` at an offset; 0 past the end (callers check the length first).
pub(crate) fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}
