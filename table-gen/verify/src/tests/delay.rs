//! Commands that act with a delay: the device's prediction against an integration, the boxes of
//! games and verifier against trajectories.

use firmware::prediction::{History, PredictionView};
use firmware::table::{LAWS, TableView};
use firmware::units::State;

use super::Random;
use crate::closed_loop::Model;
use crate::delayed_loop::closed_loop;
use crate::successor::{index, successor};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;
use synth::abstraction::Abstraction;
use synth::delay::Delay;
use synth::emit;
use synth::problem::Problem;
use synth::synthesis;

/// A spec with Hold, a delay of half a period, and a little of every other uncertainty, on a grid
/// of 492,480 cells.
const DELAYED: [&str; 9] = [
    "name=delayed",
    "grid={lower=[-0.9,-0.4,-0.2,-0.2],upper=[0.3,3.4,2.2,2.2],width=[0.02,0.2,0.1,0.1],alignment=\"edges\"}",
    "sampling.period_s=2.0",
    "uncertainty.measurement=[0.0005,0.001,0.001,0.001]",
    "uncertainty.participation=0.01",
    "uncertainty.loss_gw=[1.995,2.005]",
    "uncertainty.actuation_delay_s=1.0",
    "requirements.outer_hz=[-0.4,0.2]",
    "requirements.inner_hz=[-0.4,0.2]",
];

pub(super) fn delayed(more: &[&str]) -> Spec {
    let all: Vec<String> = DELAYED
        .iter()
        .chain(more)
        .map(|s| (*s).to_owned())
        .collect();
    Spec::load("gb-bi-band", &all).unwrap()
}

/// A table of head and no laws.
pub(super) fn bare(spec: &Spec) -> Vec<u8> {
    let none: [Option<emit::EncodedLaw>; LAWS] = [None, None, None];
    emit::assemble(emit::head(&Problem::new(spec).unwrap()).unwrap(), &none).unwrap()
}

/// In [-1, 1], an end half of the time.
pub(super) fn extreme(random: &mut Random) -> f64 {
    if random.sign() > 0.0 {
        random.sign()
    } else {
        2.0 * random.unit() - 1.0
    }
}

pub(super) fn level(random: &mut Random, spec: &Spec) -> u8 {
    let last = spec.input.levels() as f64 - 1.0;
    ((0.5 + 0.5 * extreme(random)) * last).round() as u8
}

/// The plant over a tick by fourth-order Runge-Kutta steps of at most 2 ms, states and power in
/// micro-units. The fastest mode is 2/s, so a step errs by (0.004)^5 / 120, relatively, and 6.4 s
/// by less than 1e-10: below a thousandth of a micro-unit for states of a few units.
pub(super) fn fly(plant: &Plant, mut x: [f64; STATES], power: f64, tick_s: f64) -> [f64; STATES] {
    let steps = (tick_s / 0.002).ceil();
    let h = tick_s / steps;
    for _ in 0..steps as u32 {
        let at = |k: &[f64; STATES], f: f64| std::array::from_fn(|d| x[d] + f * h * k[d]);
        let k1 = plant.derivative(x, power);
        let k2 = plant.derivative(at(&k1, 0.5), power);
        let k3 = plant.derivative(at(&k2, 0.5), power);
        let k4 = plant.derivative(at(&k3, 1.0), power);
        x = std::array::from_fn(|d| x[d] + h / 6.0 * (k1[d] + 2.0 * k2[d] + 2.0 * k3[d] + k4[d]));
    }
    x
}

pub(super) fn load(name: &str, set: &[&str]) -> Spec {
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    Spec::load(name, &set).unwrap()
}

fn specs() -> Vec<Spec> {
    vec![
        delayed(&[]),
        delayed(&["uncertainty.actuation_delay_s=0.1", "input.step=0.1"]),
        // Longer than a period, and with everything wide.
        load(
            "gb-uni-band",
            &["uncertainty.actuation_delay_s=2.0", "sampling.period_s=0.5"],
        ),
        load(
            "gb-bi-band",
            &[
                "uncertainty.actuation_delay_s=6.4",
                "uncertainty.participation=0.3",
            ],
        ),
        load(
            "paper-bi",
            &[
                "uncertainty.actuation_delay_s=1.5",
                "uncertainty.loss_gw=[1.5,2.2]",
            ],
        ),
    ]
}

