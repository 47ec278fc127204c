//! Recurrence, persistence and reactivity against their fixed points by the definition, on random
//! small games; and the strategy's promise, input by input.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::grid_shape::GridShape;
use model::interval::Interval;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use synth::abstraction::affine::{AffineAbstraction, AffineInput, Growth};
use synth::abstraction::guard::Unguarded;
use synth::game::bitset::BitSet;
use synth::game::reactive::{Promise, Reactive, persistence, reactive, recurrence};
use synth::game::{NOT_WON, Unwatched};
use tests::reference::{Boxes, SlowGame};

const D: usize = 2;

/// A random plant that circles, drifts or falls, with two to five inputs.
fn games() -> impl Strategy<Value = (SlowGame, u64)> {
    let a = proptest::collection::vec(-0.9f64..0.9, D * D);
    let b = proptest::collection::vec(-1.0f64..1.0, D);
    let counts = proptest::array::uniform2(5usize..13);
    let spread = prop_oneof![Just(0.0), 0.0f64..0.2];
    (
        a,
        b,
        counts,
        0.2f64..0.35,
        0.3f64..0.9,
        spread,
        2usize..6,
        any::<u64>(),
    )
        .prop_map(|(a, b, counts, width, period, spread, inputs, seed)| {
            let drives = (0..inputs)
                .map(|u| (2.2 * u as f64 / (inputs - 1) as f64 - 1.113, spread))
                .collect();
            let axes = counts
                .iter()
                .map(|count| (-0.5 * width * *count as f64 + 0.0137, width, *count))
                .collect();
            let game = SlowGame {
                a: DMatrix::from_row_slice(D, D, &a),
                b: DVector::from_vec(b),
                drives,
                axes,
                period,
                measurement: vec![0.0; D],
            };
            (game, seed)
        })
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
    AffineAbstraction::new(shape, &inputs, game.period, Growth::ExactLinear, [0.0; D]).unwrap()
}

type Set = Vec<bool>;

/// A random set of blobs: cells whose block of 2 x 2 has the bit, so that sets have insides.
fn blobs(game: &SlowGame, seed: u64, salt: u64, one_in: u64) -> Set {
    (0..game.cells())
        .map(|index| {
            let cell = game.cell(index);
            let block = (cell[0] / 2 + 17 * (cell[1] / 2)) as u64;
            let mixed = (seed ^ salt.rotate_left(21))
                .wrapping_add(block)
                .wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            (mixed >> 33) & 0xFFFF < 0x1_0000 / one_in
        })
        .collect()
}

fn bits(set: &Set) -> BitSet {
    let mut out = BitSet::new(set.len());
    (0..set.len())
        .filter(|i| set[*i])
        .for_each(|i| out.insert(i));
    out
}

