//! NOR flash whose supply fails: bits go to 0 by writing and to 1 by erasing, in words and pages,
//! and what is cut reads as anything.

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
    check_erase, check_read, check_write,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use update::mapped::Mapped;

/// Bytes that are written in one step.
pub(crate) const WORD: usize = 4;
/// Bytes that are erased in one step.
pub(crate) const PAGE: usize = 512;

/// What a step that is cut leaves of the bits that it changes. Writing changes ones to zeros;
/// erasing may change every bit of its page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tear {
    /// As they were.
    Nothing,
    /// As they should be; the program does not learn of it.
    Whole,
    /// Each of them one or the other.
    Torn,
    /// Each of them reads as either, from one time to the next.
    Between,
    /// Each of them one, the other, or either.
    Mixed,
}

impl Tear {
    pub(crate) const ALL: [Self; 5] = [
        Self::Nothing,
        Self::Whole,
        Self::Torn,
        Self::Between,
        Self::Mixed,
    ];
}

/// The supply failed, or a call was wrong.
#[derive(Debug)]
pub(crate) struct Failed(NorFlashErrorKind);

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

/// The flash of one charger.
#[derive(Debug, Clone)]
pub(crate) struct Flash {
    bits: Vec<u8>,
    /// Bits that read as either, and the bytes in which there are some.
    between: Vec<u8>,
    flickering: Vec<usize>,
    /// What is read at this moment.
    shown: Vec<u8>,
    random: Pcg64,
    /// Steps until the supply fails, and how.
    cut: Option<(u64, Tear)>,
    dead: bool,
    /// Steps so far.
    pub(crate) steps: u64,
}

impl Flash {
    /// An erased flash.
    pub(crate) fn new(len: usize, seed: u64) -> Self {
        Self {
            bits: vec![0xFF; len],
            between: vec![0; len],
            flickering: Vec::new(),
            shown: vec![0xFF; len],
            random: Pcg64::seed_from_u64(seed),
            cut: None,
            dead: false,
            steps: 0,
        }
    }

    /// The supply comes back.
    pub(crate) fn power_up(&mut self) {
        self.dead = false;
        self.cut = None;
        self.flicker();
    }

    /// The supply fails in the step after so many more.
    pub(crate) fn cut_after(&mut self, steps: u64, tear: Tear) {
        self.cut = Some((steps, tear));
    }

    /// Whether the supply has failed since it last came.
    pub(crate) fn is_dead(&self) -> bool {
        self.dead
    }

    /// Damages a byte, as age or radiation would.
    pub(crate) fn decay(&mut self, at: usize) {
        self.bits[at] ^= 1;
        self.shown[at] ^= 1;
    }

    /// Another moment: what reads as either may read as the other. At some moments all of it reads
    /// as 0, as with a warm chip, or all as 1; at others each bit for itself.
    fn flicker(&mut self) {
        let moment = self.random.random_range(0..3);
        for at in &self.flickering {
            let either = match moment {
                0 => 0,
                1 => 0xFF,
                _ => self.random.random::<u8>(),
            };
            let between = self.between[*at];
            self.shown[*at] = self.bits[*at] & !between | either & between;
        }
    }

    /// One step on some bytes: those that change, and what they become.
    fn step(&mut self, at: usize, change: &[u8], to_one: bool) -> Result<(), Failed> {
        if self.dead {
            return Err(Failed(NorFlashErrorKind::Other));
        }
        self.steps += 1;
        let tear = match &mut self.cut {
            Some((0, tear)) => Some(*tear),
            Some((left, _)) => {
                *left -= 1;
                None
            }
            None => None,
        };
        let changed = at..at + change.len();
        self.flickering.retain(|at| !changed.contains(at));
        // An erase that is cut has come to this part of its page, or to all of it.
        let mut ends = [at, at].map(|at| at + self.random.random_range(0..=change.len()));
        ends.sort_unstable();
        let reached = if self.random.random_bool(0.5) {
            changed.clone()
        } else {
            ends[0]..ends[1]
        };
        for (at, mask) in changed.clone().zip(change) {
            // What is 0 for certain stays so: `MultiwriteNorFlash` promises it.
            let mask = &if to_one {
                *mask
            } else {
                mask & (self.bits[at] | self.between[at])
            };
            let mut random = || self.random.random::<u8>();
            let (done, between) = match tear {
                None | Some(Tear::Whole) => (*mask, 0),
                Some(Tear::Nothing) => (0, 0),
                Some(Tear::Torn) => (mask & random(), 0),
                Some(Tear::Between) => (0, *mask),
                Some(Tear::Mixed) => (mask & random(), mask & random()),
            };
            let torn = matches!(tear, Some(Tear::Torn | Tear::Between | Tear::Mixed));
            if to_one && torn && reached.contains(&at) {
                // Erasing begins with writing zeros in many a flash: any bit may be anything.
                self.bits[at] = self.random.random();
                self.between[at] = between;
                continue;
            }
            if to_one && torn {
                continue;
            }
            if to_one {
                self.bits[at] |= done;
            } else {
                self.bits[at] &= !done;
            }
            self.between[at] = self.between[at] & !done | between;
        }
        for at in changed {
            self.shown[at] = self.bits[at];
            if self.between[at] != 0 {
                self.flickering.push(at);
            }
        }
        self.flicker();
        if tear.is_some() {
            self.dead = true;
            return Err(Failed(NorFlashErrorKind::Other));
        }
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Failed;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        check_read(self, offset, bytes.len()).map_err(Failed)?;
        let at = offset as usize;
        bytes.copy_from_slice(&self.shown[at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bits.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        check_erase(self, from, to).map_err(Failed)?;
        for page in (from..to).step_by(PAGE) {
            self.step(page as usize, &[0xFF; PAGE], true)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failed> {
        check_write(self, offset, bytes.len()).map_err(Failed)?;
        for (n, word) in bytes.chunks(WORD).enumerate() {
            let zeros: Vec<u8> = word.iter().map(|byte| !byte).collect();
            self.step(offset as usize + n * WORD, &zeros, false)?;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for Flash {}

impl Mapped for Flash {
    fn bytes(&self) -> &[u8] {
        &self.shown
    }
}
