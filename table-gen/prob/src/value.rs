//! The value of a chain over a horizon: a lower bound of the probability not to fail.
//!
//! ```text
//! V_0(q) = 1, but 0 for FAILED
//! V_{t+1}(q) = sum over k of p_k min over q' in Post(q, k) of V_t(q')
//! ```
//!
//! # Rounding
//! A product or a sum of doubles, rounded to nearest, is at most half a step away from the exact
//! result, so the double below it is a lower bound of the exact result. Every product and every sum
//! here is taken one double down, and lower bounds of non-negative terms add up to a lower bound. A
//! state with one branch of probability 1 needs no arithmetic. The relative loss of a step is at
//! most (2 K + 1) 2^-52 for K branches: 1e-12 for 120 steps of 20 branches.

use rayon::prelude::*;

use crate::chain::{Chain, FAILED, TOGETHER};

/// The values of all states with this many steps to go, each a lower bound in \[0, 1\].
pub fn values(chain: &Chain, steps: u32) -> Vec<f64> {
    let mut worst = vec![0.0; chain.sets()];
    let mut value = vec![1.0; chain.states()];
    value[FAILED as usize] = 0.0;
    for _ in 0..steps {
        step(chain, &mut worst, &mut value);
    }
    value
}

/// The lower bound from the worst initial state, for every horizon from 0 to this many steps.
pub fn bounds(chain: &Chain, steps: u32) -> Vec<f64> {
    let mut worst = vec![0.0; chain.sets()];
    let mut value = vec![1.0; chain.states()];
    value[FAILED as usize] = 0.0;
    let mut out = vec![of_initial(chain, &value)];
    for _ in 0..steps {
        step(chain, &mut worst, &mut value);
        out.push(of_initial(chain, &value));
    }
    out
}

fn of_initial(chain: &Chain, value: &[f64]) -> f64 {
    let values = chain.initial.iter().map(|state| value[*state as usize]);
    values.fold(1.0, f64::min)
}

/// One step: `worst` is for the sets' least values.
fn step(chain: &Chain, worst: &mut [f64], value: &mut [f64]) {
    chain.over_sets(value, 1.0, f64::min, worst);
    let worst = &*worst;
    // The first two states stay as they are.
    value[2..]
        .par_iter_mut()
        .with_min_len(TOGETHER)
        .enumerate()
        .for_each(|(index, value)| {
            let branches = chain.branches(index as u32 + 2);
            *value = match branches {
                [only] if only.probability == 1.0 => worst[only.set as usize],
                _ => {
                    let mut sum = 0.0f64;
                    for branch in branches {
                        let term = below(branch.probability * worst[branch.set as usize]);
                        sum = below(sum + term);
                    }
                    sum.min(1.0)
                }
            };
        });
}

/// A lower bound of the non-negative number whose nearest double this is.
fn below(rounded: f64) -> f64 {
    rounded.next_down().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{ChainBuilder, SAFE};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    #[test]
    fn a_coin_each_step_is_known() {
        // Survives a step with probability 3/4: 27/64 after three.
        let mut chain = ChainBuilder::new();
        chain.state(&[(0.75, vec![2])]).unwrap();
        let chain = chain.finish(&[2]).unwrap();
        let found = bounds(&chain, 3);
        // Three steps of a product and a sum, each two doubles down at most.
        assert!(found[3] <= 27.0 / 64.0 && found[3] > 27.0 / 64.0 * (1.0 - 12.0 * f64::EPSILON));
        assert_eq!(found[0], 1.0);
    }

    #[test]
    fn the_adversary_takes_the_worst_member() {
        // 2: half to {SAFE, 3}, half to SAFE. 3: a third fails. One step later the adversary has
        // chosen 3.
        let mut chain = ChainBuilder::new();
        chain
            .state(&[(0.5, vec![SAFE, 3]), (0.5, vec![SAFE])])
            .unwrap();
        chain.state(&[(2.0 / 3.0, vec![SAFE])]).unwrap();
        let chain = chain.finish(&[2]).unwrap();
        let found = bounds(&chain, 2);
        assert!((found[1] - 1.0).abs() < 1e-15 && found[1] <= 1.0);
        assert!((found[2] - 5.0 / 6.0).abs() < 1e-15 && found[2] <= 5.0 / 6.0);
    }

    #[test]
    fn certainty_stays_certainty() {
        let mut chain = ChainBuilder::new();
        chain.state(&[(1.0, vec![2, SAFE])]).unwrap();
        assert_eq!(bounds(&chain.finish(&[2]).unwrap(), 1000)[1000], 1.0);
    }

    /// Values in whole numbers: probabilities are over 16, so a value with t steps to go is over
    /// 16^t, exactly.
    fn slow(chain: &[Vec<(u128, Vec<u32>)>], steps: u32) -> Vec<u128> {
        let mut value = vec![1u128; chain.len() + 2];
        value[0] = 0;
        for _ in 0..steps {
            let next = chain.iter().map(|branches| {
                let worst = |members: &[u32]| members.iter().map(|s| value[*s as usize]).min();
                branches
                    .iter()
                    .map(|(p, members)| p * worst(members).unwrap())
                    .sum()
            });
            let next: Vec<u128> = next.collect();
            value = vec![0, value[1] * 16];
            value.extend(next);
        }
        value
    }

    /// Against a solver in whole numbers, on chains of four states with probabilities of
    /// sixteenths.
    #[test]
    fn never_above_the_exact_value_and_close_to_it() {
        let mut random = Pcg64::seed_from_u64(5);
        let mut below = |n: u64| random.next_u64() % n;
        let mut positive = 0;
        for _ in 0..2000 {
            let mut set = |most: u64| -> Vec<u32> {
                let count = 1 + below(most);
                (0..count).map(|_| below(6) as u32).collect()
            };
            let members: Vec<Vec<Vec<u32>>> =
                (0..4).map(|_| (0..3).map(|_| set(3)).collect()).collect();
            let steps = below(12) as u32;
            let drawn: Vec<Vec<(u128, Vec<u32>)>> = members
                .into_iter()
                .map(|sets| {
                    sets.into_iter()
                        .map(|set| (u128::from(below(6)), set))
                        .collect()
                })
                .collect();
            let mut builder = ChainBuilder::new();
            for branches in &drawn {
                let shares: Vec<(f64, Vec<u32>)> = branches
                    .iter()
                    .map(|(p, members)| (*p as f64 / 16.0, members.clone()))
                    .collect();
                builder.state(&shares).unwrap();
            }
            let chain = builder.finish(&[2]).unwrap();
            // 16^11 = 2^44: every exact value is a double.
            let exact = slow(&drawn, steps);
            let scale = 16f64.powi(steps as i32);
            for (found, exact) in values(&chain, steps).iter().zip(exact) {
                let exact = exact as f64 / scale;
                assert!(*found <= exact, "{found} {exact}");
                // A step loses at most 2 · 3 + 1 doubles, relative 2^-52 each.
                assert!(
                    *found >= exact * (1.0 - 11.0 * 7.0 * 2f64.powi(-52)),
                    "{found} {exact}"
                );
                positive += u32::from(steps > 2 && exact > 0.0 && exact < 1.0);
            }
        }
        // Chains that all fail, or never do, would show nothing.
        assert!(positive > 1000, "{positive}");
    }
}
