//! Commands that act late, in simulation and on the device.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::control_loop::{ControlLoop, Source};
use firmware::phase::Phase;
use firmware::prediction::prediction_len;
use firmware::table::{
    DENSE_HEADER_LEN, HEADER_LEN, InputsKind, LawEntry, TableView, bits_per_entry,
};
use firmware::units::State;
use lab::simulation::closed_loop::{self, Estimator};
use lab::simulation::scenario::Scenario;
use model::plant::Plant;
use model::propagator::Propagator;
use model::spec::Spec;
use synth::emit::{self, EncodedLaw};
use synth::problem::Problem;
use tests::testing::load;

/// A table that answers the trigger, and every state of the grid after it, with one level.
fn always(spec: &Spec, level: u8) -> Vec<u8> {
    let problem = Problem::new(spec).unwrap();
    let (grid, head) = (problem.grid, emit::head(&problem).unwrap());
    let bits = bits_per_entry(head.header.levels) as usize;
    let mut inputs = vec![0u8; DENSE_HEADER_LEN + (grid.cells() as usize * bits).div_ceil(8)];
    for (axis, count) in grid.count().iter().enumerate() {
        inputs[8 + 2 * axis..10 + 2 * axis].copy_from_slice(&count.to_le_bytes());
    }
    for position in 0..grid.cells() as usize * bits {
        let bit = (level + 1) >> (position % bits) & 1;
        inputs[DENSE_HEADER_LEN + position / 8] |= bit << (position % 8);
    }
    let law = EncodedLaw {
        entry: LawEntry {
            domain_kind: 0,
            inputs_kind: InputsKind::Dense as u8,
            worst_visits: 1,
            domain_len: 0,
            inputs_len: inputs.len() as u32,
        },
        domain: Vec::new(),
        inputs,
    };
    emit::assemble(head, &[None, None, Some(law)]).unwrap()
}

const COARSE: [&str; 6] = [
    "grid={lower=[-1.2,-1,-1,-1],upper=[0.2,5,4,4],width=[0.1,1,1,1],alignment=\"edges\"}",
    "requirements.containment_hz=none",
    "requirements.stay=true",
    "requirements.inner_hz=[-0.2,0]",
    "sampling.watch_s=0.01",
    "sampling.period_s=1",
];

/// Nadirs \[Hz\] of full response from the moment at which f leaves I1, by delay; from independent
/// programs.
const NADIRS: [(&str, [(f64, f64); 5]); 2] = [
    (
        "paper-uni",
        [
            (0.0, 49.391),
            (1.0, 49.336),
            (2.0, 49.262),
            (3.0, 49.184),
            (5.0, 49.128),
        ],
    ),
    (
        "paper-bi",
        [
            (0.0, 49.661),
            (1.0, 49.510),
            (2.0, 49.357),
            (3.0, 49.244),
            (5.0, 49.134),
        ],
    ),
];

#[test]
fn a_full_response_that_comes_late_has_the_nadirs_of_others() {
    for (name, nadirs) in NADIRS {
        let mut set = COARSE.to_vec();
        if name == "paper-uni" {
            set.push("requirements.outer_hz=[-0.45,0]");
        }
        let spec = load(name, &set);
        let bytes = always(&spec, 20);
        let table = TableView::parse(&bytes).unwrap();
        for (delay_s, nadir_hz) in nadirs {
            let scenario = Scenario {
                delay_s,
                duration_s: 30.0,
                ..Scenario::of(&spec)
            };
            let run =
                closed_loop::simulate(&spec, &table, &scenario, Estimator::FullState).unwrap();
            let found = run.summary.nadir_hz;
            // A tick of 10 ms later at up to 0.25 Hz/s, and half of the last printed digit.
            assert!(
                (found - nadir_hz).abs() <= 0.0025 + 0.0005,
                "{name} {delay_s}: {found}"
            );
        }
    }
}

#[test]
fn the_specs_delay_and_the_scenarios_are_one() {
    let mut set = COARSE.to_vec();
    set.push("sampling.watch_s=0.1");
    let spec = load("paper-bi", &set);
    set.push("uncertainty.actuation_delay_s=1");
    let late = load("paper-bi", &set);
    // The prediction part is there, and the answer is the same level whatever is predicted.
    let (bytes, late_bytes) = (always(&spec, 20), always(&late, 20));
    assert_eq!(late_bytes.len(), bytes.len() + prediction_len(10));
    let flag = Scenario {
        delay_s: 1.0,
        ..Scenario::of(&spec)
    };
    let key = Scenario::of(&late);
    assert_eq!(key.delay_s, 1.0);
    let run = |spec: &Spec, bytes: &[u8], scenario: &Scenario| {
        let table = TableView::parse(bytes).unwrap();
        closed_loop::simulate(spec, &table, scenario, Estimator::FullState)
            .unwrap()
            .summary
    };
    let (flag, key) = (run(&spec, &bytes, &flag), run(&late, &late_bytes, &key));
    assert_eq!((flag.nadir_hz, flag.final_hz), (key.nadir_hz, key.final_hz));
    // Without any delay the fall is caught earlier.
    let now = run(&spec, &bytes, &Scenario::of(&spec));
    assert!(now.nadir_hz > key.nadir_hz + 0.1);
}

#[test]
fn the_device_predicts_what_the_grid_becomes() {
    let mut set = COARSE.to_vec();
    set.extend(["sampling.watch_s=0.1", "uncertainty.actuation_delay_s=1"]);
    let spec = load("paper-bi", &set);
    let bytes = always(&spec, 10);
    let table = TableView::parse(&bytes).unwrap();
    let prediction = table.prediction().unwrap();
    assert_eq!(
        bytes[HEADER_LEN..].len() as u32 - table.header().laws[2].unwrap().inputs_len,
        244
    );
    // A fall with commands under way: the loop's own memory must be what a prediction from outside
    // would use.
    let plant = Plant::new(&spec);
    let step = Propagator::new(&plant, 0.1);
    let mut control = ControlLoop::new(&bytes);
    let mut history = firmware::prediction::History::NONE;
    let mut under_way = std::collections::VecDeque::from([0.0; 10]);
    let (mut x, mut states, mut predicted) = ([0.0; 4], Vec::new(), Vec::new());
    for _ in 0..60 {
        let state = State(x.map(|v: f64| (v * 1e6).floor() as i32));
        states.push(state);
        predicted.push(prediction.predict(state, &history));
        let action = control.step(state);
        assert_eq!(action.source, Source::Table);
        let level = if action.phase == Phase::NoControl {
            0
        } else {
            10
        };
        assert_eq!(action.participation.ppm(), 50_000 * u32::from(level));
        history.push(level);
        under_way.push_back(f64::from(action.participation.ppm()) * 1e-6);
        let acting = under_way.pop_front().unwrap();
        x = step.step(&x, plant.fleet * acting - 2.0);
    }
    // The loss is the expected one: ten ticks later the state is the predicted one, but for the
    // floors of f, g, l, p and ρ.
    for (then, now) in predicted.iter().zip(&states[10..]) {
        for axis in 0..4 {
            assert!((then.0[axis] - now.0[axis]).abs() <= 10, "{then:?} {now:?}");
        }
    }
}
