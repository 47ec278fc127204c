//! The flash image: a header, the coefficients of the prediction if commands act with a delay, one
//! block per law or the parameters of a response, a CRC.
//!
//! Reader ([`TableView`]) and writer ([`write`]) of the format live here, so that they cannot drift
//! apart; `docs/table-format.md` gives the same bytes in prose. All integers are little-endian.
//!
//! The image is checked once, by [`TableView::parse`]. After that every lookup is total: it ends
//! within the bound of the law's directory entry, reads only inside its block and answers `None`
//! for a cell that the law does not cover.

mod affine;
mod bytes;
mod checksum;
mod dense;
mod domain;
mod encoding;
mod error;
pub mod field;
mod header;
mod header_bytes;
mod hypotheses;
mod law;
mod law_name;
mod look_ahead;
mod response_part;
mod tree;
mod tree_node;

pub use affine::{AFFINE_FRACTION_BITS, AFFINE_LEN, AffineFunction};
pub use checksum::checksum;
pub use dense::{DENSE_HEADER_LEN, DenseView, bits_per_entry};
pub use domain::{
    DomainKind, HALF_SPACES_MAX, LEAF_HALF_SPACE, LEAF_HULL, LEAF_INSIDE, LEAF_LOOK_AHEAD,
    LEAF_OUTSIDE, LOOK_AHEADS_MAX,
};
pub use encoding::Encoding;
pub use error::{BlockError, TableError};
pub use field::SPEC_HASH_LEN;
pub use header::{Header, LEVELS_MAX, LawEntry, PlantParameters, TICK_MS_MAX, Working};
pub use header_bytes::{
    BYTE_ORDER_MARK, CRC_LEN, DIRECTORY_ENTRY_LEN, FORMAT_VERSION, HEADER_LEN, MAGIC, WriteError,
    seal, write_header,
};
pub use hypotheses::{Direction, Hypotheses, LossProfile};
pub use law::{InputsKind, LawView};
pub use law_name::{LAWS, Law};
pub use look_ahead::{LOOK_AHEAD_LEN, LOOK_AHEAD_SHIFT_MAX, LOOK_AHEAD_STEPS_MAX, LookAhead};
pub use response_part::{RESPONSE_LEN, write_response};
pub use tree::{AFFINE_PIECES_MAX, LEAF_AFFINE, TREE_DEPTH_MAX, TreeView};
pub use tree_node::{Children, LEAF_VALUES, NODE_LEN_MAX, Node, SKIP_MAX};

use crate::grid::Cell;
use crate::prediction::{PredictionView, prediction_len};
use crate::response::ResponseLaw;
use bytes::HeaderWords;
use header_bytes::read_working;
use response_part::read_response;

/// A table that was checked; lookups are total.
#[derive(Debug, Clone)]
pub struct TableView<'t> {
    working: Working,
    laws: [Option<LawView<'t>>; LAWS],
    bytes: &'t [u8],
}

impl<'t> TableView<'t> {
    /// Checks an image and gives access to it.
    ///
    /// # Errors
    /// The first thing that is wrong with it, as a [`TableError`].
    pub fn parse(bytes: &'t [u8]) -> Result<Self, TableError> {
        let (working, entries) = read_working(bytes)?;
        let mut laws = [None, None, None];
        // The header has been held against the image's length.
        let mut at = HEADER_LEN + prediction_len(working.delay_ticks);
        if working.always_on {
            read_response(bytes, at)?;
            at += RESPONSE_LEN;
        }
        let places = laws.iter_mut().zip(&entries);
        for (law, (place, entry)) in Law::ALL.into_iter().zip(places) {
            let Some(entry) = entry else { continue };
            let bad = |reason| TableError::BadBlock { law, reason };
            let end = at
                .checked_add(entry.domain_len as usize)
                .and_then(|end| end.checked_add(entry.inputs_len as usize))
                .filter(|end| *end <= bytes.len() - CRC_LEN)
                .ok_or(bad(BlockError::OutOfImage))?;
            let (domain, inputs) = bytes
                .get(at..end)
                .and_then(|block| block.split_at_checked(entry.domain_len as usize))
                .ok_or(bad(BlockError::OutOfImage))?;
            match LawView::parse(entry, domain, inputs, &working) {
                Ok(law) => *place = Some(law),
                Err(reason) => return Err(bad(reason)),
            }
            at = end;
        }
        if at != bytes.len() - CRC_LEN {
            let last = TableError::BadBlock {
                law: Law::Hold,
                reason: BlockError::OutOfImage,
            };
            return Err(last);
        }
        Ok(Self {
            working,
            laws,
            bytes,
        })
    }

    /// The same, and the table must have been made from this spec.
    ///
    /// # Errors
    /// As [`TableView::parse`], and [`TableError::ForeignSpec`].
    pub fn parse_for_spec(
        bytes: &'t [u8],
        expected: [u8; SPEC_HASH_LEN],
    ) -> Result<Self, TableError> {
        let view = Self::parse(bytes)?;
        let found = view.header().spec_hash;
        if found != expected {
            return Err(TableError::ForeignSpec { found, expected });
        }
        Ok(view)
    }

    /// The header, read anew from the image. It was checked when the image was.
    pub fn header(&self) -> Header {
        Header::decode(&HeaderWords::read(self.bytes), self.working.grid)
    }

    /// The plant, read anew from the image.
    pub fn plant(&self) -> PlantParameters {
        header_bytes::read_plant(&HeaderWords::read(self.bytes))
    }

    /// What a tick needs of the header.
    pub const fn working(&self) -> &Working {
        &self.working
    }

    /// The coefficients of the prediction, if commands act with a delay.
    pub fn prediction(&self) -> Option<PredictionView<'t>> {
        let len = prediction_len(self.working.delay_ticks);
        let part = self.bytes.get(HEADER_LEN..HEADER_LEN + len)?;
        (!part.is_empty()).then(|| PredictionView::new(part))
    }

    /// The law that is always on, if the table is a response; read anew from the image.
    pub fn response(&self) -> Option<ResponseLaw> {
        let always_on = self.working.always_on;
        always_on.then(|| read_response(self.bytes, HEADER_LEN).ok())?
    }

    /// The whole image.
    pub fn bytes(&self) -> &'t [u8] {
        self.bytes
    }

    /// A law's reader, if the table has the law.
    pub fn law(&self, law: Law) -> Option<&LawView<'t>> {
        self.laws[law as usize].as_ref()
    }

    /// Input level of a law at a cell; `None` outside the law's domain, or if the table has no such
    /// law.
    pub fn lookup(&self, law: Law, cell: Cell) -> Option<u8> {
        self.laws[law as usize].as_ref()?.lookup(cell)
    }
}
