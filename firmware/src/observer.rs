//! The governor chain (g, l, p), reconstructed from frequency alone.
//!
//! The chain is driven by f and nothing else (`g' = (K f - g)/T_G`, `l' = (g + T_1 g' - l)/T_2`,
//! `p' = (l - p)/T_t`), so the device can run a copy of it. Each tick advances the copy by the
//! exact solution for a frequency that is linear between two samples (first-order hold), with
//! coefficients computed once from the table's plant parameters.
//!
//! Tradeoffs: f32 in GW and Hz. One rounding is at most 2^-23 relative, so a chain near 4 GW rounds
//! by at most 0.5 kW a tick, and the slowest mode (T_2) forgets it within T_2 / tick ticks: below
//! 0.1 MW for T_2 = 12 s and 100 ms ticks. Additions and products only, in a fixed order: host and
//! target agree to the bit.
//!
//! [`bound`] bounds the error of the estimate, for the spec; [`loss`] estimates the lost power as
//! well.

pub mod bound;
mod config;
pub mod loss;
#[cfg(test)]
pub(crate) mod reference;

pub use config::{ObserverConfig, ObserverError};

use config::floor;
use loss::LossEstimator;

use crate::units::{MICRO, Participation, State};

/// The chain's state as the device knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    config: ObserverConfig,
    /// g, l, p \[GW\].
    chain: [f32; 3],
    /// The last frequency \[Hz\].
    f_hz: f32,
    loss: LossEstimator,
}

impl Observer {
    /// An observer at rest at a frequency deviation \[µHz\]: the chain in its steady state g = l =
    /// p = K f.
    pub fn at_rest(config: ObserverConfig, f_uhz: i32) -> Self {
        let f_hz = f_uhz as f32 / MICRO as f32;
        let rest = config.governor_gain * f_hz;
        Self {
            config,
            chain: [rest; 3],
            f_hz,
            loss: LossEstimator::EMPTY,
        }
    }

    /// Forgets everything: at rest again, at this deviation \[µHz\].
    pub fn restart(&mut self, f_uhz: i32) {
        self.f_hz = f_uhz as f32 / MICRO as f32;
        self.chain = [self.config.governor_gain * self.f_hz; 3];
        self.loss = LossEstimator::EMPTY;
    }

    /// Takes the frequency deviation measured at this tick \[µHz\] and returns the state estimate.
    pub fn step(&mut self, f_uhz: i32) -> State {
        self.advance(f_uhz);
        self.estimate(f_uhz)
    }

    /// Both for a tick whose estimates nobody asks for: as [`Observer::step`] and
    /// [`Observer::loss_kw`], without their last roundings.
    pub fn pass(&mut self, f_uhz: i32, fleet: Participation) {
        self.advance(f_uhz);
        let [_, _, p] = self.chain;
        let fleet_gw = self.fleet_gw(fleet);
        self.loss.note(&self.config, p, self.f_hz, fleet_gw);
    }

    fn advance(&mut self, f_uhz: i32) {
        let f_hz = f_uhz as f32 / MICRO as f32;
        let [g, l, p] = self.chain;
        let input = [g, l, p, self.f_hz, f_hz - self.f_hz];
        for (next, row) in self.chain.iter_mut().zip(&self.config.transition) {
            let mut acc = 0.0;
            for (coefficient, value) in row.iter().zip(&input) {
                acc += coefficient * value;
            }
            *next = acc;
        }
        self.f_hz = f_hz;
    }

    /// The lost power \[kW\], once a tick after [`Observer::step`]: `fleet` is the participation in
    /// force during the tick that ended. `None` until [`loss::WINDOW_TICKS`] ticks have been seen.
    pub fn loss_kw(&mut self, fleet: Participation) -> Option<i32> {
        let [_, _, p] = self.chain;
        let fleet_gw = self.fleet_gw(fleet);
        self.loss.step(&self.config, p, self.f_hz, fleet_gw)
    }

    /// Power of the fleet at this participation \[GW\].
    const fn fleet_gw(&self, fleet: Participation) -> f32 {
        fleet.ppm() as f32 * self.config.fleet_gw_per_ppm
    }

