//! Sets of inputs as the bits of a word: bit u for input u.

use std::fmt::Debug;
use std::ops::{BitAnd, BitOr};

use super::cells::Word;

/// A set of inputs. The default is the empty set.
pub trait InputSet: Word + Eq + Debug + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Most inputs that a set can hold.
    const INPUTS_MAX: usize;

    /// The inputs 0 to n - 1, n between 1 and [`InputSet::INPUTS_MAX`].
    fn first(n: usize) -> Self;

    /// One input.
    fn only(input: usize) -> Self;

    /// The inputs from one on; it is below [`InputSet::INPUTS_MAX`].
    fn from_on(input: usize) -> Self;

    /// The lowest input; that of the empty set is [`InputSet::INPUTS_MAX`].
    fn lowest(self) -> usize;

    /// The same without its lowest input; the set must not be empty.
    fn without_lowest(self) -> Self;

    /// Inputs in the set.
    fn len(self) -> usize;

    /// Whether no input is in the set.
    fn is_empty(self) -> bool {
        self == Self::default()
    }
}

macro_rules! word {
    ($word:ty) => {
        impl InputSet for $word {
            const INPUTS_MAX: usize = <$word>::BITS as usize;

            fn first(n: usize) -> Self {
                <$word>::MAX >> (Self::INPUTS_MAX - n)
            }

            #[inline]
            fn only(input: usize) -> Self {
                1 << input
            }

            #[inline]
            fn from_on(input: usize) -> Self {
                <$word>::MAX << input
            }

            #[inline]
            fn lowest(self) -> usize {
                self.trailing_zeros() as usize
            }

            #[inline]
            fn without_lowest(self) -> Self {
                self & (self - 1)
            }

            fn len(self) -> usize {
                self.count_ones() as usize
            }
        }
    };
}

word!(u32);
word!(u64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_taken_apart_from_the_lowest_input_on() {
        fn check<M: InputSet>() {
            let set = M::only(3) | M::only(M::INPUTS_MAX - 1);
            assert_eq!((set.len(), set.lowest()), (2, 3));
            assert_eq!(set.without_lowest(), M::only(M::INPUTS_MAX - 1));
            assert!(set.without_lowest().without_lowest().is_empty());
            assert_eq!(M::from_on(3) & set, set);
            assert_eq!(M::from_on(4) & set, set.without_lowest());
            assert_eq!(M::default().lowest(), M::INPUTS_MAX);
            assert_eq!(M::first(M::INPUTS_MAX).len(), M::INPUTS_MAX);
            assert_eq!(M::first(4) & set, M::only(3));
        }
        check::<u32>();
        check::<u64>();
    }
}
