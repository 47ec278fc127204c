//! Flash that the processor sees as memory.

use embedded_storage::nor_flash::MultiwriteNorFlash;

/// NOR flash that is read in place, as a table must be. Bits go from 1 to 0 by writing and back by
/// erasing; a word may be written again where that takes more bits to 0, so flash with
/// error-correcting codes is excluded.
pub trait Mapped: MultiwriteNorFlash {
    /// All of its bytes as they read now, [`capacity`] of them.
    ///
    /// [`capacity`]: embedded_storage::nor_flash::ReadNorFlash::capacity
    fn bytes(&self) -> &[u8];
}

impl<T: Mapped> Mapped for &mut T {
    fn bytes(&self) -> &[u8] {
        T::bytes(self)
    }
}