    /// Forgets the loss estimate's window, after a gap in the readings.
    pub fn reset_loss(&mut self) {
        self.loss.reset();
    }

    /// The estimate as it stands, with this frequency \[µHz\].
    fn estimate(&self, f_uhz: i32) -> State {
        let micro = |gw: f32| floor(gw * MICRO as f32);
        let [g, l, p] = self.chain;
        State([f_uhz, micro(g), micro(l), micro(p)])
    }
}

#[cfg(test)]
mod tests {
    use super::bound::{InputError, measurement_bound};
    use super::reference::advance;
    use super::*;
    use crate::table::PlantParameters;
    use proptest::prelude::*;

    const TICK_MS: u16 = 100;

    /// Noise in -eps..=eps from a small generator; the worst case for a filter is a slow square
    /// wave, so `hold` ticks share a value.
    fn noise(seed: &mut u64, eps: i32) -> i32 {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let span = 2 * i64::from(eps) + 1;
        ((*seed >> 33) as i64 % span) as i32 - eps
    }

    #[test]
    fn rejects_chains_that_the_series_does_not_cover() {
        let plant = PlantParameters {
            turbine_time_us: 24_999,
            ..PlantParameters::PAPER
        };
        let error = ObserverError::TimeConstantTooShort;
        assert_eq!(ObserverConfig::new(&plant, TICK_MS), Err(error));
    }

