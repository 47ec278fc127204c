//! Quotients of 64 bits by 32, for processors that divide 32 bits.
//!
//! The compiler's own routine divides any two 64-bit numbers and takes a kilobyte of flash.
//! Everything that the charger divides has a divisor of 32 bits and a quotient that fits 32 bits or
//! saturates.

/// `numerator / divisor`, rounded down; `u32::MAX` for what does not fit 32 bits, and for a divisor
/// of zero.
///
/// By hand as at school, with two digits of 16 bits.
#[inline(never)]
pub const fn divide(numerator: u64, divisor: u32) -> u32 {
    let (high, low) = ((numerator >> 32) as u32, numerator as u32);
    if high >= divisor {
        return u32::MAX;
    }
    if high == 0 {
        return low / divisor;
    }
    // Neither `high` nor `divisor` is zero, and what is shifted out of `high` is zero.
    let shift = divisor.leading_zeros();
    let divisor = divisor << shift;
    let high = high << shift | (low >> 1) >> (31 - shift);
    let low = low << shift;
    let (first, rest) = digit(high, low >> 16, divisor);
    let (second, _) = digit(rest, low & 0xFFFF, divisor);
    first << 16 | second
}

/// The digit `(rest · 2^16 + next) / divisor` and what remains, for a `rest` below the divisor,
/// whose highest bit is set, and a `next` below 2^16.
#[inline(always)]
const fn digit(rest: u32, next: u32, divisor: u32) -> (u32, u32) {
    let (upper, lower) = (divisor >> 16 | 1 << 15, divisor & 0xFFFF);
    // Without the divisor's lower half: the digit or up to 2 more.
    let (mut digit, rest) = (rest / upper, rest % upper);
    let part = rest << 16 | next;
    // At most (2^16 + 1)(2^16 - 1).
    let taken = digit * lower;
    let mut left = part.wrapping_sub(taken);
    if part < taken {
        let carry;
        (left, carry) = left.overflowing_add(divisor);
        digit -= 1;
        if !carry {
            left = left.wrapping_add(divisor);
            digit -= 1;
        }
    }
    (digit, left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of every length, and next to powers of two.
    fn any_length() -> impl Strategy<Value = u64> {
        let near =
            (0u32..64, -2i64..=2).prop_map(|(bit, off)| (1u64 << bit).wrapping_add_signed(off));
        prop_oneof![(any::<u64>(), 0u32..64).prop_map(|(x, by)| x >> by), near]
    }

    #[test]
    fn at_the_corners() {
        assert_eq!(divide(7, 0), u32::MAX);
        assert_eq!(divide(0, 1), 0);
        assert_eq!(divide(u64::from(u32::MAX), 1), u32::MAX);
        assert_eq!(divide(1 << 32, 1), u32::MAX);
        // Estimates that are 2 too large.
        assert_eq!(divide(0x7FFF_FFFF_FFFF_FFFF, 0x8000_FFFF), 0xFFFE_0005);
        assert_eq!(divide(0xFFFF_FFFE_FFFF_FFFF, u32::MAX), u32::MAX);
    }

    proptest! {
        #[test]
        fn is_the_quotient(numerator in any_length(), divisor in any_length()) {
            let divisor = divisor as u32;
            let exact = numerator.checked_div(u64::from(divisor)).unwrap_or(u64::MAX);
            prop_assert_eq!(divide(numerator, divisor), u32::try_from(exact).unwrap_or(u32::MAX));
        }

        #[test]
        fn is_the_quotient_where_it_fits(quotient in any::<u32>(), divisor in 1u32.., rest in any::<u32>()) {
            let numerator = u64::from(quotient) * u64::from(divisor) + u64::from(rest % divisor);
            prop_assert_eq!(divide(numerator, divisor), quotient);
        }
    }
}
