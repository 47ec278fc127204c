//! What a game may not do besides leaving the grid: inputs that break a promise between the
//! samples.

/// Restricts the inputs of a cell. It must not depend on the state of the game, and be the same at
/// every call.
pub trait Guard<const D: usize, M = u32>: Sync {
    /// Those of the inputs that the guard permits at a cell.
    fn permitted(&self, cell: [u32; D], inputs: M) -> M;
}

/// Permits everything.
#[derive(Debug, Clone, Copy)]
pub struct Unguarded;

impl<const D: usize, M> Guard<D, M> for Unguarded {
    fn permitted(&self, _cell: [u32; D], inputs: M) -> M {
        inputs
    }
}
