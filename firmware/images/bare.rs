//! The charger without a HAL, for measuring: what the library costs by itself.
//!
//! The same parts as in `holdfast` (zero crossings, supervisor, pilot, contactor, telemetry) over
//! pins that are words in RAM. It plays a falling frequency with glitches, a silent mains, a late
//! tick and a jump of the clock for ever, so that every path takes its turn; the stack is painted
//! by the runtime and read off the emulator's memory.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;

use cortex_m_rt::entry;
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use firmware::charger::{Charger, ChargerConfig, Watchdog};
use firmware::dispatch::Limits;
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::fault::ResetCause;
use firmware::flash;
use firmware::frequency::zero_crossing::ZeroCrossing;
use firmware::telemetry::{FRAME_MAX, Frame, TableId, encode};
use panic_halt as _;

#[path = "table_region.rs"]
mod table_region;

/// Timer of the crossings \[Hz\].
const TIMER_HZ: u32 = 1_000_000;
/// Ticks of one round of what is played.
const ROUND_TICKS: u32 = 1024;

/// A pin that nobody is connected to.
struct Pin;

impl embedded_hal::pwm::ErrorType for Pin {
    type Error = Infallible;
}

impl SetDutyCycle for Pin {
    fn max_duty_cycle(&self) -> u16 {
        black_box(8_400)
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        black_box(duty);
        Ok(())
    }
}

impl embedded_hal::digital::ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        black_box(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        black_box(true);
        Ok(())
    }
}

impl Watchdog for Pin {
    fn feed(&mut self) {
        black_box(());
    }
}

#[entry]
fn main() -> ! {
    if let Ok(source) = ZeroCrossing::new(TIMER_HZ, 5, 20) {
        run(source);
    }
    loop {
        cortex_m::asm::wfi();
    }
}

fn run(source: ZeroCrossing) {
    let dispatch = Unidirectional::new(
        Pin,
        Pin,
        ContactorTimes::DEFAULT,
        Threshold::of_serial(black_box(1)),
        Limits::all(black_box(32_000)),
    );
    let image = flash::image(table_region::bytes());
    let config = ChargerConfig::DEFAULT;
    let cause = black_box(ResetCause::PowerOn);
    let mut charger = Charger::new(source, dispatch, Pin, image, config, cause);
    let table = charger.table().map(TableId::of);
    let (mut now_ms, mut stamp, mut tick) = (0u32, 0u32, 0u32);
    let mut frame = [0; FRAME_MAX];
    loop {
        let place = tick % ROUND_TICKS;
        // A period of 20 ms that grows to 20.3 ms, 49.26 Hz, and back.
        let slow = place.min(ROUND_TICKS - place) * 3 / 5;
        for _ in 0..5 {
            stamp = stamp.wrapping_add(20_000 + slow);
            if !(300..330).contains(&place) {
                charger.source_mut().capture(stamp, now_ms);
            }
        }
        if place == 200 {
            charger
                .source_mut()
                .capture(stamp.wrapping_add(300), now_ms);
        }
        let report = charger.tick(now_ms);
        black_box(encode(&Frame::new(&report, table), &mut frame));
        let step_ms = match place {
            400 => 400,
            800 => 90_000,
            _ => 100,
        };
        now_ms = now_ms.wrapping_add(step_ms);
        tick = tick.wrapping_add(1);
    }
}
