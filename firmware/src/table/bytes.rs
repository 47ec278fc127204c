//! Little-endian fields of a byte slice, without panics.

/// The `N` bytes at an offset, or `None` past the end.
pub(crate) fn array_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk::<N>().copied()
}

/// A byte at an offset; 0 past the end (callers check the length first).
pub(crate) fn byte_at(bytes: &[u8], at: usize) -> u8 {
    bytes.get(at).copied().unwrap_or_default()
}

/// A `u16` at an offset; 0 past the end (callers check the length first).
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}

/// A `u32` at an offset; 0 past the end (callers check the length first).
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}

/// An `i32` at an offset; 0 past the end (callers check the length first).
pub(crate) fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(array_at(bytes, at).unwrap_or_default())
}
