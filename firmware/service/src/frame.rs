//! Frames: a record, its CRC-32, COBS over both, and a zero byte, as telemetry's.
//!
//! The first byte of a record tells what it is. Telemetry begins with its version, a small number;
//! the records here begin with [`ASK`] or [`ANSWER`], so that both share a line and a reader of the
//! one skips the other.

use cobs::{DecodeResult, DecoderState};
use firmware::table::{CRC_LEN, checksum};

/// First byte of what a charger is asked: version 1.
pub const ASK: u8 = 0xA1;
/// First byte of what it answers: version 1.
pub const ANSWER: u8 = 0xB1;
/// Longest record.
pub const RECORD_MAX: usize = 240;
/// Longest frame on the line: record, CRC, one byte of COBS (below 254), delimiter.
pub const FRAME_MAX: usize = RECORD_MAX + CRC_LEN + 2;

const _: () = assert!(RECORD_MAX + CRC_LEN < 254);

/// The frame of a record, delimiter included; empty for a record that is too long.
pub fn encode<'b>(record: &[u8], buffer: &'b mut [u8; FRAME_MAX]) -> &'b [u8] {
    let mut body = [0; RECORD_MAX + CRC_LEN];
    let Some((start, rest)) = body.split_at_mut_checked(record.len()) else {
        return &[];
    };
    let Some(crc) = rest.first_chunk_mut::<CRC_LEN>() else {
        return &[];
    };
    for (to, from) in start.iter_mut().zip(record) {
        *to = *from;
    }
    *crc = checksum(record).to_le_bytes();
    let body = body.get(..record.len() + CRC_LEN).unwrap_or_default();
    let Ok(written) = cobs::try_encode(body, buffer) else {
        return &[];
    };
    if let Some(delimiter) = buffer.get_mut(written) {
        *delimiter = 0;
    }
    buffer.get(..=written).unwrap_or_default()
}

/// What COBS made these bytes of, up to the first zero; `None` for bytes that it does not make, and
/// for none. The bytes are overwritten. Byte by byte: the crate's own function in place checks its
/// indices by panics.
fn unstuff(bytes: &mut [u8]) -> Option<&[u8]> {
    let mut state = DecoderState::Idle;
    let mut length = 0;
    // A byte of the record is put where one of the frame was, at the latest.
    for at in 0..bytes.len() {
        let byte = *bytes.get(at)?;
        if byte == 0 {
            break;
        }
        if let DecodeResult::DataContinue(byte) = state.feed(byte).ok()? {
            *bytes.get_mut(length)? = byte;
            length += 1;
        }
    }
    let DecodeResult::DataComplete = state.feed(0).ok()? else {
        return None;
    };
    bytes.get(..length)
}

/// The record of the bytes up to a delimiter, without it; `None` for bytes that are no frame. The
/// bytes are overwritten.
pub fn decode(bytes: &mut [u8]) -> Option<&[u8]> {
    let (record, crc) = unstuff(bytes)?.split_last_chunk::<CRC_LEN>()?;
    (checksum(record) == u32::from_le_bytes(*crc)).then_some(record)
}

/// Collects the bytes of a line into frames.
#[derive(Debug, Clone)]
pub struct Collector {
    bytes: [u8; FRAME_MAX],
    length: usize,
    /// More came than a frame has: everything up to the next delimiter is dropped.
    overrun: bool,
}

impl Collector {
    /// Before the first byte.
    pub const EMPTY: Self = Self {
        bytes: [0; FRAME_MAX],
        length: 0,
        overrun: false,
    };

    /// Takes a byte; the record of the frame that it ends, if it ends one.
    pub fn take(&mut self, byte: u8) -> Option<&[u8]> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(slot) => {
                    *slot = byte;
                    self.length += 1;
                }
                None => self.overrun = true,
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.overrun) {
            return None;
        }
        decode(self.bytes.get_mut(..length)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn the_longest_record_fits_and_a_longer_one_does_not() {
        let mut buffer = [0; FRAME_MAX];
        assert_eq!(encode(&[1; RECORD_MAX], &mut buffer).len(), FRAME_MAX);
        assert_eq!(encode(&[1; RECORD_MAX + 1], &mut buffer), &[]);
    }

    proptest! {
        #[test]
        fn any_bytes_decode_as_by_the_crate(
            bytes in proptest::collection::vec(prop_oneof![Just(0u8), 1u8..6, any::<u8>()], 0..FRAME_MAX),
            record in proptest::collection::vec(any::<u8>(), 0..=RECORD_MAX),
            at in 0usize..FRAME_MAX,
            change in any::<u8>(),
        ) {
            let mut near = encode(&record, &mut [0; FRAME_MAX]).to_vec();
            if let Some(byte) = near.get_mut(at) {
                *byte ^= change;
            }
            for bytes in [bytes, near] {
                let (mut found, mut theirs) = (bytes.clone(), bytes);
                let found = unstuff(&mut found).map(<[u8]>::to_vec);
                // To the crate nothing before the first zero is an empty frame; here it is none.
                let is_some = theirs.first().is_some_and(|byte| *byte != 0);
                let length = cobs::decode_in_place(&mut theirs).ok().filter(|_| is_some);
                prop_assert_eq!(found, length.map(|length| theirs[..length].to_vec()));
            }
        }

        #[test]
        fn records_come_back_from_a_line_with_rubbish_between(
            records in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..=RECORD_MAX), 1..5),
            rubbish in proptest::collection::vec(1u8..=255, 0..600),
        ) {
            let mut line = Vec::new();
            for record in &records {
                line.extend(&rubbish);
                line.push(0);
                line.extend(encode(record, &mut [0; FRAME_MAX]));
            }
            let mut collector = Collector::EMPTY;
            let mut found = Vec::new();
            for byte in line {
                found.extend(collector.take(byte).map(<[u8]>::to_vec));
            }
            prop_assert_eq!(found, records);
        }

        #[test]
        fn one_flipped_bit_never_passes(at in 0usize..20, bit in 0u8..8) {
            let record = [ASK, 1, 2, 0, 4, 5, 6, 0, 8, 9];
            let mut buffer = [0; FRAME_MAX];
            let length = encode(&record, &mut buffer).len() - 1;
            prop_assume!(at < length);
            buffer[at] ^= 1 << bit;
            prop_assert_eq!(decode(&mut buffer[..length]), None);
        }
    }
}
