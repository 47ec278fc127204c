//! What can be wrong with a spec. Every message says where, which key, what was found and what is
//! allowed.

use std::io;

/// Why a spec was refused. `origin` is the file, the shipped spec or the `--set` option at fault.
#[derive(Debug, thiserror::Error)]
pub enum SpecError {
    /// The argument is neither a shipped spec nor a file that exists.
    #[error("{arg}: no such spec; allowed: a shipped spec ({shipped}) or the path of a TOML file")]
    UnknownSpec {
        /// The argument as given.
        arg: String,
        /// Names of the shipped specs.
        shipped: String,
    },
    /// The file exists but cannot be read.
    #[error("{origin}: cannot be read: {source}; allowed: a TOML file in UTF-8")]
    Unreadable {
        /// Path of the file.
        origin: String,
        /// What the system says.
        source: io::Error,
    },
    /// The file is far larger than any spec.
    #[error("{origin}: longer than {limit} bytes; allowed: a spec, a few kilobytes of TOML")]
    TooLong {
        /// Path of the file.
        origin: String,
        /// The limit in bytes.
        limit: u64,
    },
    /// Not TOML.
    #[error("{origin}: line {line}, column {column}: {message}")]
    Syntax {
        /// Where the text comes from.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What the parser found and expected.
        message: String,
    },
    /// An override that is not `KEY=VALUE`.
    #[error(
        "--set {text}: found no key and value; allowed: KEY=VALUE such as plant.inertia_gw_s_per_hz=3, or KEY=none"
    )]
    MalformedOverride {
        /// The override as given.
        text: String,
    },
    /// A key that the spec does not have.
    #[error("{origin}: {key}: unknown key{}; allowed {}: {allowed}", did_you_mean(.suggestion), place(.key))]
    UnknownKey {
        /// Where the key stands.
        origin: String,
        /// Dotted path.
        key: String,
        /// The nearest key, where one is near.
        suggestion: Option<&'static str>,
        /// Names allowed in that section.
        allowed: String,
    },
    /// A value of another type than the key's.
    #[error("{origin}: {key}: found {found}, {found_type}; allowed: {allowed}")]
    WrongType {
        /// Where the value stands.
        origin: String,
        /// Dotted path.
        key: String,
        /// The value as TOML writes it.
        found: String,
        /// Its type in words.
        found_type: &'static str,
        /// What the key may hold.
        allowed: String,
    },
    /// `KEY=none` on a key that cannot be absent.
    #[error("{origin}: {key}: cannot be removed; allowed: {allowed}; none is only for {optional}")]
    NotOptional {
        /// The override.
        origin: String,
        /// Dotted path.
        key: String,
        /// What the key may hold.
        allowed: String,
        /// The keys that can be removed.
        optional: String,
    },
    /// A number that is NaN or infinite.
    #[error("{origin}: {key}: found {found}, which is not finite; allowed: {allowed}")]
    NotFinite {
        /// Where the value stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// The value.
        found: String,
        /// What the key may hold.
        allowed: String,
    },
    /// A value that its key does not allow, whatever the other keys hold.
    #[error("{origin}: {key}: found {found}; allowed: {allowed}")]
    OutOfRange {
        /// Where the value stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// The value.
        found: String,
        /// What the key may hold.
        allowed: String,
    },
    /// `requirements.formula` is none, or asks for what no game plays.
    #[error(
        "{origin}: requirements.formula: found {found:?}: {reason}; allowed: a formula in the supported fragment, or none"
    )]
    Formula {
        /// Where the formula stands.
        origin: String,
        /// The formula.
        found: String,
        /// What is wrong with it, with the sub-formula.
        reason: String,
    },
    /// Two ends in the wrong order.
    #[error("{origin}: {key}: found {found}; allowed: {allowed}")]
    Inverted {
        /// Where the value stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// Both ends.
        found: String,
        /// The order they must have.
        allowed: String,
    },
    /// A value that the key allows by itself, but not beside the other keys or on the device.
    #[error("{origin}: {key}: found {found}; allowed: {allowed}")]
    Inconsistent {
        /// Where the value stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// The value, with what it conflicts with.
        found: String,
        /// What would be consistent.
        allowed: String,
    },
    /// A target that contains no whole cell, so that no cell can be the goal of the game.
    #[error(
        "{origin}: {key}: empty target: found [{low_hz}, {high_hz}] Hz, which contains no whole cell of the f axis \
         (cells {width_hz} Hz wide, edges at {first_edge_hz} Hz + k {width_hz} Hz); \
         allowed: an interval with at least one whole cell, or a smaller grid.width"
    )]
    EmptyTarget {
        /// Where the interval stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// Lower end of the interval.
        low_hz: f64,
        /// Upper end of the interval.
        high_hz: f64,
        /// Width of a cell along f.
        width_hz: f64,
        /// Lower edge of the first cell along f.
        first_edge_hz: f64,
    },
    /// A grid that would not fit in memory.
    #[error(
        "{origin}: {key}: found {cells} cells, which need about {needed_bytes} bytes; allowed: a grid that fits the \
         {available_bytes} bytes of memory available (make the cells wider or the working region smaller)"
    )]
    TooManyCells {
        /// Where the grid stands.
        origin: String,
        /// Dotted path.
        key: &'static str,
        /// Number of cells.
        cells: u64,
        /// Estimate of what synthesis needs.
        needed_bytes: u64,
        /// What the machine has.
        available_bytes: u64,
    },
    /// The checked document does not deserialise: the key table and the structs disagree, which
    /// tests exclude.
    #[error("{origin}: {message}")]
    Malformed {
        /// Where the text comes from.
        origin: String,
        /// What serde found and expected.
        message: String,
    },
}

impl SpecError {
    /// Dotted path of the key at fault, where there is one.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        match self {
            Self::UnknownKey { key, .. }
            | Self::WrongType { key, .. }
            | Self::NotOptional { key, .. } => Some(key),
            Self::NotFinite { key, .. }
            | Self::OutOfRange { key, .. }
            | Self::Inverted { key, .. }
            | Self::Inconsistent { key, .. }
            | Self::EmptyTarget { key, .. }
            | Self::TooManyCells { key, .. } => Some(key),
            Self::Formula { .. } => Some(super::keys::FORMULA),
            Self::UnknownSpec { .. }
            | Self::Unreadable { .. }
            | Self::TooLong { .. }
            | Self::Syntax { .. }
            | Self::MalformedOverride { .. }
            | Self::Malformed { .. } => None,
        }
    }
}

fn did_you_mean(suggestion: &Option<&'static str>) -> String {
    suggestion.map_or_else(String::new, |key| format!(" (did you mean {key}?)"))
}

fn place(key: &str) -> String {
    match super::keys::section_of(key) {
        "" => "at the top level".to_owned(),
        section => format!("in [{section}]"),
    }
}
