//! Frequency from an ADE7953 metering chip on SPI1: PA4 chip select, PA5 SCLK, PA6 MISO, PA7 MOSI,
//! mode 3.

use embedded_hal::spi::{ErrorType, MODE_3, Operation, SpiDevice};
use firmware::frequency::ade7953::{Ade7953, Spi};
use stm32f4xx_hal::gpio::{Output, PA4, PA5, PA6, PA7};
use stm32f4xx_hal::pac::SPI1;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::spi;

use super::CORE_MHZ;

/// Clock of the bus \[kHz\]: the chip takes up to 5 MHz; slow enough for pins at their lowest slew
/// rate.
const BUS_KHZ: u32 = 1_000;
/// Longest time from chip select to the first edge, and from the last edge to release, that is
/// waited \[µs\].
const SETTLE_US: u32 = 2;

/// The chip on its bus, alone: a frame is what is transferred while it is selected.
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

/// Nothing: the chip is read when a tick asks.
pub(crate) struct Feed;

/// The source and what feeds it.
pub(crate) fn new(
    (bus, select, clock, data_in, data_out): (SPI1, PA4, PA5, PA6, PA7),
    rcc: &mut Rcc,
) -> Option<(Ade7953<Spi<Chip>>, Feed)> {
    let mut select = select.into_push_pull_output();
    select.set_high();
    let pins = (Some(clock), Some(data_in), Some(data_out));
    let bus = bus.spi(pins, MODE_3, BUS_KHZ.kHz(), rcc);
    Some((Ade7953::new(Spi(Chip { bus, select })), Feed))
}

impl Feed {
    /// Nothing to do between the ticks.
    pub(crate) const fn poll(&mut self, _source: &mut Ade7953<Spi<Chip>>, _now_ms: u32) {}
}
