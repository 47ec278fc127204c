//! Which readings are believed: range, age, change.
//!
//! The rate limit is against the last *accepted* reading and grows with the time since: a single
//! spike is rejected, and a true jump (an island that reconnects, say) is believed again once the
//! grid's inertia would have allowed it.

use crate::wide::divide;

use core::num::NonZeroU16;

use super::{FrequencyError, Reading};

/// What is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateLimits {
    /// Most deviation from nominal \[µHz\].
    pub range_uhz: u32,
    /// Most rate of change \[µHz/s\].
    pub rate_uhz_per_s: u32,
    /// Most age of a reading \[ms\].
    pub age_ms: u16,
}

impl GateLimits {
    /// 45 to 55 Hz; 2 Hz/s, eight times the initial slope of the paper's event (2 GW / 2H = 0.25
    /// Hz/s) and thirteen times the steepest second of 9 August 2019 (0.151 Hz/s); readings of the
    /// last 250 ms.
    pub const DEFAULT: Self = Self {
        range_uhz: 5_000_000,
        rate_uhz_per_s: 2_000_000,
        age_ms: 250,
    };
}

/// Judge of readings, one a tick.
#[derive(Debug, Clone)]
pub struct Gate {
    limits: GateLimits,
    tick_ms: u16,
    /// Bound on the source's own error; two readings may differ by twice that without a change of
    /// frequency.
    noise_uhz: u32,
    stuck_after: Option<NonZeroU16>,
    accepted: Option<i32>,
    /// Ticks since the accepted reading.
    ticks_since: u16,
    last_raw: Option<i32>,
    unchanged_ticks: u16,
}

impl Gate {
    /// A gate for a source with this error bound \[µHz\] and this limit on unchanged readings.
    pub const fn new(
        limits: GateLimits,
        tick_ms: u16,
        noise_uhz: u32,
        stuck_after: Option<NonZeroU16>,
    ) -> Self {
        Self {
            limits,
            tick_ms,
            noise_uhz,
            stuck_after,
            accepted: None,
            ticks_since: 0,
            last_raw: None,
            unchanged_ticks: 0,
        }
    }

    /// The last accepted deviation \[µHz\].
    pub const fn accepted(&self) -> Option<i32> {
        self.accepted
    }

    /// Judges this tick's reading; the accepted deviation \[µHz\] or why there is none.
    ///
    /// # Errors
    /// The source's own error, or the first of range, age, stuck and rate that the reading fails.
    pub fn admit(
        &mut self,
        reading: Result<Reading, FrequencyError>,
    ) -> Result<i32, FrequencyError> {
        self.ticks_since = self.ticks_since.saturating_add(1);
        let reading = reading?;
        let deviation_uhz = reading.deviation_uhz;
        if deviation_uhz.unsigned_abs() > self.limits.range_uhz {
            return Err(FrequencyError::OutOfRange { deviation_uhz });
        }
        if reading.age_ms > self.limits.age_ms {
            return Err(FrequencyError::Stale {
                age_ms: reading.age_ms,
            });
        }
        self.check_stuck(deviation_uhz)?;
        if let Some(last) = self.accepted {
            let jump_uhz = deviation_uhz.abs_diff(last);
            let allowed_uhz = self.allowed_uhz();
            if jump_uhz > allowed_uhz {
                return Err(FrequencyError::Implausible {
                    jump_uhz,
                    allowed_uhz,
                });
            }
        }
        self.accepted = Some(deviation_uhz);
        self.ticks_since = 0;
        Ok(deviation_uhz)
    }

    fn check_stuck(&mut self, deviation_uhz: i32) -> Result<(), FrequencyError> {
        if self.last_raw == Some(deviation_uhz) {
            self.unchanged_ticks = self.unchanged_ticks.saturating_add(1);
        } else {
            self.unchanged_ticks = 0;
        }
        self.last_raw = Some(deviation_uhz);
        match self.stuck_after {
            Some(limit) if self.unchanged_ticks >= limit.get() => Err(FrequencyError::Stuck {
                ticks: self.unchanged_ticks,
            }),
            _ => Ok(()),
        }
    }

    /// Largest change since the accepted reading that is possible \[µHz\].
    fn allowed_uhz(&self) -> u32 {
        let elapsed_ms = u32::from(self.ticks_since).saturating_mul(u32::from(self.tick_ms));
        let rate = self.limits.rate_uhz_per_s;
        let ramp = divide(u64::from(rate) * u64::from(elapsed_ms), 1000);
        ramp.saturating_add(self.noise_uhz.saturating_mul(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn gate() -> Gate {
        Gate::new(GateLimits::DEFAULT, 100, 1000, NonZeroU16::new(5))
    }

    fn fresh(deviation_uhz: i32) -> Result<Reading, FrequencyError> {
        Ok(Reading {
            deviation_uhz,
            age_ms: 0,
        })
    }

    #[test]
    fn rejects_what_is_out_of_range_or_old() {
        let mut gate = gate();
        assert_eq!(gate.admit(fresh(5_000_000)), Ok(5_000_000));
        let out = FrequencyError::OutOfRange {
            deviation_uhz: -5_000_001,
        };
        assert_eq!(gate.admit(fresh(-5_000_001)), Err(out));
        let old = Reading {
            deviation_uhz: 5_000_000,
            age_ms: 251,
        };
        assert_eq!(
            gate.admit(Ok(old)),
            Err(FrequencyError::Stale { age_ms: 251 })
        );
    }

    #[test]
    fn rejects_a_spike_and_believes_a_lasting_jump_in_time() {
        let mut gate = gate();
        assert_eq!(gate.admit(fresh(0)), Ok(0));
        // One tick allows 2 Hz/s * 0.1 s + 2 * 1 mHz.
        assert_eq!(gate.admit(fresh(202_000)), Ok(202_000));
        let spike = FrequencyError::Implausible {
            jump_uhz: 202_001,
            allowed_uhz: 202_000,
        };
        assert_eq!(gate.admit(fresh(404_001)), Err(spike));
        assert_eq!(gate.admit(fresh(404_001)), Ok(404_001));
    }

    #[test]
    fn reports_a_stuck_source_until_it_moves() {
        let mut gate = gate();
        for _ in 0..5 {
            assert_eq!(gate.admit(fresh(7)), Ok(7));
        }
        assert_eq!(
            gate.admit(fresh(7)),
            Err(FrequencyError::Stuck { ticks: 5 })
        );
        assert_eq!(gate.admit(fresh(8)), Ok(8));
    }

    proptest! {
        #[test]
        fn whatever_is_admitted_is_in_range_and_within_the_rate(
            readings in proptest::collection::vec((any::<i32>(), any::<u16>()), 1..50),
        ) {
            let mut gate = gate();
            let mut last = None;
            for (deviation_uhz, age_ms) in readings {
                if let Ok(accepted) = gate.admit(Ok(Reading { deviation_uhz, age_ms })) {
                    prop_assert!(accepted.unsigned_abs() <= 5_000_000);
                    if let Some(last) = last {
                        // At most 50 ticks of 0.2 Hz and the noise.
                        prop_assert!(accepted.abs_diff(last) <= 50 * 200_000 + 2_000);
                    }
                    last = Some(accepted);
                }
            }
        }
    }
}
