//! Flash that the processor sees as memory.

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase,
    check_read, check_write,
};

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

/// Flash that is memory: the bytes of a file, for tools, and for tests.
#[derive(Debug)]
pub struct MemoryFlash<'m>(pub &'m mut [u8]);

impl ErrorType for MemoryFlash<'_> {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for MemoryFlash<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let stored = self.0.iter().skip(offset as usize);
        for (to, from) in bytes.iter_mut().zip(stored) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for MemoryFlash<'_> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 256;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        let erased = self.0.iter_mut().skip(from as usize);
        for byte in erased.take(to.abs_diff(from) as usize) {
            *byte = 0xFF;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (to, from) in self.0.iter_mut().skip(offset as usize).zip(bytes) {
            *to &= *from;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for MemoryFlash<'_> {}

impl Mapped for MemoryFlash<'_> {
    fn bytes(&self) -> &[u8] {
        self.0
    }
}
