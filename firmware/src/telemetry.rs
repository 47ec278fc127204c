//! Telemetry: one frame a tick, over any serial line.
//!
//! A frame is a postcard record ([`Frame`]), four bytes of CRC-32 over the record, COBS over both
//! and a zero byte as the delimiter. `docs/telemetry.md` is the schema. The first byte of the
//! record is its version: a reader that does not know it skips the frame.

use serde::{Deserialize, Serialize};

use crate::charger::Report;
use crate::dispatch::SetPoint;
use crate::table::{CRC_LEN, TableView, checksum};
use crate::units::STATES;

/// Version of the record that this module writes and reads.
pub const TELEMETRY_VERSION: u8 = 2;
/// Longest record: every varint at its longest.
const RECORD_MAX: usize = 1 + 5 + 5 + 1 + 1 + STATES * 5 + 6 + 5 + 6 + 3 + 1 + 1 + TABLE_ID_LEN;
/// Bytes of a [`TableId`] at most: 16 of hash and a varint.
const TABLE_ID_LEN: usize = 16 + 5;
/// Longest frame on the line: record, CRC, one byte of COBS (below 254), delimiter.
pub const FRAME_MAX: usize = RECORD_MAX + CRC_LEN + 2;

const _: () = assert!(RECORD_MAX + CRC_LEN < 254);

/// Which table is in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableId {
    /// First half of the SHA-256 of the spec.
    pub spec_hash: [u8; 16],
    /// CRC-32 of the table's bytes, as in its trailer.
    pub crc: u32,
}

impl TableId {
    /// Of a table that was accepted.
    pub fn of(table: &TableView<'_>) -> Self {
        let trailer = table.bytes().last_chunk::<CRC_LEN>().copied();
        Self {
            spec_hash: table.header().spec_hash,
            crc: u32::from_le_bytes(trailer.unwrap_or_default()),
        }
    }
}

/// The set-point on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WireSetPoint {
    /// The hardware refused.
    Unknown,
    /// No charging.
    Paused,
    /// Current offered \[mA\].
    CurrentMa(u32),
    /// Power drawn from the grid \[W\].
    PowerW(i32),
}

/// The record of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frame {
    /// [`TELEMETRY_VERSION`].
    pub version: u8,
    /// Ticks since the start.
    pub sequence: u32,
    /// The charger's clock \[ms\].
    pub now_ms: u32,
    /// Number of the [`crate::fault::Mode`].
    pub mode: u8,
    /// Number of the [`crate::phase::Phase`].
    pub phase: u8,
    /// State estimate f, g, l, p \[µHz, kW\].
    pub state: [i32; STATES],
    /// Lost power \[kW\], if known.
    pub loss_kw: Option<i32>,
    /// Participation \[ppm\].
    pub participation_ppm: u32,
    /// What the charger was told.
    pub set_point: WireSetPoint,
    /// Bits of [`crate::fault::Faults`].
    pub faults: u16,
    /// Bits of [`crate::charger::Misfits`].
    pub misfits: u8,
    /// The table, if one was accepted.
    pub table: Option<TableId>,
}

impl Frame {
    /// The frame of a report.
    pub fn new(report: &Report, table: Option<TableId>) -> Self {
        Self {
            version: TELEMETRY_VERSION,
            sequence: report.sequence,
            now_ms: report.now_ms,
            mode: report.mode as u8,
            phase: report.phase.number(),
            state: report.state.0,
            loss_kw: report.loss_kw,
            participation_ppm: report.participation.ppm(),
            set_point: match report.set_point {
                None => WireSetPoint::Unknown,
                Some(SetPoint::Paused) => WireSetPoint::Paused,
                Some(SetPoint::Current { ma }) => WireSetPoint::CurrentMa(ma),
                Some(SetPoint::Power { w }) => WireSetPoint::PowerW(w),
            },
            faults: report.faults.bits(),
            misfits: report.misfits.bits(),
            table,
        }
    }
}

/// Why bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecodeError {
    /// Not COBS, too short, or not a record of the known version's shape.
    Malformed,
    /// Another version.
    UnsupportedVersion {
        /// Version found.
        found: u8,
    },
    /// The CRC does not match.
    BadCrc,
}

/// The frame's bytes on the line, delimiter included.
pub fn encode<'b>(frame: &Frame, buffer: &'b mut [u8; FRAME_MAX]) -> &'b [u8] {
    // The buffers hold every frame: no call can fail, and an empty slice would send nothing.
    let mut body = [0; RECORD_MAX + CRC_LEN];
    let length = postcard::to_slice(frame, &mut body).map_or(0, |record| record.len());
    let Some((record, rest)) = body.split_at_mut_checked(length) else {
        return &[];
    };
    let Some(crc) = rest.first_chunk_mut::<CRC_LEN>() else {
        return &[];
    };
    *crc = checksum(record).to_le_bytes();
    let body = body.get(..length + CRC_LEN).unwrap_or_default();
    let Ok(written) = cobs::try_encode(body, buffer) else {
        return &[];
    };
    if let Some(delimiter) = buffer.get_mut(written) {
        *delimiter = 0;
    }
    buffer.get(..=written).unwrap_or_default()
}

