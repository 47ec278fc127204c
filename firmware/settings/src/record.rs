//! All values as bytes: a version, then number and value of each setting that is not at its
//! default.
//!
//! | bytes | what |
//! |---|---|
//! | 1 | [`RECORD_VERSION`] |
//! | 5 each | number, value as `u32`, little-endian; numbers ascend |
//!
//! A record has no checksum of its own: the flash's items have one.

use crate::key::{KEYS, Key};
use crate::values::{Build, ValueError, Values};

/// Version of the record.
pub const RECORD_VERSION: u8 = 1;
/// Bytes of a setting.
const ENTRY_LEN: usize = 5;
/// Longest record.
pub const RECORD_MAX: usize = 1 + KEYS * ENTRY_LEN;

/// Why bytes are not a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordError {
    /// Empty, of another length than whole settings have, or numbers that do not ascend.
    Malformed,
    /// Another version.
    UnsupportedVersion {
        /// Version found.
        found: u8,
    },
    /// The values are not allowed.
    Value(ValueError),
}

/// The record of values, at the start of `buffer`.
pub fn write(values: &Values, build: Build, buffer: &mut [u8; RECORD_MAX]) -> usize {
    let defaults = Values::defaults(build);
    let (version, rest) = buffer.split_at_mut(1);
    version.fill(RECORD_VERSION);
    let mut slots = rest.chunks_exact_mut(ENTRY_LEN);
    let mut length = 1;
    for key in Key::ALL {
        let value = values.get(key);
        if value == defaults.get(key) {
            continue;
        }
        // There is a slot for every key.
        if let Some(([number], bytes)) = slots.next().and_then(<[u8]>::split_first_chunk_mut::<1>) {
            *number = key.number();
            bytes.copy_from_slice(&value.to_le_bytes());
            length += ENTRY_LEN;
        }
    }
    length
}

/// The values of a record.
///
/// # Errors
/// Bytes that [`write()`] did not write for this build.
pub fn read(bytes: &[u8], build: Build) -> Result<Values, RecordError> {
    let (version, rest) = bytes.split_first().ok_or(RecordError::Malformed)?;
    if *version != RECORD_VERSION {
        let found = *version;
        return Err(RecordError::UnsupportedVersion { found });
    }
    let (entries, []) = rest.as_chunks::<ENTRY_LEN>() else {
        return Err(RecordError::Malformed);
    };
    let mut changes = [(0, 0); KEYS];
    let changes = changes
        .get_mut(..entries.len())
        .ok_or(RecordError::Malformed)?;
    let mut before = 0;
    for (change, [number, bytes @ ..]) in changes.iter_mut().zip(entries) {
        if *number <= before {
            return Err(RecordError::Malformed);
        }
        before = *number;
        *change = (*number, u32::from_le_bytes(*bytes));
    }
    let values = Values::defaults(build).with(changes, build);
    values.map_err(RecordError::Value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BUILD: Build = Build::REFERENCE;

    #[test]
    fn golden_bytes() {
        let changes = [
            (Key::PilotGap.number(), 5),
            (Key::RatedCurrent.number(), 16_000),
        ];
        let values = Values::DEFAULT.with(&changes, BUILD).unwrap();
        let mut buffer = [0; RECORD_MAX];
        let length = write(&values, BUILD, &mut buffer);
        // 16 000 is 0x3E80.
        let expected = [1, 1, 0x80, 0x3E, 0, 0, 23, 5, 0, 0, 0];
        assert_eq!(buffer.get(..length), Some(&expected[..]));
        assert_eq!(read(&expected, BUILD), Ok(values));
        assert_eq!(read(&[1], BUILD), Ok(Values::DEFAULT));
    }

    #[test]
    fn what_is_no_record_is_named() {
        assert_eq!(read(&[], BUILD), Err(RecordError::Malformed));
        assert_eq!(read(&[1, 1, 0, 0], BUILD), Err(RecordError::Malformed));
        let other = RecordError::UnsupportedVersion { found: 2 };
        assert_eq!(read(&[2], BUILD), Err(other));
        let twice = [1, 2, 1, 0, 0, 0, 2, 3, 0, 0, 0];
        assert_eq!(read(&twice, BUILD), Err(RecordError::Malformed));
        let out = ValueError::OutOfRange {
            key: Key::Phases,
            value: 4,
        };
        let found = read(&[1, 2, 4, 0, 0, 0], BUILD);
        assert_eq!(found, Err(RecordError::Value(out)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_refused_or_are_what_is_written(bytes in proptest::collection::vec(any::<u8>(), 0..130)) {
            if let Ok(values) = read(&bytes, BUILD) {
                let mut buffer = [0; RECORD_MAX];
                let length = write(&values, BUILD, &mut buffer);
                prop_assert_eq!(read(&buffer[..length], BUILD), Ok(values));
            }
        }

        #[test]
        fn values_come_back(picks in proptest::collection::vec((0usize..KEYS, any::<u32>()), 0..40)) {
            let mut values = Values::DEFAULT;
            for (at, pick) in picks {
                let key = Key::ALL[at];
                let about = key.about();
                let value = about.least + pick % (about.most - about.least + 1);
                if let Ok(next) = values.with(&[(key.number(), value)], BUILD) {
                    values = next;
                }
            }
            let mut buffer = [0; RECORD_MAX];
            let length = write(&values, BUILD, &mut buffer);
            prop_assert_eq!(read(&buffer[..length], BUILD), Ok(values));
        }
    }
}
