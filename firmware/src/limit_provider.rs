//! A charger without hardware: what it may draw now, for firmware that has everything else.
//!
//! Most chargers have a pilot, a contactor, a meter and a chain of limits already: cable, site,
//! user. This is one more limit in that chain. It is told the frequency, the other limits and
//! whether a car is there. It answers with the power and current allowed until the next tick. The
//! parts are those of [`crate::charger`], and so are modes, faults and the check of the hypotheses.
//!
//! A unidirectional charger is allowed the share `1 - u` of the lowest limit, at least 6 A or
//! nothing. A bidirectional one is given a set-point between its limits on charging and on
//! discharging.

use core::num::NonZeroU16;

use crate::charger::{Charger, ChargerConfig, Installation, MeterFacts, Misfits, Report, Watchdog};
use crate::dispatch::bidirectional::power_w;
use crate::dispatch::fleet::Threshold;
use crate::dispatch::unidirectional::Floor;
use crate::dispatch::{Dispatch, DispatchError, SetPoint};
use crate::fault::ResetCause;
use crate::frequency::{FrequencyError, FrequencySource, Reading};
use crate::table::{Direction, TableError, TableView};
use crate::units::Participation;
use crate::wide::divide;

/// Most phases of a connection.
pub const PHASES_MAX: u8 = 3;
/// Highest voltage of a phase \[V\].
pub const VOLTAGE_MAX_V: u16 = 1_000;

/// The connection to the mains, by which currents and powers are converted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Connection {
    /// Phases that carry the current, 1..=[`PHASES_MAX`].
    pub phases: u8,
    /// Nominal voltage of a phase \[V\], 1..=[`VOLTAGE_MAX_V`].
    pub voltage_v: u16,
}

impl Connection {
    /// Three phases of 230 V.
    pub const THREE_PHASES: Self = Self {
        phases: 3,
        voltage_v: 230,
    };

    /// Power at 1 A \[W\]; at least 1.
    const fn volts(self) -> u32 {
        let volts = self.phases as u32 * self.voltage_v as u32;
        if volts == 0 { 1 } else { volts }
    }

    /// Power of a current in each phase \[W\], rounded down.
    const fn power_w(self, current_ma: u32) -> u32 {
        divide(current_ma as u64 * self.volts() as u64, 1_000)
    }

    /// Current in each phase for a power \[mA\], rounded down.
    const fn current_ma(self, power_w: u32) -> u32 {
        divide(power_w as u64 * 1_000, self.volts())
    }
}

/// What a limit provider is told once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProviderConfig {
    /// Which way the charger can move power, how much, and how regularly it ticks.
    pub installation: Installation,
    /// Its connection.
    pub connection: Connection,
    /// What the meter says of itself.
    pub meter: MeterFacts,
    /// Ticks of unchanged readings after which the meter is stuck; `None` for meters that may
    /// repeat themselves.
    pub stuck_after: Option<NonZeroU16>,
    /// Serial number: the place in the fleet.
    pub serial: u32,
    /// Everything else. Its `installation` and `level_offset` are taken from the fields above.
    pub charger: ChargerConfig,
}

/// What a limit provider is told at every tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inputs {
    /// What the meter read.
    pub reading: Result<Reading, FrequencyError>,
    /// Whether a car is connected that may be charged.
    pub car_present: bool,
    /// Lowest limit on the current of a phase \[mA\]; `u32::MAX` for none.
    pub limit_ma: u32,
    /// Lowest limit on charging \[W\]; `u32::MAX` for none.
    pub charge_limit_w: u32,
    /// Lowest limit on discharging \[W\]; 0 where the car must not be discharged.
    pub discharge_limit_w: u32,
}

/// What is allowed until the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Allowance {
    /// Power drawn from the grid \[W\]: the most for a charger that can only charge, the set-point
    /// for a bidirectional one, negative while discharging.
    pub power_w: i32,
    /// Current of a phase that belongs to it \[mA\].
    pub current_ma: u32,
    /// Whether anything may be energised: a car is there, and the start is over.
    pub energise: bool,
}

impl Allowance {
    /// Nothing is allowed.
    pub const NOTHING: Self = Self {
        power_w: 0,
        current_ma: 0,
        energise: false,
    };
}

/// The meter, as it is told.
#[derive(Debug)]
struct ToldMeter {
    reading: Result<Reading, FrequencyError>,
    facts: MeterFacts,
    stuck_after: Option<NonZeroU16>,
}

impl FrequencySource for ToldMeter {
    fn error_uhz(&self) -> u32 {
        self.facts.error_uhz
    }

    fn lag_ms(&self) -> u16 {
        self.facts.lag_ms
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        self.stuck_after
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        self.reading
    }
}

