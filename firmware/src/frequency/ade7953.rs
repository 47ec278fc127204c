//! Frequency from an ADE7953 metering chip over SPI or I2C.
//!
//! ## Registers
//! | register | address | bits | use |
//! |---|---|---:|---|
//! | PERIOD | 0x10E | 16 | `f = 223750 Hz / (PERIOD + 1)` |
//! | unlock | 0x0FE | 8 | 0xAD before the next one may be written |
//! | required setting | 0x120 | 16 | 0x0030: the data sheet's figures hold only with it |
//!
//! ## Bytes on the bus
//! Addresses and data are most significant byte first. Over SPI (mode 3, one chip select for the
//! whole frame) a frame is address (2), 0x80 for a read or 0x00 for a write (1), data. Over I2C the
//! device is 0x38: a read writes the address and reads the data after a repeated start, a write
//! carries address and data.
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
/// Readings in a row that may be equal \[ticks\]. On 9 August 2019 PERIOD would have stood still
/// for 18 s at most.
const STUCK_TICKS: u16 = 600;

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
}

impl<R: Registers> Ade7953<R> {
    /// A chip that is configured at the first reading.
    pub const fn new(registers: R) -> Self {
        Self {
            registers,
            configured: false,
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
        let period = self.registers.read_u16(PERIOD);
        // A chip that stopped answering may have lost its supply, and its setting with it.
        self.configured = period.is_ok();
        period
    }
}

impl<R: Registers> FrequencySource for Ade7953<R> {
    fn error_uhz(&self) -> u32 {
        // One count of 4475 at 50 Hz, rounded up.
        NOMINAL_HZ * MICRO as u32 / NOMINAL_COUNTS + 1
    }

    fn lag_ms(&self) -> u16 {
        // PERIOD is the last whole mains period.
        10
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        NonZeroU16::new(STUCK_TICKS)
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        let period = self.period().map_err(|BusError| FrequencyError::Bus)?;
        Ok(Reading {
            deviation_uhz: deviation_uhz(period)?,
            age_ms: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::i2c::{Mock as I2cMock, Transaction as I2cTransaction};
    use embedded_hal_mock::eh1::spi::{Mock as SpiMock, Transaction as SpiTransaction};
    use std::vec;

    #[test]
    fn spi_carries_these_bytes() {
        let mut mock = SpiMock::new(&[
            SpiTransaction::transaction_start(),
            SpiTransaction::write_vec(vec![0x00, 0xFE, 0x00, 0xAD]),
            SpiTransaction::transaction_end(),
            SpiTransaction::transaction_start(),
            SpiTransaction::write_vec(vec![0x01, 0x20, 0x00, 0x00, 0x30]),
            SpiTransaction::transaction_end(),
            SpiTransaction::transaction_start(),
            SpiTransaction::write_vec(vec![0x01, 0x20, 0x80]),
            SpiTransaction::read_vec(vec![0x00, 0x30]),
            SpiTransaction::transaction_end(),
            SpiTransaction::transaction_start(),
            SpiTransaction::write_vec(vec![0x01, 0x0E, 0x80]),
            SpiTransaction::read_vec(vec![0x11, 0x7A]),
            SpiTransaction::transaction_end(),
            SpiTransaction::transaction_start(),
            SpiTransaction::write_vec(vec![0x01, 0x0E, 0x80]),
            SpiTransaction::read_vec(vec![0xFF, 0xFF]),
            SpiTransaction::transaction_end(),
        ]);
        let mut chip = Ade7953::new(Spi(mock.clone()));
        let nominal = Reading {
            deviation_uhz: 0,
            age_ms: 0,
        };
        assert_eq!(chip.read(0), Ok(nominal));
        assert_eq!(chip.read(100), Err(FrequencyError::NoSignal));
        mock.done();
    }

    #[test]
    fn i2c_carries_these_bytes_and_configures_again_after_a_failure() {
        use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
        let configure = [
            I2cTransaction::write(0x38, vec![0x00, 0xFE, 0xAD]),
            I2cTransaction::write(0x38, vec![0x01, 0x20, 0x00, 0x30]),
            I2cTransaction::write_read(0x38, vec![0x01, 0x20], vec![0x00, 0x30]),
        ];
        let failed = I2cTransaction::write_read(0x38, vec![0x01, 0x0E], vec![0, 0])
            .with_error(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        let read = I2cTransaction::write_read(0x38, vec![0x01, 0x0E], vec![0x11, 0x7B]);
        let mut all = configure.to_vec();
        all.push(failed);
        all.extend(configure);
        all.push(read);
        let mut mock = I2cMock::new(&all);
        let mut chip = Ade7953::new(TwoWire(mock.clone()));
        assert_eq!(chip.read(0), Err(FrequencyError::Bus));
        // 223750/4476 - 50 = -11.1706 mHz.
        assert_eq!(chip.read(100).map(|r| r.deviation_uhz), Ok(-11_171));
        mock.done();
    }

    #[test]
    fn a_chip_that_does_not_keep_its_setting_is_a_bus_error() {
        let mut mock = I2cMock::new(&[
            I2cTransaction::write(0x38, vec![0x00, 0xFE, 0xAD]),
            I2cTransaction::write(0x38, vec![0x01, 0x20, 0x00, 0x30]),
            I2cTransaction::write_read(0x38, vec![0x01, 0x20], vec![0xFF, 0xFF]),
        ]);
        let mut chip = Ade7953::new(TwoWire(mock.clone()));
        assert_eq!(chip.read(0), Err(FrequencyError::Bus));
        mock.done();
    }

    #[test]
    fn every_register_value_decodes_within_one_count() {
        for period in 1..u16::MAX {
            let deviation = deviation_uhz(period).expect("only the ends have no signal");
            let exact = 223_750.0 / (f64::from(period) + 1.0) - 50.0;
            let exact = (exact * 1e6).min(f64::from(i32::MAX));
            // Rounded down to a µHz; f64 is exact to 1e-16 of 1e11.
            let below = exact - f64::from(deviation);
            assert!((-1e-3..1.0 + 1e-3).contains(&below), "{period}: {below}");
        }
    }
}
