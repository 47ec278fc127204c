//! Every way in which a part of the charger can be missing: the state it enters, what telemetry
//! says, how it leaves.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::num::NonZeroU16;

use firmware::charger::{Charger, ChargerConfig, Watchdog, trust_ticks};
use firmware::dispatch::{Dispatch, DispatchError, SetPoint};
use firmware::droop::Droop;
use firmware::fault::{Faults, Mode, ResetCause};
use firmware::frequency::{FrequencyError, FrequencySource, Reading};
use firmware::link::session::{Session, Wires};
use firmware::link::{Mains, Pins, Request, Response, Setup, SourceKind};
use firmware::table::PlantParameters;
use firmware::telemetry::Frame;
use firmware::units::{Participation, State};
use tests::stand_in;

const SETUP: Setup = Setup {
    source: SourceKind::Deviation,
    bidirectional: true,
    serial: 1,
    limit: 28_000,
    warm_up_ticks: Some(0),
    brown_out: false,
};

/// A charger under test: its clock goes on by a tick a call.
struct Bench<'w> {
    session: Session<'w>,
    now_ms: u32,
}

impl<'w> Bench<'w> {
    fn new(wires: &'w Wires, table: &'w [u8], setup: Setup) -> Self {
        let mut session = Session::new(wires, table);
        assert_eq!(session.handle(&Request::Start(setup)), Response::Done);
        Self { session, now_ms: 0 }
    }

    fn at(&mut self, now_ms: u32, mains: Mains) -> (Frame, Pins) {
        self.now_ms = now_ms.wrapping_add(100);
        match self.session.handle(&Request::Tick { now_ms, mains }) {
            Response::Tick { frame, pins } => (frame, pins),
            other => panic!("{other:?}"),
        }
    }

    fn tick(&mut self, mains: Mains) -> Frame {
        self.at(self.now_ms, mains).0
    }

    /// Ticks at this deviation \[µHz\]; the last frame.
    fn run(&mut self, uhz: i32, ticks: u32) -> Frame {
        (0..ticks)
            .map(|_| self.tick(deviation(uhz)))
            .last()
            .unwrap()
    }
}

fn deviation(uhz: i32) -> Mains {
    Mains::Deviation { uhz, age_ms: 0 }
}

fn mode(frame: &Frame) -> Mode {
    Mode::ALL[usize::from(frame.mode)]
}

fn has(frame: &Frame, fault: Faults) -> bool {
    Faults::from_bits(frame.faults).contains(fault)
}

fn droop_ppm(uhz: i32) -> u32 {
    Droop::PAPER.participation(State([uhz, 0, 0, 0])).ppm()
}

#[test]
fn lost_frequency_is_held_then_released_then_warmed_up() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let setup = Setup {
        warm_up_ticks: Some(20),
        ..SETUP
    };
    let mut bench = Bench::new(&wires, &table, setup);
    bench.run(0, 20);
    // Down to -0.4 Hz at 0.4 Hz/s, and there for a while.
    for n in 1..=10 {
        bench.run(-40_000 * n, 1);
    }
    let before = bench.run(-400_000, 20);
    assert_eq!(mode(&before), Mode::Table);
    assert!(before.participation_ppm > 0);
    for _ in 0..10 {
        let held = bench.tick(Mains::Silent);
        assert_eq!(mode(&held), Mode::Hold);
        assert!(has(&held, Faults::NO_SIGNAL));
        assert_eq!(held.participation_ppm, before.participation_ppm);
        assert_eq!(held.loss_kw, None);
    }
    let mut last = before.participation_ppm;
    for _ in 0..600 {
        let safe = bench.tick(Mains::Silent);
        assert_eq!(mode(&safe), Mode::Safe);
        // 1 667 ppm a tick: released in a minute, whatever was held.
        assert_eq!(safe.participation_ppm, last.saturating_sub(1_667));
        last = safe.participation_ppm;
    }
    assert_eq!(last, 0);
    for _ in 0..20 {
        let back = bench.run(-300_000, 1);
        assert_eq!(mode(&back), Mode::WarmUp);
        assert_eq!(back.participation_ppm, droop_ppm(-300_000));
    }
    assert_ne!(mode(&bench.run(-300_000, 1)), Mode::WarmUp);
}

#[test]
fn a_short_gap_goes_back_to_the_table() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let mut bench = Bench::new(&wires, &table, SETUP);
    bench.run(0, 20);
    for bad in [
        Mains::Silent,
        Mains::Deviation {
            uhz: 0,
            age_ms: 251,
        },
        deviation(5_000_001),
        deviation(1_000_000),
    ] {
        assert_eq!(mode(&bench.tick(bad)), Mode::Hold);
        assert_eq!(mode(&bench.run(0, 1)), Mode::Table);
    }
}

