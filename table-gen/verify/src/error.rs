//! Why there is no verdict.

use firmware::table::TableError;

/// Why there is no verdict.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// The firmware rejects the table.
    #[error("the firmware rejects the table: {0:?}")]
    Table(TableError),
    /// A part of the spec that the verifier does not cover.
    #[error("{key} = {found}: not covered by the verifier; {remedy}")]
    Unsupported {
        /// The spec's key.
        key: &'static str,
        /// Its value.
        found: String,
        /// What is covered.
        remedy: &'static str,
    },
    /// The observer ended it.
    #[error("interrupted")]
    Interrupted,
}