/// The dispatcher: it computes, and sets nothing.
#[derive(Debug)]
struct Limiter {
    direction: Direction,
    connection: Connection,
    floor: Floor,
    car_present: bool,
    limit_ma: u32,
    charge_w: u32,
    discharge_w: u32,
    allowed: Allowance,
}

impl Limiter {
    /// Takes a tick's limits. Each of them holds in both units.
    const fn limit(&mut self, inputs: &Inputs) {
        self.car_present = inputs.car_present;
        let by_power_ma = self.connection.current_ma(inputs.charge_limit_w);
        let by_current_w = self.connection.power_w(inputs.limit_ma);
        self.limit_ma = least(inputs.limit_ma, by_power_ma);
        self.charge_w = least(inputs.charge_limit_w, by_current_w);
        self.discharge_w = least(inputs.discharge_limit_w, by_current_w);
    }
}

impl Dispatch for Limiter {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        if !self.car_present {
            return self.rest(now_ms);
        }
        match self.direction {
            Direction::Unidirectional => {
                let ma = self.floor.current_ma(participation, self.limit_ma);
                self.allowed = Allowance {
                    // At most 80 A, 1 kV and three phases: 240 kW.
                    power_w: self.connection.power_w(ma).cast_signed(),
                    current_ma: ma,
                    energise: true,
                };
                Ok(match ma {
                    0 => SetPoint::Paused,
                    ma => SetPoint::Current { ma },
                })
            }
            Direction::Bidirectional => {
                let w = power_w(participation, self.charge_w, self.discharge_w);
                self.allowed = Allowance {
                    power_w: w,
                    current_ma: self.connection.current_ma(w.unsigned_abs()),
                    energise: true,
                };
                Ok(SetPoint::Power { w })
            }
        }
    }

    fn rest(&mut self, _now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.allowed = Allowance::NOTHING;
        Ok(match self.direction {
            Direction::Unidirectional => SetPoint::Paused,
            Direction::Bidirectional => SetPoint::Power { w: 0 },
        })
    }
}

const fn least(a: u32, b: u32) -> u32 {
    if a < b { a } else { b }
}

/// The watchdog is the caller's.
#[derive(Debug)]
struct NotOurs;

impl Watchdog for NotOurs {
    fn feed(&mut self) {}
}

/// A limit in a charger's chain of limits.
#[derive(Debug)]
pub struct LimitProvider<'t> {
    charger: Charger<'t, ToldMeter, Limiter, NotOurs>,
}

impl<'t> LimitProvider<'t> {
    /// A provider before its first tick. `table` is the flash image, checked here. With a table
    /// that is rejected, or does not fit, it runs the droop and says so at every tick.
    pub fn new(table: &'t [u8], config: &ProviderConfig, cause: ResetCause) -> Self {
        Self::with_table(TableView::parse(table), config, cause)
    }

    /// The same for a table that was parsed already. Not inlined: what is put together here must
    /// not lie on the stack while the table is parsed.
    #[inline(never)]
    pub fn with_table(
        table: Result<TableView<'t>, TableError>,
        config: &ProviderConfig,
        cause: ResetCause,
    ) -> Self {
        let meter = ToldMeter {
            reading: Err(FrequencyError::NoSignal),
            facts: config.meter,
            stuck_after: config.stuck_after,
        };
        let limiter = Limiter {
            direction: config.installation.direction,
            connection: config.connection,
            floor: Floor::new(Threshold::of_serial(config.serial)),
            car_present: false,
            limit_ma: 0,
            charge_w: 0,
            discharge_w: 0,
            allowed: Allowance::NOTHING,
        };
        let settings = ChargerConfig {
            installation: Some(config.installation),
            level_offset: crate::response::LevelOffset::of_serial(config.serial),
            ..config.charger
        };
        let charger = Charger::with_table(meter, limiter, NotOurs, table, settings, cause);
        Self { charger }
    }

    /// One tick: to be called every [`LimitProvider::tick_ms`] by a millisecond clock that may
    /// wrap.
    pub fn tick(&mut self, now_ms: u32, inputs: &Inputs) -> (Report, Allowance) {
        self.charger.source_mut().reading = inputs.reading;
        self.charger.dispatch_mut().limit(inputs);
        let report = self.charger.tick(now_ms);
        (report, self.charger.dispatch_mut().allowed)
    }

    /// Length of a tick \[ms\].
    pub const fn tick_ms(&self) -> u16 {
        self.charger.tick_ms()
    }

    /// Why the table was rejected, if it was.
    pub fn table_error(&self) -> Option<TableError> {
        self.charger.table_error()
    }

