//! Why there is no chain.

use crate::modes::ModesError;

/// Why there is no chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClosedLoopError {
    /// The plant does not contract.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// A table or spec that is not covered.
    #[error("{what}: not covered by the chain; {remedy}")]
    Unsupported {
        /// What.
        what: String,
        /// What is covered.
        remedy: &'static str,
    },
    /// A setting that makes no sense.
    #[error("{name} = {found}: allowed is {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// What was found.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// It was ended from outside.
    #[error("interrupted")]
    Interrupted,
}

impl ClosedLoopError {
    /// The sets of the chain do not hold those of the event.
    pub(super) fn too_wide() -> Self {
        Self::Unsupported {
            what: "an initial set that is far wider than the sets of the chain".to_owned(),
            remedy: "a smaller uncertainty.initial or wider bins are",
        }
    }
}
