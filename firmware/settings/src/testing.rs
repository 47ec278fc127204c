//! Flash in memory, for tests and stand-ins: it never fails, and outlives a start.

use core::cell::RefCell;
use core::convert::Infallible;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};

/// Bytes of a page.
pub const PAGE: usize = 1024;
/// Two pages.
pub const BYTES: usize = 2 * PAGE;
/// All of it.
pub const RANGE: Range<u32> = 0..BYTES as u32;

/// The cells.
pub type Cells = RefCell<[u8; BYTES]>;

/// Cells that were never written.
pub const fn blank() -> Cells {
    RefCell::new([0xFF; BYTES])
}

/// Flash over cells.
#[derive(Debug, Clone, Copy)]
pub struct Memory<'m>(pub &'m Cells);

impl ErrorType for Memory<'_> {
    type Error = Infallible;
}

impl ReadNorFlash for Memory<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        let cells = self.0.borrow();
        for (to, from) in bytes.iter_mut().zip(cells.iter().skip(offset as usize)) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for Memory<'_> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        let cells = &mut *self.0.borrow_mut();
        let (from, to) = (from as usize, to as usize);
        cells.get_mut(from..to).unwrap_or_default().fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        let cells = &mut *self.0.borrow_mut();
        for (cell, byte) in cells.iter_mut().skip(offset as usize).zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for Memory<'_> {}
