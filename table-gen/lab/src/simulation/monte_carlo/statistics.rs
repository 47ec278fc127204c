//! What many runs have in common: quantiles, and a share with its confidence interval.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// Quantiles of a measure over the runs that have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantiles {
    /// Runs that have no value (that never got there).
    pub without: usize,
    /// Least, 1 %, 5 %, 50 %, 95 %, 99 % and greatest value; `null` if no run has one.
    pub at: Option<QuantileValues>,
}

/// The values of [`Quantiles`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct QuantileValues {
    /// Least.
    pub min: f64,
    /// 1 %.
    pub p01: f64,
    /// 5 %.
    pub p05: f64,
    /// Median.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
    /// Greatest.
    pub max: f64,
}

impl Quantiles {
    /// Quantiles by the nearest rank: each is a value that occurred.
    pub fn of(values: impl Iterator<Item = Option<f64>>) -> Self {
        let mut without = 0;
        let mut sorted: Vec<f64> = values
            .filter_map(|value| {
                without += usize::from(value.is_none());
                value
            })
            .collect();
        sorted.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let rank = (share * sorted.len() as f64).ceil() as usize;
            sorted.get(rank.max(1) - 1).copied()
        };
        let at = || {
            Some(QuantileValues {
                min: rank(0.0)?,
                p01: rank(0.01)?,
                p05: rank(0.05)?,
                p50: rank(0.5)?,
                p95: rank(0.95)?,
                p99: rank(0.99)?,
                max: rank(1.0)?,
            })
        };
        Self { without, at: at() }
    }
}

/// Confidence of the intervals.
pub const CONFIDENCE: f64 = 0.95;

/// A share of runs with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Runs that have the property.
    pub count: usize,
    /// Their share of all.
    pub share: f64,
    /// Lower end of the interval of Clopper and Pearson at [`CONFIDENCE`].
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Share {
    /// The share `count / runs`; `runs` is not zero and `count` at most `runs`.
    pub fn of(count: usize, runs: usize) -> Self {
        let (k, n) = (count as f64, runs as f64);
        let tail = 0.5 * (1.0 - CONFIDENCE);
        // The quantile of a Beta law with shapes above 0, which these are where it is asked for.
        let quantile =
            |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |d| d.inverse_cdf(p));
        let low = if count == 0 {
            0.0
        } else {
            quantile(k, n - k + 1.0, tail)
        };
        let high = if count == runs {
            1.0
        } else {
            quantile(k + 1.0, n - k, 1.0 - tail)
        };
        Self {
            count,
            share: k / n,
            low,
            high,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occurred() {
        let values = (1..=200).rev().map(|n| Some(f64::from(n)));
        let quantiles = Quantiles::of(values.chain([None, None]));
        let at = quantiles.at.unwrap();
        assert_eq!(quantiles.without, 2);
        assert_eq!((at.min, at.p01, at.p05, at.p50), (1.0, 2.0, 10.0, 100.0));
        assert_eq!((at.p95, at.p99, at.max), (190.0, 198.0, 200.0));
        assert_eq!(Quantiles::of([None].into_iter()).at, None);
    }

    #[test]
    fn intervals_agree_with_closed_forms_and_a_table() {
        // All of n: the lower end is (α/2)^(1/n); none of n: the mirror image.
        let all = Share::of(1000, 1000);
        let exact = 0.025f64.powf(1.0 / 1000.0);
        assert!((all.low - exact).abs() < 1e-9 && all.high == 1.0, "{all:?}");
        let none = Share::of(0, 1000);
        assert!((none.high - (1.0 - exact)).abs() < 1e-9 && none.low == 0.0);
        // 10 of 100: 4.90 % to 17.62 %, as statistical tables print it.
        let tenth = Share::of(10, 100);
        assert!(
            (tenth.low - 0.0490).abs() < 5e-5 && (tenth.high - 0.1762).abs() < 5e-5,
            "{tenth:?}"
        );
    }
}
