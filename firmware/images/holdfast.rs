//! The product's image for the STM32F405: the charger of [`firmware::charger`] on real pins.
//!
//! | pin | use |
//! |---|---|
//! | PA0 | zero crossings of the mains, rising (TIM5 channel 1) |
//! | PA2 | telemetry, 115 200 baud 8N1 (USART2) |
//! | PA8 | control pilot, 1 kHz (TIM1 channel 1) |
//! | PB0 | contactor, high closes |
//!
//! One loop, no interrupts: the timer captures a crossing in hardware, and the loop comes round far more often than the
//! 20 ms until the next. The watchdog bites after four ticks without a completed one, and a panic ends in it too.
#![no_std]
#![no_main]

#[cfg(feature = "log")]
use defmt_rtt as _;
use panic_halt as _;

use cortex_m_rt::entry;
use embedded_hal_nb::serial::Write as _;
use firmware::charger::{Charger, ChargerConfig, Watchdog};
use firmware::dispatch::Limits;
use firmware::dispatch::contactor::ContactorTimes;
use firmware::dispatch::fleet::Threshold;
use firmware::dispatch::unidirectional::Unidirectional;
use firmware::fault::ResetCause;
use firmware::flash;
use firmware::frequency::zero_crossing::ZeroCrossing;
use firmware::telemetry::{FRAME_MAX, Frame, TableId, encode};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::Serial;
use stm32f4xx_hal::serial::config::Config as SerialConfig;
use stm32f4xx_hal::signature::Uid;
use stm32f4xx_hal::timer::{CapturePolarity, Flag, Timer};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

#[path = "table_region.rs"]
mod table_region;

/// The table, byte for byte at the start of its flash sector; empty if the build found none.
#[unsafe(link_section = ".holdfast_table")]
#[used]
static TABLE: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/table.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/table.bin"));

/// Crystal of the board \[MHz\].
const CRYSTAL_MHZ: u32 = 25;
/// Tolerance of the crystal \[ppm\].
const CRYSTAL_PPM: u16 = 20;
/// Core and timer clock \[MHz\].
const CORE_MHZ: u32 = 84;
/// Timers of the crossings and of the clock \[Hz\]; divides the timer clock.
const TIMER_HZ: u32 = 1_000_000;
/// Mains cycles a frequency is averaged over: 100 ms.
const CYCLES: u8 = 5;
/// What socket and cable bear \[mA\].
const CABLE_MA: u32 = 32_000;
/// Longest time without a completed tick \[ms\].
const WATCHDOG_MS: u32 = 400;

const _: () = assert!((CORE_MHZ * 1_000_000).is_multiple_of(TIMER_HZ));

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

    let timer = Timer::new(peripherals.TIM5, &mut rcc);
    let (crossings, (channel, ..)) = timer.capture_hz(TIMER_HZ.Hz());
    let mut crossing = channel.with(port_a.pa0);
    crossing.set_polarity(CapturePolarity::ActiveHigh);
    crossing.enable();

    let timer = Timer::new(peripherals.TIM1, &mut rcc);
    let (_, (channel, ..)) = timer.pwm_hz(firmware::dispatch::pilot::PILOT_HZ.Hz());
    let mut pilot = channel.with(port_a.pa8);
    // No charging until the first tick has decided.
    pilot.set_duty(pilot.get_max_duty());
    pilot.enable();
    let contactor = port_b.pb0.into_push_pull_output();

    let baud = SerialConfig::default().baudrate(115_200.bps());
    let line = Serial::tx(peripherals.USART2, port_a.pa2, baud, &mut rcc);

    let mut timer = peripherals.TIM2.counter_us(&mut rcc);
    let started = timer.start(u32::MAX.micros());
    let window = ZeroCrossing::new(TIMER_HZ, CYCLES, CRYSTAL_PPM);
    let (Ok(mut line), Ok(()), Ok(source)) = (line, started, window) else {
        return;
    };

    let mut dog = IndependentWatchdog::new(peripherals.IWDG);
    dog.start(WATCHDOG_MS.millis());
    let dispatch = Unidirectional::new(
        pilot,
        contactor,
        ContactorTimes::DEFAULT,
        Threshold::of_serial(serial_number()),
        Limits::all(CABLE_MA),
    );
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
        if crossings.flags().contains(Flag::C1) {
            // Reading the capture register clears its flag.
            charger.source_mut().capture(crossing.get_capture(), now_ms);
        }
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
