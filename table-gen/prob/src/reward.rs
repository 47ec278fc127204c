//! Expected seconds below a limit: an upper bound, by the same chain.
//!
//! Each state may bring so many seconds in its step. What a chain's probabilities leave over, and
//! what has failed, is taken as below the limit for the whole horizon T:
//!
//! ```text
//! R_0(q) = 0
//! R_{t+1}(q) = r(q) + sum over k of p_k max over q' in Post(q, k) of R_t(q')
//!              + T (1 - sum over k of p_k)
//! R(FAILED) = T       R(SAFE) = 0       R is never more than T
//! ```
//!
//! # Why this is a bound
//! Let E_t(x) be the expected seconds below the limit in t steps from a real state x, but T for a
//! run that fails. For x in the set of q, E_{t+1}(x) is at most r(q) plus the mean of E_t over what
//! follows; bin k has a probability of at least p_k and a mean of at most the largest R_t of its
//! set, and what is left has at most T. T is an upper bound of the seconds in T, so the cap loses
//! nothing that was right.
//!
//! # Rounding
//! Every product, sum and difference is taken one double up.

use rayon::prelude::*;

use crate::chain::{Chain, FAILED, SAFE, TOGETHER};

/// Seconds of each state's step.
#[derive(Debug, Clone, PartialEq)]
pub struct Reward {
    /// Upper bound of the seconds of the step of each state; for [`FAILED`] and [`SAFE`] 0.
    pub seconds: Vec<f64>,
    /// What a failed run counts as: the horizon \[s\].
    pub failed_s: f64,
}

/// Upper bound of the expected seconds from the worst initial state, over this many steps.
pub fn expected(chain: &Chain, reward: &Reward, steps: u32) -> f64 {
    let most = reward.failed_s;
    let mut worst = vec![0.0; chain.sets()];
    let mut value = vec![0.0; chain.states()];
    value[FAILED as usize] = most;
    let lost: Vec<f64> = (0..chain.states() as u32)
        .into_par_iter()
        .map(|state| left_over(chain, state))
        .collect();
    for _ in 0..steps {
        chain.over_sets(&value, 0.0, f64::max, &mut worst);
        let worst = &worst;
        value[2..]
            .par_iter_mut()
            .with_min_len(TOGETHER)
            .enumerate()
            .for_each(|(index, value)| {
                let state = index + 2;
                let mut sum = added(reward.seconds[state], product(lost[state], most));
                for branch in chain.branches(state as u32) {
                    let term = product(branch.probability, worst[branch.set as usize]);
                    sum = added(sum, term);
                }
                *value = sum.min(most);
            });
        debug_assert!(value[SAFE as usize] == 0.0);
    }
    let initial = chain.initial.iter();
    initial
        .map(|state| value[*state as usize])
        .fold(0.0, f64::max)
}

/// Upper bound of what the probabilities of a state leave over.
pub(crate) fn left_over(chain: &Chain, state: u32) -> f64 {
    if state == FAILED || state == SAFE {
        return 0.0;
    }
    let branches = chain.branches(state);
    if let [only] = branches
        && only.probability == 1.0
    {
        return 0.0;
    }
    let mut sum = 0.0f64;
    for branch in branches {
        sum = (sum + branch.probability).next_down();
    }
    (1.0 - sum).next_up().max(0.0)
}

/// An upper bound of a product of non-negative numbers; exact where one is 0.
fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        0.0
    } else {
        (a * b).next_up()
    }
}

/// An upper bound of a sum of non-negative numbers; exact where one is 0.
fn added(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        a + b
    } else {
        (a + b).next_up()
    }
}

/// Upper bound of the seconds of so many ticks: the tick's quotient and the product are each off by
/// at most half a double.
pub(crate) fn seconds_of(ticks: u32, tick_s: f64) -> f64 {
    product(f64::from(ticks), tick_s.next_up())
}
