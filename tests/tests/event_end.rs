//! The end of an event, in closed loop with the grid: the charger's own code over the shipped
//! tables.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use std::collections::VecDeque;

use firmware::fault::Mode;
use firmware::link::session::{Session, Wires};
use firmware::link::{Mains, Request, Response, Setup, SourceKind};
use firmware::phase::{Decision, Phase, PhaseState};
use firmware::prediction::History;
use firmware::table::TableView;
use firmware::units::State;
use model::plant::Plant;
use model::propagator::Propagator;
use synth::delay::Delay;
use tests::stand_in;
use tests::testing::{load, shipped};

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
    state: State,
}

/// A loss over time \[GW\] against a bidirectional fleet with this shipped table.
fn run(table: &str, until_s: f64, loss_gw: impl Fn(f64) -> f64) -> Vec<Tick> {
    run_late(&shipped(table), 0, until_s, loss_gw)
}

/// The same with any table, and a fleet that answers so many ticks late.
fn run_late(
    table: &[u8],
    delay_ticks: usize,
    until_s: f64,
    loss_gw: impl Fn(f64) -> f64,
) -> Vec<Tick> {
    let wires = Wires::default();
    let mut session = Session::new(&wires, table);
    let setup = Setup {
        source: SourceKind::Deviation,
        bidirectional: true,
        serial: 1,
        limit: 28_000,
        warm_up_ticks: Some(0),
        brown_out: false,
    };
    assert_eq!(session.handle(&Request::Start(setup)), Response::Done);
    let plant = Plant::new(&load("paper-bi", &[]));
    assert_eq!(plant.fleet, FLEET_GW);
    let grid = Propagator::new(&plant, TICK_S);
    let mut x = [0.0_f64; 4];
    let mut under_way = VecDeque::from(vec![0.0; delay_ticks]);
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
                state: State(frame.state),
            };
            under_way.push_back(f64::from(frame.participation_ppm) * 1e-6);
            let share = under_way.pop_front().unwrap();
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
    for table in ["paper-bi", "gb-bi-band"] {
        let ticks = run(table, 1800.0, loss);
        let at = first_release(&ticks);
        let after = &ticks[at..];
        assert!(ticks[..at].iter().any(|tick| tick.share_ppm > 0), "{table}");
        falls(after, 1_670);
        // The demand comes back no faster than a fleet in one minute: f stays inside I1's lower
        // end.
        let lowest = after.iter().map(|tick| tick.f_hz).fold(0.0, f64::min);
        assert!(lowest > OUTER_LOW_HZ, "{table}: {lowest}");
        let last = ticks.last().unwrap();
        assert_eq!((last.share_ppm, last.mode, last.phase), (0, Mode::Table, 0));
    }
}

#[test]
fn a_generator_that_comes_back_at_once_does_not_make_the_fleet_hunt() {
    let loss = |s: f64| if s < 200.0 { 2.0 } else { 0.0 };
    for table in ["paper-bi", "gb-bi-band"] {
        let ticks = run(table, 1800.0, loss);
        let at = first_release(&ticks);
        falls(&ticks[at..], 1_670);
        let last = ticks.last().unwrap();
        assert_eq!((last.share_ppm, last.mode, last.phase), (0, Mode::Table, 0));
        assert!(last.f_hz.abs() < 0.01, "{last:?}");
    }
}

/// Hold gives no more than it must, so f stays below 49.9 Hz and the event lasts: the proof's "for
/// ever" is not cut short.
#[test]
fn an_event_whose_loss_nobody_replaces_does_not_end() {
    let ticks = run("gb-bi-band", 3600.0, |_| 2.0);
    assert!(ticks.iter().all(|tick| tick.mode == Mode::Table));
    assert!(ticks.last().unwrap().share_ppm > 0);
}

