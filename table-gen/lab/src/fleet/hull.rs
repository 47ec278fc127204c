//! What the proof of a response assumes of a fleet, as a hull of the response at each moment.
//!
//! ## Derivation
//! f is the frequency, T the tick, W the window of the slope, ε the bound on a meter's error, and
//! \[λ₁, λ₂\] the lag of a meter. A charger that decides at time s has read, at its own ticks s -
//! kT,
//!
//! ```text
//! y(s - kT) = f(s - kT - λ) + e,    λ in [λ₁, λ₂],  |e| <= ε,   each time another
//! F⁻(s) = min f over [s - λ₂, s - λ₁] - ε <= y(s) <= F⁺(s) = max f over [s - λ₂, s - λ₁] + ε
//! ```
//!
//! The law's slope is (y(s) - y(s - W)) / W, so it lies between (F⁻(s) - F⁺(s - W)) / W and
//! (F⁺(s) - F⁻(s - W)) / W. The slope response falls with the slope and rises with the slope
//! response before. So one that is fed with the least slopes of a clock's ticks lies above that of
//! every charger of this clock, one that is fed with the greatest slopes below. Here both run for
//! each clock, with the firmware's own functions; M⁺ and M⁻ are the greatest and least over all
//! clocks. The target falls with f and rises with the slope response:
//!
//! ```text
//! V⁻(s) = target(F⁺(s), M⁻(s)) <= v(s) <= V⁺(s) = target(F⁻(s), M⁺(s))
//! ```
//!
//! A command lies less than the smallest change c from its target, and is 0 or 1 exactly where the
//! target is. Where the proof knows how evenly the chargers' levels are shifted
//! (`uncertainty.level_discrepancy`), the mean of those with targets up to V⁺ is at most V⁺ and a
//! part of c (`verify::response`, the lines), but 1 from 1 - c on; from below the same. It acts
//! from d after s until the next one acts, d in \[d₁, d₂\], each time another. So what acts at time
//! t was decided in \[t - d₂ - T, t - d₁\], and each charger's response lies between the least V⁻ -
//! c and the greatest V⁺ + c of that time. So does the mean over any number of chargers, which is
//! the convex hull; where the levels are known, the mean over the fleet of which they are lies in
//! the narrower one. Of a participation u the grid gets anything from u (1 - ρ) - α to u (1 + ρ) +
//! α, at most everything. A share σ of the chargers that is hostile gives anything: then the rest
//! of the fleet counts (1 - σ) times, and σ is added above.
//!
//! ## Time
//! Time goes in parts of a tick, as the fleet's does: decisions are made and powers change where a
//! part begins. A clock that is fast or slow by less than a part in a window is covered: the far
//! end of a window is taken a part longer to both sides, a command is let act a part longer, and a
//! clock's slope response may be that of any other clock.

use std::collections::VecDeque;

use firmware::response::ResponseLaw;
use firmware::units::{MICRO, Participation};

use super::config::PARTS;

/// What the proof assumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HullConfig {
    /// The law.
    pub law: ResponseLaw,
    /// Length of a tick \[ms\].
    pub tick_ms: u16,
    /// ε: bound on the error of a reading \[µHz\].
    pub meter_uhz: i32,
    /// λ₁, λ₂: lag of a reading \[s\].
    pub meter_lag_s: [f64; 2],
    /// d₁, d₂: time from a decision to its power \[s\].
    pub delay_s: [f64; 2],
    /// ρ: relative error of the participation.
    pub participation: f64,
    /// α: absolute error of the participation, as a share of the fleet.
    pub participation_absolute: f64,
    /// σ: share of the chargers that does as it likes.
    pub hostile_share: f64,
    /// How far the mean command may be from its target, as a share of the smallest change.
    pub mean_step_share: f64,
}

/// Least and greatest of one quantity.
type Ends<T> = (T, T);

/// The hull in time.
#[derive(Debug, Clone)]
pub struct ProvenHull {
    config: HullConfig,
    /// Parts of λ₁ rounded down and λ₂ rounded up.
    lag: Ends<usize>,
    /// Parts of d₁ rounded down, and of d₂ rounded up with a tick and a part.
    age: Ends<usize>,
    window_parts: usize,
    /// f at the beginning of each part, the latest first.
    f_uhz: VecDeque<i32>,
    /// Slope responses of each clock, lower and upper \[ppm\].
    held_ppm: [Ends<u32>; PARTS],
    /// Commands that were possible in each part \[ppm\], the latest first.
    commands_ppm: VecDeque<Ends<u32>>,
    part: usize,
}

