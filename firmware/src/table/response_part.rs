//! The response part: the parameters of a law that is always on.
//!
//! Eight words of four bytes. The reader accepts what [`crate::response`] is total for.

use super::bytes::WORD;
use super::error::TableError;
use super::field::{Field, response};
use crate::response::{DROOP_GAIN_MAX, ResponseLaw, WINDOW_TICKS_MAX};
use crate::units::MICRO;

/// Bytes of the response part.
pub const RESPONSE_LEN: usize = response::SMALLEST_CHANGE.end;

/// The part that begins at this offset of the image.
///
/// # Errors
/// A parameter out of its range, with its offset in the image.
pub(super) fn read_response(bytes: &[u8], at: usize) -> Result<ResponseLaw, TableError> {
    let mut words = [0; RESPONSE_LEN / WORD];
    let part = bytes.get(at..).unwrap_or_default().as_chunks().0;
    for (word, bytes) in words.iter_mut().zip(part) {
        *word = u32::from_le_bytes(*bytes);
    }
    let word = |field: Field| words[field.start / WORD];
    let check = |ok: bool, field: Field| {
        if ok {
            Ok(())
        } else {
            Err(TableError::bad_field(&(at + field.start..at + field.end)))
        }
    };
    let window_ticks = u16::try_from(word(response::WINDOW)).unwrap_or(u16::MAX);
    let law = ResponseLaw {
        droop_gain_ppm_per_hz: word(response::DROOP_GAIN),
        setpoint_uhz: word(response::SETPOINT).cast_signed(),
        slope_gain_ppm_s_per_hz: word(response::SLOPE_GAIN),
        slope_threshold_uhz_per_s: word(response::SLOPE_THRESHOLD),
        window_ticks,
        slope_most_ppm: word(response::SLOPE_MOST),
        release_ppm: word(response::RELEASE),
        smallest_change_ppm: word(response::SMALLEST_CHANGE),
    };
    check(
        law.droop_gain_ppm_per_hz <= DROOP_GAIN_MAX,
        response::DROOP_GAIN,
    )?;
    let in_window = (1..=WINDOW_TICKS_MAX).contains(&window_ticks);
    check(in_window, response::WINDOW)?;
    let full = MICRO as u32;
    check(law.slope_most_ppm <= full, response::SLOPE_MOST)?;
    check(law.release_ppm <= full, response::RELEASE)?;
    let changes = (1..=full).contains(&law.smallest_change_ppm);
    check(changes, response::SMALLEST_CHANGE)?;
    Ok(law)
}

/// The bytes of a response part.
pub fn write_response(law: &ResponseLaw) -> [u8; RESPONSE_LEN] {
    let mut out = [0u8; RESPONSE_LEN];
    let mut put = |field: Field, word: u32| out[field].copy_from_slice(&word.to_le_bytes());
    put(response::DROOP_GAIN, law.droop_gain_ppm_per_hz);
    put(response::SETPOINT, law.setpoint_uhz.cast_unsigned());
    put(response::SLOPE_GAIN, law.slope_gain_ppm_s_per_hz);
    put(response::SLOPE_THRESHOLD, law.slope_threshold_uhz_per_s);
    put(response::WINDOW, law.window_ticks.into());
    put(response::SLOPE_MOST, law.slope_most_ppm);
    put(response::RELEASE, law.release_ppm);
    put(response::SMALLEST_CHANGE, law.smallest_change_ppm);
    out
}
