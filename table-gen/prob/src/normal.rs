//! Enclosures of the normal distribution.
//!
//! For z >= 0, `Φ(z) = 1/2 + φ(z) Σ z^(2n+1) / (2n+1)!!` with `φ(z) = exp(-z²/2) / √(2π)`. All
//! terms are positive, so intervals lose a few roundings only. Once a term is less than half of the
//! one before it, the rest of the series is at most the last term.

use model::exponential::exp;
use model::interval::Interval;

/// Past this, `1 - Φ(z)` is below 6.3e-16; the enclosure is `[1 - 1e-15, 1]`.
const FAR: f64 = 8.0;
/// Most terms: z² <= 64, so terms halve from n = 64 on and are below 2^-90 of the largest after
/// 160.
const TERMS_MAX: u32 = 200;

/// Φ(z).
pub fn below(z: f64) -> Interval {
    if z < 0.0 {
        return clamped(Interval::ONE - below(-z));
    }
    if z > FAR {
        return Interval {
            low: 1.0 - 1e-15,
            high: 1.0,
        };
    }
    let z = Interval::point(z);
    let square = z * z;
    let (mut term, mut sum) = (z, z);
    for n in 1..=TERMS_MAX {
        term = term * square / Interval::point(f64::from(2 * n + 1));
        sum = sum + term;
    }
    // The next terms are each at most half of the one before.
    let rest = Interval {
        low: 0.0,
        high: term.high,
    };
    clamped(Interval::point(0.5) + density(square) * (sum + rest))
}

/// Lower bound of the probability of `[a, b]`; 0 if b is not above a.
pub fn mass(a: f64, b: f64) -> f64 {
    if b <= a {
        return 0.0;
    }
    // On the far side of 0 the tails are small, and their difference loses nothing.
    let difference = if a > 0.0 {
        below(-a) - below(-b)
    } else {
        below(b) - below(a)
    };
    difference.low.clamp(0.0, 1.0)
}

/// Upper bound of the probability to be farther than z from the mean, on either side.
pub fn outside(z: f64) -> f64 {
    (Interval::point(2.0) * tail(z)).high.clamp(0.0, 1.0)
}

/// `1 - Φ(z)` for z >= 0: from Φ while that has digits left, from Mills' inequality `φ(z)/z`
/// beyond.
fn tail(z: f64) -> Interval {
    let by_mills = if z > 1.0 {
        (density(Interval::point(z) * Interval::point(z)) / Interval::point(z)).high
    } else {
        1.0
    };
    let direct = Interval::ONE - below(z);
    Interval {
        low: direct.low.max(0.0),
        high: direct.high.min(by_mills),
    }
}

/// φ for a given z².
fn density(square: Interval) -> Interval {
    // The double below π and the one above.
    let pi = Interval {
        low: std::f64::consts::PI,
        high: std::f64::consts::PI.next_up(),
    };
    let root = Interval {
        low: (2.0 * pi.low).sqrt().next_down(),
        high: (2.0 * pi.high).sqrt().next_up(),
    };
    Interval::ONE / (exp(square * Interval::point(0.5)) * root)
}

fn clamped(value: Interval) -> Interval {
    Interval {
        low: value.low.clamp(0.0, 1.0),
        high: value.high.clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, Normal};

    #[test]
    fn encloses_known_values_tightly() {
        // Φ(1) and Φ(2) to 16 digits, from tables.
        for (z, known) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_542_9),
            (2.0, 0.977_249_868_051_820_8),
        ] {
            let found = below(z);
            assert!(found.low <= known && known <= found.high, "{z} {found:?}");
            // 200 terms of three operations lose at most 600 roundings, relative.
            assert!(found.high - found.low < 600.0 * f64::EPSILON);
        }
    }

    #[test]
    fn agrees_with_the_library() {
        let library = Normal::standard();
        for i in -70..=70 {
            let z = f64::from(i) / 10.0;
            // The library's error function is good to about 1e-11 relative.
            assert!((below(z).mid() - library.cdf(z)).abs() < 1e-10, "{z}");
        }
    }

    #[test]
    fn tails_are_bounds_and_masses_add_up() {
        // 2 (1 - Φ(5)) = 5.733031437583868e-7 and 2 (1 - Φ(10)) = 1.524e-23, from tables.
        assert!(outside(5.0) >= 5.733_031_437_583_868e-7 && outside(5.0) < 5.734e-7);
        assert!(outside(10.0) >= 1.523e-23 && outside(10.0) < 1.56e-23);
        let pieces = (-50..50).map(|i| mass(f64::from(i) / 10.0, f64::from(i + 1) / 10.0));
        let sum: f64 = pieces.sum();
        assert!(
            sum <= 1.0 - 5.733e-7 && sum > 1.0 - 5.734e-7 - 1e-11,
            "{sum}"
        );
        assert!(mass(6.0, 7.0) > 9.8e-10 && mass(6.0, 7.0) < 9.9e-10);
        assert_eq!(mass(1.0, 1.0), 0.0);
    }
}
