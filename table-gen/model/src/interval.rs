//! Closed intervals with outward rounding: the arithmetic in which everything that a proof rests on
//! is computed.
//!
//! An IEEE operation rounds to nearest, so its result is within one step of the exact one; moving
//! the lower end one step down and the upper one step up makes the interval contain every exact
//! result. The cost does not matter here: intervals build the coefficients of an abstraction, once.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number type in which the plant's equations can be evaluated: `f64` for simulation,
/// [`Interval`] for proofs.
pub trait Scalar:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The number itself.
    fn of(value: f64) -> Self;
}

impl Scalar for f64 {
    fn of(value: f64) -> Self {
        value
    }
}

/// A closed interval of reals, `low <= high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Zero, exactly.
    pub const ZERO: Self = Self::point(0.0);
    /// One, exactly.
    pub const ONE: Self = Self::point(1.0);

    /// One number, exactly.
    pub const fn point(value: f64) -> Self {
        Self {
            low: value,
            high: value,
        }
    }

    /// From two ends in either order.
    pub fn hull(a: f64, b: f64) -> Self {
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }

    /// The smallest interval that contains both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn outward(low: f64, high: f64) -> Self {
        Self {
            low: low.next_down(),
            high: high.next_up(),
        }
    }

    /// A number inside, near the middle.
    pub fn mid(self) -> f64 {
        let mid = 0.5 * self.low + 0.5 * self.high;
        mid.clamp(self.low, self.high)
    }

    /// Largest distance from [`Interval::mid`] to a member, rounded up.
    pub fn radius(self) -> f64 {
        let mid = self.mid();
        (self.high - mid).max(mid - self.low).next_up()
    }

    /// Largest magnitude of a member.
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// The interval of magnitudes.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            -self
        } else {
            Self {
                low: 0.0,
                high: self.magnitude(),
            }
        }
    }

    /// Whether the number is a member.
    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// The interval `[-r, r]` for the magnitude `r` of `self`.
    #[must_use]
    pub fn symmetric(self) -> Self {
        let r = self.magnitude();
        Self { low: -r, high: r }
    }
}

impl Scalar for Interval {
    fn of(value: f64) -> Self {
        Self::point(value)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        // Adding an exact zero is exact; it keeps sparse matrices sparse.
        if self == Self::ZERO {
            return other;
        }
        if other == Self::ZERO {
            return self;
        }
        Self::outward(self.low + other.low, self.high + other.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // A product with an exact zero is exact.
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        let products = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let low = products.iter().copied().fold(f64::INFINITY, f64::min);
        let high = products.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self::outward(low, high)
    }
}

impl Div for Interval {
    type Output = Self;
    /// The divisor must not contain zero; if it does, the result is the whole line.
    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self {
                low: f64::NEG_INFINITY,
                high: f64::INFINITY,
            };
        }
        let quotients = [
            self.low / other.low,
            self.low / other.high,
            self.high / other.low,
            self.high / other.high,
        ];
        if self == Self::ZERO {
            return Self::ZERO;
        }
        let low = quotients.iter().copied().fold(f64::INFINITY, f64::min);
        let high = quotients.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self::outward(low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The exact result of an operation on doubles is compared through 128-bit integers: small
        /// whole numbers over a power of two are exact in f64, and so are their sums and products
        /// in i128.
        #[test]
        fn operations_enclose_exact_results(a in -(1i64<<52)..(1i64<<52), b in -(1i64<<52)..(1i64<<52)) {
            let (x, y) = (Interval::point(a as f64), Interval::point(b as f64));
            let exact = i128::from(a) * i128::from(b);
            let product = x * y;
            // Both ends are whole numbers below 2^105, so the casts are exact.
            prop_assert!(product.low as i128 <= exact && exact <= product.high as i128);
            let sum = i128::from(a) + i128::from(b);
            prop_assert!((x + y).low as i128 <= sum && sum <= (x + y).high as i128);
            if b != 0 {
                let q = x / y;
                // q.low * b <= a <= q.high * b, checked with intervals again, loosely ordered.
                let back = q * y;
                prop_assert!(back.low <= a as f64 && a as f64 <= back.high);
            }
        }
    }

    #[test]
    fn a_third_is_strictly_inside() {
        let third = Interval::ONE / Interval::point(3.0);
        assert!(third.low < third.high);
        assert!((third * Interval::point(3.0)).contains(1.0));
    }
}
