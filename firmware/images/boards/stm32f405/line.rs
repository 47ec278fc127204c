//! The telemetry line, both ways: USART2, whose received bytes DMA writes to memory.
//!
//! DMA needs no processor, so no byte is lost while a tick measures the pilot, a signature is
//! verified or a sector of flash is erased, as long as no more come meanwhile than the ring holds:
//! 512 bytes, 44 ms of a line that never rests. An asker waits for its answer, so at most one frame
//! of 246 bytes is under way. Bytes beyond that are overwritten, and a frame that lost some fails
//! its checksum.

use core::sync::atomic::{AtomicU8, Ordering};

use embedded_hal_nb::serial::Write as _;
use stm32f4xx_hal::gpio::{PA2, PA3, Pull};
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Enable, Rcc};
use stm32f4xx_hal::serial::config::{Config, DmaConfig};
use stm32f4xx_hal::serial::{Serial, Tx};

/// Telemetry \[baud\].
const BAUD: u32 = 115_200;
/// Bytes of the ring.
const RING_LEN: usize = 512;
/// Stream of DMA1 that serves USART2's receiver, on channel 4.
const STREAM: usize = 5;
/// Channel 4, to memory by bytes, one place after the other, round and round.
const SETTING: u32 = 4 << 25 | 1 << 10 | 1 << 8;
const ENABLE: u32 = 1;

/// What came. DMA writes it, the loop reads it.
static RING: [AtomicU8; RING_LEN] = [const { AtomicU8::new(0) }; RING_LEN];

/// The line.
pub(super) struct Line {
    transmitter: Tx<USART2>,
    dma: DMA1,
    /// Place of the next byte to be read.
    next: usize,
}

impl Line {
    /// Sets the line up.
    pub(super) fn start(
        usart: USART2,
        (sends, receives): (PA2, PA3),
        dma: DMA1,
        rcc: &mut Rcc,
    ) -> Option<Self> {
        let mut receives = receives;
        // A line that nobody drives is at rest.
        receives.set_internal_resistor(Pull::Up);
        let config = Config::default().baudrate(BAUD.bps()).dma(DmaConfig::Rx);
        let serial = Serial::new(usart, (sends, receives), config, rcc).ok()?;
        // DMA reads for the receiver.
        let (transmitter, _receiver) = serial.split();
        let from = receiver_register();
        DMA1::enable(rcc);
        let stream = dma.st(STREAM);
        // SAFETY: documented values of these registers: from the receiver's data register to the
        // ring, which is a variable of the whole program, and whose bytes may change at any moment.
        unsafe {
            stream.par().write(|w| w.bits(from));
            let ring = (&raw const RING).expose_provenance();
            stream.m0ar().write(|w| w.bits(ring as u32));
            stream.ndtr().write(|w| w.bits(RING_LEN as u32));
            stream.cr().write(|w| w.bits(SETTING));
            stream.cr().write(|w| w.bits(SETTING | ENABLE));
        }
        Some(Self {
            transmitter,
            dma,
            next: 0,
        })
    }

    /// Gives a byte to the line; `false` if it does not take one now.
    pub(super) fn send(&mut self, byte: u8) -> bool {
        self.transmitter.write(byte).is_ok()
    }

    /// The next byte that came.
    pub(super) fn receive(&mut self) -> Option<u8> {
        let left = self.dma.st(STREAM).ndtr().read().bits() as usize;
        // Places are filled from the first on, and the count goes down from the ring's length.
        let filled = RING_LEN.saturating_sub(left) % RING_LEN;
        if self.next == filled {
            return None;
        }
        let byte = RING.get(self.next)?.load(Ordering::Relaxed);
        self.next = (self.next + 1) % RING_LEN;
        Some(byte)
    }
}

/// Address of the receiver's data register.
fn receiver_register() -> u32 {
    // SAFETY: an address is taken, nothing is read.
    unsafe { (*USART2::ptr()).dr().as_ptr().expose_provenance() as u32 }
}
