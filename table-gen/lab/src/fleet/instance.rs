//! One charger of the fleet: the firmware's supervisor on its own hardware.

use firmware::charger::{Charger, ChargerConfig};
use firmware::dispatch::SetPoint;
use firmware::dispatch::contactor::ContactorTimes;
use firmware::fault::ResetCause;
use firmware::response::LevelOffset;
use firmware::table::TableView;
use rand::SeedableRng;
use rand_pcg::Pcg32;

use super::config::{FleetConfig, Hostility, PARTS};
use super::hardware::{Dispatcher, Meter, NoWatchdog, Operations};
use crate::car::{Car, CarConfig, THREE_PHASE_V};
use crate::simulation::chance::{symmetric, unit};
use model::spec::{Direction, Spec};

/// Smallest change of the command that counts as one \[ppm of full scale\].
const COUNTED_PPM: i64 = 50_000;
/// A clock that is off by a ppm reads 50 Hz off by so much \[µHz\].
const UHZ_PER_PPM: f64 = 50.0;
/// Millionths: responses are counted in whole ppm of a charger's swing, so that sums do not depend
/// on their order.
const PPM: i64 = 1_000_000;

/// What a charger did at a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Tally {
    /// Change of the response that the car gives, in ppm of a charger's swing.
    pub(super) given_ppm: i64,
    /// Participation that the firmware asked for \[ppm\].
    pub(super) asked_ppm: i64,
    /// Chargers whose set-point changed.
    pub(super) changed: u32,
}

impl std::ops::Add for Tally {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            given_ppm: self.given_ppm + other.given_ppm,
            asked_ppm: self.asked_ppm + other.asked_ppm,
            changed: self.changed + other.changed,
        }
    }
}

/// A charger that works.
#[derive(Debug)]
pub(super) struct Instance<'t> {
    charger: Charger<'t, Meter, Dispatcher, NoWatchdog>,
    /// Largest draw: mA or W.
    limit: i64,
    last: Option<SetPoint>,
    car: Car,
    /// Response of the car at the last tick \[ppm of the swing\].
    given_ppm: i64,
    /// Parts of a tick from a decision to its power.
    pub(super) delay_parts: usize,
    /// Parts of a tick by which the meter lags.
    pub(super) lag_parts: usize,
    /// Error of the clock \[ppm\].
    clock_ppm: f64,
    /// Moment of the next tick, in parts since the start.
    pub(super) due_parts: f64,
    /// Length of a tick by the charger's own clock, in parts.
    tick_parts: f64,
    tick_ms: u32,
    ticks: u32,
    /// The command when a change of 5 % was counted last \[ppm\].
    counted_ppm: i64,
    operations: Operations,
    hostility: Option<Hostility>,
    /// Whether the event has been: before it all are honest, for the grid was at rest with them.
    attacks: bool,
    /// What happened since the event.
    pub(super) counts: Counts,
}

/// What is counted of a charger.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Changes of its set-point.
    pub(super) set_points: u32,
    /// Changes of its command by 5 % of full scale and more.
    pub(super) changes: u32,
    /// Operations of its contactor.
    pub(super) operations: u32,
}

