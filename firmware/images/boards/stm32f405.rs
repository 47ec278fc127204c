//! The reference board: STM32F405RG with a 25 MHz crystal. Its pins, clocks and peripherals, and
//! nothing else; its memory is in `memory.x`.
//!
//! | pin | use | build |
//! |---|---|---|
//! | PA0 | zero crossings, rising (TIM5 channel 1) | unless `ade7953` |
//! | PA4 to PA7 | ADE7953: select, SCLK, MISO, MOSI (SPI1) | `ade7953` |
//! | PA8 | control pilot, 1 kHz (TIM1 channel 1) | unless `bidirectional` |
//! | PB0 | contactor, high closes | unless `bidirectional` |
//! | PA8 | signed power set-point, 1 kHz (TIM1 channel 1) | `bidirectional` |
//! | PA1 | the pilot's voltage: 1.65 V for 0 V, 3.15 V for 12 V (ADC1) | unless `bidirectional` |
//! | PA2 | telemetry and answers, 115 200 baud 8N1 (USART2) | always |
//! | PA3 | what is asked, the same line's other direction (USART2, DMA1 stream 5) | always |
//!
//! The timer captures a crossing in hardware. The watchdog bites after four ticks without a
//! completed one, and a panic ends in it too.

#[path = "stm32f405/clock.rs"]
mod clock;
#[path = "stm32f405/dog.rs"]
mod dog;
#[path = "stm32f405/ending.rs"]
mod ending;
#[path = "stm32f405/flash.rs"]
pub(crate) mod flash;
#[path = "stm32f405/line.rs"]
mod line;

use embedded_hal::spi::{ErrorType, MODE_3, Operation, SpiDevice};
use firmware::board::{Board, Hardware, Rest};
use firmware::charger::reference;
use firmware::dispatch::car::{CarSense, CarState};
use firmware::dispatch::pilot::PILOT_HZ;
use firmware::fault::{Faults, ResetCause};
use firmware::frequency::captures::Captures;
use firmware::retained::{self, Care, Ending};
use stm32f4xx_hal::gpio::{Output, PA0, PA1, PA4, PA5, PA6, PA7, PA8, PB0};
use stm32f4xx_hal::pac::{self, ADC_COMMON, ADC1, SPI1, TIM1, TIM2, TIM5};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::signature::Uid;
use stm32f4xx_hal::spi;
use stm32f4xx_hal::timer::capture::{CaptureChannel, CaptureHzManager};
use stm32f4xx_hal::timer::{CaptureFilter, CapturePolarity, CounterUs, Flag, PwmChannel, Timer};

/// Core and timer clock \[MHz\].
const CORE_MHZ: u32 = clock::CORE_MHZ;
/// Timer of the captures \[Hz\]: the whole timer clock, so that its tick is worth 6 µHz.
const CAPTURE_HZ: u32 = CORE_MHZ * 1_000_000;
// The products' tables are chosen for these captures.
const _: () = assert!(CAPTURE_HZ == reference::TIMER_HZ);
/// Conversions of the pilot: 68 cycles of 21 MHz each, so 1.04 ms, more than a period.
const PILOT_SAMPLES: u32 = 320;
/// Turns that a conversion is waited for; it takes 270 cycles of the core.
const CONVERSION_TURNS: u32 = 1_000;
/// Supply of the converter, 4096 of its counts \[mV\].
const SUPPLY_MV: i32 = 3_300;
/// Voltage on PA1 for 0 V on the pilot \[mV\].
const PILOT_ZERO_MV: i32 = 1_650;
/// Volts on the pilot for one on PA1.
const PILOT_GAIN: i32 = 8;
/// Clock of the SPI \[kHz\]: slow enough for pins at their lowest slew rate.
const SPI_KHZ: u32 = 1_000;
/// Time waited from chip select to the first edge, and from the last edge to release \[µs\].
const SETTLE_US: u32 = 2;

/// The board, started.
pub(crate) struct Started {
    /// What meter and drive are set up on.
    pub(crate) hardware: Pins,
    /// Time and telemetry.
    pub(crate) board: Lines,
    /// The watchdog, running.
    pub(crate) watchdog: dog::Dog,
    /// Why the controller started.
    pub(crate) cause: ResetCause,
    /// What is wrong with the board in this run.
    pub(crate) faults: Faults,
    /// What this start dares, after those before it.
    pub(crate) care: Care,
    /// Starts before this one since the supply came; wraps.
    pub(crate) starts: u8,
    /// A number of this chip, for its place in the fleet.
    pub(crate) serial: u32,
    /// Where settings and slots are kept.
    pub(crate) places: (flash::SettingsFlash, flash::SlotFlash),
}