impl ProvenHull {
    /// A hull on a grid that has been at a deviation \[µHz\] for long.
    pub fn new(config: HullConfig, at_rest_uhz: i32) -> Self {
        let part_s = f64::from(config.tick_ms) / 1000.0 / PARTS as f64;
        let outward = |[least, most]: [f64; 2]| {
            // A billionth of a part is the noise of decimal times.
            let (least, most) = (least / part_s + 1e-9, most / part_s - 1e-9);
            (
                least.floor().max(0.0) as usize,
                most.ceil().max(0.0) as usize,
            )
        };
        let (d1, d2) = outward(config.delay_s);
        let lag = outward(config.meter_lag_s);
        let window_parts = usize::from(config.law.window_ticks) * PARTS;
        let length = window_parts + lag.1 + 2;
        Self {
            config,
            lag,
            age: (d1, d2 + PARTS + 1),
            window_parts,
            f_uhz: std::iter::repeat_n(at_rest_uhz, length).collect(),
            held_ppm: [(0, 0); PARTS],
            commands_ppm: VecDeque::new(),
            part: 0,
        }
    }

    /// Takes the true deviation where a part begins \[µHz\]. Returns the least and the greatest
    /// response of the fleet that the proof allows over this part, as shares of the fleet.
    pub fn part(&mut self, f_uhz: i32) -> Ends<f64> {
        self.f_uhz.pop_back();
        self.f_uhz.push_front(f_uhz);
        let law = &self.config.law;
        let (low, high) = self.read(0, 0);
        let (then_low, then_high) = self.read(self.window_parts, 1);
        let slope = |then, now| law.slope_uhz_per_s(then, now, self.config.tick_ms);
        let (steepest, mildest) = (slope(then_high, low), slope(then_low, high));
        let clock = &mut self.held_ppm[self.part % PARTS];
        *clock = (
            law.held_ppm(clock.0, mildest),
            law.held_ppm(clock.1, steepest),
        );
        let held = self.held_ppm.iter();
        let (least, most) = held.fold((u32::MAX, 0), |(l, m), (a, b)| (l.min(*a), m.max(*b)));
        // A clock that has just fallen behind by a part let go once less.
        let most = most.saturating_add(law.release_ppm);
        let (least, most) = (law.target(high, least), law.target(low, most));
        self.commands_ppm.push_front(self.commands(least, most));
        self.commands_ppm.truncate(self.age.1 + 1);
        self.part += 1;
        self.acting()
    }

    /// Least and greatest reading of so many parts ago, with grace to both sides.
    fn read(&self, ago: usize, grace: usize) -> Ends<i32> {
        let from = (ago + self.lag.0).saturating_sub(grace);
        let until = ago + self.lag.1 + grace;
        let read = self.f_uhz.iter().skip(from).take(until + 1 - from);
        let (low, high) = read.fold((i32::MAX, i32::MIN), |(l, h), f| (l.min(*f), h.max(*f)));
        let error = self.config.meter_uhz;
        (low.saturating_sub(error), high.saturating_add(error))
    }

    /// Commands for targets between two ends \[ppm\].
    fn commands(&self, least: Participation, most: Participation) -> Ends<u32> {
        let change = self.config.law.smallest_change_ppm;
        let full = MICRO as u32;
        // The hostile may be whichever chargers suit them. An offset is rounded down by less than
        // 1 ppm.
        let share = self.config.mean_step_share + self.config.hostile_share;
        let step = (f64::from(change) * share).ceil() as u32 + 1;
        let step = step.min(change);
        let low = match least.ppm() {
            all if all == full => full,
            little if little <= change => 0,
            target => target - step,
        };
        let high = match most.ppm() {
            0 => 0,
            much if much >= full.saturating_sub(change) => full,
            target => target + step,
        };
        (low, high)
    }

    /// What acts over this part.
    fn acting(&self) -> Ends<f64> {
        let acting = self.commands_ppm.iter().skip(self.age.0);
        // Before the first decision nothing acts.
        let all_known = self.commands_ppm.len() == self.age.1 + 1;
        let before = if all_known { u32::MAX } else { 0 };
        let (low, high) = acting.fold((before, 0), |(l, h), (a, b)| (l.min(*a), h.max(*b)));
        let share = |ppm: u32| f64::from(ppm) / f64::from(MICRO);
        let (relative, absolute) = (
            self.config.participation,
            self.config.participation_absolute,
        );
        let hostile = self.config.hostile_share;
        let honest = |ppm: u32| (1.0 - hostile) * share(ppm);
        (
            (honest(low) * (1.0 - relative) - absolute).max(0.0),
            (honest(high) * (1.0 + relative) + absolute + hostile).min(1.0),
        )
    }
}

