//! The flash, as two places that a program may write: settings, and two slots for tables.
//!
//! | place | sectors | bytes from its start |
//! |---|---|---|
//! | settings | 1, 2 | two pages of 1 KB, each the first of a sector |
//! | slots | 3, 4 | A at 0, B at 16 KB; sector 4 has 64 KB, of which the first 16 are used |
//!
//! A page of settings is not the whole sector: when one is full its items are copied, and what that
//! takes grows with the square of their number. Those of 16 KB took 900 million instructions; the
//! five records or forty small items of a page of 1 KB take some.
//!
//! The flash has one bank: while a sector is erased every access to it waits, the processor's next
//! instruction too. Timers and pins go on, so pilot, contactor and power line stay as they are, and
//! what comes on the line is kept by DMA. Whoever erases has made sure that a charger can bear it.
//!
//! The watchdog gets more time before an erasure and its usual time after. If it does not take the
//! longer time nothing is erased.

use core::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase,
    check_read, check_write,
};
use stm32f4xx_hal::pac::FLASH;
use update::layout::Layout;
use update::mapped::Mapped;

use super::dog;

/// Start of the flash in memory.
const FLASH_AT: u32 = 0x0800_0000;
/// From one sector's start to the next one's.
const SECTOR: u32 = 16 * 1024;
/// Bytes of a page of settings.
const PAGE: u32 = 1024;
/// Bytes written at once.
const WORD: usize = 4;
/// The first and the second key that open the control register.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// Time of the watchdog while a sector is erased \[ms\]. Its oscillator runs at 17 to 47 kHz, 32
/// nominally, so it bites after 2.7 s at least. Sector 4, the largest that is erased, takes 1.1 s
/// at most with 32 bits at a time, the supply at 2.7 V or more.
const ERASE_DOG_MS: u16 = 4_000;
const ERASE_LONGEST_MS: u32 = 1_100;
const _: () = assert!(ERASE_DOG_MS as u32 * 32 / 47 >= 2 * ERASE_LONGEST_MS);
/// Turns for which the controller is waited for: a turn is eight cycles or more, so 4 s or more.
const TURNS: u32 = 50_000_000;

/// Where the settings lie.
pub(crate) type SettingsFlash = Place<{ FLASH_AT + SECTOR }, PAGE>;
/// All of [`SettingsFlash`].
pub(crate) const SETTINGS: Range<u32> = 0..2 * PAGE;
/// Where the slots lie.
pub(crate) type SlotFlash = Place<{ FLASH_AT + 3 * SECTOR }, SECTOR>;
/// The slots in [`SlotFlash`]; `None` would be a layout that cannot be.
pub(crate) const SLOTS: Option<Layout> = Layout::new(0, SECTOR, SECTOR);
const _: () = assert!(SLOTS.is_some());

/// The first bytes of two sectors, from an address on: so many of each, seen one after the other.
/// The first five sectors begin 16 KB apart, so a sector's number is its distance from the flash's
/// start.
pub(crate) struct Place<const AT: u32, const USED: u32>(());

/// The two places; to be taken once.
pub(crate) fn places(_flash: FLASH) -> (SettingsFlash, SlotFlash) {
    (Place(()), Place(()))
}

/// The controller's registers. Only this module writes to the flash, and the loop is one thread.
fn controller() -> &'static stm32f4xx_hal::pac::flash::RegisterBlock {
    // SAFETY: the peripheral was given to `places`, and only the two places reach this.
    unsafe { &*FLASH::ptr() }
}

/// Errors that the status register holds, and the flag of an end.
const FLAGS: u32 = 0xF3;
const ERRORS: u32 = 0xF2;
/// Bits of the control register: program, erase a sector, 32 bits at a time, start, lock.
const PG: u32 = 1;
const SER: u32 = 1 << 1;
const BY_32: u32 = 2 << 8;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;

/// Waits until the controller is done; whether it did what it was told.
fn done() -> bool {
    let status = || controller().sr().read();
    (0..TURNS).any(|_| status().bsy().bit_is_clear()) && status().bits() & ERRORS == 0
}

/// Sets the control register.
fn control(bits: u32) {
    // SAFETY: documented bits of this register, put together by the functions below.
    controller().cr().write(|w| unsafe { w.bits(bits) });
}

