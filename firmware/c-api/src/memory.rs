//! The caller's memory: checked, marked when something is put there, and not touched beyond that.

use core::ffi::c_void;
use core::mem::{align_of, size_of};

use crate::numbers::Status;

/// What stands in the caller's memory.
#[derive(Debug)]
pub(crate) struct Marked<T> {
    mark: u32,
    value: T,
}

/// A type that lives in the caller's memory.
pub(crate) trait Resident: Sized {
    /// The type that the caller reserves.
    type Memory;
    /// What says that the memory holds one: a number that memory rarely holds by chance, another
    /// for each type.
    const MARK: u32;
    /// The memory is large enough and aligned.
    const FITS: () = assert!(
        size_of::<Marked<Self>>() <= size_of::<Self::Memory>()
            && align_of::<Marked<Self>>() <= align_of::<Self::Memory>()
    );
}

/// Puts a value into the caller's memory.
///
/// # Safety
/// `memory` is NULL, or `size` bytes from there may be written and nobody else uses them during the
/// call.
pub(crate) unsafe fn place<'m, T: Resident>(
    memory: *mut c_void,
    size: usize,
    value: T,
) -> Result<&'m mut T, Status> {
    let () = T::FITS;
    let at = memory.cast::<Marked<T>>();
    if at.is_null() {
        return Err(Status::Null);
    }
    if !at.is_aligned() {
        return Err(Status::Misaligned);
    }
    if size < size_of::<T::Memory>() {
        return Err(Status::TooSmall);
    }
    let mark = T::MARK;
    // SAFETY: not NULL, aligned and large enough, checked above; the caller vouches for the rest.
    // What stood there before is only bytes: no value of ours has a destructor.
    unsafe {
        at.write(Marked { mark, value });
        Ok(&mut (*at).value)
    }
}

/// The value in the caller's memory.
///
/// # Safety
/// `memory` is NULL, or points to a whole `T::Memory` that holds initialised bytes: zeros, or what
/// [`place`] left there. Nobody else uses it during the call.
pub(crate) unsafe fn resident<'m, T: Resident>(
    memory: *mut T::Memory,
) -> Result<&'m mut T, Status> {
    let () = T::FITS;
    let at = memory.cast::<Marked<T>>();
    if at.is_null() {
        return Err(Status::Null);
    }
    if !at.is_aligned() {
        return Err(Status::Misaligned);
    }
    // SAFETY: not NULL and aligned, checked above; the mark's bytes are initialised, as the caller
    // vouches, and any bytes are a `u32`. With the mark in place the bytes are those of `place`.
    unsafe {
        if (&raw const (*at).mark).read() != T::MARK {
            return Err(Status::NotInitialised);
        }
        Ok(&mut (*at).value)
    }
}

/// A record that the caller passes to be read.
///
/// # Safety
/// `record` is NULL, or points to an initialised `T`, any bytes of which are valid; nobody writes
/// it during the call.
pub(crate) unsafe fn read<T: Copy>(record: *const T) -> Result<T, Status> {
    if record.is_null() {
        return Err(Status::Null);
    }
    if !record.is_aligned() {
        return Err(Status::Misaligned);
    }
    // SAFETY: not NULL and aligned, checked above; the caller vouches for the rest.
    Ok(unsafe { record.read() })
}

/// A record that the caller passes to be written; what it holds is not read.
///
/// # Safety
/// `record` is NULL, or a `T` may be written there and nobody else uses it during the call.
pub(crate) unsafe fn write<T: Copy>(record: *mut T, value: T) -> Result<(), Status> {
    if record.is_null() {
        return Err(Status::Null);
    }
    if !record.is_aligned() {
        return Err(Status::Misaligned);
    }
    // SAFETY: not NULL and aligned, checked above; the caller vouches for the rest.
    unsafe { record.write(value) };
    Ok(())
}

/// The caller's bytes; they must stay for as long as anything made from them is used.
///
/// # Safety
/// `bytes` is NULL, or `length` initialised bytes from there stay as they are for `'b`.
pub(crate) unsafe fn bytes<'b>(bytes: *const u8, length: usize) -> Result<&'b [u8], Status> {
    if bytes.is_null() {
        return Err(Status::Null);
    }
    if isize::try_from(length).is_err() {
        return Err(Status::TooSmall);
    }
    // SAFETY: not NULL, any address is aligned for bytes, and the length fits an `isize`, checked
    // above; the caller vouches for the rest.
    Ok(unsafe { core::slice::from_raw_parts(bytes, length) })
}
