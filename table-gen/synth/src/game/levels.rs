//! Sets of input levels as masks: bit u for level u.

/// The bits of a mask that are nearest to a level: none, one or two.
pub fn nearest(allowed: u32, level: u8) -> u32 {
    let at = 1u32 << level;
    let mut around = at;
    for _ in 0..u32::BITS {
        if allowed & around != 0 {
            return allowed & around;
        }
        around = widened(around, 1);
    }
    0
}

/// A mask and every level that is at most so many levels from one of its.
pub fn widened(mask: u32, levels: u32) -> u32 {
    let mut wide = mask;
    for _ in 0..levels.min(u32::BITS) {
        wide |= wide << 1 | wide >> 1;
    }
    wide
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_allowed_levels_are_found_on_both_sides() {
        assert_eq!(nearest(0b1111, 2), 0b0100);
        assert_eq!(nearest(0b1_0001, 2), 0b1_0001);
        assert_eq!(nearest(0b1_0001, 1), 0b0_0001);
        assert_eq!(nearest(1 << 31, 0), 1 << 31);
        assert_eq!(nearest(0, 7), 0);
        assert_eq!(widened(0b100, 1), 0b1110);
        assert_eq!(widened(1, 32), u32::MAX);
    }
}