    proptest! {
        /// Every float, by its bits, and those around whole numbers.
        #[test]
        fn floor_is_floor(bits: u32, near in -20_000_000i32..20_000_000, off in -2i32..=2) {
            let around = (near as f32).to_bits().wrapping_add_signed(off);
            for bits in [bits, around] {
                let value = f32::from_bits(bits);
                prop_assert_eq!(floor(value), libm::floorf(value) as i32);
            }
        }

        /// Ticks that are passed leave the same observer as ticks that are asked.
        #[test]
        fn a_passed_tick_is_a_tick(
            ticks in proptest::collection::vec((-900_000i32..900_000, 0u32..=1_000_000, any::<bool>()), 1..60),
        ) {
            let config = ObserverConfig::new(&PlantParameters::PAPER, 100).unwrap();
            let start = Observer::at_rest(config, 0);
            let (mut asked, mut passed) = (start, start);
            for (f_uhz, ppm, pass) in ticks {
                let fleet = Participation::from_ppm(ppm);
                let answers = (asked.step(f_uhz), asked.loss_kw(fleet));
                if pass {
                    passed.pass(f_uhz, fleet);
                } else {
                    prop_assert_eq!((passed.step(f_uhz), passed.loss_kw(fleet)), answers);
                }
                prop_assert_eq!(asked, passed);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_error_stays_within_the_derived_bound(
            seed in any::<u64>(),
            eps in 0i32..5_000,
            hold in 1u32..100,
            loss_kw in 0u32..2_200_000,
            participations in proptest::collection::vec(0u32..=1_000_000, 8),
        ) {
            let config = ObserverConfig::new(&PlantParameters::PAPER, TICK_MS).expect("the paper's chain");
            let mut observer = Observer::at_rest(config, 0);
            // The fleet may step by all of its power at any tick, the loss at the first: both at
            // ticks, so f' bends nowhere inside one. Imbalance and |l - p| below 4 GW in every such
            // run.
            let input = InputError {
                reading_uhz: eps as u32 + 1,
                curvature_uhz_per_s2: InputError::curvature_uhz_per_s2(&PlantParameters::PAPER, 4_000_000, 4_000_000),
                power_step_kw: 0,
            };
            let bound = measurement_bound(&PlantParameters::PAPER, TICK_MS, &input);
            let (mut x, mut seed, mut error) = ([0.0; 4], seed, 0);
            for tick in 0..600u32 {
                let u = participations[(tick / 75) as usize];
                x = advance(x, u32::from(TICK_MS), 1.4e-6 * f64::from(u), 1e-6 * f64::from(loss_kw));
                if tick % hold == 0 {
                    error = noise(&mut seed, eps);
                }
                let state = observer.step((x[0] * 1e6).floor() as i32 + error);
                for axis in 0..4 {
                    let off = (f64::from(state.0[axis]) - x[axis] * 1e6).abs();
                    prop_assert!(off <= f64::from(bound[axis]), "axis {axis} tick {tick}: {off}");
                }
            }
        }

        #[test]
        fn the_loss_is_found_within_its_bound(
            seed in any::<u64>(),
            eps in 0i32..2_000,
            loss_kw in 0u32..2_200_000,
            ppm in 0u32..=1_000_000,
        ) {
            let config = ObserverConfig::new(&PlantParameters::PAPER, TICK_MS).expect("the paper's chain");
            let mut observer = Observer::at_rest(config, 0);
            let input = InputError {
                reading_uhz: eps as u32 + 1,
                curvature_uhz_per_s2: InputError::curvature_uhz_per_s2(&PlantParameters::PAPER, 4_000_000, 4_000_000),
                power_step_kw: 0,
            };
            let turbine = measurement_bound(&PlantParameters::PAPER, TICK_MS, &input)[3];
            let bound = LossEstimator::error_kw(&PlantParameters::PAPER, TICK_MS, eps as u32 + 1, turbine, 0);
            let (mut x, mut seed) = ([0.0; 4], seed);
            // The reading before the event, then the event.
            observer.step(0);
            prop_assert_eq!(observer.loss_kw(Participation::NONE), None);
            for tick in 1..600usize {
                x = advance(x, u32::from(TICK_MS), 1.4e-6 * f64::from(ppm), 1e-6 * f64::from(loss_kw));
                let off = noise(&mut seed, eps);
                observer.step((x[0] * 1e6).floor() as i32 + off);
                let loss = observer.loss_kw(Participation::from_ppm(ppm));
                prop_assert_eq!(loss.is_some(), tick >= loss::WINDOW_TICKS);
                if let Some(loss) = loss {
                    prop_assert!(loss.abs_diff(loss_kw as i32) <= bound, "tick {}: {} {}", tick, loss, loss_kw);
                }
            }
        }

        #[test]
        fn any_readings_give_an_estimate(readings in proptest::collection::vec(any::<i32>(), 1..100)) {
            let config = ObserverConfig::new(&PlantParameters::PAPER, TICK_MS).expect("the paper's chain");
            let mut observer = Observer::at_rest(config, 0);
            for reading in readings {
                prop_assert_eq!(observer.step(reading).0[0], reading);
                let _ = observer.loss_kw(Participation::ALL);
            }
        }
    }

    #[test]
    fn a_constant_bias_is_a_shift_of_the_loss() {
        // x + b (1, K, K, K) with the loss shifted by (D - K) b: the observer cannot tell the two
        // apart.
        let config =
            ObserverConfig::new(&PlantParameters::PAPER, TICK_MS).expect("the paper's chain");
        let bias = 5_000;
        let mut observer = Observer::at_rest(config, bias);
        let mut x = [0.0; 4];
        let mut loss = None;
        observer.step(bias);
        let _ = observer.loss_kw(Participation::NONE);
        for _ in 0..300 {
            x = advance(x, u32::from(TICK_MS), 0.0, 1.5);
            let state = observer.step((x[0] * 1e6).floor() as i32 + bias);
            loss = observer.loss_kw(Participation::NONE);
            for (estimate, truth) in state.0.iter().zip(x).skip(1) {
                let shifted = truth * 1e6 - 5.0 * f64::from(bias);
                // Interpolation and rounding only: 5 * 0.09 mHz of curvature at most, and 0.1 MW.
                assert!((f64::from(*estimate) - shifted).abs() < 600.0);
            }
        }
        let shift = loss.map(|kw| kw - 1_500_000);
        // -(D - K) b = -30 MW, to the 1 MW of the trapezoids.
        assert!(
            shift.is_some_and(|kw| (kw + 30_000).abs() < 1_000),
            "{shift:?}"
        );
    }
}
