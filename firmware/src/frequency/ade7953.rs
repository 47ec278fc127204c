//! Frequency from an ADE7953 metering chip over SPI or I2C.
//!
//! ## Registers
//! | register | address | bits | use |
//! |---|---|---:|---|
//! | PERIOD | 0x10E | 16 | `f = 223750 Hz / (PERIOD + 1)` |
//! | unlock | 0x0FE | 8 | 0xAD before the next one may be written |
//! | required setting | 0x120 | 16 | 0x0030: the data sheet's figures hold only with it |
//! | last data | 0x1FF | 16 | what the chip sent or took in the last transfer of 16 bits |
//!
//! ## Bytes on the bus
//! Addresses and data are most significant byte first. Over SPI (mode 3, one chip select for the
//! whole frame) a frame is address (2), 0x80 for a read or 0x00 for a write (1), data. Over I2C the
//! device is 0x38: a read writes the address and reads the data after a repeated start, a write
//! carries address and data.
//!
//! After every reading of PERIOD the last data are read too. They are what the chip sent; if they
//! differ from what arrived, a bit was lost on the bus, and there is no reading.
//!
//! ## Steps of the phase
//! PERIOD is one period of the mains. When the phase steps by 2 degrees, one of them is wrong by
//! 0.28 Hz. So the chip is read once a period between the ticks, and the reading is the median of
//! the last five: a step is in one of them. It lags by two periods more.
//!
//! ## Tradeoffs
//! One step of PERIOD is 11.2 mHz at 50 Hz: enough for the droop, coarse for a table whose spec
//! allows 2 mHz of measurement error. Prefer [`super::zero_crossing`] on the chip's ZX output where
//! a timer is free.

use core::num::NonZeroU16;

use embedded_hal::i2c::I2c;
use embedded_hal::spi::{Operation, SpiDevice};

use super::{FrequencyError, FrequencySource, NOMINAL_HZ, Reading};
use crate::board::Hardware;
use crate::units::MICRO;
use crate::wide::divide;

/// Address of PERIOD.
pub const PERIOD: u16 = 0x10E;
/// Address of the register that unlocks [`REQUIRED`] for one write.
pub const UNLOCK: u16 = 0x0FE;
/// Address of the setting that the data sheet requires after power-up.
pub const REQUIRED: u16 = 0x120;
/// Address of what was transferred last, 16 bits.
pub const LAST_DATA: u16 = 0x1FF;
/// What unlocks.
pub const UNLOCK_VALUE: u8 = 0xAD;
/// What is required.
pub const REQUIRED_VALUE: u16 = 0x0030;
/// Address on the I2C bus.
pub const I2C_ADDRESS: u8 = 0x38;
/// Clock of the period counter \[Hz\].
pub const PERIOD_CLOCK_HZ: u32 = 223_750;
/// Counts in a nominal period, `PERIOD + 1`.
const NOMINAL_COUNTS: u32 = PERIOD_CLOCK_HZ / NOMINAL_HZ;
/// Error of the chip's crystal, temperature and ageing included \[ppm\].
pub const CLOCK_PPM: u32 = 30;
/// Bound on a reading's error \[µHz\]: one count of 4475 at 50 Hz, rounded up, and the crystal.
pub const ERROR_UHZ: u32 = NOMINAL_HZ * MICRO as u32 / NOMINAL_COUNTS + 1 + NOMINAL_HZ * CLOCK_PPM;
/// Readings in a row that may be equal \[ticks\]. On 9 August 2019 PERIOD would have stood still
/// for 18 s at most.
const STUCK_TICKS: u16 = 600;

/// Periods whose median is the reading.
const SAMPLES: usize = 5;
/// Time between two samples: a nominal period \[ms\].
const SAMPLE_MS: u32 = 1000 / NOMINAL_HZ;
/// Delay of a reading \[ms\]. PERIOD is the last whole mains period: half of it. The median of a
/// ramp is its middle.
pub const LAG_MS: u16 = (SAMPLE_MS / 2 + SAMPLE_MS * (SAMPLES as u32 / 2)) as u16;

const _: () = assert!(NOMINAL_COUNTS == 4475);

