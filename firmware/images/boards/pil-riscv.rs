//! What the `pil` image asks of a RISC-V core: start and stack pointer. Time is not measured there.

pub(crate) use riscv_rt::entry;

/// There is no timer to start.
pub(crate) const fn start_timer() {}

/// No time.
pub(crate) const fn timer() -> u32 {
    0
}

/// No time between two moments.
pub(crate) const fn elapsed(_before: u32, _after: u32) -> u32 {
    0
}

/// The stack pointer.
#[inline(always)]
pub(crate) fn stack_pointer() -> *mut u32 {
    let pointer: *mut u32;
    // SAFETY: copies a register.
    unsafe { core::arch::asm!("mv {}, sp", out(reg) pointer, options(nomem, nostack)) };
    pointer
}
