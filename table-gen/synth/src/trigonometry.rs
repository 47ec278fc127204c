//! Sine, cosine and square root of intervals, rounded outward.
//!
//! The argument is halved until it is at most 1/2, where the Taylor series converges fast, and the
//! angle is doubled back: `sin 2x = 2 sin x cos x`, `cos 2x = 1 - 2 sin² x`. Past the term of order
//! n the series' remainder is at most `|x|^(n+1)/(n+1)!` (Lagrange), and that is added on both
//! sides.

use model::interval::Interval;

/// Order of the last term of both series; the remainder at 1/2 is below 2^-17/17!, or 3e-20.
const ORDER: u32 = 16;
/// Largest magnitude of the argument of the series.
const REDUCED_MAX: f64 = 0.5;

/// Enclosures of sin x and cos x.
pub fn sin_cos(x: Interval) -> (Interval, Interval) {
    let mut halvings = 0;
    let mut reduced = x;
    while reduced.magnitude() > REDUCED_MAX && halvings < f64::MAX_EXP {
        // Halving is exact, short of the smallest numbers.
        reduced = Interval {
            low: 0.5 * reduced.low,
            high: 0.5 * reduced.high,
        };
        halvings += 1;
    }
    let (mut sine, mut cosine) = series(reduced);
    let two = Interval::point(2.0);
    for _ in 0..halvings {
        let doubled = two * sine * cosine;
        cosine = Interval::ONE - two * (sine * sine);
        sine = doubled;
    }
    (sine, cosine)
}

/// Enclosure of tan x; the whole line if the interval may hold a pole.
pub fn tan(x: Interval) -> Interval {
    let (sine, cosine) = sin_cos(x);
    sine / cosine
}

/// Enclosure of the square root of what is not negative in x.
pub fn sqrt(x: Interval) -> Interval {
    // IEEE 754 rounds the square root to nearest.
    Interval {
        low: x.low.max(0.0).sqrt().next_down().max(0.0),
        high: x.high.max(0.0).sqrt().next_up(),
    }
}

/// Enclosure of sin x / x, which is 1 at 0.
pub fn sinc(x: Interval) -> Interval {
    if x.magnitude() > REDUCED_MAX {
        return sin_cos(x).0 / x;
    }
    let square = x * x;
    let (mut sum, mut term) = (Interval::ONE, Interval::ONE);
    for n in 1..=ORDER / 2 {
        let n = f64::from(n);
        term = -(term * square / Interval::point((2.0 * n) * (2.0 * n + 1.0)));
        sum = sum + term;
    }
    // sin x = x (sum) + remainder, and |remainder / x| <= |x|^(ORDER+1)/(ORDER+2)!, below that of
    // the series of sin.
    sum + remainder()
}

fn series(x: Interval) -> (Interval, Interval) {
    let (mut sine, mut cosine) = (Interval::ZERO, Interval::ZERO);
    let mut term = Interval::ONE;
    for n in 0..=ORDER {
        if n > 0 {
            term = term * x / Interval::point(f64::from(n));
        }
        let signed = if n / 2 % 2 == 0 { term } else { -term };
        if n % 2 == 0 {
            cosine = cosine + signed;
        } else {
            sine = sine + signed;
        }
    }
    (sine + remainder(), cosine + remainder())
}

/// `[-r, r]` with r at least `REDUCED_MAX^(ORDER+1)/(ORDER+1)!`.
fn remainder() -> Interval {
    let mut bound = 1.0f64;
    for n in 1..=ORDER + 1 {
        bound = (bound * REDUCED_MAX / f64::from(n)).next_up();
    }
    Interval {
        low: -bound,
        high: bound,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against the standard library, which errs by less than 1e-15 here; the doublings (at most
        /// five) each multiply the width by less than five, from a few 1e-16.
        #[test]
        fn enclosures_are_tight_and_hold_the_librarys(x in -8.0f64..8.0) {
            let (sine, cosine) = sin_cos(Interval::point(x));
            let quotient = sinc(Interval::point(x));
            let library = if x == 0.0 { 1.0 } else { x.sin() / x };
            for (range, exact) in [(sine, x.sin()), (cosine, x.cos()), (quotient, library)] {
                prop_assert!(range.low - 1e-15 <= exact && exact <= range.high + 1e-15, "{range:?} {exact}");
                prop_assert!(range.high - range.low < 5f64.powi(5) * 4e-15, "{range:?}");
            }
            let root = sqrt(Interval::point(x.abs()));
            prop_assert!((root * root).contains(x.abs()));
        }

        /// A wide argument encloses what each of its members gives.
        #[test]
        fn wide_arguments_enclose_their_members(x in -4.0f64..4.0, width in 0.0f64..0.2, at in 0.0f64..1.0) {
            let wide = Interval::hull(x, x + width);
            let member = (x + at * width).clamp(wide.low, wide.high);
            let (sine, cosine) = sin_cos(wide);
            prop_assert!(sine.low - 1e-15 <= member.sin() && member.sin() <= sine.high + 1e-15);
            prop_assert!(cosine.low - 1e-15 <= member.cos() && member.cos() <= cosine.high + 1e-15);
        }
    }

    #[test]
    fn known_values() {
        let (sine, cosine) = sin_cos(Interval::ZERO);
        assert!(sine.contains(0.0) && cosine.contains(1.0));
        assert!(sqrt(Interval::point(4.0)).contains(2.0));
        // tan(0.7853981633974483) is 1 within 2e-16 of the argument.
        let one = tan(Interval::point(std::f64::consts::FRAC_PI_4));
        assert!((one.mid() - 1.0).abs() < 1e-14);
        assert_eq!(sinc(Interval::ZERO).mid(), 1.0);
    }
}
