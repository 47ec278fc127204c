//! This charger's place in the fleet.
//!
//! Currents below 6 A cannot be offered, so a charger that should draw less either draws 6 A or
//! pauses. If each charger has its own threshold θ in [0, 1) and draws 6 A exactly when `θ < wanted
//! / 6 A`, and the thresholds are spread evenly, the fleet's mean is what was wanted, without any
//! communication.

use crate::units::MICRO;

/// A serial number's place in the fleet, in units of 2^-32: multiples of the golden ratio modulo 1.
/// Any run of N consecutive numbers is spread so evenly that its share below any level is within
/// about `log N / N` of that level.
pub(crate) const fn spread(serial: u32) -> u32 {
    // 2^32 / golden ratio, odd.
    serial.wrapping_mul(0x9E37_79B9)
}

/// A charger's threshold in [0, 1), in parts per million.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Threshold(u32);

impl Threshold {
    /// The threshold of a serial number; consecutive ones are spread evenly.
    pub const fn of_serial(serial: u32) -> Self {
        Self(((spread(serial) as u64 * MICRO as u64) >> 32) as u32)
    }

    /// A threshold in ppm; 1 000 000 and more become the highest.
    pub const fn from_ppm(ppm: u32) -> Self {
        Self(if ppm < MICRO as u32 {
            ppm
        } else {
            MICRO as u32 - 1
        })
    }

    /// Whether this charger is among the share `part / whole` of the fleet.
    pub const fn is_within(self, part: u32, whole: u32) -> bool {
        (self.0 as u64) * (whole as u64) < part as u64 * MICRO as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_serial_numbers_share_evenly() {
        let chargers = 25_000u32;
        for part in [0, 1, 100, 1500, 3000, 4500, 5999, 6000] {
            let within = (0..chargers)
                .filter(|n| Threshold::of_serial(17_000 + n).is_within(part, 6000))
                .count() as f64;
            let wanted = f64::from(chargers) * f64::from(part) / 6000.0;
            // Discrepancy of the golden-ratio sequence: N D < 1 + 0.7 log2 N, hence below 12 for N
            // = 25 000.
            assert!((within - wanted).abs() < 12.0, "{part}: {within} {wanted}");
        }
    }

    #[test]
    fn none_and_all_are_exact() {
        for threshold in [Threshold::from_ppm(0), Threshold::from_ppm(u32::MAX)] {
            assert!(!threshold.is_within(0, 6000));
            assert!(threshold.is_within(6000, 6000));
        }
    }
}
