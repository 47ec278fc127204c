//! What a key may hold: the vocabulary of ranges shared by the checks, the error texts and the
//! reference.

use std::fmt;

use super::chance::LOSS_SYNTHETIC;

/// An interval of finite numbers, each end included or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end, in the key's unit.
    pub min: f64,
    /// Whether the lower end itself is allowed.
    pub min_included: bool,
    /// Upper end, in the key's unit.
    pub max: f64,
    /// Whether the upper end itself is allowed.
    pub max_included: bool,
}

impl Range {
    /// `min <= x <= max`.
    pub(super) const fn closed(min: f64, max: f64) -> Self {
        Self {
            min,
            min_included: true,
            max,
            max_included: true,
        }
    }

    /// `min < x <= max`.
    pub(super) const fn above(min: f64, max: f64) -> Self {
        Self {
            min,
            min_included: false,
            max,
            max_included: true,
        }
    }

    /// `min <= x < max`.
    pub(super) const fn below(min: f64, max: f64) -> Self {
        Self {
            min,
            min_included: true,
            max,
            max_included: false,
        }
    }

    /// Whether `x` lies in the range; never for NaN.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        let above = if self.min_included {
            x >= self.min
        } else {
            x > self.min
        };
        let below = if self.max_included {
            x <= self.max
        } else {
            x < self.max
        };
        above && below
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from = if self.min_included { "from" } else { "above" };
        let to = if self.max_included { "to" } else { "to below" };
        write!(f, "{from} {} {to} {}", self.min, self.max)
    }
}

/// What one key may hold. `Display` gives the sentence used in error messages and in the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    /// One finite number.
    Number(Range),
    /// One finite number, or no such key at all (`--set KEY=none` removes it).
    OptionalNumber(Range),
    /// An array of exactly `len` finite numbers, each in the range.
    Numbers {
        /// Number of elements.
        len: usize,
        /// Range of each element.
        each: Range,
    },
    /// An array of numbers, or no such key at all.
    OptionalNumbers {
        /// Number of elements.
        len: usize,
        /// Range of each element.
        each: Range,
    },
    /// One finite number, or an array of two, the ends of an interval.
    NumberOrInterval(Range),
    /// A whole number, written without a decimal point.
    Integer {
        /// Least value.
        min: u32,
        /// Greatest value.
        max: u32,
    },
    /// `true` or `false`.
    Flag,
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// A name that is safe in file names and reports.
    Name,
    /// A formula of temporal logic, or no such key at all.
    OptionalFormula,
    /// A distribution of the delivered participation, or no such key at all.
    OptionalParticipation,
    /// A distribution of the size of the loss, or no such key at all.
    OptionalLoss,
}

impl Allowed {
    /// Whether the key may be absent with a meaning of its own, rather than standing for its
    /// default.
    #[must_use]
    pub fn is_optional(&self) -> bool {
        matches!(self, Self::OptionalNumber(_) | Self::OptionalNumbers { .. })
            || self.is_optional_text()
    }

    /// Whether it is a text of a form of its own that may be absent.
    pub(super) fn is_optional_text(&self) -> bool {
        matches!(
            self,
            Self::OptionalFormula | Self::OptionalParticipation | Self::OptionalLoss
        )
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(range) => write!(f, "a number {range}"),
            Self::OptionalNumber(range) => write!(f, "a number {range}, or none"),
            Self::Numbers { len, each } => write!(f, "{len} numbers, each {each}"),
            Self::OptionalNumbers { len, each } => {
                write!(f, "{len} numbers, each {each}, or none")
            }
            Self::NumberOrInterval(range) => write!(f, "a number {range}, or 2 such numbers"),
            Self::Integer { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Flag => f.write_str("true or false"),
            Self::Choice(names) => {
                for (i, name) in names.iter().enumerate() {
                    write!(f, "{}\"{name}\"", if i == 0 { "" } else { " or " })?;
                }
                Ok(())
            }
            Self::OptionalFormula => f.write_str("a formula in the supported fragment, or none"),
            Self::OptionalParticipation => write!(f, "{}, or none", crate::participation::ALLOWED),
            Self::OptionalLoss => write!(
                f,
                "\"{LOSS_SYNTHETIC}\" or the path of a .csv file, or none"
            ),
            Self::Name => write!(
                f,
                "1 to {NAME_LEN_MAX} ASCII letters, digits, - _ or ., the first a letter or digit"
            ),
        }
    }
}

/// Longest spec name, in characters.
const NAME_LEN_MAX: usize = 64;

/// Whether `name` is safe as a file name on every platform and needs no escaping in a report.
pub(super) fn is_valid_name(name: &str) -> bool {
    let safe = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    name.len() <= NAME_LEN_MAX
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name.chars().all(safe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_keeps_its_open_ends_out() {
        assert!(Range::closed(0.0, 1.0).contains(0.0) && Range::closed(0.0, 1.0).contains(1.0));
        assert!(!Range::above(0.0, 1.0).contains(0.0) && Range::above(0.0, 1.0).contains(1.0));
        assert!(Range::below(0.0, 1.0).contains(0.0) && !Range::below(0.0, 1.0).contains(1.0));
        assert!(!Range::closed(0.0, 1.0).contains(f64::NAN));
        assert_eq!(Range::above(0.0, 10.0).to_string(), "above 0 to 10");
        assert_eq!(
            Range::below(-100.0, 0.0).to_string(),
            "from -100 to below 0"
        );
    }

    #[test]
    fn names_that_could_leave_the_directory_are_refused() {
        for good in ["paper-bi", "a", "run_2.1"] {
            assert!(is_valid_name(good), "{good}");
        }
        for bad in [
            "",
            "..",
            ".hidden",
            "a/b",
            "a b",
            "é",
            "-x",
            &"x".repeat(65),
        ] {
            assert!(!is_valid_name(bad), "{bad}");
        }
    }
}
