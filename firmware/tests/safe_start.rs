//! Nothing is energised that should not be: at the start, without mains, and after the mains was
//! gone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::cell::Cell;
use std::num::NonZeroU16;
use std::rc::Rc;

use firmware::charger::{Charger, ChargerConfig, StartDelay, Watchdog};
use firmware::dispatch::{Dispatch, DispatchError, SetPoint};
use firmware::fault::{Faults, Mode, ResetCause};
use firmware::frequency::{FrequencyError, FrequencySource, Reading};
use firmware::link::session::{PILOT_COUNTS, Session, Wires};
use firmware::link::{Mains, Pins, Request, Response, Setup, SourceKind};
use firmware::telemetry::{Frame, WireSetPoint};
use firmware::units::Participation;

const TICK_MS: u32 = 100;

/// A charger behind the link, without a table: the droop, which asks for nothing at 50 Hz.
struct Bench<'w> {
    session: Session<'w>,
    now_ms: u32,
}

impl<'w> Bench<'w> {
    fn new(wires: &'w Wires, bidirectional: bool) -> Self {
        let mut session = Session::new(wires, &[]);
        let setup = Setup {
            source: SourceKind::Deviation,
            bidirectional,
            serial: 1,
            limit: 32_000,
            warm_up_ticks: Some(0),
            brown_out: false,
        };
        assert_eq!(session.handle(&Request::Start(setup)), Response::Done);
        Self { session, now_ms: 0 }
    }

    fn tick(&mut self, mains: Mains) -> (Frame, Pins) {
        let now_ms = self.now_ms;
        self.now_ms += TICK_MS;
        match self.session.handle(&Request::Tick { now_ms, mains }) {
            Response::Tick { frame, pins } => (frame, pins),
            other => unreachable!("{other:?}"),
        }
    }
}

const NOMINAL: Mains = Mains::Deviation { uhz: 0, age_ms: 0 };

fn is_at_rest(frame: &Frame, pins: &Pins) -> bool {
    frame.set_point == WireSetPoint::Paused && !pins.contactor && pins.pilot_counts == PILOT_COUNTS
}

#[test]
fn without_mains_a_unidirectional_charger_is_open_and_offers_nothing() {
    let wires = Wires::default();
    let mut bench = Bench::new(&wires, false);
    for _ in 0..3_000 {
        let (frame, pins) = bench.tick(Mains::Silent);
        assert!(is_at_rest(&frame, &pins), "{frame:?} {pins:?}");
        assert!(Faults::from_bits(frame.faults).contains(Faults::NO_SIGNAL));
    }
    // 32 A are a duty of 53.3 %.
    let (frame, pins) = bench.tick(NOMINAL);
    assert_eq!(frame.set_point, WireSetPoint::CurrentMa(32_000));
    assert!(pins.contactor);
    assert_eq!(pins.pilot_counts, 22_399);
}

#[test]
fn without_mains_a_power_stage_is_told_no_power() {
    let wires = Wires::default();
    let mut bench = Bench::new(&wires, true);
    for _ in 0..3_000 {
        let (frame, pins) = bench.tick(Mains::Silent);
        assert_eq!(
            (frame.set_point, pins.power_w),
            (WireSetPoint::PowerW(0), 0)
        );
    }
    assert_eq!(bench.tick(NOMINAL).1.power_w, 32_000);
}

#[test]
fn when_the_mains_is_gone_the_charger_comes_to_rest() {
    let wires = Wires::default();
    let mut bench = Bench::new(&wires, false);
    assert!(bench.tick(NOMINAL).1.contactor);
    // Held for 1 s, as a gap may be short.
    for _ in 0..10 {
        let (frame, pins) = bench.tick(Mains::Silent);
        assert_eq!(Mode::ALL[usize::from(frame.mode)], Mode::Hold);
        assert!(pins.contactor);
    }
    for _ in 0..100 {
        let (frame, pins) = bench.tick(Mains::Silent);
        assert!(is_at_rest(&frame, &pins), "{frame:?} {pins:?}");
    }
    assert!(bench.tick(NOMINAL).1.contactor);
}

/// A source that a test switches off.
struct Switched(Rc<Cell<bool>>);

impl FrequencySource for Switched {
    fn error_uhz(&self) -> u32 {
        1
    }