fn zip(a: &Set, b: &Set, f: impl Fn(bool, bool) -> bool) -> Set {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

/// The fixed point by the definition, all sets recomputed from the start every time.
fn slow(game: &SlowGame, boxes: &Boxes, assumptions: &[Set], goals: &[Set], avoid: &Set) -> Set {
    let pre = |set: &Set| -> Set {
        (0..set.len())
            .map(|cell| !avoid[cell] && game.mask(boxes, cell, set) != 0)
            .collect()
    };
    let or = |a: bool, b: bool| a || b;
    let mut z: Set = avoid.iter().map(|avoided| !avoided).collect();
    loop {
        let pre_z = pre(&z);
        let mut next_z = z.clone();
        for goal in goals {
            let met = zip(goal, &pre_z, |a, b| a && b);
            let mut y = vec![false; z.len()];
            loop {
                let base = zip(&met, &pre(&y), or);
                let mut next_y = base.clone();
                for assumption in assumptions {
                    let mut x = vec![true; z.len()];
                    loop {
                        let rest = zip(&pre(&x), assumption, |pre, a| pre && !a);
                        let next_x = zip(&base, &rest, or);
                        if next_x == x {
                            break;
                        }
                        x = next_x;
                    }
                    next_y = zip(&next_y, &x, or);
                }
                if next_y == y {
                    break;
                }
                y = next_y;
            }
            next_z = zip(&next_z, &y, |a, b| a && b);
        }
        if next_z == z {
            return z;
        }
        z = next_z;
    }
}

/// What the module promises of ranks and inputs, cell by cell.
fn strategy_keeps_its_promise(
    game: &SlowGame,
    boxes: &Boxes,
    (assumptions, goals): (&[Set], &[Set]),
    solved: &Reactive,
) -> Result<(), TestCaseError> {
    let won: Set = (0..game.cells())
        .map(|cell| solved.won.contains(cell))
        .collect();
    prop_assert_eq!(solved.towards.len(), goals.len());
    for (towards, goal) in solved.towards.iter().zip(goals) {
        let ranks = &towards.solution.ranks;
        // On each resting rank one assumption holds nowhere.
        for rank in &towards.resting {
            let on: Vec<usize> = (0..ranks.len())
                .filter(|cell| ranks[*cell] == *rank)
                .collect();
            let fails = |assumption: &Set| on.iter().all(|cell| !assumption[*cell]);
            prop_assert!(assumptions.iter().any(fails), "rank {}", rank);
        }
        for cell in 0..game.cells() {
            let mask = towards.solution.masks[cell];
            prop_assert_eq!(ranks[cell] != NOT_WON, won[cell], "cell {}", cell);
            prop_assert_eq!(mask != 0, won[cell], "cell {}", cell);
            if !won[cell] {
                continue;
            }
            let rank = ranks[cell];
            prop_assert!(rank > 0 || goal[cell]);
            let limit = match rank {
                0 => NOT_WON - 1,
                rank if towards.resting.contains(&rank) => rank,
                rank => rank - 1,
            };
            let below: Set = ranks.iter().map(|r| *r <= limit).collect();
            // Every input of the mask, not only some.
            prop_assert_eq!(
                game.mask(boxes, cell, &below) & mask,
                mask,
                "cell {} rank {}",
                cell,
                rank
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(160))]

    #[test]
    fn reactive_games_agree_with_the_definition((game, seed) in games()) {
        let boxes = game.boxes();
        let abstraction = engine(&game);
        let avoid = blobs(&game, seed, 1, 9);
        let assumptions = [blobs(&game, seed, 2, 3), blobs(&game, seed, 3, 2)];
        let goals = [blobs(&game, seed, 4, 3), blobs(&game, seed, 5, 2)];
        let avoided = bits(&avoid);
        let sets = |sets: &[Set]| sets.iter().map(bits).collect::<Vec<_>>();
        // One goal, two goals, one set to stay in, and both with assumptions.
        for count in 1..=2 {
            let goals = &goals[..count];
            let solved = recurrence(&abstraction, &sets(goals), &avoided, &Unguarded, &Unwatched).unwrap();
            let expected = slow(&game, &boxes, &[], goals, &avoid);
            prop_assert_eq!(solved.won.iter().collect::<Vec<_>>(), bits(&expected).iter().collect::<Vec<_>>());
            strategy_keeps_its_promise(&game, &boxes, (&[], goals), &solved)?;
        }
        let stay = zip(&goals[1], &goals[0], |a, b| a || b);
        let solved = persistence(&abstraction, &bits(&stay), &avoided, &Unguarded, &Unwatched).unwrap();
        let (leaves, never) = ([stay.iter().map(|s| !s).collect::<Set>()], [vec![false; stay.len()]]);
        let expected = slow(&game, &boxes, &leaves, &never, &avoid);
        prop_assert_eq!(solved.won.iter().collect::<Vec<_>>(), bits(&expected).iter().collect::<Vec<_>>());
        strategy_keeps_its_promise(&game, &boxes, (&leaves, &never), &solved)?;
        let (a, g) = (sets(&assumptions), sets(&goals));
        let promise = Promise { assumptions: &a, goals: &g, avoid: &avoided };
        let solved = reactive(&abstraction, promise, &Unguarded, &Unwatched).unwrap();
        let expected = slow(&game, &boxes, &assumptions, &goals, &avoid);
        prop_assert_eq!(solved.won.iter().collect::<Vec<_>>(), bits(&expected).iter().collect::<Vec<_>>());
        strategy_keeps_its_promise(&game, &boxes, (&assumptions, &goals), &solved)?;
    }
}
