//! Why something of the C interface failed, and where its package is.

use std::io;
use std::path::PathBuf;

use crate::images::ImageError;
use crate::root;

/// Why the C interface was not built, run or measured.
#[derive(Debug, thiserror::Error)]
pub enum CApiError {
    /// A file or a program.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// A program said no; its messages are above or in the text.
    #[error("{0}")]
    Failed(String),
    /// An ELF file.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The C program's answers are not the host's.
    #[error("{0}")]
    Differs(String),
}

pub(super) fn io_error(what: impl Into<String>) -> impl FnOnce(io::Error) -> CApiError {
    let what = what.into();
    |source| CApiError::Io { what, source }
}

/// The package's folder.
pub(super) fn sources() -> PathBuf {
    root().join("firmware/c-api")
}