/// Access to the chip's registers. Errors carry nothing: the answer to each is the same, no reading
/// this tick.
pub trait Registers {
    /// Writes an 8-bit register.
    ///
    /// # Errors
    /// The bus failed.
    fn write_u8(&mut self, address: u16, value: u8) -> Result<(), BusError>;

    /// Writes a 16-bit register.
    ///
    /// # Errors
    /// The bus failed.
    fn write_u16(&mut self, address: u16, value: u16) -> Result<(), BusError>;

    /// Reads a 16-bit register.
    ///
    /// # Errors
    /// The bus failed.
    fn read_u16(&mut self, address: u16) -> Result<u16, BusError>;
}

/// The bus failed, or the chip does not hold what was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusError;

/// The chip on SPI; the device owns the chip select.
#[derive(Debug)]
pub struct Spi<D>(pub D);

impl<D: SpiDevice> Registers for Spi<D> {
    fn write_u8(&mut self, address: u16, value: u8) -> Result<(), BusError> {
        let [high, low] = address.to_be_bytes();
        self.0
            .write(&[high, low, 0x00, value])
            .map_err(|_| BusError)
    }

    fn write_u16(&mut self, address: u16, value: u16) -> Result<(), BusError> {
        let [high, low] = address.to_be_bytes();
        let [first, second] = value.to_be_bytes();
        self.0
            .write(&[high, low, 0x00, first, second])
            .map_err(|_| BusError)
    }

    fn read_u16(&mut self, address: u16) -> Result<u16, BusError> {
        let [high, low] = address.to_be_bytes();
        let mut data = [0; 2];
        self.0
            .transaction(&mut [
                Operation::Write(&[high, low, 0x80]),
                Operation::Read(&mut data),
            ])
            .map_err(|_| BusError)?;
        Ok(u16::from_be_bytes(data))
    }
}

/// The chip on I2C.
#[derive(Debug)]
pub struct TwoWire<B>(pub B);

impl<B: I2c> Registers for TwoWire<B> {
    fn write_u8(&mut self, address: u16, value: u8) -> Result<(), BusError> {
        let [high, low] = address.to_be_bytes();
        self.0
            .write(I2C_ADDRESS, &[high, low, value])
            .map_err(|_| BusError)
    }

    fn write_u16(&mut self, address: u16, value: u16) -> Result<(), BusError> {
        let [high, low] = address.to_be_bytes();
        let [first, second] = value.to_be_bytes();
        self.0
            .write(I2C_ADDRESS, &[high, low, first, second])
            .map_err(|_| BusError)
    }

    fn read_u16(&mut self, address: u16) -> Result<u16, BusError> {
        let mut data = [0; 2];
        self.0
            .write_read(I2C_ADDRESS, &address.to_be_bytes(), &mut data)
            .map_err(|_| BusError)?;
        Ok(u16::from_be_bytes(data))
    }
}

/// Deviation from nominal \[µHz\], rounded down, of a value of PERIOD.
///
/// # Errors
/// [`FrequencyError::NoSignal`] for 0 and 0xFFFF, which a chip without mains or a floating bus
/// gives.
pub const fn deviation_uhz(period: u16) -> Result<i32, FrequencyError> {
    if period == 0 || period == u16::MAX {
        return Err(FrequencyError::NoSignal);
    }
    let frequency = divide(PERIOD_CLOCK_HZ as u64 * MICRO as u64, period as u32 + 1);
    let deviation = frequency as i64 - NOMINAL_HZ as i64 * MICRO as i64;
    // PERIOD = 1 would be 111.9 kHz: past 32 bits of µHz, and out of any range.
    Ok(if deviation > i32::MAX as i64 {
        i32::MAX
    } else {
        deviation as i32
    })
}

/// The chip on a board's SPI; `None` if the board has none.
pub fn on<H: Hardware>(hardware: &mut H) -> Option<Ade7953<Spi<H::Spi>>> {
    Some(Ade7953::new(Spi(hardware.spi()?)))
}

/// The chip as a frequency source.
#[derive(Debug)]
pub struct Ade7953<R> {
    registers: R,
    configured: bool,
    /// Deviations \[µHz\] with their moment \[ms\], the oldest first.
    samples: heapless::Deque<(i32, u32), SAMPLES>,
}

