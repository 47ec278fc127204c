//! A charger that is not what its table's proof assumed says so and runs the droop.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::num::NonZeroU16;
use std::rc::Rc;

use firmware::charger::{Charger, ChargerConfig, Installation, Misfits, Watchdog};
use firmware::dispatch::{Dispatch, DispatchError, SetPoint};
use firmware::droop::Droop;
use firmware::fault::{Faults, Mode, ResetCause};
use firmware::frequency::{FrequencyError, FrequencySource, Reading};
use firmware::phase::Phase;
use firmware::response::LevelOffset;
use firmware::table::{Direction, TableView};
use firmware::telemetry::Frame;
use firmware::units::{Participation, State};

const GB_BI: &[u8] = include_bytes!("../tables/gb-bi.bin");

/// A meter of any error and lag at 49.7 Hz.
#[derive(Clone, Copy)]
struct Meter {
    error_uhz: u32,
    lag_ms: u16,
    f_uhz: i32,
}

impl FrequencySource for Meter {
    fn error_uhz(&self) -> u32 {
        self.error_uhz
    }

    fn lag_ms(&self) -> u16 {
        self.lag_ms
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        None
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        Ok(Reading {
            deviation_uhz: self.f_uhz,
            age_ms: 0,
        })
    }
}

struct Car;

impl Dispatch for Car {
    fn apply(&mut self, _: Participation, _: u32) -> Result<SetPoint, DispatchError> {
        Ok(SetPoint::Paused)
    }

    fn rest(&mut self, _: u32) -> Result<SetPoint, DispatchError> {
        Ok(SetPoint::Paused)
    }
}

/// Counts how often it was fed.
#[derive(Clone, Default)]
struct Dog(Rc<Cell<u32>>);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

/// What gb-bi was proven for.
const METER: Meter = Meter {
    error_uhz: 3_000,
    lag_ms: 50,
    f_uhz: -300_000,
};
const INSTALLATION: Installation = Installation {
    direction: Direction::Bidirectional,
    power_w: 56_000,
    tick_most_ms: 200,
    change_gap_ms: 0,
};

/// A hundred ticks of a charger: its last frame, and how often the watchdog was fed.
fn run(meter: Meter, installation: Option<Installation>, filter_ticks: u8) -> (Frame, u32) {
    let config = ChargerConfig {
        installation,
        filter_ticks,
        level_offset: LevelOffset::of_serial(7),
        ..ChargerConfig::DEFAULT
    };
    let dog = Dog::default();
    let cause = ResetCause::PowerOn;
    let mut charger = Charger::new(meter, Car, dog.clone(), GB_BI, config, cause);
    assert_eq!(charger.table_error(), None);
    let mut last = None;
    for n in 1..=100 {
        last = Some(charger.tick(n * 100));
    }
    (Frame::new(&last.unwrap(), None), dog.0.get())
}

#[test]
fn a_charger_as_assumed_runs_the_response() {
    for (meter, installation) in [
        (METER, INSTALLATION),
        // The ends of what was assumed: 70 ms of lag, 10 % of power.
        (
            Meter {
                lag_ms: 70,
                error_uhz: 0,
                ..METER
            },
            INSTALLATION,
        ),
        (
            METER,
            Installation {
                power_w: 61_600,
                tick_most_ms: 100,
                ..INSTALLATION
            },
        ),
        (
            METER,
            Installation {
                power_w: 50_400,
                ..INSTALLATION
            },
        ),
        // As late as a command may act.
        (
            METER,
            Installation {
                change_gap_ms: 500,
                ..INSTALLATION
            },
        ),
    ] {
        let (frame, fed) = run(meter, Some(installation), 1);
        assert_eq!(frame.mode, Mode::Table as u8);
        assert_eq!(frame.phase, Phase::Response.number());
        assert_eq!((frame.faults, frame.misfits), (0, 0));
        assert_eq!(fed, 100);
    }
}

