//! The formulas, and how they are written.

use std::fmt;

/// A signal that atoms speak about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Deviation of the frequency from nominal \[Hz\].
    Frequency,
    /// Lost infeed \[GW\].
    Loss,
}

/// How an atom compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `<=`, and `<`, which is the same to within a set of measure zero.
    AtMost,
    /// `>=` and `>`.
    AtLeast,
}

/// A closed interval, by name or written out.
#[derive(Debug, Clone, PartialEq)]
pub enum Interval {
    /// A name that the spec gives meaning to: `I1`, `I2`.
    Named(String),
    /// Its ends.
    Ends(f64, f64),
}

/// A formula. Times are in seconds.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// Always true.
    True,
    /// A signal compared with a number.
    Compare(Signal, Comparison, f64),
    /// A signal in an interval.
    In(Signal, Interval),
    /// Not.
    Not(Box<Formula>),
    /// Both.
    And(Box<Formula>, Box<Formula>),
    /// Either.
    Or(Box<Formula>, Box<Formula>),
    /// If the first, then the second.
    Implies(Box<Formula>, Box<Formula>),
    /// Always, or for so long.
    Always(Option<f64>, Box<Formula>),
    /// At some time, or within so long.
    Eventually(Option<f64>, Box<Formula>),
    /// The first until the second, which comes (within so long).
    Until(Option<f64>, Box<Formula>, Box<Formula>),
}

/// Strength of binding; a sub-formula that binds less than its place needs brackets.
fn strength(formula: &Formula) -> u8 {
    match formula {
        Formula::Implies(..) => 0,
        Formula::Or(..) => 1,
        Formula::And(..) => 2,
        Formula::Until(..) => 3,
        Formula::Not(_) | Formula::Always(..) | Formula::Eventually(..) => 4,
        Formula::True | Formula::Compare(..) | Formula::In(..) => 5,
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Frequency => "f",
            Self::Loss => "loss",
        })
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => out.write_str(name),
            Self::Ends(low, high) => write!(out, "[{low}, {high}]"),
        }
    }
}

/// A sub-formula in a place that needs at least this strength.
fn placed(out: &mut fmt::Formatter<'_>, formula: &Formula, needed: u8) -> fmt::Result {
    if strength(formula) < needed {
        write!(out, "({formula})")
    } else {
        write!(out, "{formula}")
    }
}

fn bound(out: &mut fmt::Formatter<'_>, within_s: Option<f64>) -> fmt::Result {
    match within_s {
        Some(s) => write!(out, "[<={s}s]"),
        None => Ok(()),
    }
}

fn prefixed(
    out: &mut fmt::Formatter<'_>,
    operator: &str,
    within_s: Option<f64>,
    of: &Formula,
) -> fmt::Result {
    out.write_str(operator)?;
    bound(out, within_s)?;
    // `G(f >= 1)` reads better than `G f >= 1`, and `!(f in I1)` leaves no doubt.
    write!(out, "({of})")
}

fn joined(
    out: &mut fmt::Formatter<'_>,
    (left, needed_left): (&Formula, u8),
    operator: &str,
    (right, needed_right): (&Formula, u8),
) -> fmt::Result {
    placed(out, left, needed_left)?;
    write!(out, " {operator} ")?;
    placed(out, right, needed_right)
}

impl fmt::Display for Formula {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::True => out.write_str("true"),
            Self::Compare(signal, Comparison::AtMost, value) => write!(out, "{signal} <= {value}"),
            Self::Compare(signal, Comparison::AtLeast, value) => write!(out, "{signal} >= {value}"),
            Self::In(signal, interval) => write!(out, "{signal} in {interval}"),
            Self::Not(of) => prefixed(out, "!", None, of),
            Self::Always(within_s, of) => prefixed(out, "G", *within_s, of),
            Self::Eventually(within_s, of) => prefixed(out, "F", *within_s, of),
            // Chains of & and | group to the left, of -> to the right; U does not chain.
            Self::And(a, b) => joined(out, (a, 2), "&", (b, 3)),
            Self::Or(a, b) => joined(out, (a, 1), "|", (b, 2)),
            Self::Implies(a, b) => joined(out, (a, 1), "->", (b, 0)),
            Self::Until(within_s, a, b) => {
                placed(out, a, 4)?;
                out.write_str(" U")?;
                bound(out, *within_s)?;
                out.write_str(" ")?;
                placed(out, b, 4)
            }
        }
    }
}