    fn lag_ms(&self) -> u16 {
        0
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        None
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        let reading = Reading {
            deviation_uhz: -1_234,
            age_ms: 0,
        };
        self.0
            .get()
            .then_some(reading)
            .ok_or(FrequencyError::NoSignal)
    }
}

/// Notes whether it was told to apply a participation.
struct Noted(Rc<Cell<bool>>);

impl Dispatch for Noted {
    fn apply(&mut self, _: Participation, _: u32) -> Result<SetPoint, DispatchError> {
        self.0.set(true);
        Ok(SetPoint::Current { ma: 32_000 })
    }

    fn rest(&mut self, _: u32) -> Result<SetPoint, DispatchError> {
        self.0.set(false);
        Ok(SetPoint::Paused)
    }
}

struct NoDog;

impl Watchdog for NoDog {
    fn feed(&mut self) {}
}

/// The tick at which the charger is first energised, the mains being there from a tick on.
fn first_energised(serial: u32, cause: ResetCause, mains_from: u32) -> u32 {
    let (mains, energised) = (Rc::new(Cell::new(false)), Rc::new(Cell::new(false)));
    let config = ChargerConfig {
        start_delay: StartDelay::street(serial),
        ..ChargerConfig::DEFAULT
    };
    let source = Switched(mains.clone());
    let dispatch = Noted(energised.clone());
    let mut charger = Charger::new(source, dispatch, NoDog, &[], config, cause);
    for tick in 0..10_000 {
        mains.set(tick >= mains_from);
        charger.tick(tick * TICK_MS);
        if energised.get() {
            return tick;
        }
    }
    u32::MAX
}

#[test]
fn the_delay_runs_from_the_mains_and_holds_after_every_kind_of_reset() {
    for cause in [
        ResetCause::PowerOn,
        ResetCause::BrownOut,
        ResetCause::Watchdog,
    ] {
        for serial in 0..20 {
            for mains_from in [0, 700] {
                let tick = first_energised(serial, cause, mains_from);
                // 60 s to 660 s, in ticks.
                let after = tick - mains_from;
                assert!(
                    (600..=6_600).contains(&after),
                    "{cause:?} {serial}: {after}"
                );
            }
        }
    }
}

#[test]
fn neighbours_return_at_different_moments() {
    let mut ticks: Vec<u32> = (0..50)
        .map(|serial| first_energised(serial, ResetCause::PowerOn, 0))
        .collect();
    ticks.sort_unstable();
    ticks.dedup();
    // Of 50 draws from 6 000 ticks, more than 5 pairs that agree have a probability below 1e-6.
    assert!(ticks.len() >= 45, "{}", ticks.len());
}

/// The frames' faults and whether anything was energised, over 200 s of healthy mains.
fn with_standing(standing_faults: Faults) -> (Vec<Faults>, bool, Mode) {
    let energised = Rc::new(Cell::new(false));
    let config = ChargerConfig {
        standing_faults,
        ..ChargerConfig::DEFAULT
    };
    let source = Switched(Rc::new(Cell::new(true)));
    let dispatch = Noted(energised.clone());
    let mut charger = Charger::new(source, dispatch, NoDog, &[], config, ResetCause::Watchdog);
    let mut ever = false;
    let mut faults = Vec::new();
    let mut mode = Mode::WarmUp;
    for tick in 0..2_000 {
        let report = charger.tick(tick * TICK_MS);
        ever |= energised.get();
        faults.push(report.faults);
        mode = report.mode;
    }
    (faults, ever, mode)
}

#[test]
fn without_its_crystal_a_charger_believes_no_frequency_and_energises_nothing() {
    let (faults, energised, mode) = with_standing(Faults::CLOCK);
    assert!(!energised);
    assert!(faults.iter().all(|found| found.contains(Faults::CLOCK)));
    assert_eq!(mode, Mode::Safe);
}

#[test]
fn a_run_that_was_stopped_is_told_in_the_next_and_changes_nothing_else() {
    let (faults, energised, mode) = with_standing(Faults::STOPPED);
    assert!(energised);
    assert!(faults.iter().all(|found| found.contains(Faults::STOPPED)));
    assert_eq!(mode, Mode::DroopNoTable);
}