/// Starts watchdog, clocks, time and telemetry. `None` if one of them does not start, or a second
/// time: then nothing is set up, every pin floats, and the watchdog restarts the board.
pub(crate) fn start() -> Option<Started> {
    let peripherals = pac::Peripherals::take()?;
    // Before the clock: a crystal that does not start must not hang the charger for ever.
    let watchdog = dog::start(peripherals.IWDG);
    let cause = reset_cause(&peripherals.RCC);
    let mut kept = ending::Backup::open(&peripherals.RCC, &peripherals.PWR);
    let last = retained::start(&mut kept, cause);
    let mut faults = Faults::NONE;
    if last.care() != Care::None {
        faults.insert(Faults::GUARDED);
    }
    if last.ending != Ending::Unnoted {
        faults.insert(Faults::STOPPED);
    }
    let mut rcc = clock::internal(peripherals.RCC);
    if clock::to_crystal(&rcc)? == clock::Oscillator::Internal {
        faults.insert(Faults::CLOCK);
    }
    let port_a = peripherals.GPIOA.split(&mut rcc);
    let port_b = peripherals.GPIOB.split(&mut rcc);
    let pins = (port_a.pa2, port_a.pa3);
    let line = line::Line::start(peripherals.USART2, pins, peripherals.DMA1, &mut rcc)?;
    let mut timer = peripherals.TIM2.counter_us(&mut rcc);
    timer.start(u32::MAX.micros()).ok()?;
    let spi = (
        peripherals.SPI1,
        port_a.pa4,
        port_a.pa5,
        port_a.pa6,
        port_a.pa7,
    );
    Some(Started {
        hardware: Pins {
            rcc,
            spi: Some(spi),
            capture: Some((peripherals.TIM5, port_a.pa0)),
            pwm: Some((peripherals.TIM1, port_a.pa8)),
            coil: Some(port_b.pb0),
            car: Some((peripherals.ADC1, peripherals.ADC_COMMON, port_a.pa1)),
        },
        board: Lines { timer, line },
        watchdog: watchdog.of_run(kept),
        cause,
        faults,
        care: last.care(),
        starts: last.starts,
        serial: serial_number(),
        places: flash::places(peripherals.FLASH),
    })
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

fn serial_number() -> u32 {
    let uid = Uid::get();
    let lot = uid.lot_num().bytes().fold(0u32, |number, byte| {
        number.wrapping_mul(31).wrapping_add(u32::from(byte))
    });
    let die = (u32::from(uid.x()) << 16) ^ u32::from(uid.y());
    lot.wrapping_mul(0x0100_0193) ^ die ^ (u32::from(uid.waf_num()) << 8)
}

/// Time (TIM2) and telemetry (USART2).
pub(crate) struct Lines {
    timer: CounterUs<TIM2>,
    line: line::Line,
}

impl Board for Lines {
    fn now_us(&mut self) -> u32 {
        self.timer.now().ticks()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.line.send(byte)
    }

    fn receive(&mut self) -> Option<u8> {
        self.line.receive()
    }
}

/// Pins and peripherals that are not set up yet.
pub(crate) struct Pins {
    rcc: Rcc,
    spi: Option<(SPI1, PA4, PA5, PA6, PA7)>,
    capture: Option<(TIM5, PA0)>,
    pwm: Option<(TIM1, PA8)>,
    coil: Option<PB0>,
    car: Option<(ADC1, ADC_COMMON, PA1)>,
}

impl Hardware for Pins {
    type Spi = Chip;
    type Captures = Crossings;
    type Pwm = PwmChannel<TIM1, 0>;
    type Coil = PB0<Output>;
    type Car = Pilot;

    fn spi(&mut self) -> Option<Chip> {
        let (bus, select, clock, data_in, data_out) = self.spi.take()?;
        let mut select = select.into_push_pull_output();
        select.set_high();
        let pins = (Some(clock), Some(data_in), Some(data_out));
        let bus = bus.spi(pins, MODE_3, SPI_KHZ.kHz(), &mut self.rcc);
        Some(Chip { bus, select })
    }

    fn captures(&mut self) -> Option<Crossings> {
        let (timer, pin) = self.capture.take()?;
        let timer = Timer::new(timer, &mut self.rcc);
        let (timer, (channel, ..)) = timer.capture_hz(CAPTURE_HZ.Hz());
        let mut channel = channel.with(pin);
        channel.set_polarity(CapturePolarity::ActiveHigh);
        // Eight samples alike at 21 MHz: spikes of up to 0.33 µs pass by, and an edge moves by 48
        // ns.
        channel.set_filter(CaptureFilter::FdtsDiv4N8);
        channel.enable();
        Some(Crossings { timer, channel })
    }

    fn pwm(&mut self, rest: Rest) -> Option<PwmChannel<TIM1, 0>> {
        let (timer, line) = self.pwm.take()?;
        let (_, (channel, ..)) = Timer::new(timer, &mut self.rcc).pwm_hz(PILOT_HZ.Hz());
        let mut pwm = channel.with(line);
        pwm.set_duty(match rest {
            Rest::Low => 0,
            Rest::High => pwm.get_max_duty(),
        });
        pwm.enable();
        Some(pwm)
    }

    fn coil(&mut self) -> Option<PB0<Output>> {
        Some(self.coil.take()?.into_push_pull_output())
    }

    fn car(&mut self) -> Option<Pilot> {
        let (adc, common, pin) = self.car.take()?;
        let _analog = pin.into_analog();
        self.rcc.apb2enr().modify(|_, w| w.adc1en().set_bit());
        // SAFETY: documented values of these registers: a quarter of the bus clock, channel 1
        // sampled for 56 cycles, and one conversion, of channel 1.
        unsafe {
            common.ccr().write(|w| w.bits(1 << 16));
            adc.smpr2().write(|w| w.bits(3 << 3));
            adc.sqr3().write(|w| w.bits(1));
        }
        adc.cr2().write(|w| w.adon().set_bit());
        Some(Pilot { adc })
    }
}

/// The pilot's voltage on PA1. The registers are used directly: the HAL's driver divides by what it
/// measures.
pub(crate) struct Pilot {
    adc: ADC1,
}

impl Pilot {
    /// One conversion; `None` if it does not end in time.
    fn convert(&self) -> Option<u16> {
        self.adc.cr2().modify(|_, w| w.swstart().set_bit());
        (0..CONVERSION_TURNS)
            .any(|_| self.adc.sr().read().eoc().bit_is_set())
            .then(|| self.adc.dr().read().data().bits())
    }
}

impl CarSense for Pilot {
    fn state(&mut self) -> Option<CarState> {
        // The highest of a whole period of the pilot is its upper level.
        let mut highest = 0;
        for _ in 0..PILOT_SAMPLES {
            highest = highest.max(self.convert()?);
        }
        let pin_mv = (i32::from(highest) * SUPPLY_MV) >> 12;
        Some(CarState::of_level((pin_mv - PILOT_ZERO_MV) * PILOT_GAIN))
    }
}

/// Flag of TIM5's status register: a capture of channel 1 was overwritten.
const CC1OF: u32 = 1 << 9;

/// Rising edges on PA0, captured by TIM5 in hardware.
pub(crate) struct Crossings {
    timer: CaptureHzManager<TIM5>,
    channel: CaptureChannel<TIM5, 0>,
}

impl Captures for Crossings {
    const TIMER_HZ: u32 = CAPTURE_HZ;
    const CLOCK_PPM: u16 = reference::CLOCK_PPM;
    const JITTER_NS: u32 = reference::JITTER_NS;

    fn lost(&mut self) -> bool {
        // SAFETY: reads a status register, and clears one flag by writing 0 to it and 1, which
        // changes nothing, to all others. Nothing else writes this register while the loop runs.
        let status = unsafe { (*TIM5::ptr()).sr() };
        let lost = status.read().cc1of().bit();
        if lost {
            status.write(|w| unsafe { w.bits(!CC1OF) });
        }
        lost
    }

    fn take(&mut self) -> Option<u32> {
        // Reading the capture register clears its flag.
        let captured = self.timer.flags().contains(Flag::C1);
        captured.then(|| self.channel.get_capture())
    }
}

/// A chip alone on SPI1: a frame is what is transferred while it is selected.
pub(crate) struct Chip {
    bus: spi::Spi<SPI1>,
    select: PA4<Output>,
}

impl ErrorType for Chip {
    type Error = spi::Error;
}

impl Chip {
    fn transfer(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        for operation in operations {
            match operation {
                Operation::Read(words) => self.bus.read(words)?,
                Operation::Write(words) => self.bus.write(words)?,
                Operation::Transfer(read, write) => self.bus.transfer(read, write)?,
                Operation::TransferInPlace(words) => self.bus.transfer_in_place(words)?,
                Operation::DelayNs(ns) => wait_us(ns.div_ceil(1000)),
            }
        }
        self.bus.flush()
    }
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        self.select.set_low();
        wait_us(SETTLE_US);
        let done = self.transfer(operations);
        wait_us(SETTLE_US);
        self.select.set_high();
        done
    }
}

fn wait_us(us: u32) {
    cortex_m::asm::delay(us.saturating_mul(CORE_MHZ));
}