/// Tells for how long a response lay outside a hull.
#[derive(Debug, Clone)]
pub struct OutsideHull {
    hull: ProvenHull,
    part_s: f64,
    /// Parts outside.
    parts: u64,
    /// Largest distance from the hull, as a share of the fleet.
    pub(super) farthest: f64,
}

/// Set-points are whole watts and milliamperes of a charger of a kilowatt at least: what their
/// rounding is of the charger's swing.
const ROUNDING: f64 = 1e-3;

impl OutsideHull {
    /// A monitor.
    pub fn new(config: HullConfig, at_rest_uhz: i32) -> Self {
        Self {
            hull: ProvenHull::new(config, at_rest_uhz),
            part_s: f64::from(config.tick_ms) / 1000.0 / PARTS as f64,
            parts: 0,
            farthest: 0.0,
        }
    }

    /// Takes the deviation where a part begins \[µHz\] and the fleet's response over it.
    pub fn part(&mut self, f_uhz: i32, given: f64) {
        let (low, high) = self.hull.part(f_uhz);
        let distance = (low - given).max(given - high);
        if distance > ROUNDING {
            self.parts += 1;
            self.farthest = self.farthest.max(distance);
        }
    }

    /// Forgets what was so far.
    pub const fn forget(&mut self) {
        self.parts = 0;
        self.farthest = 0.0;
    }

    /// Time outside \[s\].
    pub fn seconds(&self) -> f64 {
        self.parts as f64 * self.part_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::response::{LevelOffset, Response};
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    const CONFIG: HullConfig = HullConfig {
        law: ResponseLaw {
            droop_gain_ppm_per_hz: 4_285_714,
            setpoint_uhz: -50_000,
            slope_gain_ppm_s_per_hz: 1_428_571,
            slope_threshold_uhz_per_s: 30_000,
            window_ticks: 5,
            slope_most_ppm: 642_857,
            release_ppm: 3_571,
            smallest_change_ppm: 50_000,
        },
        tick_ms: 100,
        meter_uhz: 2_000,
        meter_lag_s: [0.05, 0.07],
        delay_s: [0.1, 0.5],
        participation: 0.0,
        participation_absolute: 0.0,
        hostile_share: 0.0,
        mean_step_share: 1.0,
    };
    /// The same in parts of 10 ms.
    const LAG: [usize; 2] = [5, 7];
    const DELAY: [usize; 2] = [10, 50];

    /// Who errs how, and who is late.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Malice {
        /// Everybody as chance has it, anew each time.
        Chance,
        /// All as late as they may be, and reading too high.
        AllLate,
        /// All as early as they may be, and reading too low.
        AllEarly,
        /// Half of them one, half the other.
        TwoGroups,
        /// Early while f falls, late while it rises; errors that make slopes.
        Pumping,
    }

    struct Charger {
        response: Response,
        clock: usize,
        ticks: usize,
        /// When each command was decided \[part\], and what \[ppm\].
        commands: VecDeque<(usize, u32)>,
    }

    fn any_of(random: &mut Pcg64, [low, high]: [usize; 2]) -> usize {
        low + (random.next_u64() % (high - low + 1) as u64) as usize
    }

