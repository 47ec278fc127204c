//! The TABLE region of the memory map, as bytes.

unsafe extern "C" {
    /// First byte of the region, from memory.x.
    static __table_start: u8;
    /// First byte after the region, from memory.x.
    static __table_limit: u8;
}

/// The whole region, whatever was flashed there. The addresses come from the linker and the bytes
/// may be flashed without this image, so the compiler knows nothing about them.
pub(crate) fn bytes() -> &'static [u8] {
    let start = (&raw const __table_start).expose_provenance();
    let limit = (&raw const __table_limit).expose_provenance();
    let region = core::ptr::with_exposed_provenance::<u8>(start);
    // SAFETY: memory.x asserts that the region is whole sectors of flash, which are always
    // readable, and that nothing else lies in it. No code of this image writes flash, so the bytes
    // do not change while the program runs.
    unsafe { core::slice::from_raw_parts(region, limit.wrapping_sub(start)) }
}
