//! Two areas seen through two frequencies: the observer's error bound, and the game on what it
//! says, against a plant of this file's own.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use proptest::prelude::*;
use synth::abstraction::Abstraction;
use synth::abstraction::guard::Unguarded;
use synth::game::{NOT_WON, Unwatched, reach::reach, safety::safety};
use synth::yardsticks::two_areas::observer::{GAINS, METER_HZ, Observer, error, on_estimate};
use synth::yardsticks::two_areas::{self, BAND, CONTAINMENT, STATES};

type State = [f64; STATES];
/// Period \[s\].
const PERIOD_S: f64 = 0.5;
/// Steps of the integration in a period.
const FINE: u32 = 50;
/// Least and most loss of each area \[GW\].
const LOSSES: [[f64; 2]; 2] = [[0.95, 1.0], [0.0, 0.02]];

/// The equations, written down again: H, D, K, T of each area, the tie of 0.4 GW/(Hz s).
fn slope(x: &State, net: [f64; 2]) -> State {
    let [f1, f2, tie, p1, p2] = *x;
    [
        (p1 + net[0] - 0.8 * f1 - tie) / 6.0,
        (p2 + net[1] - 0.4 * f2 + tie) / 3.0,
        0.4 * (f1 - f2),
        (-4.0 * f1 - p1) / 8.0,
        (-2.0 * f2 - p2) / 8.0,
    ]
}

/// A period of the real grid, by Runge-Kutta.
fn period(x: &mut State, net: [f64; 2]) {
    let h = PERIOD_S / f64::from(FINE);
    let shifted = |x: &State, k: &State, by: f64| std::array::from_fn(|d| x[d] + by * k[d]);
    for _ in 0..FINE {
        let k1 = slope(x, net);
        let k2 = slope(&shifted(x, &k1, 0.5 * h), net);
        let k3 = slope(&shifted(x, &k2, 0.5 * h), net);
        let k4 = slope(&shifted(x, &k3, h), net);
        for d in 0..STATES {
            x[d] += h / 6.0 * (k1[d] + 2.0 * k2[d] + 2.0 * k3[d] + k4[d]);
        }
    }
}

/// Responses of an input \[GW\]: fleets of 1.5 and 0.8 GW in quarters.
fn responses(input: usize) -> [f64; 2] {
    [0.375 * (input % 5) as f64, 0.2 * (input / 5) as f64]
}

fn net(input: usize, shares: [f64; 2]) -> [f64; 2] {
    let given = responses(input);
    std::array::from_fn(|i| {
        let [low, high] = LOSSES[i];
        given[i] - (low + (high - low) * shares[i])
    })
}

/// scipy: the same gains, 4,000 terms of the sum.
const SCIPY: State = [
    0.003_342_0,
    0.004_047_8,
    0.025_724,
    0.013_324_5,
    0.009_602_8,
];

#[test]
fn the_errors_bound_is_what_an_independent_program_sums() {
    let found = error().unwrap();
    for (found, other) in found.into_iter().zip(SCIPY) {
        assert!(
            found >= other * 0.9999 && found <= other * 1.01,
            "{found} {other}"
        );
    }
}

/// Largest ratio of the error to its bound over a run, for the worst readings and losses towards
/// one state: signs by the influence of each period's readings on that state at the end.
fn worst_run(towards: usize, meter_hz: f64) -> f64 {
    let bound = error().unwrap();
    let steps = 200;
    // Rows of M^k, by running the homogeneous error backwards in unit vectors.
    let advance = |e: &State| -> State {
        let mut x = *e;
        period(&mut x, [0.0; 2]);
        let seen = [x[0], x[1]];
        std::array::from_fn(|d| x[d] - GAINS[d][0] * seen[0] - GAINS[d][1] * seen[1])
    };
    let mut of_reading = vec![[0.0; 2]; steps];
    let mut of_loss = vec![[0.0; 2]; steps];
    for area in 0..2 {
        let mut by_reading: State = std::array::from_fn(|d| -GAINS[d][area]);
        let mut x = [0.0; STATES];
        let mut power = [0.0; 2];
        power[area] = -1.0;
        period(&mut x, power);
        let mut by_loss: State =
            std::array::from_fn(|d| x[d] - GAINS[d][0] * x[0] - GAINS[d][1] * x[1]);
        for k in 0..steps {
            of_reading[k][area] = by_reading[towards];
            of_loss[k][area] = by_loss[towards];
            by_reading = advance(&by_reading);
            by_loss = advance(&by_loss);
        }
    }
    let mut x = [0.0; STATES];
    let mut observer = Observer::new(x);
    for k in 0..steps {
        let left = steps - 1 - k;
        let shares = of_loss[left].map(|influence| f64::from(u8::from(influence > 0.0)));
        period(&mut x, net(7, shares));
        let noise = of_reading[left].map(|influence| meter_hz * influence.signum());
        observer.step(7, [x[0] + noise[0], x[1] + noise[1]]);
    }
    let estimate = observer.estimate();
    (0..STATES)
        .map(|d| (x[d] - estimate[d]).abs() / bound[d])
        .fold(0.0, f64::max)
}

