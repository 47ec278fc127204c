//! One charger of the fleet: the firmware's supervisor on its own hardware.

use firmware::charger::{Charger, ChargerConfig};
use firmware::dispatch::SetPoint;
use firmware::fault::ResetCause;
use firmware::table::TableView;

use super::FleetConfig;
use super::hardware::{Dispatcher, Meter, NoWatchdog};
use model::spec::{Direction, Spec};

/// Voltage between phase and neutral times the phases of a three-phase charger \[V\].
const THREE_PHASE_V: f64 = 3.0 * 230.0;
/// Millionths: responses are counted in whole ppm of a charger's swing, so that sums do not depend on their order.
const PPM: i64 = 1_000_000;

/// What a charger did at a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Tally {
    /// Response given, in ppm of a charger's swing.
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
    /// Times that its set-point changed after the event.
    pub(super) changes: u32,
}

impl<'t> Instance<'t> {
    /// A charger in service for long before the event: its observer needs no warm-up.
    pub(super) fn new(
        spec: &Spec,
        table: &TableView<'t>,
        config: &FleetConfig,
        serial: u32,
    ) -> Self {
        let tick_s = f64::from(table.header().tick_ms) / 1000.0;
        let meter = Meter::new(
            config.seed,
            serial,
            (config.noise_hz * 1e6).round() as u32,
            config.outages_per_hour / 3600.0 * tick_s,
            config.outage_s / tick_s,
        );
        let swing_w = spec.fleet.power_per_charger_kw * 1000.0;
        let (dispatcher, limit) = match spec.fleet.direction {
            Direction::Unidirectional => {
                let ma = (swing_w / THREE_PHASE_V * 1000.0).round() as u32;
                (Dispatcher::unidirectional(serial, ma), ma)
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
                ..ChargerConfig::DEFAULT
            },
            ResetCause::PowerOn,
        );
        Self {
            charger,
            limit: i64::from(limit),
            last: None,
            changes: 0,
        }
    }

    /// A tick at a time \[ms\] and a true deviation \[µHz\].
    pub(super) fn tick(&mut self, now_ms: u32, f_uhz: i32) -> Tally {
        self.charger.source_mut().f_uhz = f_uhz;
        let report = self.charger.tick(now_ms);
        let changed = self.last.is_some() && report.set_point != self.last;
        self.changes += u32::from(changed);
        self.last = report.set_point;
        Tally {
            given_ppm: self.given_ppm(report.set_point),
            asked_ppm: i64::from(report.participation.ppm()),
            changed: u32::from(changed),
        }
    }

    /// Response of a set-point in ppm of the swing, from full charging on.
    fn given_ppm(&self, set_point: Option<SetPoint>) -> i64 {
        let limit = self.limit.max(1);
        match set_point {
            None => 0,
            Some(SetPoint::Paused) => PPM,
            Some(SetPoint::Current { ma }) => PPM - i64::from(ma) * PPM / limit,
            Some(SetPoint::Power { w }) => (limit - i64::from(w)) * PPM / (2 * limit),
        }
    }

    /// Forgets what was counted before the event.
    pub(super) fn event(&mut self) {
        self.changes = 0;
        self.charger.source_mut().missed_ticks = 0;
    }

    /// Ticks since the event without a reading.
    pub(super) fn missed_ticks(&mut self) -> u32 {
        self.charger.source_mut().missed_ticks
    }
}