impl<R: Registers> Ade7953<R> {
    /// A chip that is configured at the first reading.
    pub const fn new(registers: R) -> Self {
        Self {
            registers,
            configured: false,
            samples: heapless::Deque::new(),
        }
    }

    /// The bus, given back.
    pub fn release(self) -> R {
        self.registers
    }

    fn configure(&mut self) -> Result<(), BusError> {
        self.registers.write_u8(UNLOCK, UNLOCK_VALUE)?;
        self.registers.write_u16(REQUIRED, REQUIRED_VALUE)?;
        if self.registers.read_u16(REQUIRED)? == REQUIRED_VALUE {
            Ok(())
        } else {
            Err(BusError)
        }
    }

    fn period(&mut self) -> Result<u16, BusError> {
        if !self.configured {
            self.configure()?;
            self.configured = true;
        }
        let period = self.verified();
        // A chip that stopped answering may have lost its supply, and its setting with it.
        self.configured = period.is_ok();
        period
    }

    /// PERIOD, as the chip confirms that it was sent.
    fn verified(&mut self) -> Result<u16, BusError> {
        let period = self.registers.read_u16(PERIOD)?;
        if self.registers.read_u16(LAST_DATA)? == period {
            Ok(period)
        } else {
            Err(BusError)
        }
    }

    /// Takes a sample.
    fn sample(&mut self, now_ms: u32) -> Result<(), FrequencyError> {
        let period = self.period().map_err(|BusError| FrequencyError::Bus)?;
        let deviation = deviation_uhz(period);
        // A chip that was reset has no period yet, and has lost its setting.
        self.configured = deviation.is_ok();
        let deviation = deviation?;
        if self.samples.is_full() {
            let _oldest = self.samples.pop_front();
        }
        // There is room now.
        let _ = self.samples.push_back((deviation, now_ms));
        Ok(())
    }

    /// The age of the newest sample \[ms\]; none before the first.
    fn age_ms(&self, now_ms: u32) -> Option<u32> {
        let (_, at_ms) = self.samples.back()?;
        Some(now_ms.wrapping_sub(*at_ms))
    }

    /// The median of the samples of the last five periods \[µHz\]; the newest, if they are too few.
    fn median(&self, now_ms: u32) -> Option<i32> {
        let fresh = |at_ms: u32| now_ms.wrapping_sub(at_ms) < SAMPLES as u32 * SAMPLE_MS;
        let mut young = heapless::Vec::<i32, SAMPLES>::new();
        for (deviation, at_ms) in &self.samples {
            if fresh(*at_ms) {
                // As many as there are samples fit.
                let _ = young.push(*deviation);
            }
        }
        let half = young.len() / 2;
        if young.len() < 3 {
            return young.last().copied();
        }
        // By counting: sorting would compile a panic in. At most half of the samples lie below the
        // median, and with its equals more than half.
        let below = |value: i32| young.iter().filter(|other| **other < value).count();
        let up_to = |value: i32| young.iter().filter(|other| **other <= value).count();
        let mut candidates = young.iter().copied();
        candidates.find(|value| below(*value) <= half && up_to(*value) > half)
    }
}

impl<R: Registers> FrequencySource for Ade7953<R> {
    fn error_uhz(&self) -> u32 {
        ERROR_UHZ
    }

    fn lag_ms(&self) -> u16 {
        LAG_MS
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        NonZeroU16::new(STUCK_TICKS)
    }

    fn poll(&mut self, now_ms: u32) {
        if self.age_ms(now_ms).is_none_or(|age| age >= SAMPLE_MS) && self.sample(now_ms).is_err() {
            // The tick that reads next says what is wrong.
            self.samples.clear();
        }
    }

    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError> {
        if self.age_ms(now_ms).is_none_or(|age| age >= SAMPLE_MS)
            && let Err(error) = self.sample(now_ms)
        {
            self.samples.clear();
            return Err(error);
        }
        Ok(Reading {
            deviation_uhz: self.median(now_ms).ok_or(FrequencyError::NoSignal)?,
            age_ms: 0,
        })
    }
}

#[cfg(test)]
mod tests;
