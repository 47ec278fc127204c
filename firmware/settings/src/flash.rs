//! Two or more pages of flash whose erasing a power cut does not leave half done.
//!
//! A power cut while a page is erased leaves anything in it: what was there, nothing, or neither.
//! Whoever looks at it afterwards cannot tell a page that still holds data from one that was being
//! thrown away. So before a page is erased, the page before it gets a mark that says so, and when
//! the page is blank the mark is struck out. After a power cut a mark that was not struck out is
//! found, and the page is erased again. The page that holds the mark is not erased meanwhile, so
//! the mark is whole or was never made.
//!
//! ## Layout of a page
//! | bytes | what |
//! |---|---|
//! | all but the last [`MARKS`] words | what is seen, addressed from 0 without gaps |
//! | [`MARKS`] words | marks: blank, `BEGUN` while the next page is erased, then 0 |
//!
//! A mark is struck out by clearing its bits, so the flash must allow a word to be written twice
//! ([`MultiwriteNorFlash`]); flash with error correction over a word does not.
//!
//! Where all marks of a page are used up, pages are erased without one. That takes more than
//! [`MARKS`] cuts within one filling of a page: each filling needs one mark, and each cut while
//! items are copied one more. The page that is then erased is the copy, whose items all stand in
//! the other page still.
//!
//! ## A page that is blank but for a few bits
//! A half-erased page may have lost its start's mark but not its contents. Such a page holds
//! nothing that counts, and looks free: it is erased when the flash is opened.

use core::ops::Range;
use core::pin::Pin;
use core::task::{Context, Poll};

use embedded_storage::nor_flash::{MultiwriteNorFlash, NorFlashError, NorFlashErrorKind};
use embedded_storage_async::nor_flash as served;

/// Marks of a page.
pub const MARKS: usize = 64;
/// A mark of an erasure that has begun.
const BEGUN: [u8; MARK_LEN] = *b"HfE\x01";
/// Bytes of a mark.
const MARK_LEN: usize = 4;
/// Bytes of a page's marks.
const MARKS_LEN: usize = MARKS * MARK_LEN;
/// Least bytes of a page.
pub const PAGE_LEAST: usize = 1024;
/// Zero bits in the first word from which on a page counts as used; sequential-storage's number.
const USED_BITS: u32 = 4;
/// Bytes read at a time.
const CHUNK: usize = 64;

/// Why the flash did not do what it was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashError {
    /// The range is not two or more whole pages of at least [`PAGE_LEAST`] bytes, or its words are
    /// longer than 4 bytes.
    Layout,
    /// An access that leaves a page.
    OutOfBounds,
    /// The flash failed.
    Device,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::Layout | Self::Device => NorFlashErrorKind::Other,
        }
    }
}

/// Pages of a flash.
#[derive(Debug)]
pub struct Pages<F> {
    flash: F,
    start: u32,
    count: u32,
}

impl<F: MultiwriteNorFlash> Pages<F> {
    /// Bytes of a page that are seen.
    pub const SEEN: usize = F::ERASE_SIZE.saturating_sub(MARKS_LEN);

    /// The pages in this range of the flash. Finishes what a power cut interrupted.
    ///
    /// # Errors
    /// [`FlashError::Layout`], [`FlashError::Device`].
    pub fn open(flash: F, range: Range<u32>) -> Result<Self, FlashError> {
        let page = F::ERASE_SIZE;
        let words = F::WRITE_SIZE.max(F::READ_SIZE);
        let suits = page >= PAGE_LEAST && MARK_LEN.is_multiple_of(words.max(1));
        let page = u32::try_from(page).ok().filter(|_| suits);
        let page = page.ok_or(FlashError::Layout)?;
        let length = range.end.saturating_sub(range.start);
        let whole = range.start.is_multiple_of(page) && length.is_multiple_of(page);
        let inside = usize::try_from(range.end).is_ok_and(|end| end <= flash.capacity());
        let count = length / page;
        if !whole || !inside || count < 2 {
            return Err(FlashError::Layout);
        }
        let mut pages = Self {
            flash,
            start: range.start,
            count,
        };
        pages.finish()?;
        Ok(pages)
    }

    /// Range of the addresses that are seen.
    pub fn seen(&self) -> Range<u32> {
        // Below the flash's own size, which fits.
        0..self.count * Self::SEEN as u32
    }

