//! Distributions of the delivered participation, cut into bins.

use model::interval::Interval;

use super::bin::Bin;

/// Most pieces into which a distribution is cut.
const BINS_MAX: f64 = 4000.0;

/// Bins of `u (1 + e)`, e within ± bound; `share` is a lower bound of the probability that e is in
/// an interval. Where the whole fleet is reached, one bin takes all larger errors.
pub(super) fn relative(
    bound: f64,
    command: f64,
    width: f64,
    share: &dyn Fn(f64, f64) -> f64,
) -> Vec<Bin> {
    let full = 1.0 / command - 1.0;
    let (low, high) = ((-bound).max(-1.0), bound.min(full));
    let delivered = |a: f64, b: f64| {
        let at = |e: f64| Interval::point(command) * (Interval::ONE + Interval::point(e));
        Interval {
            low: at(a).low.clamp(0.0, 1.0),
            high: at(b).high.clamp(0.0, 1.0),
        }
    };
    let count = ((high - low) * command / width).ceil().clamp(1.0, BINS_MAX);
    let edge = |i: f64| {
        if i == count {
            high
        } else {
            low + (high - low) * i / count
        }
    };
    let mut bins: Vec<Bin> = (0..count as u32)
        .map(|i| {
            let (a, b) = (edge(f64::from(i)), edge(f64::from(i) + 1.0));
            Bin {
                probability: share(a, b),
                delivered: delivered(a, b),
            }
        })
        .collect();
    if full < bound {
        bins.push(Bin {
            probability: share(full, f64::INFINITY),
            delivered: Interval {
                low: delivered(full, full).low,
                high: 1.0,
            },
        });
    }
    bins
}

/// Bins of the mean of n coins: binomial probabilities relative to the likeliest count, divided by
/// their sum, all in intervals.
pub(super) fn coins(n: u32, u: f64, width: f64) -> Vec<Bin> {
    let (p, q) = (Interval::point(u), Interval::ONE - Interval::point(u));
    let odds = p / q;
    let middle = ((f64::from(n) + 1.0) * u).floor().min(f64::from(n)) as u32;
    let mut weight = vec![Interval::ZERO; n as usize + 1];
    weight[middle as usize] = Interval::ONE;
    let non_negative = |x: Interval| Interval {
        low: x.low.max(0.0),
        high: x.high,
    };
    let number = |k: u32| Interval::point(f64::from(k));
    for k in middle..n {
        let ratio = number(n - k) / number(k + 1) * odds;
        weight[k as usize + 1] = non_negative(weight[k as usize] * ratio);
    }
    for k in (0..middle).rev() {
        let ratio = number(k + 1) / number(n - k) / odds;
        weight[k as usize] = non_negative(weight[k as usize + 1] * ratio);
    }
    let total = weight.iter().fold(Interval::ZERO, |sum, w| sum + *w);
    let each = ((width * f64::from(n)).floor() as usize).max(1);
    let mut bins = Vec::new();
    for (index, part) in weight.chunks(each).enumerate() {
        let first = (index * each) as f64;
        let last = first + (part.len() - 1) as f64;
        let sum = part.iter().fold(Interval::ZERO, |sum, w| sum + *w);
        let probability = (sum / total).low.clamp(0.0, 1.0);
        // Together these are less than a hundred-thousand-millionth: left to failure.
        if probability < 1e-16 {
            continue;
        }
        let mean = |k: f64| Interval::point(k) / Interval::point(f64::from(n));
        let delivered = Interval {
            low: mean(first).low.clamp(0.0, 1.0),
            high: mean(last).high.clamp(0.0, 1.0),
        };
        bins.push(Bin {
            probability,
            delivered,
        });
    }
    bins
}
