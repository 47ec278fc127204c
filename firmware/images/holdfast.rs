//! The product's image for the STM32F405: the charger of [`firmware::charger`] on real pins.
//!
//! | pin | use | build |
//! |---|---|---|
//! | PA0 | zero crossings of the mains, rising (TIM5 channel 1) | unless `ade7953` |
//! | PA4, PA5, PA6, PA7 | ADE7953: chip select, SCLK, MISO, MOSI (SPI1, mode 3) | feature `ade7953` |
//! | PA8 | control pilot, 1 kHz (TIM1 channel 1) | unless `bidirectional` |
//! | PB0 | contactor, high closes | unless `bidirectional` |
//! | PA8 | signed power set-point, 1 kHz (TIM1 channel 1), see [`firmware::dispatch::power_line`] | feature `bidirectional` |
//! | PA2 | telemetry, 115 200 baud 8N1 (USART2) | always |
//!
//! One loop, no interrupts: the timer captures a crossing in hardware, and the loop comes round far
//! more often than the 20 ms until the next. The watchdog bites after four ticks without a
//! completed one, and a panic ends in it too.
#![no_std]
#![no_main]

#[cfg(feature = "log")]
use defmt_rtt as _;
use panic_halt as _;

use cortex_m_rt::entry;
use embedded_hal_nb::serial::Write as _;
use firmware::charger::{Charger, ChargerConfig, Watchdog};
use firmware::fault::ResetCause;
use firmware::flash;
use firmware::telemetry::{FRAME_MAX, Frame, TableId, encode};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::Serial;
use stm32f4xx_hal::serial::config::Config as SerialConfig;
use stm32f4xx_hal::signature::Uid;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

#[cfg_attr(feature = "ade7953", path = "holdfast/ade7953.rs")]
#[cfg_attr(not(feature = "ade7953"), path = "holdfast/zero_crossing.rs")]
mod source;
#[cfg_attr(feature = "bidirectional", path = "holdfast/power_line.rs")]
#[cfg_attr(not(feature = "bidirectional"), path = "holdfast/pilot.rs")]
mod stage;
#[path = "table_region.rs"]
mod table_region;

/// The table, byte for byte at the start of its flash sector; empty if the build found none.
#[unsafe(link_section = ".holdfast_table")]
#[used]
static TABLE: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/table.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/table.bin"));

/// Crystal of the board \[MHz\].
const CRYSTAL_MHZ: u32 = 25;
/// Core and timer clock \[MHz\].
const CORE_MHZ: u32 = 84;
/// Longest time without a completed tick \[ms\].
const WATCHDOG_MS: u32 = 400;

/// The independent watchdog, which runs on its own oscillator.
struct Dog(IndependentWatchdog);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.feed();
    }
}

/// Why the controller started; power-on sets the brown-out flag as well, so it is asked first.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().clear());
    if flags.wdgrstf().bit() {
        ResetCause::Watchdog
    } else if flags.borrstf().bit() && !flags.porrstf().bit() {
        ResetCause::BrownOut
    } else {
        ResetCause::PowerOn
    }
}

/// A number of this chip, for its place in the fleet.
fn serial_number() -> u32 {
    let uid = Uid::get();
    let lot = uid.lot_num().bytes().fold(0u32, |number, byte| {
        number.wrapping_mul(31).wrapping_add(u32::from(byte))
    });
    let die = (u32::from(uid.x()) << 16) ^ u32::from(uid.y());
    lot.wrapping_mul(0x0100_0193) ^ die ^ (u32::from(uid.waf_num()) << 8)
}

/// Milliseconds from a microsecond counter that wraps.
struct Clock {
    last_us: u32,
    rest_us: u32,
    ms: u32,
}

impl Clock {
    fn at(&mut self, now_us: u32) -> u32 {
        self.rest_us = self
            .rest_us
            .saturating_add(now_us.wrapping_sub(self.last_us));
        self.last_us = now_us;
        self.ms = self.ms.wrapping_add(self.rest_us / 1000);
        self.rest_us %= 1000;
        self.ms
    }
}

#[entry]
fn main() -> ! {
    if let Some(peripherals) = pac::Peripherals::take() {
        run(peripherals);
    }
    loop {
        cortex_m::asm::wfi();
    }
}

fn run(peripherals: pac::Peripherals) {
    let cause = reset_cause(&peripherals.RCC);
    let clocks = Config::hse(CRYSTAL_MHZ.MHz()).sysclk(CORE_MHZ.MHz());
    let mut rcc = peripherals.RCC.freeze(clocks);
    let port_a = peripherals.GPIOA.split(&mut rcc);
    let port_b = peripherals.GPIOB.split(&mut rcc);

    #[cfg(feature = "ade7953")]
    let pins = (
        peripherals.SPI1,
        port_a.pa4,
        port_a.pa5,
        port_a.pa6,
        port_a.pa7,
    );
    #[cfg(not(feature = "ade7953"))]
    let pins = (peripherals.TIM5, port_a.pa0);
    let source = source::new(pins, &mut rcc);
    let pins = (peripherals.TIM1, port_a.pa8, port_b.pb0);
    let dispatch = stage::new(pins, serial_number(), &mut rcc);

    let baud = SerialConfig::default().baudrate(115_200.bps());
    let line = Serial::tx(peripherals.USART2, port_a.pa2, baud, &mut rcc);

    let mut timer = peripherals.TIM2.counter_us(&mut rcc);
    let started = timer.start(u32::MAX.micros());
    let (Ok(mut line), Ok(()), Some((source, mut feed))) = (line, started, source) else {
        return;
    };

    let mut dog = IndependentWatchdog::new(peripherals.IWDG);
    dog.start(WATCHDOG_MS.millis());
    let image = flash::image(table_region::bytes());
    let config = ChargerConfig::DEFAULT;
    let mut charger = Charger::new(source, dispatch, Dog(dog), image, config, cause);
    let table = charger.table().map(TableId::of);
    let tick_ms = u32::from(charger.tick_ms());

    let mut clock = Clock {
        last_us: 0,
        rest_us: 0,
        ms: 0,
    };
    let mut next_ms = tick_ms;
    let mut frame = [0; FRAME_MAX];
    let (mut sent, mut length) = (0, 0);
    loop {
        let now_ms = clock.at(timer.now().ticks());
        feed.poll(charger.source_mut(), now_ms);
        if now_ms.wrapping_sub(next_ms) < u32::MAX / 2 {
            next_ms = next_ms.wrapping_add(tick_ms);
            let report = charger.tick(now_ms);
            if sent == length {
                length = encode(&Frame::new(&report, table), &mut frame).len();
                sent = 0;
            }
        }
        // One byte at a time, so that a slow line never delays a tick.
        if sent < length
            && let Some(byte) = frame.get(sent)
            && line.write(*byte).is_ok()
        {
            sent += 1;
        }
    }
}