    /// The table, if it was accepted.
    pub fn table(&self) -> Option<&TableView<'t>> {
        self.charger.table()
    }

    /// What the proof of the table assumed otherwise.
    pub const fn misfits(&self) -> Misfits {
        self.charger.misfits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charger::StartDelay;
    use crate::fault::{Faults, Mode};
    use proptest::prelude::*;

    const CONFIG: ProviderConfig = ProviderConfig {
        installation: Installation::REFERENCE_UNIDIRECTIONAL,
        connection: Connection::THREE_PHASES,
        meter: MeterFacts {
            error_uhz: 3_000,
            lag_ms: 50,
        },
        stuck_after: None,
        serial: 1,
        charger: ChargerConfig::DEFAULT,
    };

    const BIDIRECTIONAL: ProviderConfig = ProviderConfig {
        installation: Installation::REFERENCE_BIDIRECTIONAL,
        ..CONFIG
    };

    fn inputs(deviation_uhz: i32) -> Inputs {
        Inputs {
            reading: Ok(Reading {
                deviation_uhz,
                age_ms: 0,
            }),
            car_present: true,
            limit_ma: 32_000,
            charge_limit_w: u32::MAX,
            discharge_limit_w: 28_000,
        }
    }

    /// Without a table: the paper's droop, which is at its end from 0.65 Hz below nominal on.
    fn on_the_droop(config: &ProviderConfig, inputs: &Inputs) -> (Report, Allowance) {
        let mut provider = LimitProvider::new(&[], config, ResetCause::PowerOn);
        assert!(provider.table_error().is_some());
        provider.tick(100, inputs)
    }

    #[test]
    fn at_nominal_frequency_the_lowest_limit_is_allowed() {
        let (report, allowed) = on_the_droop(&CONFIG, &inputs(0));
        assert_eq!(report.mode, Mode::DroopNoTable);
        assert!(report.faults.contains(Faults::TABLE_REJECTED));
        // 32 A, 3 phases of 230 V.
        let full = Allowance {
            power_w: 22_080,
            current_ma: 32_000,
            energise: true,
        };
        assert_eq!(allowed, full);
        let by_power = Inputs {
            charge_limit_w: 11_040,
            ..inputs(0)
        };
        assert_eq!(on_the_droop(&CONFIG, &by_power).1.current_ma, 16_000);
        // Below 6 A nothing can be offered.
        let too_low = Inputs {
            limit_ma: 5_999,
            ..inputs(0)
        };
        assert_eq!(on_the_droop(&CONFIG, &too_low).1.power_w, 0);
    }

    #[test]
    fn far_below_nominal_everything_is_given_up() {
        let (report, allowed) = on_the_droop(&CONFIG, &inputs(-800_000));
        assert_eq!(report.participation, Participation::ALL);
        assert_eq!((allowed.power_w, allowed.current_ma), (0, 0));
        assert!(allowed.energise);
        let (_, allowed) = on_the_droop(&BIDIRECTIONAL, &inputs(-800_000));
        // The cable's 32 A are 22 080 W in both directions.
        assert_eq!((allowed.power_w, allowed.current_ma), (-22_080, 32_000));
        let wide = Inputs {
            limit_ma: u32::MAX,
            charge_limit_w: 28_000,
            ..inputs(-800_000)
        };
        let (_, allowed) = on_the_droop(&BIDIRECTIONAL, &wide);
        // 28 000 W / 690 V.
        assert_eq!((allowed.power_w, allowed.current_ma), (-28_000, 40_579));
    }

    #[test]
    fn without_a_car_or_before_the_start_is_over_nothing_is_allowed() {
        let absent = Inputs {
            car_present: false,
            ..inputs(-800_000)
        };
        for config in [CONFIG, BIDIRECTIONAL] {
            assert_eq!(on_the_droop(&config, &absent).1, Allowance::NOTHING);
            let mut late = config;
            late.charger.start_delay = StartDelay::street(1);
            assert_eq!(on_the_droop(&late, &inputs(0)).1, Allowance::NOTHING);
        }
    }

    proptest! {
        #[test]
        fn no_limit_is_ever_exceeded(
            f in -2_000_000i32..2_000_000,
            limit_ma: u32, charge_limit_w: u32, discharge_limit_w: u32,
            phases in 1u8..=3, voltage_v in 1u16..=1000, serial: u32, bidirectional: bool,
        ) {
            let mut config = if bidirectional { BIDIRECTIONAL } else { CONFIG };
            config.connection = Connection { phases, voltage_v };
            config.serial = serial;
            let told = Inputs { limit_ma, charge_limit_w, discharge_limit_w, ..inputs(f) };
            let (_, allowed) = on_the_droop(&config, &told);
            let (w, ma) = (i64::from(allowed.power_w), u64::from(allowed.current_ma));
            prop_assert!(w <= i64::from(charge_limit_w));
            prop_assert!(ma <= u64::from(limit_ma));
            if bidirectional {
                prop_assert!(-w <= i64::from(discharge_limit_w));
            } else {
                prop_assert!(w >= 0);
            }
        }
    }
}
