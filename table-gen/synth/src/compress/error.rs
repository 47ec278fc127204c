//! Why compression has no result.

use crate::emit::EmitError;
use crate::game::GameError;
use crate::synthesis::SynthesisError;
use model::plant::STATES;

/// Why compression has no result.
#[derive(Debug, thiserror::Error)]
pub enum CompressError {
    /// The abstraction cannot be built.
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    /// A game inside compression has no result.
    #[error("while ranking the compressed law: {0}")]
    Game(#[from] GameError),
    /// The closed loop cannot be explored.
    #[error(
        "table.domain = \"reachable\" needs an exactly known event or requirements.stay = true: in Fixed nothing bounds \
         where an uncertain state goes; use table.domain = \"winning\""
    )]
    Unbounded,
    /// The closed loop leaves the laws.
    #[error(
        "the closed loop reaches a state near f g l p = {state:?} (µHz, kW) for which no law has an entry; use \
         table.domain = \"winning\" to see which"
    )]
    LeavesTable {
        /// The state, in micro-units.
        state: [i32; STATES],
    },
    /// The preferred law does not fit the format.
    #[error(
        "the preferred law changes by 32 levels or more from one cell to the next: take a smaller \
         grid.width or a less steep law"
    )]
    TooSteep,
    /// A table cannot be assembled.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// A part is larger than the format holds.
    #[error("a tree is larger than the format holds (16 MiB below one node)")]
    TooLarge,
}