    /// Runs a fleet along a path of f, and shows each part's hull and mean.
    fn run(
        config: HullConfig,
        number: usize,
        malice: Malice,
        late_parts: usize,
        seed: u64,
        see: &mut dyn FnMut((f64, f64), f64),
    ) {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut chargers: Vec<Charger> = (0..number)
            .map(|index| Charger {
                response: Response::new(
                    config.law,
                    config.tick_ms,
                    LevelOffset::of_serial(index as u32),
                ),
                clock: any_of(&mut random, [0, PARTS - 1]),
                ticks: 0,
                commands: VecDeque::from([(0, 0)]),
            })
            .collect();
        let mut hull = ProvenHull::new(config, 0);
        let mut f = vec![0; LAG[1] + 1];
        let (mut now, mut slope) = (0.0f64, 0.0);
        for part in 0..2_000 {
            if part % 100 == 0 && part >= 200 {
                // Up to half a Hz a second, anew each second.
                slope = any_of(&mut random, [0, 10_000]) as f64 - 5_000.0;
            }
            now = (now + slope).clamp(-700_000.0, 150_000.0);
            f.insert(0, now as i32);
            f.truncate(LAG[1] + 1);
            let ends = hull.part(f[0]);
            let mut sum = 0u64;
            for (index, charger) in chargers.iter_mut().enumerate() {
                let first_group = index % 2 == 0;
                let late = match malice {
                    Malice::Chance => None,
                    Malice::AllLate => Some(true),
                    Malice::AllEarly => Some(false),
                    Malice::TwoGroups => Some(first_group),
                    Malice::Pumping => Some(slope > 0.0),
                };
                let pick = |[least, most]: [usize; 2], random: &mut Pcg64| match late {
                    None => any_of(random, [least, most]),
                    Some(true) => most,
                    Some(false) => least,
                };
                if part % PARTS == charger.clock {
                    let error = match malice {
                        Malice::Chance => any_of(&mut random, [0, 4_000]) as i32 - 2_000,
                        Malice::Pumping if charger.ticks / 5 % 2 == 0 => 2_000,
                        Malice::Pumping => -2_000,
                        _ if late == Some(true) => 2_000,
                        _ => -2_000,
                    };
                    let read = f[pick(LAG, &mut random)] + error;
                    let command = charger.response.step(read);
                    charger.ticks += 1;
                    charger.commands.push_front((part, command.ppm()));
                    charger.commands.truncate(16);
                }
                let until = part.saturating_sub(pick(DELAY, &mut random) + late_parts);
                let acting = charger.commands.iter().find(|(at, _)| *at <= until);
                sum += u64::from(acting.map_or(0, |(_, ppm)| *ppm));
            }
            see(ends, sum as f64 / (number as f64 * 1e6));
        }
    }

    const ALL: [Malice; 5] = [
        Malice::Chance,
        Malice::AllLate,
        Malice::AllEarly,
        Malice::TwoGroups,
        Malice::Pumping,
    ];

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn every_fleet_within_the_hypotheses_stays_inside(
            number in 1usize..=1000,
            seed in any::<u64>(),
        ) {
            for malice in ALL {
                let mut outside = 0;
                run(CONFIG, number, malice, 0, seed, &mut |(low, high), mean| {
                    // Sums of whole ppm: a quotient rounds by less than this.
                    outside += usize::from(mean < low - 1e-12 || mean > high + 1e-12);
                });
                prop_assert_eq!(outside, 0, "{:?}", malice);
            }
        }
    }

    /// Levels a fifth apart, which 300 consecutive serial numbers shift by golden multiples: no arc
    /// holds (1 + 0.7 log2 300)/300 < 0.023 more or less of them than its length, both ways 0.046.
    #[test]
    fn a_fleet_of_shifted_levels_stays_inside_the_narrower_hull() {
        let law = ResponseLaw {
            smallest_change_ppm: 200_000,
            ..CONFIG.law
        };
        let narrow = HullConfig {
            law,
            mean_step_share: 0.546,
            ..CONFIG
        };
        let mut nearest = f64::INFINITY;
        for (malice, seed) in ALL
            .iter()
            .flat_map(|malice| [1, 2, 3].map(|seed| (*malice, seed)))
        {
            let mut outside = 0;
            run(narrow, 300, malice, 0, seed, &mut |(low, high), mean| {
                outside += usize::from(mean < low - 1e-12 || mean > high + 1e-12);
                if high < 0.9 && high > 0.25 {
                    nearest = nearest.min(high - mean);
                }
            });
            assert_eq!(outside, 0, "{malice:?} {seed}");
        }
        // The hull is not so wide that nothing comes near it: half a step of levels at most.
        assert!(nearest < 0.1, "{nearest}");
    }

    /// The monitor can fail: a fleet that is a second later than assumed leaves the hull on each of
    /// a few paths.
    #[test]
    fn a_fleet_that_is_later_than_assumed_is_seen() {
        for seed in 0..5 {
            let mut outside = 0;
            run(
                CONFIG,
                50,
                Malice::AllLate,
                100,
                seed,
                &mut |(low, high), mean| {
                    outside += usize::from(mean < low || mean > high);
                },
            );
            assert!(outside > 0, "seed {seed}");
        }
    }

    #[test]
    fn at_rest_nothing_is_allowed_but_nothing() {
        let mut hull = ProvenHull::new(CONFIG, 0);
        for _ in 0..200 {
            assert_eq!(hull.part(0), (0.0, 0.0));
        }
    }
}
