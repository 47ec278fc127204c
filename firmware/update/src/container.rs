//! The bytes of a signed container. `docs/signed-tables.md` gives the same in prose.
//!
//! | offset | bytes | field |
//! |---:|---:|---|
//! | 0 | 4 | magic `HFSC` |
//! | 4 | 2 | version of this format, 1 |
//! | 6 | 2 | 0 |
//! | 8 | 4 | bytes of the table, n |
//! | 12 | 4 | device class |
//! | 16 | 4 | version of the container, not 0; a newer one has a larger number |
//! | 20 | 4 | first second at which it may be installed, since 1970; 0: any |
//! | 24 | 4 | last second; 2³² - 1: any |
//! | 28 | 4 | 0 |
//! | 32 | n | the table |
//! | 32 + n | 64 | Ed25519 over all bytes before it |
//!
//! All integers are little-endian. The magic is signed with the rest, so that a signature over
//! anything else is none over a container.

use core::ops::Range;

use crate::class::DeviceClass;
use crate::refusal::Refusal;

/// First bytes of every container.
pub const MAGIC: [u8; 4] = *b"HFSC";
/// Version of the format that this module writes and reads.
pub const FORMAT: u16 = 1;
/// Bytes before the table.
pub const HEADER_LEN: usize = 32;
/// Bytes after the table.
pub const SIGNATURE_LEN: usize = 64;

const FORMAT_AT: Range<usize> = 4..6;
const RESERVED_AT: Range<usize> = 6..8;
const LENGTH_AT: Range<usize> = 8..12;
const CLASS_AT: Range<usize> = 12..16;
const VERSION_AT: Range<usize> = 16..20;
const FROM_AT: Range<usize> = 20..24;
const UNTIL_AT: Range<usize> = 24..28;
const LAST_AT: Range<usize> = 28..32;

/// When a container may be installed \[s since 1970\]. A table that is installed stays: a charger
/// that is cut off must not lose its response on a date.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Validity {
    /// First second.
    pub from_s: u32,
    /// Last second.
    pub until_s: u32,
}

impl Validity {
    /// At any time.
    pub const ALWAYS: Self = Self {
        from_s: 0,
        until_s: u32::MAX,
    };

    /// Whether it may be installed now; `None` where nobody knows the time.
    ///
    /// # Errors
    /// [`Refusal::NotYetValid`], [`Refusal::Expired`], [`Refusal::NoTime`].
    pub fn check(&self, now_s: Option<u32>) -> Result<(), Refusal> {
        let Self { from_s, until_s } = *self;
        match now_s {
            None if *self == Self::ALWAYS => Ok(()),
            None => Err(Refusal::NoTime),
            Some(now_s) if now_s < from_s => Err(Refusal::NotYetValid { from_s, now_s }),
            Some(now_s) if now_s > until_s => Err(Refusal::Expired { until_s, now_s }),
            Some(_) => Ok(()),
        }
    }
}

/// What a container says beside its table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Bytes of the table.
    pub table_len: u32,
    /// For which chargers.
    pub class: DeviceClass,
    /// Version; a newer one has a larger number.
    pub version: u32,
    /// When it may be installed.
    pub validity: Validity,
}

