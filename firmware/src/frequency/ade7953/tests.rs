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
        SpiTransaction::write_vec(vec![0x01, 0xFF, 0x80]),
        SpiTransaction::read_vec(vec![0x11, 0x7A]),
        SpiTransaction::transaction_end(),
        SpiTransaction::transaction_start(),
        SpiTransaction::write_vec(vec![0x01, 0x0E, 0x80]),
        SpiTransaction::read_vec(vec![0xFF, 0xFF]),
        SpiTransaction::transaction_end(),
        SpiTransaction::transaction_start(),
        SpiTransaction::write_vec(vec![0x01, 0xFF, 0x80]),
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
    all.push(I2cTransaction::write_read(
        0x38,
        vec![0x01, 0xFF],
        vec![0x11, 0x7B],
    ));
    let mut mock = I2cMock::new(&all);
    let mut chip = Ade7953::new(TwoWire(mock.clone()));
    assert_eq!(chip.read(0), Err(FrequencyError::Bus));
    // 223750/4476 - 50 = -11.1706 mHz.
    assert_eq!(chip.read(100).map(|r| r.deviation_uhz), Ok(-11_171));
    mock.done();
}

/// A chip whose registers the test sets; counts what was configured and read.
#[derive(Default)]
struct Fake {
    required: u16,
    period: u16,
    /// Bits that the bus turns over on the way from PERIOD.
    lost_bits: u16,
    configured: u32,
    sampled: u32,
}

impl Registers for &mut Fake {
    fn write_u8(&mut self, _: u16, _: u8) -> Result<(), BusError> {
        Ok(())
    }

    fn write_u16(&mut self, address: u16, value: u16) -> Result<(), BusError> {
        if address == REQUIRED {
            self.required = value;
            self.configured += 1;
        }
        Ok(())
    }

    fn read_u16(&mut self, address: u16) -> Result<u16, BusError> {
        match address {
            REQUIRED => Ok(self.required),
            PERIOD => {
                self.sampled += 1;
                Ok(self.period ^ self.lost_bits)
            }
            LAST_DATA => Ok(self.period),
            _ => Err(BusError),
        }
    }
}

/// 223 750 / 4497 = 49.756 Hz.
const LOW: u16 = 4496;

#[test]
fn a_bit_that_the_bus_loses_is_no_reading() {
    for bit in 0..16 {
        let mut fake = Fake {
            period: LOW,
            ..Fake::default()
        };
        let mut chip = Ade7953::new(&mut fake);
        assert!(chip.read(0).is_ok());
        chip.registers.lost_bits = 1 << bit;
        assert_eq!(chip.read(100), Err(FrequencyError::Bus), "bit {bit}");
        chip.registers.lost_bits = 0;
        assert!(chip.read(200).is_ok());
        // A chip that may have lost its supply is configured again.
        assert_eq!(fake.configured, 2);
    }
}

#[test]
fn a_chip_that_was_reset_is_configured_again() {
    let mut fake = Fake {
        period: LOW,
        ..Fake::default()
    };
    let mut chip = Ade7953::new(&mut fake);
    assert!(chip.read(0).is_ok());
    // Without its setting the chip counts nothing for a while: 0 is no period.
    (chip.registers.required, chip.registers.period) = (0, 0);
    assert_eq!(chip.read(100), Err(FrequencyError::NoSignal));
    chip.registers.period = LOW;
    assert!(chip.read(200).is_ok());
    assert_eq!((fake.configured, fake.required), (2, REQUIRED_VALUE));
}

#[test]
fn a_step_of_the_phase_in_one_period_is_no_frequency() {
    let low = deviation_uhz(LOW).expect("a period");
    // 2, 4 and 6 degrees of 20 ms are 112, 223 and 335 µs, 25, 50 and 75 counts.
    for counts in [-75i16, -50, -25, 25, 50, 75] {
        let mut fake = Fake {
            period: LOW,
            ..Fake::default()
        };
        let mut chip = Ade7953::new(&mut fake);
        for ms in 0..400 {
            let stepped = (200..220).contains(&ms);
            chip.registers.period = LOW.wrapping_add_signed(if stepped { counts } else { 0 });
            chip.poll(ms);
            if ms % 100 == 99 {
                let read = chip.read(ms).expect("a reading").deviation_uhz;
                assert_eq!(read, low, "{counts} counts, {ms} ms");
            }
        }
        // One sample every 20 ms, and none by the ticks.
        assert_eq!(fake.sampled, 20);
    }
}

proptest::proptest! {
    #[test]
    fn the_median_is_that_of_the_sorted_samples(periods in proptest::collection::vec(4_000u16..5_000, 1..12)) {
        let mut fake = Fake::default();
        let mut chip = Ade7953::new(&mut fake);
        let mut all = vec![];
        for (n, period) in (0u32..).zip(&periods) {
            chip.registers.period = *period;
            chip.poll(SAMPLE_MS * n);
            all.push(deviation_uhz(*period).expect("a period"));
        }
        let now_ms = SAMPLE_MS * (periods.len() as u32 - 1);
        let last = all.len().saturating_sub(SAMPLES);
        let mut kept = all.split_off(last);
        let newest = kept.last().copied();
        let few = kept.len() < 3;
        kept.sort_unstable();
        let median = if few { newest } else { kept.get(kept.len() / 2).copied() };
        proptest::prop_assert_eq!(chip.median(now_ms), median);
    }
}

#[test]
fn without_polls_the_reading_is_the_register() {
    let mut fake = Fake::default();
    let mut chip = Ade7953::new(&mut fake);
    for tick in 1..20u16 {
        chip.registers.period = LOW + tick;
        let read = chip
            .read(u32::from(tick) * 100)
            .map(|read| read.deviation_uhz);
        assert_eq!(read, deviation_uhz(LOW + tick));
    }
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
