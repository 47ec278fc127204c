//! How the delivered participation is drawn, as a spec or an option says it.
//!
//! Under a commanded participation u the fleet delivers u' in `[0, 1]`.

use std::fmt;
use std::str::FromStr;

/// How the delivered participation is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Participation {
    /// Exactly what was commanded.
    Exact,
    /// `u (1 + e)`, e uniform within ± this.
    Uniform {
        /// Largest relative error.
        bound: f64,
    },
    /// `u (1 + e)`, e normal with this deviation, given that |e| is at most the bound.
    Truncated {
        /// Standard deviation, relative.
        sigma: f64,
        /// Largest relative error.
        bound: f64,
    },
    /// `u (1 + e)`, e normal with this deviation. Errors past `tail` deviations count as failure.
    Gaussian {
        /// Standard deviation, relative.
        sigma: f64,
        /// Deviations that are followed.
        tail: f64,
    },
    /// Each of so many chargers responds in full with probability u, on its own: the mean of as
    /// many coins.
    Bernoulli {
        /// Chargers.
        chargers: u32,
    },
}

/// Deviations that are followed where nothing else is asked for.
pub const TAIL: f64 = 5.0;
/// Most chargers of a fleet of coins.
const CHARGERS_MAX: u32 = 10_000_000;
/// What a text may be, for messages. A test holds the number of chargers against the constant.
pub(crate) const ALLOWED: &str = "\"exact\", \"uniform:BOUND\", \"gaussian:SIGMA\", \"gaussian:SIGMA,DEVIATIONS\", \
     \"truncated:SIGMA,BOUND\" (relative, above 0, at most 1; deviations 1 to 8) or \"bernoulli:CHARGERS\" (1 to 10000000)";

/// Why a distribution cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("participation = {found}: allowed is {ALLOWED}")]
pub struct ParticipationError {
    /// What was given.
    pub found: String,
}

/// As it is read.
impl fmt::Display for Participation {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => write!(out, "exact"),
            Self::Uniform { bound } => write!(out, "uniform:{bound}"),
            Self::Truncated { sigma, bound } => write!(out, "truncated:{sigma},{bound}"),
            Self::Gaussian { sigma, tail } => write!(out, "gaussian:{sigma},{tail}"),
            Self::Bernoulli { chargers } => write!(out, "bernoulli:{chargers}"),
        }
    }
}

impl FromStr for Participation {
    type Err = ParticipationError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || ParticipationError {
            found: text.to_owned(),
        };
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let numbers: Vec<f64> = match rest {
            "" => Vec::new(),
            rest => rest
                .split(',')
                .map(|number| number.trim().parse().map_err(|_| wrong()))
                .collect::<Result<_, _>>()?,
        };
        let share = |value: f64| value > 0.0 && value <= 1.0;
        let found = match (kind, numbers.as_slice()) {
            ("exact", []) => Self::Exact,
            ("uniform", [bound]) if share(*bound) => Self::Uniform { bound: *bound },
            ("gaussian", [sigma]) if share(*sigma) => Self::Gaussian {
                sigma: *sigma,
                tail: TAIL,
            },
            ("gaussian", [sigma, tail]) if share(*sigma) && (1.0..=8.0).contains(tail) => {
                Self::Gaussian {
                    sigma: *sigma,
                    tail: *tail,
                }
            }
            ("truncated", [sigma, bound]) if share(*sigma) && share(*bound) => Self::Truncated {
                sigma: *sigma,
                bound: *bound,
            },
            ("bernoulli", [n])
                if *n >= 1.0 && *n <= f64::from(CHARGERS_MAX) && n.fract() == 0.0 =>
            {
                Self::Bernoulli {
                    chargers: *n as u32,
                }
            }
            _ => return Err(wrong()),
        };
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_distribution_is_refused() {
        for text in [
            "",
            "gauss:0.05",
            "gaussian:",
            "uniform:0",
            "uniform:nan",
            "gaussian:0.05,9",
            "bernoulli:0.5",
            "bernoulli:10000001",
        ] {
            assert!(text.parse::<Participation>().is_err(), "{text}");
        }
        assert!(ALLOWED.contains(&format!("(1 to {CHARGERS_MAX})")));
    }
}