impl Header {
    /// Reads a header; its length and whatever follows are not looked at.
    ///
    /// # Errors
    /// [`Refusal::NotAContainer`], [`Refusal::UnsupportedFormat`], [`Refusal::BadField`].
    pub fn read(bytes: &[u8; HEADER_LEN]) -> Result<Self, Refusal> {
        let [a, b, c, d, ..] = *bytes;
        if [a, b, c, d] != MAGIC {
            let found = [a, b, c, d];
            return Err(Refusal::NotAContainer { found });
        }
        let format = u32_at(bytes, &FORMAT_AT) as u16;
        if format != FORMAT {
            return Err(Refusal::UnsupportedFormat {
                found: format,
                supported: FORMAT,
            });
        }
        let header = Self {
            table_len: u32_at(bytes, &LENGTH_AT),
            class: DeviceClass(u32_at(bytes, &CLASS_AT)),
            version: u32_at(bytes, &VERSION_AT),
            validity: Validity {
                from_s: u32_at(bytes, &FROM_AT),
                until_s: u32_at(bytes, &UNTIL_AT),
            },
        };
        let bad = |field: Range<usize>| Refusal::BadField {
            offset: field.start as u8,
        };
        let Validity { from_s, until_s } = header.validity;
        if u32_at(bytes, &RESERVED_AT) != 0 {
            Err(bad(RESERVED_AT))
        } else if u32_at(bytes, &LAST_AT) != 0 {
            Err(bad(LAST_AT))
        } else if header.version == 0 {
            Err(bad(VERSION_AT))
        } else if until_s < from_s {
            Err(bad(UNTIL_AT))
        } else {
            Ok(header)
        }
    }

    /// The header's bytes.
    pub fn write(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        let mut put = |field: Range<usize>, value: &[u8]| {
            for (to, from) in bytes.iter_mut().skip(field.start).zip(value) {
                *to = *from;
            }
        };
        put(0..4, &MAGIC);
        put(FORMAT_AT, &FORMAT.to_le_bytes());
        put(LENGTH_AT, &self.table_len.to_le_bytes());
        put(CLASS_AT, &self.class.0.to_le_bytes());
        put(VERSION_AT, &self.version.to_le_bytes());
        put(FROM_AT, &self.validity.from_s.to_le_bytes());
        put(UNTIL_AT, &self.validity.until_s.to_le_bytes());
        bytes
    }

    /// Bytes of the whole container; `None` if they cannot be counted in 32 bits.
    pub fn container_len(&self) -> Option<u32> {
        self.table_len
            .checked_add((HEADER_LEN + SIGNATURE_LEN) as u32)
    }
}

/// An integer of a field of at most four bytes.
fn u32_at(bytes: &[u8], field: &Range<usize>) -> u32 {
    let field = bytes.get(field.clone()).unwrap_or_default();
    let digits = field.iter().rev();
    digits.fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// A container in its parts. Nothing is verified yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Container<'c> {
    /// The header.
    pub header: Header,
    /// The table's bytes.
    pub table: &'c [u8],
    /// What the signature is over.
    pub signed: &'c [u8],
    /// The signature.
    pub signature: &'c [u8; SIGNATURE_LEN],
}

impl<'c> Container<'c> {
    /// The container at the start of a stretch of flash; what follows it is not looked at.
    ///
    /// # Errors
    /// [`Refusal::Truncated`], and as [`Header::read`].
    pub fn at_start(bytes: &'c [u8]) -> Result<Self, Refusal> {
        let found = bytes.len() as u32;
        let truncated = |needed| Refusal::Truncated { found, needed };
        let least = (HEADER_LEN + SIGNATURE_LEN) as u32;
        let first = bytes.first_chunk().ok_or(truncated(least))?;
        let header = Header::read(first)?;
        let needed = header.container_len().unwrap_or(u32::MAX);
        let whole = bytes.get(..needed as usize).ok_or(truncated(needed))?;
        let split = whole.split_last_chunk::<SIGNATURE_LEN>();
        let (signed, signature) = split.ok_or(truncated(least))?;
        let table = signed.get(HEADER_LEN..).ok_or(truncated(least))?;
        Ok(Self {
            header,
            table,
            signed,
            signature,
        })
    }

    /// A container that is all of the bytes, as in a file.
    ///
    /// # Errors
    /// As [`Container::at_start`], and [`Refusal::TooMany`].
    pub fn parse(bytes: &'c [u8]) -> Result<Self, Refusal> {
        let container = Self::at_start(bytes)?;
        let stated = container.signed.len() + SIGNATURE_LEN;
        if stated != bytes.len() {
            return Err(Refusal::TooMany {
                found: bytes.len() as u32,
                stated: stated as u32,
            });
        }
        Ok(container)
    }
}
