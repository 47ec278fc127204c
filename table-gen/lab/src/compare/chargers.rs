//! A fleet of control loops: each charger with its own clock, meter and delay, and nothing else of
//! a charger.
//!
//! A tick of the table is cut into ten parts. Charger i decides in part i mod 10. Its command acts
//! after its own delay, which is constant over a run; the delays are spread evenly over the spec's
//! range. Its meter errs by a uniform error within the spec's bound, drawn anew each tick, and
//! reads what f was a while ago: its own lag, spread evenly over the meter's. Its levels are
//! shifted as its serial number says. What the fleet gives is a sum of whole ppm: it does not
//! depend on the order of the chargers.

use std::collections::VecDeque;

use firmware::control_loop::ControlLoop;
use firmware::droop::Droop;
use firmware::observer::{Observer, ObserverConfig, ObserverError};
use firmware::response::LevelOffset;
use firmware::table::TableView;
use firmware::units::{MICRO, State};
use rand::SeedableRng;
use rand_pcg::Pcg32;

use crate::simulation::chance::symmetric;
use model::spec::Spec;

/// Parts of a tick.
pub const PARTS: usize = 10;
/// Smallest change of a command that is counted \[ppm of full scale\].
const COUNTED_PPM: i64 = 50_000;
/// The golden ratio's fraction: its multiples fill the unit interval evenly, however many are
/// taken.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct ChargersConfig {
    /// Chargers, at least one.
    pub number: usize,
    /// Bound on the error of each charger's frequency meter \[Hz\].
    pub meter_hz: f64,
    /// Least and most delay of a charger \[s\].
    pub delay_s: [f64; 2],
    /// Least and most lag of a charger's meter \[s\].
    pub lag_s: [f64; 2],
    /// Seed of the meters' errors.
    pub seed: u64,
}

impl ChargersConfig {
    /// So many chargers with the meter and the delays of a spec.
    pub fn of(spec: &Spec, number: usize) -> Self {
        Self {
            number,
            meter_hz: spec.uncertainty.measurement[0],
            delay_s: *spec.uncertainty.actuation_delay_s.ends_s(),
            lag_s: spec.meter.lag_ms().map(|ms| ms / 1000.0),
            seed: 0,
        }
    }
}

/// What each charger runs.
#[derive(Debug)]
pub enum Kind<'s, 't> {
    /// The droop of a spec.
    Droop(&'s Spec),
    /// The firmware's control loop on a table.
    Table(&'s TableView<'t>),
}

/// What one charger responds with.
#[derive(Debug, Clone)]
enum Responder<'t> {
    Droop(Droop),
    Table(Box<(ControlLoop<'t>, Observer)>),
}

impl Responder<'_> {
    /// The same law with the levels of a serial number.
    fn of_serial(&self, serial: u32) -> Self {
        match self {
            Self::Droop(droop) => Self::Droop(*droop),
            Self::Table(table) => {
                let (firmware, observer) = &**table;
                let offset = LevelOffset::of_serial(serial);
                Self::Table(Box::new((firmware.clone().with_offset(offset), *observer)))
            }
        }
    }
}

#[derive(Debug, Clone)]
struct Charger<'t> {
    law: Responder<'t>,
    random: Pcg32,
    /// Parts of a tick from a decision to its power.
    delay_parts: usize,
    /// Parts of a tick by which its meter lags.
    lag_parts: usize,
    command_ppm: i64,
    /// The command when a change was counted last.
    counted_ppm: i64,
    changes: u32,
}

/// The fleet in time.
#[derive(Debug, Clone)]
pub struct Chargers<'t> {
    chargers: Vec<Charger<'t>>,
    meter_uhz: f64,
    /// Deviations of the last parts \[µHz\], the latest first: as many as the longest lag needs.
    f_uhz: VecDeque<i32>,
    /// Changes of the sum that are under way \[ppm\], by the part in which they act, modulo the
    /// length.
    under_way: Vec<i64>,
    part: usize,
    /// What acts now \[ppm, all chargers together\].
    acting_ppm: i64,
}

impl<'t> Chargers<'t> {
    /// A fleet at rest at 50 Hz.
    ///
    /// # Errors
    /// A table whose plant the observer cannot follow.
    pub fn new(
        kind: &Kind<'_, 't>,
        config: &ChargersConfig,
        tick_ms: u16,
    ) -> Result<Self, ObserverError> {
        let law = match kind {
            Kind::Droop(spec) => Responder::Droop(droop(spec)),
            Kind::Table(table) => {
                let plant = &table.header().plant;
                let observer = ObserverConfig::new(plant, tick_ms)?;
                Responder::Table(Box::new((
                    ControlLoop::with_table(Ok((*table).clone())),
                    Observer::at_rest(observer, 0),
                )))
            }
        };
        let part_s = f64::from(tick_ms) / 1000.0 / PARTS as f64;
        let [least, most] = config.delay_s.map(|s| (s / part_s).round());
        let [lag_least, lag_most] = config.lag_s.map(|s| (s / part_s).round());
        // The end of a range belongs to it.
        let within = |least: f64, most: f64, share: f64| {
            (least + ((most - least + 1.0) * share).floor()) as usize
        };
        let chargers = (0..config.number).map(|index| {
            let share = (index as f64 * GOLDEN).fract();
            // Another irrational: lags and delays are not paired.
            let other = (index as f64 * GOLDEN.sqrt()).fract();
            Charger {
                law: law.of_serial(index as u32),
                random: Pcg32::seed_from_u64(config.seed ^ ((index as u64) << 32)),
                delay_parts: within(least, most, share),
                lag_parts: within(lag_least, lag_most, other),
                command_ppm: 0,
                counted_ppm: 0,
                changes: 0,
            }
        });
        Ok(Self {
            chargers: chargers.collect(),
            meter_uhz: config.meter_hz * f64::from(MICRO),
            f_uhz: vec![0; lag_most as usize + 1].into(),
            under_way: vec![0; most as usize + 1],
            part: 0,
            acting_ppm: 0,
        })
    }

