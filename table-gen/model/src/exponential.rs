//! Enclosures of exp and ln.
//!
//! exp is a series at `|x| / 2^k <= 1/2`, squared k times. ln is the library's, which promises no
//! precision, moved outward until exp proves it.

use crate::interval::Interval;

/// Terms of the series: the last is below `0.5^20 / 20!`.
const TERMS: u32 = 20;
/// Past this exp leaves the doubles.
const EXPONENT_MAX: f64 = 700.0;
/// First distance from the library's logarithm, relative to its magnitude and 1.
const LN_PAD: f64 = 1e-14;

/// exp(x). Above 700 its high end is infinite, below -700 its low end is 0.
#[must_use]
pub fn exp(x: Interval) -> Interval {
    let at = |end: f64| {
        if end > EXPONENT_MAX {
            Interval {
                low: of_positive(EXPONENT_MAX).low,
                high: f64::INFINITY,
            }
        } else if end < -EXPONENT_MAX {
            Interval {
                low: 0.0,
                high: (Interval::ONE / of_positive(EXPONENT_MAX)).high,
            }
        } else if end < 0.0 {
            Interval::ONE / of_positive(-end)
        } else {
            of_positive(end)
        }
    };
    Interval {
        low: at(x.low).low.max(0.0),
        high: at(x.high).high,
    }
}

/// exp(y) for y in 0 to [`EXPONENT_MAX`].
fn of_positive(y: f64) -> Interval {
    let halvings = (y.max(0.5) / 0.5).log2().ceil() as u32;
    // A power of two divides exactly.
    let small = Interval::point(y * 0.5f64.powi(halvings as i32));
    let (mut term, mut sum) = (Interval::ONE, Interval::ONE);
    for n in 1..=TERMS {
        term = term * small / Interval::point(f64::from(n));
        sum = sum + term;
    }
    // Each later term is less than half of the one before it.
    let rest = Interval {
        low: 0.0,
        high: term.high,
    };
    let mut out = sum + rest;
    for _ in 0..halvings {
        out = out * out;
    }
    out
}

/// ln(x) for x above 0; the whole line where x reaches 0.
#[must_use]
pub fn ln(x: Interval) -> Interval {
    if x.low <= 0.0 || !x.high.is_finite() {
        return Interval {
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
    }
    let outward = |value: f64, sign: f64, proven: &dyn Fn(Interval) -> bool| {
        let near = value.ln();
        let mut pad = LN_PAD * near.abs().max(1.0);
        // Ten doublings are a thousand times what any library is off by; past them the end is
        // unknown.
        for _ in 0..10 {
            let end = near + sign * pad;
            if proven(exp(Interval::point(end))) {
                return end;
            }
            pad *= 2.0;
        }
        sign * f64::INFINITY
    };
    Interval {
        low: outward(x.low, -1.0, &|found| found.high <= x.low),
        high: outward(x.high, 1.0, &|found| found.low >= x.high),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_are_enclosed_tightly() {
        // To 16 digits, from tables.
        for (x, known) in [
            (0.0, 1.0),
            (1.0, core::f64::consts::E),
            (-1.0, 0.367_879_441_171_442_3),
            (10.0, 22_026.465_794_806_718),
            (-30.0, 9.357_622_968_840_175e-14),
        ] {
            let found = exp(Interval::point(x));
            assert!(found.contains(known), "{x} {found:?}");
            // Some sixty operations, and each squaring doubles what is relative: 2^7 times 60.
            assert!(
                found.high - found.low < 8_000.0 * f64::EPSILON * known,
                "{x} {found:?}"
            );
        }
        let found = ln(Interval::point(2.0));
        assert!(found.contains(core::f64::consts::LN_2) && found.high - found.low < 1e-13);
    }

    #[test]
    fn far_ends_are_bounds() {
        let far = exp(Interval::point(1e4));
        assert!(far.low > 1e300 && far.high == f64::INFINITY);
        let near = exp(Interval::point(-1e4));
        assert!(near.low == 0.0 && near.high > 0.0 && near.high < 1e-300);
        assert_eq!(ln(Interval::point(0.0)).high, f64::INFINITY);
    }

    #[test]
    fn ln_undoes_exp() {
        for i in 1..400 {
            let x = f64::from(i) * 0.37;
            let back = ln(exp(Interval::point(x)));
            assert!(
                back.contains(x) && back.high - back.low < 1e-11,
                "{x} {back:?}"
            );
        }
    }
}
