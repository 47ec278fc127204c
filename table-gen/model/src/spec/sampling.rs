//! Inputs, clocks and the method of the abstraction.

use serde::{Deserialize, Serialize};

/// The finite set of inputs: participations u in {0, step, ..., 1}.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InputSpec {
    /// Distance between participations; must divide 1, with at most 32 levels (the allowed inputs
    /// of a cell are a mask of 32 bits). The paper's "Symbolic Control for the Grid".
    ///
    /// Unit: 1. Allowed: a number from 0.001 to 1. Default: 0.05.
    pub step: f64,
}

impl Default for InputSpec {
    fn default() -> Self {
        Self { step: 0.05 }
    }
}

impl InputSpec {
    /// Number of input levels, both ends counted: 21 for a step of 0.05.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.intervals().saturating_add(1)
    }

    /// Participation of a level, in [0, 1]: level / (levels - 1), so that the ends are exact;
    /// levels past the last give 1.
    #[must_use]
    pub fn value(&self, level: usize) -> f64 {
        let intervals = self.intervals();
        level.min(intervals) as f64 / intervals as f64
    }

    fn intervals(&self) -> usize {
        ((1.0 / self.step).round() as usize).max(1)
    }
}

/// The clocks of the closed loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingSpec {
    /// Sampling time tau: in C1, C2 and Hold a decision is made and held for this long. Not printed
    /// in the paper; 1.5 is where its bidirectional loop settles. A whole number of `watch_s`.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 3600. Default: 1.5.
    pub period_s: f64,
    /// Watch tick: in No control and Fixed the phase is examined this often, and tau's clock starts
    /// at the switch. A whole number of milliseconds, at most 65535 to the period. At most half of
    /// the time after which a charger's watchdog bites.
    ///
    /// Unit: s. Allowed: a number from 0.001 to 0.2. Default: 0.1.
    pub watch_s: f64,
}

impl Default for SamplingSpec {
    fn default() -> Self {
        Self {
            period_s: 1.5,
            watch_s: 0.1,
        }
    }
}

impl SamplingSpec {
    /// Watch ticks in one period: 15 for the defaults.
    #[must_use]
    pub fn ticks_per_period(&self) -> u32 {
        self.period_ms() / self.watch_ms().max(1)
    }

    /// Watch ticks in a time \[s\], to the nearest millisecond and down.
    #[must_use]
    pub fn ticks_of(&self, time_s: f64) -> u32 {
        to_ms(time_s) / self.watch_ms().max(1)
    }

    /// The period in milliseconds.
    #[must_use]
    pub fn period_ms(&self) -> u32 {
        to_ms(self.period_s)
    }

    /// The watch tick in milliseconds.
    #[must_use]
    pub fn watch_ms(&self) -> u32 {
        to_ms(self.watch_s)
    }
}

/// `time_s` in milliseconds, to the nearest; saturating.
pub(super) fn to_ms(time_s: f64) -> u32 {
    (time_s * 1e3).round() as u32
}

/// `time_s` in milliseconds where it is a whole number of them.
///
/// The tolerance, a picosecond, covers decimal noise up to an hour: 3.6e6 ms, where a rounding errs
/// by 2.4e-10 ms.
pub(super) fn to_whole_ms(time_s: f64) -> Option<u32> {
    const TOLERANCE_MS: f64 = 1e-9;
    let scaled = time_s * 1e3;
    ((scaled - scaled.round()).abs() <= TOLERANCE_MS).then(|| to_ms(time_s))
}

/// How the radius of a successor box is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Successor {
    /// exp(L tau) r with L the Metzler matrix of A: SCOTS' growth bound.
    GrowthBound,
    /// |exp(A tau)| r: exact for a linear plant, never larger.
    ExactLinear,
}

impl Successor {
    /// All values as the spec writes them.
    pub(super) const NAMES: &'static [&'static str] = &["growth-bound", "exact-linear"];

    /// The value as the spec writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::GrowthBound => "growth-bound",
            Self::ExactLinear => "exact-linear",
        }
    }
}

/// How the abstraction is computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MethodSpec {
    /// How the radius of a successor box is bounded.
    ///
    /// Unit: -. Allowed: "growth-bound" or "exact-linear". Default: "growth-bound".
    pub successor: Successor,
    /// Whether the games themselves keep f above containment, and in I2 under Hold, between the
    /// samples too: inputs whose reach tube over a period leaves the band are not allowed. The
    /// literature's games bound the samples alone.
    ///
    /// Unit: -. Allowed: true or false. Default: false.
    pub between_samples: bool,
}

impl Default for MethodSpec {
    fn default() -> Self {
        Self {
            successor: Successor::GrowthBound,
            between_samples: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_run_from_nothing_to_everything() {
        let input = InputSpec::default();
        assert_eq!(input.levels(), 21);
        assert_eq!(input.value(0), 0.0);
        assert_eq!(input.value(1), 0.05);
        assert_eq!(input.value(20), 1.0);
        assert_eq!(input.value(99), 1.0);
        assert_eq!(InputSpec { step: 1.0 / 31.0 }.levels(), 32);
        assert_eq!(InputSpec { step: 1.0 }.levels(), 2);
    }

    #[test]
    fn ticks_are_counted_in_whole_milliseconds() {
        assert_eq!(SamplingSpec::default().ticks_per_period(), 15);
        // 0.3 / 0.1 is 2.9999999999999996 in f64: counting milliseconds does not lose the tick.
        assert_eq!(
            SamplingSpec {
                period_s: 0.3,
                watch_s: 0.1
            }
            .ticks_per_period(),
            3
        );
        assert_eq!(
            SamplingSpec {
                period_s: 1.0,
                watch_s: 0.0
            }
            .ticks_per_period(),
            1000
        );
    }

    #[test]
    fn a_part_of_a_millisecond_is_seen() {
        assert_eq!(to_whole_ms(3599.999), Some(3_599_999));
        assert_eq!(to_whole_ms(0.000_5), None);
        assert_eq!(to_whole_ms(1.500_000_1), None);
    }
}