/// More than half of the loss is replaced, and what Fixed still holds brings f above 49.9 Hz, or
/// above I1.
#[test]
fn a_release_that_comes_too_early_stands_still_above_i1() {
    for rest_gw in [0.8, 0.85, 0.9] {
        let loss = |s: f64| if s < 200.0 { 2.0 } else { rest_gw };
        let ticks = run("paper-bi", 3600.0, loss);
        let after = &ticks[first_release(&ticks)..];
        falls(after, 1_670);
        // Never below I1, where the event would begin anew: the release just stands still.
        assert!(after.iter().all(|tick| tick.mode == Mode::Release));
        assert!(after.iter().all(|tick| tick.f_hz > OUTER_LOW_HZ));
        // At rest f = (1.4 u - w) / 6: a tick of release moves it by 1.4 * 167e-6 / 6 = 0.04 mHz,
        // and the last ones before it stood still may not have come through yet: 25 of them are
        // allowed, 2.5 s.
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
    for table in ["paper-bi", "gb-bi-band"] {
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

/// The commands that the charger gave are all that is under way, whoever decided them: from them
/// alone follows every decision.
#[test]
fn the_next_loss_within_the_delay_is_decided_on_what_is_under_way() {
    let (mut anew, mut forgetful) = (0, 0);
    for delay_ticks in [10, 20] {
        let set = format!(
            "uncertainty.actuation_delay_s={}",
            delay_ticks as f64 * TICK_S
        );
        let spec = load("paper-bi", &[&set]);
        let delay = Delay::of(&spec).unwrap().unwrap();
        let bytes = stand_in::late(&shipped("paper-bi"), &delay).unwrap();
        let table = TableView::parse(&bytes).unwrap();
        // Every second loss comes while the fleet is released from the first.
        for (second_s, second_gw) in [(225.0, 1.5), (260.0, 2.0), (300.0, 1.0), (380.0, 2.0)] {
            let loss = |s: f64| match s {
                s if s < 200.0 => 2.0,
                s if s < second_s => 0.0,
                _ => second_gw,
            };
            let ticks = run_late(&bytes, delay_ticks, second_s + 60.0, loss);
            let (begun, otherwise) = follow(&table, &ticks);
            println!("{delay_ticks} {second_s} {second_gw}: {begun} {otherwise}");
            anew += begun;
            forgetful += otherwise;
        }
    }
    // The case exists, and forgetting what is under way would have decided otherwise.
    assert!(anew > 0 && forgetful > 0, "{anew} {forgetful}");
}

/// Holds every decision of a run against the phase machine on what follows from the commands so
/// far. How many events began during a release, and for how many the decision would have been
/// another had the commands under way been forgotten.
fn follow(table: &TableView<'_>, ticks: &[Tick]) -> (u32, u32) {
    let prediction = table.prediction().unwrap();
    let step_ppm = table.header().input_step_ppm;
    let (mut history, mut state) = (History::NONE, PhaseState::INITIAL);
    let (mut anew, mut forgetful) = (0, 0);
    for pair in ticks.windows(2) {
        let (before, now) = (&pair[0], &pair[1]);
        // What droop and release command are whole levels too, or the prediction would not know
        // them.
        assert_eq!(before.share_ppm % step_ppm, 0, "{before:?}");
        history.push((before.share_ppm / step_ppm) as u8);
        if now.mode == Mode::Release {
            state = PhaseState::INITIAL;
            continue;
        }
        let decided = |history: &History| {
            let ahead = || prediction.predict(now.state, history);
            state.step_ahead(table, now.state, ahead)
        };
        let (next, step) = decided(&history);
        if before.mode == Mode::Release && next.phase != Phase::NoControl {
            anew += 1;
            forgetful += u32::from(decided(&History::NONE).1 != step);
        }
        state = next;
        assert_eq!(now.phase, next.phase.number(), "{now:?}");
        if let Decision::Level(level) = step {
            assert_eq!(now.share_ppm, step_ppm * u32::from(level), "{now:?}");
        }
    }
    (anew, forgetful)
}