#[test]
fn a_prediction_is_within_its_bound_of_an_integration() {
    let mut random = Random::new(1);
    for spec in specs() {
        let delay = Delay::of(&spec).unwrap().unwrap();
        let bytes = bare(&spec);
        let view = TableView::parse(&bytes).unwrap();
        let prediction = view.prediction().unwrap();
        assert_eq!(prediction.ticks() as u32, delay.ticks);
        let plant = Plant::new(&spec);
        let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
        let fleet = spec.fleet_power_gw() * 1e6;
        let [low, high] = spec.uncertainty.loss_gw;
        let loss = 0.5 * (low + high) * 1e6;
        // A few micro-units: nothing beside a cell. Most of it is a micro-unit of f that becomes K
        // kW of g.
        assert!(
            delay.rounding.iter().all(|rho| *rho < 40.0),
            "{:?}",
            delay.rounding
        );
        for _ in 0..60 {
            let state = State(std::array::from_fn(|_| (3e6 * extreme(&mut random)) as i32));
            let mut history = History::NONE;
            let levels: Vec<u8> = (0..delay.ticks)
                .map(|_| level(&mut random, &spec))
                .collect();
            // What came before the delay must not matter.
            history.push(level(&mut random, &spec));
            let mut x = state.0.map(f64::from);
            for level in &levels {
                history.push(*level);
                let power = fleet * spec.input.value((*level).into()) - loss;
                x = fly(&plant, x, power, tick_s);
            }
            let predicted = prediction.predict(state, &history);
            for d in 0..STATES {
                let off = f64::from(predicted.0[d]) - x[d];
                // The result was floored; 0.01 for the integration.
                let rho = delay.rounding[d];
                assert!(
                    off <= rho + 0.01 && off >= -1.0 - rho - 0.01,
                    "{}: axis {d}, {off} off, {rho} allowed",
                    spec.name
                );
            }
        }
    }
}

/// A loop in mid-event: the real plant, the commands under way, and what the device knows.
struct Loop<'t> {
    spec: &'t Spec,
    plant: Plant,
    prediction: PredictionView<'t>,
    history: History,
    /// Levels under way, the oldest first.
    under_way: std::collections::VecDeque<u8>,
    x: [f64; STATES],
    tick_s: f64,
    /// Mean ticks for which loss and participation keep their errors, and the errors, in [-1, 1].
    pace: f64,
    errors: [f64; 2],
}

impl Loop<'_> {
    fn predict(&self, random: &mut Random) -> State {
        let e = self.spec.uncertainty.measurement;
        let measured: [i32; STATES] =
            std::array::from_fn(|d| (self.x[d] + e[d] * 1e6 * extreme(random)).floor() as i32);
        self.prediction.predict(State(measured), &self.history)
    }

    /// A tick under an adversary, with this level decided at its start.
    fn tick(&mut self, random: &mut Random, level: u8) {
        self.history.push(level);
        self.under_way.push_back(level);
        let acting = self.under_way.pop_front().unwrap();
        if random.unit() * self.pace < 1.0 {
            self.errors = [extreme(random), extreme(random)];
        }
        let uncertainty = &self.spec.uncertainty;
        let u = self.spec.input.value(acting.into());
        let delivered = (u * (1.0 + uncertainty.participation * self.errors[0])).min(1.0);
        let [low, high] = uncertainty.loss_gw;
        let loss = 0.5 * (low + high) + 0.5 * (high - low) * self.errors[1];
        let power = (self.spec.fleet_power_gw() * delivered - loss) * 1e6;
        self.x = fly(&self.plant, self.x, power, self.tick_s);
    }
}

