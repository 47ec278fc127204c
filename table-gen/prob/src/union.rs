//! Draws that all stay within what is proven with certainty: a union bound.
//!
//! A proof that holds for every error within r, however it moves, holds for every run in which all
//! draws are within r. With n draws, each outside with probability at most q, that is at least `1 -
//! n q`, whether or not they depend on each other.

/// Number of draws in a time, one at its beginning and one in every interval after it.
pub fn draws_in(horizon_s: f64, interval_s: f64) -> u64 {
    (horizon_s / interval_s).ceil().max(0.0) as u64 + 1
}

/// `1 - n q`, rounded down.
pub fn all_within(draws: u64, outside: f64) -> f64 {
    // A count below 2^53 is a double; the product and the difference are off by one double each.
    let lost = (draws as f64 * outside).next_up();
    if outside == 0.0 {
        1.0
    } else {
        (1.0 - lost).next_down().clamp(0.0, 1.0)
    }
}

/// All of several claims, each with at least its probability: `1 - sum of (1 - p)`, rounded down.
pub fn together(bounds: &[f64]) -> f64 {
    let mut lost = 0.0f64;
    for bound in bounds.iter().filter(|bound| **bound < 1.0) {
        lost = (lost + (1.0 - bound).next_up()).next_up();
    }
    if lost == 0.0 {
        1.0
    } else {
        (1.0 - lost).next_down().clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unions_are_rounded_down() {
        assert_eq!(draws_in(120.0, 1.5), 81);
        let bound = all_within(81, 1e-6);
        assert!(bound <= 1.0 - 81e-6 && bound > 1.0 - 81e-6 - 1e-15);
        assert_eq!(all_within(10, 0.5), 0.0);
        assert_eq!(all_within(10, 0.0), 1.0);
        assert_eq!(together(&[1.0, 1.0]), 1.0);
        assert!(together(&[0.9, 0.8]) <= 0.7 && together(&[0.9, 0.8]) > 0.7 - 1e-15);
    }
}