#[test]
fn every_frequency_error_has_its_own_fault() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let mut bench = Bench::new(&wires, &table, SETUP);
    bench.run(0, 20);
    for (bad, fault) in [
        (Mains::Silent, Faults::NO_SIGNAL),
        (
            Mains::Deviation {
                uhz: 0,
                age_ms: 251,
            },
            Faults::STALE,
        ),
        (deviation(5_000_001), Faults::OUT_OF_RANGE),
        (deviation(1_000_000), Faults::IMPLAUSIBLE),
    ] {
        assert_eq!(bench.tick(bad).faults, fault.bits());
        assert_eq!(bench.run(0, 1).faults, 0);
    }
    let chip = Setup {
        source: SourceKind::Ade7953,
        ..SETUP
    };
    let mut bench = Bench::new(&wires, &table, chip);
    assert_eq!(bench.tick(Mains::Silent).faults, Faults::BUS.bits());
    for _ in 0..600 {
        assert_eq!(bench.tick(Mains::Period(4474)).faults, 0);
    }
    assert_eq!(bench.tick(Mains::Period(4474)).faults, Faults::STUCK.bits());
    assert_eq!(bench.tick(Mains::Period(4475)).faults, 0);
}

#[test]
fn a_rejected_table_leaves_the_papers_droop() {
    let wires = Wires::default();
    let mut broken = stand_in::table(true).unwrap();
    broken[500] ^= 1;
    for bytes in [&broken[..], &[0xFF; 4096], &[]] {
        let mut bench = Bench::new(&wires, bytes, SETUP);
        for uhz in [0, -150_000, -200_000, -400_000, -500_000] {
            let frame = bench.run(uhz, 5);
            assert_eq!(mode(&frame), Mode::DroopNoTable);
            assert_eq!(frame.faults, Faults::TABLE_REJECTED.bits());
            assert_eq!(frame.participation_ppm, droop_ppm(uhz));
            assert_eq!(frame.table, None);
        }
    }
}

#[test]
fn outside_the_domain_the_droop_answers_until_the_table_covers_the_state() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let mut bench = Bench::new(&wires, &table, SETUP);
    bench.run(0, 5);
    let mut outside = None;
    for n in 1..=70 {
        let uhz = -20_000 * n;
        let frame = bench.run(uhz, 1);
        if mode(&frame) == Mode::DroopOutside {
            assert_eq!(frame.faults, Faults::OUTSIDE_DOMAIN.bits());
            assert_eq!(frame.participation_ppm, droop_ppm(uhz));
            outside = Some(uhz);
        }
    }
    // The grid ends at -1 Hz; the ramp went to -1.4 Hz.
    assert_eq!(outside, Some(-1_400_000));
    for n in 1..=65 {
        bench.run(-1_400_000 + 20_000 * n, 1);
    }
    // The governor wound up to 7 GW, past the grid; at -0.1 Hz it rests at 0.5 GW within minutes.
    let back = bench.run(-100_000, 1_200);
    assert_eq!((mode(&back), back.faults), (Mode::Table, 0));
}

#[test]
fn missed_ticks_are_made_good() {
    let (wires, other, table) = (
        Wires::default(),
        Wires::default(),
        stand_in::table(true).unwrap(),
    );
    let mut punctual = Bench::new(&wires, &table, SETUP);
    let mut late = Bench::new(&other, &table, SETUP);
    for bench in [&mut punctual, &mut late] {
        bench.run(0, 50);
        bench.run(-60_000, 1);
    }
    // Four ticks pass; the late charger sees the last alone. On a line, its interpolation is exact.
    let expected = (1..=4)
        .map(|n| punctual.run(-60_000 - 20_000 * n, 1))
        .last()
        .unwrap();
    late.now_ms += 300;
    let frame = late.run(-140_000, 1);
    assert_eq!(frame.faults, Faults::OVERRUN.bits());
    assert_eq!(frame.state, expected.state);
    assert_eq!(frame.mode, expected.mode);
    assert_eq!(frame.participation_ppm, expected.participation_ppm);
    assert_eq!(late.run(-140_000, 1).faults, 0);
}

#[test]
fn a_tick_that_comes_early_advances_nothing() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let mut bench = Bench::new(&wires, &table, SETUP);
    let before = bench.run(-40_000, 50);
    let (early, pins) = bench.at(bench.now_ms - 90, deviation(-50_000));
    assert_eq!((early.state, early.mode), (before.state, before.mode));
    assert_eq!(early.faults, 0);
    assert_eq!(pins.fed, 51);
}

