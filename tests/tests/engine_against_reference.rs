//! The engine against a slow solver on random small plants, grids and targets, and on any number of
//! threads.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::grid_shape::GridShape;
use model::interval::Interval;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use synth::abstraction::affine::{AffineAbstraction, AffineInput, Growth};
use synth::abstraction::guard::Unguarded;
use synth::game::bitset::BitSet;
use synth::game::reach::reach;
use synth::game::safety::safety;
use synth::game::{NOT_WON, Unwatched, unwatched};
use synth::synthesis;
use tests::reference::SlowGame;
use tests::testing::{load, on_threads};

const D: usize = 3;

/// A random plant: stable or not quite, unstable, or singular (a row of zeros: a pure integrator of
/// the drive).
fn plants() -> impl Strategy<Value = DMatrix<f64>> {
    let entries = proptest::collection::vec(-0.6f64..0.6, D * D);
    let shift = prop_oneof![2 => Just(-0.5), 1 => Just(0.0), 1 => Just(0.6)];
    let zero = prop_oneof![2 => Just(None), 1 => (0..D).prop_map(Some)];
    (entries, shift, zero).prop_map(|(entries, shift, zero)| {
        let mut a = DMatrix::from_row_slice(D, D, &entries) + DMatrix::identity(D, D) * shift;
        if let Some(row) = zero {
            a.row_mut(row).fill(0.0);
        }
        a
    })
}

/// A random plant with enough authority that games are neither empty nor full.
fn games() -> impl Strategy<Value = (SlowGame, [usize; 2], u64)> {
    let drive = proptest::collection::vec(-1.0f64..1.0, D);
    let counts = proptest::array::uniform3(4usize..11);
    let widths = proptest::array::uniform3(0.15f64..0.35);
    let spread = prop_oneof![Just(0.0), 0.0f64..0.1];
    let error = prop_oneof![Just(0.0), 0.0f64..0.03];
    (
        plants(),
        drive,
        counts,
        widths,
        0.2f64..0.9,
        spread,
        error,
        2usize..8,
        0usize..4,
        any::<u64>(),
    )
        .prop_map(
            |(a, b, counts, widths, period, spread, error, inputs, first, seed)| {
                let drives = (0..inputs)
                    .map(|u| (2.0 * u as f64 / (inputs - 1) as f64 - 1.013, spread))
                    .collect();
                let axes = (0..D)
                    .map(|d| {
                        (
                            -0.5 * widths[d] * counts[d] as f64 + 0.0137,
                            widths[d],
                            counts[d],
                        )
                    })
                    .collect();
                let b = DVector::from_vec(b);
                let game = SlowGame {
                    a,
                    b,
                    drives,
                    axes,
                    period,
                    measurement: vec![error; D],
                };
                // A target band on the first axis, at most half of it.
                let low = first.min(counts[0] - 2);
                let high = (low + counts[0] / 2).min(counts[0] - 1);
                (game, [low, high], seed)
            },
        )
}

fn engine(game: &SlowGame) -> AffineAbstraction<D> {
    let a = std::array::from_fn(|i| std::array::from_fn(|j| Interval::point(game.a[(i, j)])));
    let b = std::array::from_fn(|i| Interval::point(game.b[i]));
    let inputs: Vec<_> = game
        .drives
        .iter()
        .map(|(middle, spread)| AffineInput {
            a,
            b,
            drive: Interval::hull(middle - spread, middle + spread),
        })
        .collect();
    let shape = GridShape {
        lower: std::array::from_fn(|d| game.axes[d].0),
        width: std::array::from_fn(|d| game.axes[d].1),
        count: std::array::from_fn(|d| game.axes[d].2 as u32),
    };
    let measurement = std::array::from_fn(|d| game.measurement[d]);
    AffineAbstraction::new(
        shape,
        &inputs,
        game.period,
        Growth::ExactLinear,
        measurement,
    )
    .unwrap()
}

fn set(cells: usize, member: impl Fn(usize) -> bool) -> BitSet {
    let mut set = BitSet::new(cells);
    (0..cells)
        .filter(|i| member(*i))
        .for_each(|i| set.insert(i));
    set
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn reach_avoid_and_safety_agree_with_the_definition((game, [low, high], seed) in games()) {
        let boxes = game.boxes();
        let cells = game.cells();
        let band = |i: usize| (low..=high).contains(&(i % game.axes[0].2));
        // A few cells to avoid, outside the target, spread by the seed.
        let avoided = |i: usize| !band(i) && (seed.rotate_left((i % 64) as u32) ^ (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)).is_multiple_of(11);
        let target: Vec<bool> = (0..cells).map(band).collect();
        let avoid: Vec<bool> = (0..cells).map(avoided).collect();
        let slow = game.reach(&boxes, &target, &avoid);
        let abstraction = engine(&game);
        let fast = reach(&abstraction, &set(cells, band), &set(cells, avoided), &Unguarded, &Unwatched).unwrap();
        for (i, (rank, mask)) in slow.iter().enumerate() {
            prop_assert_eq!(fast.ranks[i], rank.unwrap_or(NOT_WON), "rank of cell {}", i);
            prop_assert_eq!(fast.masks[i], *mask, "inputs of cell {}", i);
        }
        let kernel = game.safety(&boxes, &target);
        let fast = safety(&abstraction, &set(cells, band), &Unguarded, &Unwatched).unwrap();
        prop_assert_eq!(fast.masks, kernel);
        // Reach and stay: the kernel as the target.
        let kernel = fast.ranks.iter().map(|r| *r == 0).collect::<Vec<_>>();
        if kernel.iter().any(|k| *k) {
            let slow = game.reach(&boxes, &kernel, &avoid);
            let fast = reach(&abstraction, &set(cells, |i| kernel[i]), &set(cells, avoided), &Unguarded, &Unwatched).unwrap();
            for (i, (rank, mask)) in slow.iter().enumerate() {
                prop_assert_eq!((fast.ranks[i], fast.masks[i]), (rank.unwrap_or(NOT_WON), *mask));
            }
        }
    }
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let spec = load("paper-bi", &[]);
    let solve = |threads| {
        on_threads(threads, || {
            synthesis::synthesise(&spec, &unwatched).unwrap()
        })
    };
    let one = solve(1);
    for threads in [2, 8] {
        let other = solve(threads);
        assert!(
            one.c1.solution == other.c1.solution,
            "C1 on {threads} threads"
        );
        let c2 = |s: &synth::synthesis::Synthesis| s.c2.clone().unwrap().solution;
        assert!(c2(&one) == c2(&other), "C2 on {threads} threads");
    }
}
