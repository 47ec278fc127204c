//! Frequency from the zero crossings of the mains: rising edges on PA0, captured by TIM5 channel 1
//! in hardware.

use firmware::frequency::zero_crossing::ZeroCrossing;
use stm32f4xx_hal::gpio::PA0;
use stm32f4xx_hal::pac::TIM5;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::capture::{CaptureChannel, CaptureHzManager};
use stm32f4xx_hal::timer::{CapturePolarity, Flag, Timer};

use super::CORE_MHZ;

/// Tolerance of the crystal \[ppm\].
const CRYSTAL_PPM: u16 = 20;
/// The capture's timer \[Hz\]; divides the timer clock.
const TIMER_HZ: u32 = 1_000_000;
/// Mains cycles a frequency is averaged over: 100 ms.
const CYCLES: u8 = 5;

const _: () = assert!((CORE_MHZ * 1_000_000).is_multiple_of(TIMER_HZ));

/// Carries captures from the timer to the window.
pub(crate) struct Feed {
    timer: CaptureHzManager<TIM5>,
    channel: CaptureChannel<TIM5, 0>,
}

/// The source and what feeds it.
pub(crate) fn new((timer, pin): (TIM5, PA0), rcc: &mut Rcc) -> Option<(ZeroCrossing, Feed)> {
    let (timer, (channel, ..)) = Timer::new(timer, rcc).capture_hz(TIMER_HZ.Hz());
    let mut channel = channel.with(pin);
    channel.set_polarity(CapturePolarity::ActiveHigh);
    channel.enable();
    let window = ZeroCrossing::new(TIMER_HZ, CYCLES, CRYSTAL_PPM).ok()?;
    Some((window, Feed { timer, channel }))
}

impl Feed {
    /// Hands over a crossing, if there was one; the loop comes round far more often than every 20
    /// ms.
    pub(crate) fn poll(&mut self, window: &mut ZeroCrossing, now_ms: u32) {
        if self.timer.flags().contains(Flag::C1) {
            // Reading the capture register clears its flag.
            window.capture(self.channel.get_capture(), now_ms);
        }
    }
}
