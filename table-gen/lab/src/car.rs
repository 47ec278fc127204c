//! The car behind a charger: from a set-point to the power that the grid sees.
//!
//! ```text
//! set-point -> pilot (least time between changes, hysteresis at 6 A) -> dead time -> ramp -> power
//! ```
//!
//! A car that is told to draw less than its own largest draw does so; told more, it draws what it
//! can. Some cars pause by themselves for a while when their set-point changes. Everything is in
//! ppm of the charger's swing: 0 is full charging, a million is the whole response.
//!
//! The one model of a car: the fleet and the scorecard use it. A car of [`CarConfig::IDEAL`]
//! follows at once.

use std::collections::VecDeque;

use rand::SeedableRng;
use rand_pcg::Pcg32;

use crate::simulation::chance::{between, unit};
use model::spec::{Direction, Spec};

/// A million: the whole swing.
const FULL_PPM: i64 = 1_000_000;
/// Lowest current that a pilot can offer \[A\].
const FLOOR_A: f64 = 6.0;
/// Voltage between phase and neutral times the phases of a three-phase charger \[V\].
pub const THREE_PHASE_V: f64 = 3.0 * 230.0;

/// One car and its charger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarConfig {
    /// Time until it begins to answer \[ms\].
    pub dead_ms: u32,
    /// Time for its whole swing \[ms\].
    pub ramp_ms: u32,
    /// Least time between two changes of the pilot, except to pause \[ms\].
    pub pilot_change_ms: u32,
    /// Response up to which a paused car is charged again \[ppm\].
    pub resume_ppm: i64,
    /// Response that a car cannot give, since it draws that much less than the rating \[ppm\].
    pub missing_ppm: i64,
    /// Length of its own pauses \[s\]; `None` for a car that never pauses by itself.
    pub pause_s: Option<[f64; 2]>,
}

impl CarConfig {
    /// A car that follows at once.
    pub const IDEAL: Self = Self {
        dead_ms: 0,
        ramp_ms: 0,
        pilot_change_ms: 0,
        resume_ppm: FULL_PPM,
        missing_ppm: 0,
        pause_s: None,
    };

    /// A car of a spec's fleet, drawn.
    pub fn draw(spec: &Spec, random: &mut Pcg32) -> Self {
        let charger = &spec.charger;
        let ms = |s: f64| (s * 1000.0).round() as u32;
        let dead_ms = ms(between(random, charger.dead_time_s));
        let ramp_ms = ms(between(random, charger.ramp_s));
        let draw = between(random, charger.draw);
        let pauses = unit(random) < charger.pausing_share;
        let common = Self {
            dead_ms,
            ramp_ms,
            pause_s: pauses.then_some(charger.pause_s),
            ..Self::IDEAL
        };
        if spec.fleet.direction == Direction::Bidirectional {
            return common;
        }
        let rating_a = spec.fleet.power_per_charger_kw * 1000.0 / THREE_PHASE_V;
        let resume_a = FLOOR_A + charger.resume_above_floor_a;
        let ppm = |share: f64| (share * FULL_PPM as f64).round() as i64;
        Self {
            pilot_change_ms: ms(charger.pilot_change_s),
            resume_ppm: ppm((1.0 - resume_a / rating_a).max(0.0)),
            missing_ppm: ppm(1.0 - draw),
            ..common
        }
    }
}

/// A car in time.
#[derive(Debug, Clone)]
pub struct Car {
    config: CarConfig,
    random: Pcg32,
    /// What the pilot says \[ppm\], and since when \[ms\].
    pilot: (i64, u32),
    /// What the pilot said, with the time at which the car begins to follow it.
    under_way: VecDeque<(u32, i64)>,
    /// What it is moving to \[ppm\].
    target_ppm: i64,
    /// Where it is \[ppm\].
    power_ppm: i64,
    /// End of its own pause \[ms\].
    pause_ends_ms: Option<u32>,
    now_ms: u32,
}

impl Car {
    /// A car that has been charging for long.
    pub fn new(config: CarConfig, seed: u64) -> Self {
        Self {
            config,
            random: Pcg32::seed_from_u64(seed),
            pilot: (0, 0),
            under_way: VecDeque::new(),
            target_ppm: 0,
            power_ppm: 0,
            pause_ends_ms: None,
            now_ms: 0,
        }
    }

    /// Whether a car is not there: power follows the set-point at once.
    fn is_ideal(&self) -> bool {
        self.config == CarConfig::IDEAL
    }

    /// Takes the set-point of a tick \[ppm\] at a time \[ms\]; the response at that time \[ppm\].
    /// Times may not fall.
    pub fn tick(&mut self, set_point_ppm: i64, now_ms: u32) -> i64 {
        if self.is_ideal() {
            return set_point_ppm;
        }
        self.move_on(now_ms);
        self.offer(set_point_ppm, now_ms);
        self.follow(now_ms);
        let paused = self.pause_ends_ms.is_some_and(|end_ms| now_ms < end_ms);
        let response = if paused { FULL_PPM } else { self.power_ppm };
        (response - self.config.missing_ppm).max(0)
    }

