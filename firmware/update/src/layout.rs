//! Where the two slots lie in the flash.

use core::ops::Range;

use crate::container::HEADER_LEN;
use crate::marks::MARKS_LEN;

/// One of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// The first.
    A,
    /// The second.
    B,
}

impl Slot {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Where the slots lie in the flash \[bytes from its start\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    a: u32,
    b: u32,
    len: u32,
}

impl Layout {
    /// Two slots of `len` bytes at `a` and `b`, each of whole units of erasing; `None` if they
    /// overlap, leave 32 bits, or hold no container.
    pub const fn new(a: u32, b: u32, len: u32) -> Option<Self> {
        let ends = a.checked_add(len).is_some() && b.checked_add(len).is_some();
        let apart = a.abs_diff(b) >= len;
        let holds = len as usize > MARKS_LEN + HEADER_LEN;
        if ends && apart && holds {
            Some(Self { a, b, len })
        } else {
            None
        }
    }

    /// Bytes that a container may have.
    pub const fn room(&self) -> u32 {
        self.len - MARKS_LEN as u32
    }

    pub(crate) const fn start(&self, slot: Slot) -> u32 {
        match slot {
            Slot::A => self.a,
            Slot::B => self.b,
        }
    }

    pub(crate) const fn range(&self, slot: Slot) -> Range<u32> {
        let start = self.start(slot);
        start..start + self.len
    }
}
