//! The engine of `prob` on small chains that are solved by hand or in another way: a controller's
//! choices, and expected seconds.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use prob::chain::{ChainBuilder, SAFE};
use prob::choices::{Choices, Goal, GroupsError};
use prob::reward::{Reward, expected};
use prob::value;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Group 2 has two inputs: one keeps a half for ever, the other 3/4 but may meet group 3,
/// which keeps a half. With one step to go the second is better, with two the first.
#[test]
fn the_controller_takes_the_best_input_and_the_adversary_the_worst_group() {
    let mut chain = ChainBuilder::new();
    chain.state(&[(0.5, vec![SAFE])]).unwrap();
    chain.state(&[(0.75, vec![2, 3])]).unwrap();
    chain.state(&[(0.5, vec![SAFE])]).unwrap();
    let chain = chain.finish(&[2]).unwrap();
    let choices = Choices::new(chain.clone(), vec![0, 1, 2, 4, 5]).unwrap();
    let one = choices.values(Goal::Safe, 1, 0.0);
    assert!((one.groups[2] - 0.75).abs() < 1e-15 && one.groups[2] <= 0.75);
    // After a step with the second input the adversary takes group 3: 3/4 · 1/2.
    let two = choices.values(Goal::Safe, 2, 0.0);
    assert!((two.groups[2] - 0.5).abs() < 1e-15 && two.groups[2] <= 0.5);
    assert!(two.states[3] <= 0.375 && two.states[3] > 0.374);
    // To reach SAFE: the first input has it with a half at once.
    let reach = choices.values(Goal::Reach, 1, 0.0);
    assert!(reach.groups[2] <= 0.5 && reach.groups[2] > 0.499);
    assert_eq!(Choices::new(chain, vec![0, 1, 2, 4]), Err(GroupsError));
}

/// With one input each it is the value of the chain; with more it is never less than that of
/// any fixed choice.
#[test]
fn never_below_a_fixed_choice() {
    let mut random = Pcg64::seed_from_u64(11);
    let mut below = |n: u64| random.next_u64() % n;
    let mut gained = 0;
    for _ in 0..300 {
        // Three groups of two states.
        let states: Vec<Vec<(f64, Vec<u32>)>> = (0..6)
            .map(|_| {
                (0..2)
                    .map(|_| {
                        let set = (0..1 + below(2)).map(|_| below(5) as u32).collect();
                        (below(8) as f64 / 16.0, set)
                    })
                    .collect()
            })
            .collect();
        let steps = below(9) as u32;
        let mut all = ChainBuilder::new();
        for branches in &states {
            all.state(branches).unwrap();
        }
        let all = Choices::new(all.finish(&[2]).unwrap(), vec![0, 1, 2, 4, 6, 8]).unwrap();
        let best = all.values(Goal::Safe, steps, 0.0);
        for fixed in 0..8u32 {
            let mut chain = ChainBuilder::new();
            for group in 0..3 {
                let choice = (fixed >> group & 1) as usize;
                chain.state(&states[2 * group + choice]).unwrap();
            }
            let chain = chain.finish(&[2]).unwrap();
            let values = value::values(&chain, steps);
            for group in 2..5 {
                assert!(best.groups[group] >= values[group]);
                gained += u32::from(best.groups[group] > values[group]);
            }
            let alone = Choices::new(chain, vec![0, 1, 2, 3, 4, 5]).unwrap();
            assert_eq!(alone.values(Goal::Safe, steps, 0.0).groups, values);
        }
    }
    assert!(gained > 1000, "{gained}");
}

/// A second a step, failed with a quarter: 1 + T/4 in one step, 1 + T/4 + 3/4 (1 + T/4) in two.
#[test]
fn expected_seconds_of_a_coin_are_known() {
    let mut chain = ChainBuilder::new();
    chain.state(&[(0.75, vec![2])]).unwrap();
    let chain = chain.finish(&[2]).unwrap();
    let reward = Reward {
        seconds: vec![0.0, 0.0, 1.0],
        failed_s: 100.0,
    };
    let one = expected(&chain, &reward, 1);
    assert!((26.0..26.0 + 1e-12).contains(&one), "{one}");
    let two = expected(&chain, &reward, 2);
    assert!((45.5..45.5 + 1e-12).contains(&two), "{two}");
    // Never more than the horizon.
    assert_eq!(expected(&chain, &reward, 1000), 100.0);
}

#[test]
fn the_adversary_takes_the_longest_member() {
    let mut chain = ChainBuilder::new();
    chain.state(&[(1.0, vec![SAFE, 3])]).unwrap();
    chain.state(&[(1.0, vec![SAFE])]).unwrap();
    let chain = chain.finish(&[2]).unwrap();
    let reward = Reward {
        seconds: vec![0.0, 0.0, 0.0, 2.0],
        failed_s: 10.0,
    };
    assert_eq!(expected(&chain, &reward, 1), 0.0);
    let two = expected(&chain, &reward, 2);
    assert!((2.0..2.0 + 1e-14).contains(&two), "{two}");
}