#[test]
fn no_trajectory_leaves_the_boxes_of_games_and_verifier() {
    let mut random = Random::new(7);
    // The flow integrates far better than this, and cells are thousands wide.
    const DUST: f64 = 0.01;
    for spec in specs() {
        let bytes = bare(&spec);
        let view = TableView::parse(&bytes).unwrap();
        let grid = view.header().grid;
        let delay = Delay::of(&spec).unwrap().unwrap();
        let abstraction = synthesis::abstraction(&Problem::new(&spec).unwrap()).unwrap();
        let model = closed_loop(&view, &spec);
        assert_eq!(model.known.limit, None);
        let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
        let (ticks, period) = (delay.ticks, spec.sampling.ticks_per_period());
        let (mut checked, mut most) = (0u32, [0.0f64; STATES]);
        for trial in 0..400 {
            // From a state and a past that an adversary prefers: the same extremes for long, or
            // changing ones.
            let pace = 100f64.powf(random.unit());
            let mut real = Loop {
                spec: &spec,
                plant: Plant::new(&spec),
                prediction: view.prediction().unwrap(),
                history: History::NONE,
                under_way: (0..ticks).map(|_| 0).collect(),
                x: std::array::from_fn(|d| {
                    let (low, width) = (grid.lower_edge()[d], grid.width()[d]);
                    let span = f64::from(width) * f64::from(grid.count()[d]);
                    f64::from(low) + span * (0.1 + 0.8 * random.unit())
                }),
                tick_s,
                pace,
                errors: [extreme(&mut random), extreme(&mut random)],
            };
            let mut before = level(&mut random, &spec);
            for _ in 0..ticks {
                if random.unit() * pace < 1.0 {
                    before = level(&mut random, &spec);
                }
                real.tick(&mut random, before);
            }
            let known = real.predict(&mut random);
            let Some(cell) = grid.quantise(known) else {
                continue;
            };
            let level = if trial % 3 == 0 {
                (spec.input.levels() - 1) as u8
            } else {
                level(&mut random, &spec)
            };
            // When the command begins to act the real state is within E'; a period after the
            // decision the next one is made.
            let mut decided_on = None;
            for tick in 0..ticks.max(period) {
                if tick == ticks {
                    check_effective(&real, known, &delay, &model, &mut most);
                }
                if tick == period {
                    decided_on = Some(real.predict(&mut random));
                }
                let now = if tick < period { level } else { before };
                real.tick(&mut random, now);
            }
            if ticks >= period {
                check_effective(&real, known, &delay, &model, &mut most);
            }
            let next = decided_on.unwrap_or_else(|| real.predict(&mut random));
            let at = cell.0.map(u32::from);
            let bounds = grid.bounds(cell).unwrap();
            let from = std::array::from_fn(|d| Interval {
                low: f64::from(bounds[d].0) - model.known.before[d],
                high: f64::from(bounds[d].1) + model.known.before[d],
            });
            let drift = &model.known.drifts[usize::from(level)];
            let verifiers = successor(&grid, &model, &from, drift);
            let games = abstraction.successor(&abstraction.anchor(at), level.into());
            for d in 0..STATES {
                let one = index(&grid, d, f64::from(next.0[d]));
                let inside =
                    |low: u32, high: u32| one.is_some_and(|i| (low..=high).contains(&u32::from(i)));
                if let Some(cells) = &verifiers {
                    assert!(
                        inside(cells.low[d].into(), cells.high[d].into()),
                        "verifier, {}, axis {d}: {next:?}",
                        spec.name
                    );
                }
                if let Some(cells) = &games {
                    assert!(
                        inside(cells.low[d], cells.high[d]),
                        "games, {}, axis {d}: {next:?}",
                        spec.name
                    );
                }
            }
            checked += u32::from(verifiers.is_some() && games.is_some());
            if let (Some(a), Some(b)) = (&verifiers, &games) {
                // Two derivations of one box: they may differ by rounding at an edge, and by the
                // growth bound.
                for d in 0..STATES {
                    let (low, high) = (u32::from(a.low[d]), u32::from(a.high[d]));
                    assert!(b.low[d] <= low + 1 && b.high[d] + 1 >= high, "{a:?} {b:?}");
                }
            }
        }
        // The adversary comes near the bound of f, so the test can fail.
        println!("{}: {checked} checked, nearest {most:?} of E'", spec.name);
        assert!(checked > 30, "{}: {checked}", spec.name);
        assert!(
            most[0] > 0.7 && most[0] <= 1.0 + DUST,
            "{}: {most:?}",
            spec.name
        );
    }
}

/// The real state against what was known of it when the command was decided.
fn check_effective(
    real: &Loop<'_>,
    known: State,
    delay: &Delay,
    model: &Model,
    most: &mut [f64; STATES],
) {
    for d in 0..STATES {
        // The stored prediction is a floor.
        let off = (real.x[d] - f64::from(known.0[d]) - 0.5).abs() - 0.5;
        for bound in [delay.effective[d], model.known.real[d]] {
            assert!(off <= bound + 0.01, "axis {d}: {off} of {bound}");
            most[d] = most[d].max(off / bound);
        }
    }
}
