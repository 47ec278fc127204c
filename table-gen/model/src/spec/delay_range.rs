//! A time that is known, or known to lie between two ends.

use serde::{Deserialize, Serialize};

/// A delay: a number of seconds, or `[least, most]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct DelayRange {
    ends_s: [f64; 2],
}

/// As the spec writes it.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Exact(f64),
    Between([f64; 2]),
}

impl From<Written> for DelayRange {
    fn from(written: Written) -> Self {
        let ends_s = match written {
            Written::Exact(s) => [s; 2],
            Written::Between(ends_s) => ends_s,
        };
        Self { ends_s }
    }
}

impl From<DelayRange> for Written {
    fn from(range: DelayRange) -> Self {
        range
            .exact_s()
            .map_or(Self::Between(range.ends_s), Self::Exact)
    }
}

impl DelayRange {
    /// A delay that is known \[s\].
    #[must_use]
    pub const fn exactly(s: f64) -> Self {
        Self { ends_s: [s; 2] }
    }

    /// Least and most \[s\].
    #[must_use]
    pub const fn ends_s(&self) -> &[f64; 2] {
        &self.ends_s
    }

    /// The least \[s\].
    #[must_use]
    pub const fn least_s(&self) -> f64 {
        self.ends_s[0]
    }

    /// The most \[s\].
    #[must_use]
    pub const fn most_s(&self) -> f64 {
        self.ends_s[1]
    }

    /// The delay where it is known \[s\].
    #[must_use]
    pub fn exact_s(&self) -> Option<f64> {
        let [least, most] = self.ends_s;
        (least == most).then_some(most)
    }

    /// Time from the least to the most \[ms\], rounded up; 0 where the delay is known.
    ///
    /// A millionth of a millisecond covers the decimal noise of ends that are whole milliseconds,
    /// which a spec for games has.
    #[must_use]
    pub fn span_ms(&self) -> u32 {
        let [least, most] = self.ends_s;
        ((most - least) * 1e3 - 1e-6).ceil().max(0.0) as u32
    }
}