/// The frame of a stretch of bytes up to a delimiter (with or without it); the bytes are
/// overwritten.
///
/// # Errors
/// Bytes that [`encode`] did not write.
pub fn decode(bytes: &mut [u8]) -> Result<Frame, DecodeError> {
    let length = cobs::decode_in_place(bytes).map_err(|_| DecodeError::Malformed)?;
    let body = bytes.get(..length).unwrap_or_default();
    let Some((record, crc)) = body.split_last_chunk::<CRC_LEN>() else {
        return Err(DecodeError::Malformed);
    };
    if checksum(record) != u32::from_le_bytes(*crc) {
        return Err(DecodeError::BadCrc);
    }
    match record.first() {
        None => return Err(DecodeError::Malformed),
        Some(&TELEMETRY_VERSION) => {}
        Some(&found) => return Err(DecodeError::UnsupportedVersion { found }),
    }
    match postcard::take_from_bytes(record) {
        Ok((frame, [])) => Ok(frame),
        _ => Err(DecodeError::Malformed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> Frame {
        Frame {
            version: 2,
            sequence: 1,
            now_ms: 100,
            mode: 1,
            phase: 2,
            state: [-150_000, 0, 1, -1],
            loss_kw: Some(2),
            participation_ppm: 300,
            set_point: WireSetPoint::CurrentMa(6_000),
            faults: 0x81,
            misfits: 3,
            table: None,
        }
    }

    #[test]
    fn golden_bytes() {
        // Zigzag varints: -150 000 is 299 999 = 0xDF 0xA7 0x12; 6 000 is 0xF0 0x2E; 300 is 0xAC
        // 0x02; 0x81 is 0x81 0x01.
        let record = [
            2, 1, 100, 1, 2, 0xDF, 0xA7, 0x12, 0, 2, 1, 1, 4, 0xAC, 0x02, 2, 0xF0, 0x2E, 0x81,
            0x01, 3, 0,
        ];
        let mut plain = [0; RECORD_MAX];
        let written = postcard::to_slice(&sample(), &mut plain);
        assert_eq!(written.as_deref(), Ok(&record[..]));
        let crc = checksum(&record).to_le_bytes();
        let mut buffer = [0; FRAME_MAX];
        let line = encode(&sample(), &mut buffer);
        // COBS by hand: 8 non-zero bytes before the first zero, 12 before the second, then the CRC.
        let mut expected = std::vec![9];
        expected.extend(&record[..8]);
        expected.push(13);
        expected.extend(&record[9..21]);
        expected.push(5);
        expected.extend(crc);
        expected.push(0);
        assert!(
            crc.iter().all(|byte| *byte != 0),
            "the hand-made COBS assumes it"
        );
        assert_eq!(line, &expected[..]);
    }

    #[test]
    fn the_longest_frame_fits() {
        let frame = Frame {
            version: 2,
            sequence: u32::MAX,
            now_ms: u32::MAX,
            mode: 255,
            phase: 255,
            state: [i32::MIN; STATES],
            loss_kw: Some(i32::MIN),
            participation_ppm: u32::MAX,
            set_point: WireSetPoint::PowerW(i32::MIN),
            faults: u16::MAX,
            misfits: u8::MAX,
            table: Some(TableId {
                spec_hash: [255; 16],
                crc: u32::MAX,
            }),
        };
        let mut buffer = [0; FRAME_MAX];
        let length = encode(&frame, &mut buffer).len();
        assert_eq!(length, FRAME_MAX);
        assert_eq!(decode(&mut buffer), Ok(frame));
    }

    #[test]
    fn another_version_is_named() {
        let mut buffer = [0; FRAME_MAX];
        let next = Frame {
            version: 3,
            ..sample()
        };
        let length = encode(&next, &mut buffer).len();
        let found = decode(&mut buffer[..length]);
        assert_eq!(found, Err(DecodeError::UnsupportedVersion { found: 3 }));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_rejected(mut bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&mut bytes);
        }

        #[test]
        fn one_flipped_bit_never_passes(at in 0usize..27, bit in 0u8..8) {
            let mut buffer = [0; FRAME_MAX];
            let length = encode(&sample(), &mut buffer).len();
            prop_assume!(at < length - 1);
            buffer[at] ^= 1 << bit;
            let decoded = decode(&mut buffer[..length]);
            prop_assert!(decoded != Ok(sample()) && decoded.is_err(), "{decoded:?}");
        }
    }
}
