//! The meter: what measures the frequency that the device goes by.

use serde::{Deserialize, Serialize};

/// Mains cycles a second, for the window of a meter.
const CYCLES_PER_S: u32 = 50;

/// Kinds of meters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeterKind {
    /// The state is known within `uncertainty.measurement`, at once.
    Ideal,
    /// A timer captures the zero crossings of the mains.
    ZeroCrossing,
    /// An ADE7953 metering chip.
    Ade7953,
}

impl MeterKind {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["ideal", "zero-crossing", "ade7953"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::ZeroCrossing => "zero-crossing",
            Self::Ade7953 => "ade7953",
        }
    }
}

/// The meter of a charger. What follows from it is compared with `uncertainty.measurement`, and
/// with the charger's own meter when it starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeterSpec {
    /// What measures the frequency.
    ///
    /// Unit: -. Allowed: "ideal" or "zero-crossing" or "ade7953". Default: "ideal".
    pub kind: MeterKind,
    /// Largest error of the time of a zero crossing.
    ///
    /// Unit: µs. Allowed: a number from 0 to 1000. Default: 0.
    pub jitter_us: f64,
    /// Error of the meter's clock, temperature and ageing included.
    ///
    /// Unit: ppm. Allowed: a number from 0 to 1000. Default: 0.
    pub clock_ppm: f64,
    /// Step between two readings.
    ///
    /// Unit: Hz. Allowed: a number from 0 to 1. Default: 0.
    pub resolution_hz: f64,
    /// Mains cycles over which a reading is averaged.
    ///
    /// Unit: 1. Allowed: a whole number from 1 to 50. Default: 1.
    pub window_cycles: u32,
    /// Longest age of a reading when a decision goes by it, its window apart.
    ///
    /// Unit: ms. Allowed: a number from 0 to 1000. Default: 0.
    pub latest_age_ms: f64,
    /// Largest constant error of a reading, the clock's apart.
    ///
    /// Unit: Hz. Allowed: a number from 0 to 0.1. Default: 0.
    pub bias_hz: f64,
}

impl Default for MeterSpec {
    fn default() -> Self {
        Self {
            kind: MeterKind::Ideal,
            jitter_us: 0.0,
            clock_ppm: 0.0,
            resolution_hz: 0.0,
            window_cycles: 1,
            latest_age_ms: 0.0,
            bias_hz: 0.0,
        }
    }
}

impl MeterSpec {
    /// Delay of a reading behind the frequency, for a ramp, least and most \[ms\]: half the window,
    /// and the reading's age. None for an ideal meter.
    #[must_use]
    pub fn lag_ms(&self) -> [f64; 2] {
        if self.kind == MeterKind::Ideal {
            return [0.0, 0.0];
        }
        let half_ms = f64::from(self.window_cycles) * 500.0 / f64::from(CYCLES_PER_S);
        [half_ms, half_ms + self.latest_age_ms]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_meter_lags_by_half_its_window_and_its_age() {
        let meter = MeterSpec {
            kind: MeterKind::ZeroCrossing,
            window_cycles: 5,
            latest_age_ms: 20.0,
            ..MeterSpec::default()
        };
        assert_eq!(meter.lag_ms(), [50.0, 70.0]);
        assert_eq!(MeterSpec::default().lag_ms(), [0.0, 0.0]);
    }
}
