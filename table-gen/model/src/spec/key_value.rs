//! Values of the spec as the table of keys gives them: for the listing and the hash.

use std::fmt;

/// A value of the spec, borrowed from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum KeyValue<'a> {
    /// A number, or an optional one that is present.
    Number(f64),
    /// An array of numbers.
    Numbers(&'a [f64]),
    /// A whole number.
    Integer(u32),
    /// A flag.
    Flag(bool),
    /// A name or a choice.
    Text(&'a str),
    /// An optional key that is absent.
    Absent,
}

impl fmt::Display for KeyValue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Numbers(xs) => {
                f.write_str("[")?;
                for (i, x) in xs.iter().enumerate() {
                    write!(f, "{}{x}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("]")
            }
            Self::Integer(n) => write!(f, "{n}"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Text(text) => write!(f, "{text:?}"),
            Self::Absent => f.write_str("none"),
        }
    }
}
