//! A piece of a distribution.

use model::interval::Interval;

/// A piece of the distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Lower bound of the probability.
    pub probability: f64,
    /// The delivered participation, within \[0, 1\].
    pub delivered: Interval,
}