#[test]
fn each_misfit_is_named_and_the_droop_is_in_force() {
    let cases = [
        (
            Misfits::METER_ERROR,
            Meter {
                error_uhz: 3_001,
                ..METER
            },
            INSTALLATION,
            1,
        ),
        (
            Misfits::METER_LAG,
            Meter {
                lag_ms: 71,
                ..METER
            },
            INSTALLATION,
            1,
        ),
        (
            Misfits::METER_LAG,
            Meter {
                lag_ms: 49,
                ..METER
            },
            INSTALLATION,
            1,
        ),
        // Two ticks of moving average: 50 ms more.
        (Misfits::METER_LAG, METER, INSTALLATION, 2),
        (
            Misfits::TICK,
            METER,
            Installation {
                tick_most_ms: 99,
                ..INSTALLATION
            },
            1,
        ),
        (
            Misfits::DIRECTION,
            METER,
            Installation {
                direction: Direction::Unidirectional,
                ..INSTALLATION
            },
            1,
        ),
        (
            Misfits::POWER,
            METER,
            Installation {
                power_w: 61_601,
                ..INSTALLATION
            },
            1,
        ),
        (
            Misfits::POWER,
            METER,
            Installation {
                power_w: 50_399,
                ..INSTALLATION
            },
            1,
        ),
        (
            Misfits::PACE,
            METER,
            Installation {
                change_gap_ms: 501,
                ..INSTALLATION
            },
            1,
        ),
    ];
    let droop = TableView::parse(GB_BI).unwrap().header().droop;
    let expected = droop.participation(State([METER.f_uhz, 0, 0, 0]));
    // 150 mHz below the dead band, of 500.
    assert_eq!(expected.ppm(), 300_000);
    for (misfit, meter, installation, filter_ticks) in cases {
        let (frame, fed) = run(meter, Some(installation), filter_ticks);
        assert_eq!(frame.misfits, misfit.bits(), "{misfit:?}");
        assert_eq!(frame.faults, Faults::MISFIT.bits(), "{misfit:?}");
        assert_eq!(frame.mode, Mode::DroopMisfit as u8, "{misfit:?}");
        assert_eq!(frame.phase, Phase::Fallback.number(), "{misfit:?}");
        assert_eq!(frame.participation_ppm, expected.ppm(), "{misfit:?}");
        // Every tick is completed: no reset loop.
        assert_eq!(fed, 100, "{misfit:?}");
    }
}

#[test]
fn several_misfits_are_all_named() {
    let meter = Meter {
        error_uhz: 11_174,
        lag_ms: 10,
        ..METER
    };
    let unidirectional = Installation {
        direction: Direction::Unidirectional,
        power_w: 22_080,
        tick_most_ms: 50,
        change_gap_ms: 5_000,
    };
    let (frame, _) = run(meter, Some(unidirectional), 1);
    let all = Misfits::NAMES
        .iter()
        .fold(0, |bits, (misfit, _)| bits | misfit.bits());
    assert_eq!(frame.misfits, all);
}

#[test]
fn an_experiment_compares_nothing() {
    let meter = Meter {
        error_uhz: 1_000_000,
        lag_ms: 1_000,
        ..METER
    };
    let (frame, _) = run(meter, None, 1);
    assert_eq!((frame.faults, frame.misfits), (0, 0));
    assert_eq!(frame.mode, Mode::Table as u8);
}

#[test]
fn a_charger_without_a_table_has_nothing_to_fit() {
    let config = ChargerConfig {
        installation: Some(INSTALLATION),
        ..ChargerConfig::DEFAULT
    };
    let dog = Dog::default();
    let mut charger = Charger::new(METER, Car, dog, &[], config, ResetCause::PowerOn);
    let report = charger.tick(100);
    assert_eq!(report.mode, Mode::DroopNoTable);
    assert_eq!(report.faults, Faults::TABLE_REJECTED);
    assert_eq!(report.misfits, Misfits::NONE);
    let expected = Droop::PAPER.participation(State([METER.f_uhz, 0, 0, 0]));
    assert_eq!(report.participation, expected);
}
