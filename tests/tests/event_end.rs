//! The end of an event, in closed loop with the grid: the charger's own code over the shipped tables.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use firmware::fault::Mode;
use firmware::link::session::{Session, Wires};
use firmware::link::{Mains, Request, Response, Setup, SourceKind};
use table_gen::simulation::propagator::Propagator;
use tests::pil::run::plant;
use tests::root;

const TICK_S: f64 = 0.1;
const FLEET_GW: f64 = 1.4;
/// Lower end of I1 in both tables \[Hz\].
const OUTER_LOW_HZ: f64 = -0.3;

/// A tick of the run.
#[derive(Debug, Clone, Copy)]
struct Tick {
    s: f64,
    f_hz: f64,
    share_ppm: u32,
    mode: Mode,
    phase: u8,
}

/// A loss over time \[GW\] against a bidirectional fleet with this table.
fn run(table: &str, until_s: f64, loss_gw: impl Fn(f64) -> f64) -> Vec<Tick> {
    let table = std::fs::read(root().join("firmware/tables").join(table)).unwrap();
    let wires = Wires::default();
    let mut session = Session::new(&wires, &table);
    let setup = Setup {
        source: SourceKind::Deviation,
        bidirectional: true,
        serial: 1,
        limit: 28_000,
        warm_up_ticks: Some(0),
        brown_out: false,
    };
    assert_eq!(session.handle(&Request::Start(setup)), Response::Done);
    let grid = Propagator::new(&plant(FLEET_GW), TICK_S);
    let mut x = [0.0_f64; 4];
    (0..(until_s / TICK_S) as u32)
        .map(|n| {
            let s = f64::from(n) * TICK_S;
            let mains = Mains::Deviation {
                uhz: (x[0] * 1e6).floor() as i32,
                age_ms: 0,
            };
            let now_ms = n * 100;
            let answer = session.handle(&Request::Tick { now_ms, mains });
            let Response::Tick { frame, .. } = answer else {
                panic!("{answer:?}")
            };
            let tick = Tick {
                s,
                f_hz: x[0],
                share_ppm: frame.participation_ppm,
                mode: Mode::ALL[usize::from(frame.mode)],
                phase: frame.phase,
            };
            let share = f64::from(frame.participation_ppm) * 1e-6;
            x = grid.step(&x, FLEET_GW * share - loss_gw(s));
            tick
        })
        .collect()
}

fn first_release(ticks: &[Tick]) -> usize {
    let found = ticks.iter().position(|tick| tick.mode == Mode::Release);
    found.unwrap_or_else(|| panic!("no release: {:?}", ticks.last()))
}

/// From the release on participation only falls, by at most `most_ppm` a tick.
fn falls(ticks: &[Tick], most_ppm: u32) {
    for pair in ticks.windows(2) {
        let (before, now) = (pair[0].share_ppm, pair[1].share_ppm);
        assert!(now <= before && before - now <= most_ppm, "{pair:?}");
    }
}

#[test]
fn reserves_replace_the_loss_and_charging_resumes() {
    let loss = |s: f64| (2.0 * (1.0 - (s - 200.0) / 300.0)).clamp(0.0, 2.0);
    for table in ["paper-bi.bin", "gb-bi.bin"] {
        let ticks = run(table, 1800.0, loss);
        let at = first_release(&ticks);
        let after = &ticks[at..];
        assert!(ticks[..at].iter().any(|tick| tick.share_ppm > 0), "{table}");
        falls(after, 1_670);
        // The demand comes back no faster than a fleet in one minute: f stays inside I1's lower end.
        let lowest = after.iter().map(|tick| tick.f_hz).fold(0.0, f64::min);
        assert!(lowest > OUTER_LOW_HZ, "{table}: {lowest}");
        let last = ticks.last().unwrap();
        assert_eq!((last.share_ppm, last.mode, last.phase), (0, Mode::Table, 0));
    }
}

#[test]
fn a_generator_that_comes_back_at_once_does_not_make_the_fleet_hunt() {
    let loss = |s: f64| if s < 200.0 { 2.0 } else { 0.0 };
    for table in ["paper-bi.bin", "gb-bi.bin"] {
        let ticks = run(table, 1800.0, loss);
        let at = first_release(&ticks);
        falls(&ticks[at..], 1_670);
        let last = ticks.last().unwrap();
        assert_eq!((last.share_ppm, last.mode, last.phase), (0, Mode::Table, 0));
        assert!(last.f_hz.abs() < 0.01, "{last:?}");
    }
}

/// Hold gives no more than it must, so f stays below 49.9 Hz and the event lasts: the proof's "for ever" is not cut short.
#[test]
fn an_event_whose_loss_nobody_replaces_does_not_end() {
    let ticks = run("gb-bi.bin", 3600.0, |_| 2.0);
    assert!(ticks.iter().all(|tick| tick.mode == Mode::Table));
    assert!(ticks.last().unwrap().share_ppm > 0);
}

/// More than half of the loss is replaced, and what Fixed still holds brings f above 49.9 Hz, or above I1.
#[test]
fn a_release_that_comes_too_early_stands_still_above_i1() {
    for rest_gw in [0.7, 0.8, 0.9] {
        let loss = |s: f64| if s < 200.0 { 2.0 } else { rest_gw };
        let ticks = run("paper-bi.bin", 3600.0, loss);
        let after = &ticks[first_release(&ticks)..];
        falls(after, 1_670);
        // Never below I1, where the event would begin anew: the release just stands still.
        assert!(after.iter().all(|tick| tick.mode == Mode::Release));
        assert!(after.iter().all(|tick| tick.f_hz > OUTER_LOW_HZ));
        // At rest f = (1.4 u - w) / 6: a tick of release moves it by 1.4 * 167e-6 / 6 = 0.04 mHz, and the last ones before
        // it stood still may not have come through yet: 25 of them are allowed, 2.5 s.
        let last = ticks.last().unwrap();
        assert!((last.f_hz + 0.1).abs() < 1e-3, "{rest_gw}: {last:?}");
        let rest = (FLEET_GW * f64::from(last.share_ppm) * 1e-6 - rest_gw) / 6.0;
        assert!((last.f_hz - rest).abs() < 1e-3, "{rest_gw}: {last:?}");
    }
}

#[test]
fn the_next_loss_during_a_release_is_answered() {
    let loss = |s: f64| match s {
        s if s < 200.0 => 2.0,
        s if s < 400.0 => 0.0,
        _ => 2.0,
    };
    for table in ["paper-bi.bin", "gb-bi.bin"] {
        let ticks = run(table, 520.0, loss);
        let second = ticks.iter().filter(|tick| tick.s >= 400.0);
        let below = second
            .clone()
            .find(|tick| tick.f_hz < OUTER_LOW_HZ)
            .unwrap_or_else(|| panic!("{table}: the second loss does not bring f below I1"));
        // The estimate is the floor in µHz: the same tick decides.
        assert_ne!(below.mode, Mode::Release, "{table}: {below:?}");
        assert!(below.share_ppm > 0, "{table}: {below:?}");
        let lowest = second.map(|tick| tick.f_hz).fold(0.0, f64::min);
        assert!(lowest > -0.8, "{table}: {lowest}");
    }
}