#[test]
fn the_worst_readings_come_near_the_bound_and_worse_meters_pass_it() {
    for towards in 0..STATES {
        let near = worst_run(towards, METER_HZ);
        assert!(near > 0.75 && near <= 1.0, "state {towards}: {near}");
        assert!(worst_run(towards, 3.0 * METER_HZ) > 1.0, "state {towards}");
    }
}

/// The cell on an axis; a place off the grid is a fault of the game.
fn on_axis(index: f64, count: u32) -> u32 {
    assert!(index >= 0.0 && index < f64::from(count), "off the grid");
    index as u32
}

/// From wherever the game on the estimate is won, the real frequencies come into the band, stay
/// there, and never fall below containment at a sample.
#[test]
fn the_game_on_the_estimate_keeps_the_real_grid_in_the_band() {
    let bound = error().unwrap();
    let game = on_estimate(&two_areas::shape([2, 2, 2, 1, 1]), &bound).unwrap();
    let hold = safety(&game.abstraction, &game.band, &Unguarded, &Unwatched).unwrap();
    let target = hold.winning_set(true);
    let come = reach(
        &game.abstraction,
        &target,
        &game.avoid,
        &Unguarded,
        &Unwatched,
    )
    .unwrap();
    println!("{} stay, {} more come", hold.winning, come.winning);
    assert!(hold.winning > 0 && come.winning > 0);
    let shape = *game.abstraction.shape();
    let won: Vec<usize> = (0..shape.cells())
        .filter(|cell| come.ranks[*cell] != NOT_WON)
        .collect();
    let runs = |(start, within, noise): (prop::sample::Index, State, Vec<[f64; 4]>)| {
        let cell = shape.cell(won[start.index(won.len())]);
        let mut x: State = std::array::from_fn(|d| {
            let (low, high) = shape.interval(d, cell[d]);
            low + (high - low) * within[d]
        });
        let mut observer = Observer::new(x);
        let mut settled = false;
        for [a, b, c, d] in noise {
            let estimate = observer.estimate();
            let cell: [u32; STATES] = std::array::from_fn(|d| {
                let index = (estimate[d] - shape.lower[d]) / shape.width[d];
                on_axis(index, shape.count[d])
            });
            let at = shape.index(cell);
            settled |= target.contains(at);
            let masks = if settled { &hold.masks } else { &come.masks };
            prop_assert!(masks[at] != 0, "no input at {cell:?}");
            let input = masks[at].trailing_zeros() as usize;
            period(&mut x, net(input, [a, b]));
            let readings = [
                x[0] + METER_HZ * (2.0 * c - 1.0),
                x[1] + METER_HZ * (2.0 * d - 1.0),
            ];
            observer.step(input, readings);
            for (d, estimate) in observer.estimate().into_iter().enumerate() {
                prop_assert!((x[d] - estimate).abs() <= bound[d], "state {d}");
            }
            let (low, high) = (x[0].min(x[1]), x[0].max(x[1]));
            prop_assert!(low >= CONTAINMENT, "{low}");
            if settled {
                prop_assert!(low >= BAND[0] && high <= BAND[1], "{low} to {high}");
            }
        }
        prop_assert!(settled, "not in the kernel after 60 s");
        Ok(())
    };
    let side = || prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
    let inputs = (
        any::<prop::sample::Index>(),
        prop::array::uniform5(0.0..1.0),
        prop::collection::vec(prop::array::uniform4(side()), 120),
    );
    let config = ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(300)
    };
    let mut runner = proptest::test_runner::TestRunner::new(config);
    runner.run(&inputs, runs).unwrap();
}
