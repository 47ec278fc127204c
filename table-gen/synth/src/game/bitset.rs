//! A set of cells as bits in the dense order, and its erosion along the axes.
//!
//! The bits are one flat string: moving by one cell along axis d moves by a fixed number of bits. A
//! shifted AND of the whole string therefore erodes all rows at once. Bits that the shift carries
//! across the end of a row are wrong, but they belong to boxes that leave the grid, and no query
//! asks for those.

/// A set of cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BitSet {
    words: Vec<u64>,
    bits: usize,
}

impl BitSet {
    /// The empty set over a number of cells.
    pub fn new(bits: usize) -> Self {
        // One spare word, so that an unaligned read needs no special case at the end.
        Self {
            words: vec![0; Self::words_for(bits)],
            bits,
        }
    }

    /// Words of a set over a number of cells, the spare one among them.
    pub(super) fn words_for(bits: usize) -> usize {
        bits.div_ceil(64) + 1
    }

    /// From its words: those of [`BitSet::words_for`], without a bit past the last cell.
    pub(super) fn of_words(words: Vec<u64>, bits: usize) -> Self {
        Self { words, bits }
    }

    /// The words, 64 cells each, in the dense order.
    pub(super) fn words(&self) -> &[u64] {
        &self.words
    }

    /// A run of cells, 64 to a word, from its first cell on.
    pub(crate) fn part(&self, from: usize, len: usize) -> Vec<u64> {
        let (first, shift) = (from / 64, from % 64);
        let word = |at: usize| {
            let next = self.words.get(first + at + 1).copied().unwrap_or(0);
            (self.words[first + at] >> shift) | (next << 1 << (63 - shift))
        };
        let mut words: Vec<u64> = (0..len.div_ceil(64)).map(word).collect();
        if let Some(last) = words.last_mut()
            && !len.is_multiple_of(64)
        {
            *last &= u64::MAX >> (64 - len % 64);
        }
        words
    }

    /// Adds the cells of a run that [`BitSet::part`] gave.
    pub(crate) fn add_part(&mut self, from: usize, words: &[u64]) {
        let (first, shift) = (from / 64, from % 64);
        for (at, word) in words.iter().enumerate() {
            self.words[first + at] |= word << shift;
            if let Some(next) = self.words.get_mut(first + at + 1) {
                *next |= word >> 1 >> (63 - shift);
            }
        }
    }

    /// The set of all cells.
    pub fn full(bits: usize) -> Self {
        let mut set = Self::new(bits);
        for word in &mut set.words[..bits / 64] {
            *word = u64::MAX;
        }
        if !bits.is_multiple_of(64) {
            set.words[bits / 64] = (1u64 << (bits % 64)) - 1;
        }
        set
    }

    /// Cells of the universe.
    pub fn len(&self) -> usize {
        self.bits
    }