/// Opens the controller, does something, and closes it again.
fn opened(work: impl FnOnce() -> bool) -> Result<(), NorFlashErrorKind> {
    let registers = controller();
    if !(0..TURNS).any(|_| registers.sr().read().bsy().bit_is_clear()) {
        return Err(NorFlashErrorKind::Other);
    }
    if registers.cr().read().lock().bit_is_set() {
        for key in KEYS {
            // SAFETY: the documented keys of this register.
            registers.keyr().write(|w| unsafe { w.bits(key) });
        }
    }
    // SAFETY: flags are cleared by writing 1 to them.
    registers.sr().write(|w| unsafe { w.bits(FLAGS) });
    let worked = work();
    control(LOCK);
    forget_cached();
    if worked {
        Ok(())
    } else {
        Err(NorFlashErrorKind::Other)
    }
}

/// The data cache may hold what the flash held before.
fn forget_cached() {
    let access = controller().acr();
    if access.read().dcen().bit_is_set() {
        access.modify(|_, w| w.dcen().clear_bit());
        access.modify(|_, w| w.dcrst().set_bit());
        access.modify(|_, w| w.dcrst().clear_bit());
        access.modify(|_, w| w.dcen().set_bit());
    }
}

impl<const AT: u32, const USED: u32> Place<AT, USED> {
    /// Bytes of the place.
    const LEN: u32 = 2 * USED;

    /// A byte of the place.
    fn at(offset: u32) -> *const u8 {
        let address = AT + offset / USED * SECTOR + offset % USED;
        core::ptr::with_exposed_provenance(address as usize)
    }

    /// An access that stays in the place and in its sector.
    const fn fits(offset: u32, length: usize) -> bool {
        offset < Self::LEN && length <= (USED - offset % USED) as usize
    }
}

impl<const AT: u32, const USED: u32> ErrorType for Place<AT, USED> {
    type Error = NorFlashErrorKind;
}

impl<const AT: u32, const USED: u32> ReadNorFlash for Place<AT, USED> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        if !Self::fits(offset, bytes.len()) {
            return Err(NorFlashErrorKind::OutOfBounds);
        }
        let start = Self::at(offset);
        for (n, byte) in bytes.iter_mut().enumerate() {
            // SAFETY: within the place, which is always readable; nobody writes it meanwhile.
            *byte = unsafe { start.wrapping_add(n).read() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::LEN as usize
    }
}

impl<const AT: u32, const USED: u32> NorFlash for Place<AT, USED> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = USED as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        if !dog::allow(ERASE_DOG_MS) {
            let _ = dog::allow(dog::USUAL_MS);
            return Err(NorFlashErrorKind::Other);
        }
        let first = (AT - FLASH_AT) / SECTOR;
        let sectors = first + from / USED..first + to / USED;
        let erased = opened(|| {
            sectors.into_iter().all(|sector| {
                dog::feed();
                control(BY_32 | SER | sector << 3);
                control(BY_32 | SER | sector << 3 | START);
                done()
            })
        });
        // A watchdog that keeps the longer time is one that bites later.
        let _ = dog::allow(dog::USUAL_MS);
        erased
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        if !Self::fits(offset, bytes.len()) {
            return Err(NorFlashErrorKind::OutOfBounds);
        }
        let start = Self::at(offset);
        opened(|| {
            control(BY_32 | PG);
            let (words, _) = bytes.as_chunks::<WORD>();
            words.iter().enumerate().all(|(n, word)| {
                let at = start.wrapping_add(n * WORD).cast_mut().cast::<u32>();
                // SAFETY: within the place, which no code and no constant of the image lies in, by
                // a whole word; the controller is open for it. Nobody holds a reference: `bytes`
                // borrows the place, which is borrowed for writing here, but for the table in
                // force, whose words are never written while it is.
                unsafe { at.write_volatile(u32::from_le_bytes(*word)) };
                done()
            })
        })
    }
}

impl<const AT: u32, const USED: u32> MultiwriteNorFlash for Place<AT, USED> {}

impl Mapped for SlotFlash {
    fn bytes(&self) -> &[u8] {
        // SAFETY: flash without gaps, which is always readable. It changes by `write` and `erase`
        // alone, which borrow the place for writing.
        unsafe { core::slice::from_raw_parts(Self::at(0), Self::LEN as usize) }
    }
}

/// The table in force: a stretch of [`SlotFlash`] for as long as the program runs.
pub(crate) fn table(of: Range<u32>) -> &'static [u8] {
    let inside = of.start <= of.end && of.end <= SlotFlash::LEN;
    if !inside {
        return &[];
    }
    let start = SlotFlash::at(0).wrapping_add(of.start as usize);
    // SAFETY: within the place. The slot in force is never erased and its container never written
    // while it is (`update::slots`, the first point of its argument), so the bytes do not change
    // while the program runs.
    unsafe { core::slice::from_raw_parts(start, (of.end - of.start) as usize) }
}