    /// The next part of a tick, at a true deviation \[µHz\]. Returns the fleet's response, 0..=1.
    pub fn part(&mut self, f_uhz: i32) -> f64 {
        self.f_uhz.pop_back();
        self.f_uhz.push_front(f_uhz);
        let slots = self.under_way.len();
        let ready = self.chargers.iter_mut().skip(self.part % PARTS);
        for charger in ready.step_by(PARTS) {
            let read = self.f_uhz.get(charger.lag_parts).unwrap_or(&f_uhz);
            let change = charger.tick(*read, self.meter_uhz);
            self.under_way[(self.part + charger.delay_parts) % slots] += change;
        }
        self.acting_ppm += std::mem::take(&mut self.under_way[self.part % slots]);
        self.part += 1;
        self.acting_ppm as f64 / (f64::from(MICRO) * self.chargers.len() as f64)
    }

    /// Forgets the changes so far.
    pub fn forget_changes(&mut self) {
        for charger in &mut self.chargers {
            charger.changes = 0;
        }
    }

    /// Changes of a charger's command by 5 % of full scale and more: on average, and the most of
    /// any.
    pub fn changes(&self) -> (f64, u32) {
        let changes = self.chargers.iter().map(|charger| charger.changes);
        let sum: u64 = changes.clone().map(u64::from).sum();
        let mean = sum as f64 / self.chargers.len() as f64;
        (mean, changes.max().unwrap_or(0))
    }
}

impl Charger<'_> {
    /// Decides; returns the change of the command \[ppm\].
    fn tick(&mut self, f_uhz: i32, meter_uhz: f64) -> i64 {
        let error = (meter_uhz * symmetric(&mut self.random)).round() as i32;
        let read = f_uhz.saturating_add(error);
        let participation = match &mut self.law {
            Responder::Droop(droop) => droop.participation(State([read, 0, 0, 0])),
            Responder::Table(table) => {
                let (firmware, observer) = &mut **table;
                firmware.step(observer.step(read)).participation
            }
        };
        let command = i64::from(participation.ppm());
        if (command - self.counted_ppm).abs() >= COUNTED_PPM {
            self.counted_ppm = command;
            self.changes += 1;
        }
        let change = command - self.command_ppm;
        self.command_ppm = command;
        change
    }
}

/// The droop of a spec as a charger runs it: without the lag of the power electronics.
pub fn droop(spec: &Spec) -> Droop {
    let micro = |hz: f64| (hz * f64::from(MICRO)).round() as u32;
    Droop {
        deadband_uhz: micro(spec.baseline.deadband_hz),
        full_uhz: micro(spec.baseline.droop_hz * spec.plant.damping_gw_per_hz),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty chargers, two a part; delays 0 to 0.1 s.
    fn droops(delay_s: [f64; 2], meter_hz: f64) -> Chargers<'static> {
        let config = ChargersConfig {
            number: 20,
            meter_hz,
            delay_s,
            lag_s: [0.0, 0.0],
            seed: 3,
        };
        Chargers::new(&Kind::Droop(&Spec::default()), &config, 100).unwrap()
    }

    #[test]
    fn each_charger_decides_once_a_tick_and_acts_after_its_delay() {
        // 0.15 Hz of dead band and 0.25 of 0.5 Hz: half.
        let at_once: Vec<f64> = {
            let mut fleet = droops([0.0, 0.0], 0.0);
            (0..12).map(|_| fleet.part(-400_000)).collect()
        };
        for (part, given) in at_once.iter().enumerate() {
            // Sums of whole ppm: exact.
            assert_eq!(*given, 0.5 * (part + 1).min(10) as f64 / 10.0, "{part}");
        }
        let mut late = droops([0.05, 0.05], 0.0);
        for (part, given) in (0..17).map(|part| (part, late.part(-400_000))) {
            let expected = if part < 5 {
                0.0
            } else {
                at_once[(part - 5).min(11)]
            };
            assert_eq!(given, expected, "{part}");
        }
    }

    #[test]
    fn delays_fill_their_range() {
        let fleet = droops([0.02, 0.05], 0.0);
        let mut delays: Vec<usize> = fleet.chargers.iter().map(|c| c.delay_parts).collect();
        delays.sort_unstable();
        delays.dedup();
        assert_eq!(delays, [2, 3, 4, 5]);
    }

    #[test]
    fn small_changes_are_not_counted_until_they_add_up() {
        let mut fleet = droops([0.0, 0.0], 0.0);
        // 1 % of full scale is 5 mHz; sixteen steps of it are three changes of 5 %.
        for step in 1..=16 {
            for _ in 0..PARTS {
                fleet.part(-150_000 - 5_000 * step);
            }
        }
        assert_eq!(fleet.changes(), (3.0, 3));
        fleet.forget_changes();
        assert_eq!(fleet.changes(), (0.0, 0));
    }

    #[test]
    fn meters_err_within_their_bound_and_each_in_its_own_way() {
        let mut fleet = droops([0.0, 0.0], 0.05);
        for _ in 0..PARTS {
            fleet.part(-400_000);
        }
        let mut commands: Vec<i64> = fleet.chargers.iter().map(|c| c.command_ppm).collect();
        // 50 mHz are 10 % of full scale.
        assert!(commands.iter().all(|ppm| (400_000..=600_000).contains(ppm)));
        commands.sort_unstable();
        commands.dedup();
        assert!(commands.len() > 10, "{commands:?}");
    }
}