#[test]
fn a_jump_of_the_clock_starts_the_observer_again() {
    let table = stand_in::table(true).unwrap();
    let setup = Setup {
        warm_up_ticks: Some(30),
        ..SETUP
    };
    // The bench's clock is a tick ahead already, and one tick too early would be excused.
    for jump_ms in [600, 60_000, 2_000_000_000, -250, -60_000] {
        let wires = Wires::default();
        let mut bench = Bench::new(&wires, &table, setup);
        assert_eq!(mode(&bench.run(-60_000, 40)), Mode::Table);
        bench.now_ms = bench.now_ms.wrapping_add(jump_ms as u32);
        let frame = bench.run(-60_000, 1);
        assert_eq!(frame.faults, Faults::CLOCK_JUMP.bits(), "{jump_ms} ms");
        assert_eq!(mode(&frame), Mode::WarmUp);
        assert_eq!(mode(&bench.run(-60_000, 29)), Mode::WarmUp);
        assert_eq!(mode(&bench.run(-60_000, 1)), Mode::Table);
    }
}

#[test]
fn the_clock_may_wrap() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let mut bench = Bench::new(&wires, &table, SETUP);
    bench.now_ms = u32::MAX - 950;
    for _ in 0..20 {
        assert_eq!(bench.run(0, 1).faults, 0);
    }
}

#[test]
fn a_brown_out_in_mid_event_droops_until_the_observer_is_trusted() {
    let (wires, table) = (Wires::default(), stand_in::table(true).unwrap());
    let setup = Setup {
        warm_up_ticks: None,
        brown_out: true,
        ..SETUP
    };
    let mut bench = Bench::new(&wires, &table, setup);
    // Six times T_2 = 12 s, at ten ticks a second.
    let ticks = trust_ticks(&PlantParameters::PAPER, 100);
    assert_eq!(ticks, 720);
    for _ in 0..ticks {
        let frame = bench.run(-450_000, 1);
        assert_eq!(mode(&frame), Mode::WarmUp);
        assert_eq!(frame.faults, Faults::RESTARTED.bits());
        assert_eq!(frame.participation_ppm, droop_ppm(-450_000));
    }
    let frame = bench.run(-450_000, 1);
    assert_ne!(mode(&frame), Mode::WarmUp);
    assert!(!has(&frame, Faults::RESTARTED));
}

#[test]
fn every_fault_bit_has_a_name() {
    let mut all = Faults::NONE;
    for (fault, name) in Faults::NAMES {
        assert_eq!(fault.bits().count_ones(), 1, "{name}");
        assert!(!all.contains(fault), "{name} twice");
        all.insert(fault);
    }
    assert_eq!(all.bits(), 0xFFFF);
}

struct Steady;

impl FrequencySource for Steady {
    fn error_uhz(&self) -> u32 {
        0
    }

    fn lag_ms(&self) -> u16 {
        0
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        None
    }

    fn read(&mut self, _now_ms: u32) -> Result<Reading, FrequencyError> {
        Ok(Reading {
            deviation_uhz: 0,
            age_ms: 0,
        })
    }
}

/// Fails every third time.
struct Flaky(u32);

impl Dispatch for Flaky {
    fn apply(&mut self, _: Participation, _now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.0 += 1;
        if self.0.is_multiple_of(3) {
            Err(DispatchError::Pilot)
        } else {
            Ok(SetPoint::Paused)
        }
    }

    fn rest(&mut self, now_ms: u32) -> Result<SetPoint, DispatchError> {
        self.apply(Participation::NONE, now_ms)
    }
}

struct Dog<'c>(&'c std::cell::Cell<u32>);

impl Watchdog for Dog<'_> {
    fn feed(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

#[test]
fn the_watchdog_is_fed_by_completed_ticks_alone() {
    let fed = std::cell::Cell::new(0);
    let table = stand_in::table(true).unwrap();
    let mut charger = Charger::new(
        Steady,
        Flaky(0),
        Dog(&fed),
        &table,
        ChargerConfig::DEFAULT,
        ResetCause::PowerOn,
    );
    for tick in 1..=30u32 {
        let before = fed.get();
        let report = charger.tick(tick * 100);
        let failed = tick.is_multiple_of(3);
        assert_eq!(report.faults.contains(Faults::DISPATCH), failed);
        assert_eq!(report.set_point.is_none(), failed);
        assert_eq!(fed.get() - before, u32::from(!failed));
    }
}
