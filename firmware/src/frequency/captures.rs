//! What capture hardware offers.

/// Hardware that keeps the timer's count at a zero crossing until it is read.
pub trait Captures {
    /// Rate of the timer \[Hz\].
    const TIMER_HZ: u32;
    /// Tolerance of the timer's clock \[ppm\].
    const CLOCK_PPM: u16;
    /// Most by which a crossing is captured early or late, comparator and noise \[ns\].
    const JITTER_NS: u32;

    /// The count at the last crossing, if there was one since the last call.
    fn take(&mut self) -> Option<u32>;

    /// Whether a crossing was captured and overwritten before it was taken, since the last call.
    fn lost(&mut self) -> bool;
}
