//! Slabs of a game on several ranks: the same solution, bit for bit, as on one.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use model::grid_shape::GridShape;
use model::interval::Interval;
use proptest::prelude::*;
use synth::abstraction::Abstraction;
use synth::abstraction::affine::{AffineAbstraction, AffineInput, Growth};
use synth::abstraction::guard::{Guard, Unguarded};
use synth::game::bitset::BitSet;
use synth::game::exchange::Exchange;
use synth::game::reach::{reach, reach_shared};
use synth::game::safety::{safety, safety_shared};
use synth::game::{GameError, Solution, Unwatched};
use synth::ranks::slab::{Slab, WindowGuard};
use synth::ranks::{Slabs, gather, threads};
use synth::yardsticks::unicycle;

/// The cells of a set in a window of the dense order.
fn cut(set: &BitSet, window: std::ops::Range<usize>) -> BitSet {
    let mut out = BitSet::new(window.len());
    window
        .clone()
        .filter(|index| set.contains(*index))
        .for_each(|index| out.insert(index - window.start));
    out
}

/// A rank's solution, and its own cells in it.
type Share<M> = (Solution<M>, std::ops::Range<usize>);

/// Own parts of the ranks' solutions, put together; counts and sweeps must be the same on all.
type Whole<M> = Result<(Vec<M>, Vec<u16>, usize, u16), GameError>;

fn whole<M: Copy>(parts: Vec<Result<Share<M>, GameError>>) -> Whole<M> {
    let (mut masks, mut ranks, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        let (solution, own) = part?;
        masks.extend_from_slice(&solution.masks[own.clone()]);
        ranks.extend_from_slice(&solution.ranks[own]);
        counts.push((solution.winning, solution.sweeps));
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    Ok((masks, ranks, counts[0].0, counts[0].1))
}

fn one<M>(solution: Result<Solution<M>, GameError>) -> Whole<M> {
    solution.map(|s| (s.masks, s.ranks, s.winning, s.sweeps))
}

/// Both games on so many ranks.
fn shared<const D: usize, A: Abstraction<D>>(
    abstraction: &A,
    (target, avoid): (&BitSet, &BitSet),
    guard: &(impl Guard<D, A::Inputs> + Clone),
    count: usize,
) -> [Whole<A::Inputs>; 2] {
    [false, true].map(|stay| {
        whole(threads::run(count, |rank| {
            let slab = Slab::new(abstraction, synth::ranks::Transport::rank(rank), count);
            let part = slab.part();
            let slabs = Slabs::new(rank, &part).unwrap();
            let (target, avoid) = (
                cut(target, part.window.clone()),
                cut(avoid, part.window.clone()),
            );
            let guard = WindowGuard::new(guard, &slab);
            let own = slabs.owned(target.len());
            let solution = if stay {
                safety_shared(&slab, &target, &guard, &slabs, &Unwatched)
            } else {
                reach_shared(&slab, (&target, &avoid), &guard, &slabs, &Unwatched)
            }?;
            Ok((solution, own))
        }))
    })
}

/// Forbids an input in some cells, by their position in the whole grid.
#[derive(Clone)]
struct Checkered;

impl<const D: usize> Guard<D> for Checkered {
    fn permitted(&self, cell: [u32; D], inputs: u32) -> u32 {
        if cell.iter().sum::<u32>().is_multiple_of(5) {
            inputs & !1
        } else {
            inputs
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn random_games_have_the_same_solution_on_one_to_four_ranks(
        a in proptest::array::uniform3(proptest::array::uniform3(-1.0f64..1.0)),
        b in proptest::array::uniform3(-2.0f64..2.0),
        count in proptest::array::uniform3(4u32..14),
        spread in 0.0f64..0.2,
        period_s in 0.1f64..0.8,
        low in 0u32..4,
        seed in any::<u64>(),
    ) {
        let width = [0.3, 0.2, 0.25];
        let lower = std::array::from_fn(|d| -0.5 * width[d] * f64::from(count[d]) + 0.0137);
        let shape = GridShape { lower, width, count };
        let inputs: Vec<_> = (0..5)
            .map(|u| AffineInput {
                a: a.map(|row| row.map(Interval::point)),
                b: b.map(Interval::point),
                drive: Interval::hull(0.5 * f64::from(u) - 1.0 - spread, 0.5 * f64::from(u) - 1.0 + spread),
            })
            .collect();
        let engine = AffineAbstraction::new(shape, &inputs, period_s, Growth::ExactLinear, [0.0; 3]).unwrap();
        let (mut target, mut avoid) = (BitSet::new(shape.cells()), BitSet::new(shape.cells()));
        for index in 0..shape.cells() {
            let cell = shape.cell(index);
            if (low..low + count[0] / 2 + 1).contains(&cell[0]) {
                target.insert(index);
            } else if seed.rotate_left((index % 64) as u32).wrapping_mul(0x9E37_79B9).is_multiple_of(11) {
                avoid.insert(index);
            }
        }
        let alone = [
            one(reach(&engine, &target, &avoid, &Checkered, &Unwatched)),
            one(safety(&engine, &target, &Checkered, &Unwatched)),
        ];
        for ranks in 1..=4 {
            let together = shared(&engine, (&target, &avoid), &Checkered, ranks);
            for (alone, together) in alone.iter().zip(&together) {
                prop_assert_eq!(alone, together, "{} ranks", ranks);
            }
        }
    }
}

#[test]
fn the_vehicle_has_the_same_solution_on_three_ranks() {
    let abstraction = unicycle::abstraction().unwrap();
    let (target, avoid) = (unicycle::target(), unicycle::avoid());
    let alone = one(reach(&abstraction, &target, &avoid, &Unguarded, &Unwatched));
    let [together, _] = shared(&abstraction, (&target, &avoid), &Unguarded, 3);
    assert!(alone == together);
}

#[test]
fn words_are_gathered_in_the_order_of_the_ranks() {
    let found = threads::run(3, |rank| {
        let rank_number = synth::ranks::Transport::rank(rank) as u64;
        gather(rank, &vec![rank_number; 1 + rank_number as usize]).unwrap()
    });
    assert_eq!(found, [Some(vec![0, 1, 1, 2, 2, 2]), None, None]);
}
