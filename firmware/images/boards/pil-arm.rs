//! What the `pil` image asks of an Arm core: start, system timer, stack pointer.

pub(crate) use cortex_m_rt::entry;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// Counts of the system timer.
const SYSTICK_MASK: u32 = 0x00FF_FFFF;

/// Starts the system timer on the core's clock.
pub(crate) fn start_timer() {
    if let Some(mut peripherals) = cortex_m::Peripherals::take() {
        let timer = &mut peripherals.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(SYSTICK_MASK);
        timer.clear_current();
        timer.enable_counter();
    }
}

/// The system timer, which counts down.
pub(crate) fn timer() -> u32 {
    SYST::get_current()
}

/// Ticks of the system timer between two of its values.
pub(crate) const fn elapsed(before: u32, after: u32) -> u32 {
    before.wrapping_sub(after) & SYSTICK_MASK
}

/// The stack pointer.
pub(crate) fn stack_pointer() -> *mut u32 {
    cortex_m::register::msp::read() as *mut u32
}