    /// The pilot's own rules.
    fn offer(&mut self, set_point_ppm: i64, now_ms: u32) {
        let (says, since_ms) = self.pilot;
        let pause = set_point_ppm >= FULL_PPM;
        let paused = says >= FULL_PPM;
        let too_soon = now_ms - since_ms < self.config.pilot_change_ms && since_ms > 0;
        let too_low = paused && set_point_ppm > self.config.resume_ppm;
        if set_point_ppm == says || (!pause && (too_soon || too_low)) {
            return;
        }
        self.pilot = (set_point_ppm, now_ms);
        let from_ms = now_ms + self.config.dead_ms;
        self.under_way.push_back((from_ms, set_point_ppm));
    }

    /// Takes what the dead time has let through.
    fn follow(&mut self, now_ms: u32) {
        while let Some((from_ms, ppm)) = self.under_way.front().copied() {
            if from_ms > now_ms {
                break;
            }
            self.under_way.pop_front();
            self.target_ppm = ppm;
            if let Some(pause_s) = self.config.pause_s {
                let length_ms = (1000.0 * between(&mut self.random, pause_s)) as u32;
                self.pause_ends_ms.get_or_insert(now_ms + length_ms);
            }
        }
        if self.config.ramp_ms == 0 {
            self.power_ppm = self.target_ppm;
        }
        if self.pause_ends_ms.is_some_and(|end_ms| now_ms >= end_ms) {
            self.pause_ends_ms = None;
        }
    }

    /// Ramps from the last tick to this.
    fn move_on(&mut self, now_ms: u32) {
        let passed_ms = i64::from(now_ms - self.now_ms);
        self.now_ms = now_ms;
        let Some(way) = (passed_ms * FULL_PPM).checked_div(i64::from(self.config.ramp_ms)) else {
            return;
        };
        let left = self.target_ppm - self.power_ppm;
        self.power_ppm += left.clamp(-way, way);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Responses of a car at ticks of 0.1 s, in thousandths.
    fn responses(config: CarConfig, set_points: impl Iterator<Item = i64>) -> Vec<i64> {
        let mut car = Car::new(config, 1);
        (1..)
            .zip(set_points)
            .map(|(tick, thousandths)| car.tick(1000 * thousandths, 100 * tick) / 1000)
            .collect()
    }

    fn steps(parts: &[(usize, i64)]) -> impl Iterator<Item = i64> {
        let parts = parts.to_vec();
        parts
            .into_iter()
            .flat_map(|(ticks, value)| std::iter::repeat_n(value, ticks))
    }

    #[test]
    fn an_ideal_car_follows_at_once() {
        let wanted = [0, 500, 1000, 200];
        assert_eq!(responses(CarConfig::IDEAL, wanted.into_iter()), wanted);
    }

    #[test]
    fn a_car_waits_and_ramps() {
        let config = CarConfig {
            dead_ms: 200,
            ramp_ms: 1000,
            ..CarConfig::IDEAL
        };
        // Told 300 at the second tick: begins at the fourth, moves by 100 a tick.
        let seen = responses(config, steps(&[(1, 0), (9, 300)]));
        assert_eq!(seen, [0, 0, 0, 0, 100, 200, 300, 300, 300, 300]);
    }

    #[test]
    fn the_pilot_changes_every_five_seconds_unless_to_pause() {
        let config = CarConfig {
            pilot_change_ms: 5000,
            ..CarConfig::IDEAL
        };
        let seen = responses(config, steps(&[(10, 100), (30, 200), (20, 300), (5, 1000)]));
        // The first change is free; the next comes 50 ticks later; a pause at once.
        assert_eq!(seen[..50], [100; 50]);
        assert_eq!(seen[50..60], [300; 10]);
        assert_eq!(seen[60..], [1000; 5]);
    }

    #[test]
    fn a_paused_car_resumes_well_above_the_floor() {
        let config = CarConfig {
            resume_ppm: 600_000,
            ..CarConfig::IDEAL
        };
        let seen = responses(config, [700, 1000, 700, 601, 600, 700].into_iter());
        assert_eq!(seen, [700, 1000, 1000, 1000, 600, 700]);
    }

    #[test]
    fn what_a_car_does_not_draw_it_cannot_give() {
        let config = CarConfig {
            missing_ppm: 200_000,
            ..CarConfig::IDEAL
        };
        let seen = responses(config, [0, 100, 500, 1000].into_iter());
        assert_eq!(seen, [0, 0, 300, 800]);
    }

    #[test]
    fn some_cars_pause_by_themselves() {
        let config = CarConfig {
            pause_s: Some([1.0, 2.0]),
            ..CarConfig::IDEAL
        };
        let seen = responses(config, steps(&[(1, 0), (40, 100)]));
        let paused = seen.iter().filter(|ppm| **ppm == 1000).count();
        assert!((10..=20).contains(&paused), "{seen:?}");
        assert_eq!((seen[0], seen[40]), (0, 100));
    }
}