    /// Whether no cell is in the set.
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|w| *w == 0)
    }

    /// Cells in the set.
    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Whether a cell is in the set.
    #[inline]
    pub fn contains(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Adds a cell.
    #[inline]
    pub fn insert(&mut self, index: usize) {
        self.words[index / 64] |= 1 << (index % 64);
    }

    /// Removes a cell.
    #[inline]
    pub fn remove(&mut self, index: usize) {
        self.words[index / 64] &= !(1 << (index % 64));
    }

    /// The complement.
    #[must_use]
    pub fn complement(&self) -> Self {
        let mut out = Self::full(self.bits);
        for (word, mine) in out.words.iter_mut().zip(&self.words) {
            *word &= !mine;
        }
        out
    }

    /// Adds the cells of another set over the same universe.
    pub fn add(&mut self, other: &Self) {
        for (word, theirs) in self.words.iter_mut().zip(&other.words) {
            *word |= theirs;
        }
    }

    /// Keeps only cells that another set over the same universe has too.
    pub fn keep(&mut self, other: &Self) {
        for (word, theirs) in self.words.iter_mut().zip(&other.words) {
            *word &= theirs;
        }
    }

    /// Removes the cells of another set over the same universe.
    pub fn subtract(&mut self, other: &Self) {
        for (word, theirs) in self.words.iter_mut().zip(&other.words) {
            *word &= !theirs;
        }
    }

    /// Whether every cell is in another set over the same universe.
    pub fn is_subset(&self, other: &Self) -> bool {
        self.words
            .iter()
            .zip(&other.words)
            .all(|(mine, theirs)| mine & !theirs == 0)
    }

    /// Whether the `len` cells from `index` on are all in the set.
    #[inline]
    pub fn all_ones(&self, index: usize, len: usize) -> bool {
        let (mut index, mut len) = (index, len);
        loop {
            let (at, shift) = (index / 64, index % 64);
            // Two shifts, so that a shift of 64 is none at all.
            let word = (self.words[at] >> shift) | (self.words[at + 1] << 1 << (63 - shift));
            if len <= 64 {
                let mask = u64::MAX >> (64 - len);
                return word & mask == mask;
            }
            if word != u64::MAX {
                return false;
            }
            index += 64;
            len -= 64;
        }
    }

    /// Keeps the cells whose `extent` neighbours from themselves on, a stride apart, are all in the
    /// set.
    pub fn erode(&mut self, stride: usize, extent: u32) {
        let mut have = 1;
        while have < extent {
            let step = have.min(extent - have);
            self.and_shifted(stride * step as usize);
            have += step;
        }
    }

    /// `self &= self >> shift`, in place: each word reads itself and later words only.
    fn and_shifted(&mut self, shift: usize) {
        let (words, bits) = (shift / 64, shift % 64);
        let n = self.words.len();
        if words >= n {
            self.words.fill(0);
            return;
        }
        if words == 0 {
            for i in 0..n - 1 {
                let other = (self.words[i] >> bits) | (self.words[i + 1] << 1 << (63 - bits));
                self.words[i] &= other;
            }
            self.words[n - 1] &= self.words[n - 1] >> bits;
            return;
        }
        // The part read (from `words` on) and the part written overlap only ahead of the writes.
        for i in 0..n - words - 1 {
            let other =
                (self.words[i + words] >> bits) | (self.words[i + words + 1] << 1 << (63 - bits));
            self.words[i] &= other;
        }
        self.words[n - words - 1] &= self.words[n - 1] >> bits;
        self.words[n - words..].fill(0);
    }

    /// The cells of the set in the dense order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(at, word)| {
            let mut rest = *word;
            std::iter::from_fn(move || {
                if rest == 0 {
                    return None;
                }
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                Some(at * 64 + bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn erosion_and_ranges_equal_the_obvious(
            bits in proptest::collection::vec(proptest::bool::weighted(0.9), 1..400),
            stride in 1usize..90, extent in 1u32..9, start in 0usize..400, len in 1usize..150,
        ) {
            let mut set = BitSet::new(bits.len());
            for (i, bit) in bits.iter().enumerate() {
                if *bit { set.insert(i); }
            }
            let get = |i: usize| bits.get(i).copied().unwrap_or(false);
            let mut eroded = set.clone();
            eroded.erode(stride, extent);
            for i in 0..bits.len() {
                let expected = (0..extent as usize).all(|k| get(i + k * stride));
                prop_assert_eq!(eroded.contains(i), expected);
            }
            if start + len <= bits.len() {
                prop_assert_eq!(set.all_ones(start, len), (start..start + len).all(get));
            }
            let (from, run) = (start.min(bits.len()), len.min(bits.len() - start.min(bits.len())));
            let mut copy = BitSet::new(bits.len());
            copy.add_part(from, &set.part(from, run));
            for i in 0..bits.len() {
                prop_assert_eq!(copy.contains(i), get(i) && (from..from + run).contains(&i));
            }
            prop_assert_eq!(set.count(), bits.iter().filter(|b| **b).count());
            prop_assert_eq!(set.complement().count(), bits.len() - set.count());
            prop_assert_eq!(set.iter().collect::<Vec<_>>(), (0..bits.len()).filter(|i| get(*i)).collect::<Vec<_>>());
        }
    }
}