impl<'t> Instance<'t> {
    /// A charger in service for long before the event: its observer needs no warm-up.
    pub(super) fn new(
        spec: &Spec,
        table: &TableView<'t>,
        config: &FleetConfig,
        serial: u32,
        part: usize,
    ) -> Self {
        let mut random = Pcg32::seed_from_u64(!config.seed ^ (u64::from(serial) << 32));
        let clock_ppm = spec.charger.clock_ppm * symmetric(&mut random);
        let parts = PARTS as f64;
        let tick_s = f64::from(table.header().tick_ms) / 1000.0;
        let meter = Meter::new(
            config.seed,
            serial,
            (config.noise_hz * 1e6).round() as u32,
            config.outages_per_hour / 3600.0 * tick_s,
            config.outage_s / tick_s,
        );
        let part_s = tick_s / parts;
        let delay = |[least, most]: [f64; 2], share: f64| {
            ((least + (most - least) * share) / part_s).round() as usize
        };
        let delay_parts = delay(config.delay_s, unit(&mut random));
        let lag_parts = delay(config.lag_s, unit(&mut random));
        let operations = Operations::default();
        let swing_w = spec.fleet.power_per_charger_kw * 1000.0;
        let (dispatcher, limit) = match spec.fleet.direction {
            Direction::Unidirectional => {
                let ma = (swing_w / THREE_PHASE_V * 1000.0).round() as u32;
                let times = contactor_times(spec);
                let coil = operations.clone();
                (Dispatcher::unidirectional(serial, ma, times, coil), ma)
            }
            Direction::Bidirectional => {
                let w = (0.5 * swing_w).round() as u32;
                (Dispatcher::bidirectional(w), w)
            }
        };
        let charger = Charger::with_table(
            meter,
            dispatcher,
            NoWatchdog,
            Ok(table.clone()),
            ChargerConfig {
                warm_up_ticks: Some(0),
                level_offset: LevelOffset::of_serial(serial),
                ..ChargerConfig::DEFAULT
            },
            ResetCause::PowerOn,
        );
        Self {
            charger,
            limit: i64::from(limit),
            last: None,
            car: Car::new(
                CarConfig::draw(spec, &mut random),
                config.seed ^ u64::from(serial),
            ),
            given_ppm: 0,
            delay_parts,
            lag_parts,
            clock_ppm,
            due_parts: part as f64,
            tick_parts: parts * (1.0 + 1e-6 * clock_ppm),
            tick_ms: table.header().tick_ms.into(),
            ticks: 0,
            counted_ppm: 0,
            operations,
            hostility: Hostility::of(serial as usize, config.hostile_share),
            attacks: false,
            counts: Counts::default(),
        }
    }

    /// Whether it ticks where this part begins.
    pub(super) fn is_due(&self, part: u64) -> bool {
        self.due_parts < (part + 1) as f64
    }

    /// A tick at a true deviation \[µHz\], by the charger's own clock.
    pub(super) fn tick(&mut self, f_uhz: i32) -> Tally {
        let now_ms = self.tick_ms * self.ticks;
        self.ticks += 1;
        self.due_parts += self.tick_parts;
        let bias_uhz = (self.clock_ppm * UHZ_PER_PPM).round() as i32;
        self.charger.source_mut().f_uhz = f_uhz.saturating_add(bias_uhz);
        let report = self.charger.tick(now_ms);
        let changed = self.last.is_some() && report.set_point != self.last;
        self.counts.set_points += u32::from(changed);
        self.last = report.set_point;
        let command = i64::from(report.participation.ppm());
        if (command - self.counted_ppm).abs() >= COUNTED_PPM {
            self.counted_ppm = command;
            self.counts.changes += 1;
        }
        let told = self.told_ppm(report.set_point);
        let told = match self.hostility.filter(|_| self.attacks) {
            None => told,
            Some(Hostility::Opposite) => PPM - told,
            Some(Hostility::Nothing) => 0,
        };
        let given = self.car.tick(told, now_ms);
        let change = given - self.given_ppm;
        self.given_ppm = given;
        Tally {
            given_ppm: change,
            asked_ppm: command,
            changed: u32::from(changed),
        }
    }

    /// Response of a set-point in ppm of the swing, from full charging on.
    fn told_ppm(&self, set_point: Option<SetPoint>) -> i64 {
        let limit = self.limit.max(1);
        match set_point {
            None => 0,
            Some(SetPoint::Paused) => PPM,
            Some(SetPoint::Current { ma }) => PPM - i64::from(ma) * PPM / limit,
            Some(SetPoint::Power { w }) => (limit - i64::from(w)) * PPM / (2 * limit),
        }
    }

    /// The event: what was counted before is forgotten, and a hostile charger is one from now on.
    pub(super) fn event(&mut self) {
        self.attacks = true;
        self.counts = Counts::default();
        self.operations.forget();
        self.charger.source_mut().missed_ticks = 0;
    }

    /// Whether it does what it is told.
    pub(super) const fn is_honest(&self) -> bool {
        self.hostility.is_none()
    }

    /// What was counted since the event.
    pub(super) fn counts(&self) -> Counts {
        Counts {
            operations: self.operations.number(),
            ..self.counts
        }
    }

    /// Ticks since the event without a reading.
    pub(super) fn missed_ticks(&mut self) -> u32 {
        self.charger.source_mut().missed_ticks
    }
}

/// The contactor's times of a spec.
fn contactor_times(spec: &Spec) -> ContactorTimes {
    let ms = |s: f64| (s * 1000.0).round() as u32;
    ContactorTimes {
        open_after_ms: ms(spec.charger.contactor_opens_after_s),
        off_min_ms: ms(spec.charger.contactor_open_least_s),
    }
}