    /// The flash itself.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    fn page_at(&self, page: u32) -> u32 {
        self.start + page * F::ERASE_SIZE as u32
    }

    fn mark_at(&self, page: u32, mark: usize) -> u32 {
        self.page_at(page) + (Self::SEEN + mark * MARK_LEN) as u32
    }

    fn next(&self, page: u32) -> u32 {
        if page + 1 == self.count { 0 } else { page + 1 }
    }

    fn before(&self, page: u32) -> u32 {
        if page == 0 { self.count - 1 } else { page - 1 }
    }

    fn read_at(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let read = self.flash.read(address, bytes);
        read.map_err(|_| FlashError::Device)
    }

    fn write_at(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let written = self.flash.write(address, bytes);
        written.map_err(|_| FlashError::Device)
    }

    fn erase_at(&mut self, page: u32) -> Result<(), FlashError> {
        let from = self.page_at(page);
        let erased = self.flash.erase(from, from + F::ERASE_SIZE as u32);
        erased.map_err(|_| FlashError::Device)
    }

    /// Finishes the erasures that were begun, and erases pages that only look blank.
    fn finish(&mut self) -> Result<(), FlashError> {
        for page in 0..self.count {
            for mark in 0..MARKS {
                let at = self.mark_at(page, mark);
                let mut found = [0; MARK_LEN];
                self.read_at(at, &mut found)?;
                if found == BEGUN {
                    self.erase_at(self.next(page))?;
                    self.write_at(at, &[0; MARK_LEN])?;
                }
            }
        }
        for page in 0..self.count {
            if self.only_looks_blank(page)? {
                self.erase_page(page)?;
            }
        }
        Ok(())
    }

    /// Whether the page's first word says that nothing is in it, and something is.
    fn only_looks_blank(&mut self, page: u32) -> Result<bool, FlashError> {
        let from = self.page_at(page);
        let mut chunk = [0; CHUNK];
        let mut at = 0;
        while at < Self::SEEN {
            let length = CHUNK.min(Self::SEEN - at);
            let Some(bytes) = chunk.get_mut(..length) else {
                return Ok(false);
            };
            self.read_at(from + at as u32, bytes)?;
            if at == 0 {
                let first = bytes.get(..F::READ_SIZE).unwrap_or_default();
                let zeros: u32 = first.iter().map(|byte| byte.count_zeros()).sum();
                if zeros >= USED_BITS {
                    return Ok(false);
                }
            }
            if bytes.iter().any(|byte| *byte != 0xFF) {
                return Ok(true);
            }
            at += length;
        }
        Ok(false)
    }

    /// A mark of the page that is blank.
    fn free_mark(&mut self, page: u32) -> Result<Option<u32>, FlashError> {
        for mark in 0..MARKS {
            let at = self.mark_at(page, mark);
            let mut found = [0; MARK_LEN];
            self.read_at(at, &mut found)?;
            if found == [0xFF; MARK_LEN] {
                return Ok(Some(at));
            }
        }
        Ok(None)
    }

    /// Erases a page so that a power cut does not leave it half erased for long.
    fn erase_page(&mut self, page: u32) -> Result<(), FlashError> {
        let mark = self.free_mark(self.before(page))?;
        if let Some(at) = mark {
            self.write_at(at, &BEGUN)?;
        }
        self.erase_at(page)?;
        if let Some(at) = mark {
            self.write_at(at, &[0; MARK_LEN])?;
        }
        Ok(())
    }

    /// Address in the flash of a stretch that is seen.
    fn address(&self, offset: u32, length: usize) -> Result<u32, FlashError> {
        let seen = Self::SEEN as u32;
        let (page, inside) = (offset / seen, offset % seen);
        let fits = usize::try_from(inside).is_ok_and(|at| at + length <= Self::SEEN);
        if page < self.count && fits {
            Ok(self.page_at(page) + inside)
        } else {
            Err(FlashError::OutOfBounds)
        }
    }
}

impl<F: MultiwriteNorFlash> Pages<F> {
    fn erase_range(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let seen = Self::SEEN as u32;
        if !from.is_multiple_of(seen) || !to.is_multiple_of(seen) || to / seen > self.count {
            return Err(FlashError::OutOfBounds);
        }
        for page in from / seen..to / seen {
            self.erase_page(page)?;
        }
        Ok(())
    }
}

/// What the flash said: it is there already. Polled once more it waits for ever, where the
/// language's own futures panic.
struct Done(Option<Result<(), FlashError>>);

impl Future for Done {
    type Output = Result<(), FlashError>;

    fn poll(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Self::Output> {
        self.0.take().map_or(Poll::Pending, Poll::Ready)
    }
}

impl<F> served::ErrorType for Pages<F> {
    type Error = FlashError;
}

impl<F: MultiwriteNorFlash> served::ReadNorFlash for Pages<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(
        &mut self,
        offset: u32,
        bytes: &mut [u8],
    ) -> impl Future<Output = Result<(), FlashError>> {
        let address = self.address(offset, bytes.len());
        Done(Some(
            address.and_then(|address| self.read_at(address, bytes)),
        ))
    }

    fn capacity(&self) -> usize {
        self.count as usize * Self::SEEN
    }
}

impl<F: MultiwriteNorFlash> served::NorFlash for Pages<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = Self::SEEN;

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), FlashError>> {
        Done(Some(self.erase_range(from, to)))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), FlashError>> {
        let address = self.address(offset, bytes.len());
        Done(Some(
            address.and_then(|address| self.write_at(address, bytes)),
        ))
    }
}
