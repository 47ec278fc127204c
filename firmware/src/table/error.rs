//! Why an image, or a law's block in it, is rejected.

use super::field::{self, SPEC_HASH_LEN};
use super::law_name::Law;
use crate::grid::GridError;

/// Why an image was rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableError {
    /// Fewer bytes than a header and a CRC.
    TooShort {
        /// Bytes found.
        found: u32,
        /// Bytes that every table has.
        needed: u32,
    },
    /// The first four bytes are not `MAGIC`.
    BadMagic {
        /// Bytes found.
        found: [u8; 4],
    },
    /// The byte-order mark is swapped: written on a big-endian machine.
    WrongEndianness,
    /// Neither the byte-order mark nor its swap.
    BadByteOrderMark {
        /// Value found.
        found: u16,
    },
    /// Another version of the format.
    UnsupportedVersion {
        /// Version found.
        found: u16,
        /// The version that this reader reads.
        supported: u16,
    },
    /// The header's length is not the image's.
    WrongLength {
        /// Bytes in the image.
        found: u32,
        /// Length that the header states.
        stated: u32,
    },
    /// The CRC does not match.
    BadCrc {
        /// CRC of the bytes.
        computed: u32,
        /// CRC in the trailer.
        stored: u32,
    },
    /// The table was made from another spec.
    ForeignSpec {
        /// Hash in the header.
        found: [u8; SPEC_HASH_LEN],
        /// Hash expected.
        expected: [u8; SPEC_HASH_LEN],
    },
    /// The header's grid is impossible.
    BadGrid(GridError),
    /// A header field is out of its range.
    BadField {
        /// Offset of the field in the image, as in [`field`].
        offset: u16,
    },
    /// The block of a law is malformed.
    BadBlock {
        /// The law.
        law: Law,
        /// Why.
        reason: BlockError,
    },
}

impl TableError {
    /// This field of the header is out of its range.
    pub(crate) const fn bad_field(field: &field::Field) -> Self {
        Self::BadField {
            offset: field.start as u16,
        }
    }
}

/// Why the block of a law is malformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockError {
    /// The block reaches past the image, or blocks overlap or leave gaps.
    OutOfImage,
    /// An encoding that this reader does not know.
    UnknownEncoding {
        /// Kind found.
        found: u8,
    },
    /// The block's own header contradicts its length or the grid.
    BadShape,
    /// An entry names an input level that does not exist.
    BadLevel,
    /// A node of a tree is malformed, or a subtree does not end where its parent says.
    BadNode,
    /// A law or half-space could overflow 32 bits on the header's grid.
    Overflow,
    /// The inputs answer for every cell, so the law needs a domain part and has none.
    NoDomain,
    /// A lookup could take more visits than the directory states, or more than the reader accepts.
    TooManyVisits,
}
