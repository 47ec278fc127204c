//! The error of the delivered participation, drawn anew each period, cut into bins.
//!
//! A bin is an interval of the delivered participation u' and a lower bound of the probability that
//! u' falls into it. Bins cover what counts; what they leave over counts as failure.

mod bin;
mod cut;

use model::independence::Crowd;
use model::interval::Interval;
pub use model::participation::{Participation, ParticipationError, TAIL};

use crate::{normal, union};
pub use bin::Bin;
use cut::{coins, relative};

/// What a bound asks of a distribution.
pub trait Drawn {
    /// Lower bound of the probability that all of so many draws are within `u (1 ± r) ± a` of what
    /// was commanded: for proofs that hold for any such error. Draws may depend on each other; the
    /// coins of a fleet are independent, and each charger draws at a moment of its own.
    fn all_within(&self, draws: u64, r: f64, a: f64) -> f64;

    /// The bins under a command, each at most `width` of participation wide.
    fn bins(&self, command: f64, width: f64) -> Vec<Bin>;
}

impl Drawn for Participation {
    fn all_within(&self, draws: u64, r: f64, a: f64) -> f64 {
        let by_draws = |within: f64| {
            let outside = if within < 1.0 {
                (1.0 - within).next_up()
            } else {
                0.0
            };
            union::all_within(draws, outside)
        };
        let inside = |z: f64| (1.0 - normal::outside(z)).next_down().max(0.0);
        match *self {
            Self::Exact => 1.0,
            Self::Uniform { bound } | Self::Truncated { bound, .. } if r >= bound => 1.0,
            Self::Uniform { bound } => by_draws((r / bound).next_down().max(0.0)),
            // Given |e| <= bound, an error within r is likelier still.
            Self::Truncated { sigma, .. } | Self::Gaussian { sigma, .. } => {
                by_draws(inside(down(r / sigma)))
            }
            Self::Bernoulli { chargers } => {
                let crowd = Crowd {
                    chargers,
                    moments: draws.saturating_mul(chargers.into()),
                };
                (1.0 - crowd.outside(r, a)).next_down().max(0.0)
            }
        }
    }

    fn bins(&self, command: f64, width: f64) -> Vec<Bin> {
        let all = |delivered| {
            vec![Bin {
                probability: 1.0,
                delivered,
            }]
        };
        // A relative error of nothing is nothing, and no coin falls on its face with probability 0.
        if command == 0.0 || *self == Self::Exact {
            return all(Interval::point(command));
        }
        match *self {
            Self::Exact => all(Interval::point(command)),
            Self::Bernoulli { .. } if command >= 1.0 => all(Interval::ONE),
            Self::Bernoulli { chargers } => coins(chargers, command, width),
            Self::Uniform { bound } => {
                let share = |a: f64, b: f64| {
                    let whole = Interval::point(2.0) * Interval::point(bound);
                    let b = b.min(bound);
                    ((Interval::point(b) - Interval::point(a)) / whole)
                        .low
                        .max(0.0)
                };
                relative(bound, command, width, &share)
            }
            Self::Truncated { sigma, bound } => {
                // Given |e| <= bound, every probability is divided by one that is at most this.
                let z = up(bound / sigma);
                let whole = (normal::below(z) - normal::below(-z)).high.min(1.0);
                let share = |a: f64, b: f64| {
                    down(normal::mass(up(a / sigma), down(b.min(bound) / sigma)) / whole).max(0.0)
                };
                relative(bound, command, width, &share)
            }
            Self::Gaussian { sigma, tail } => {
                let share = |a: f64, b: f64| normal::mass(up(a / sigma), down(b / sigma));
                relative(tail * sigma, command, width, &share)
            }
        }
    }
}

fn up(value: f64) -> f64 {
    value.next_up()
}

fn down(value: f64) -> f64 {
    value.next_down()
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Binomial, DiscreteCDF};

    #[test]
    fn bins_touch_and_add_up() {
        for (text, at_least) in [
            ("uniform:0.1", 1.0 - 1e-12),
            ("gaussian:0.05", 1.0 - 5.74e-7),
            ("truncated:0.05,0.2", 1.0 - 1e-11),
            ("bernoulli:25000", 1.0 - 1e-9),
        ] {
            let kind: Participation = text.parse().unwrap();
            assert_eq!(kind.to_string().parse(), Ok(kind));
            for command in [0.05, 0.5, 0.95, 1.0] {
                let bins = kind.bins(command, 0.004);
                let sum: f64 = bins.iter().map(|bin| bin.probability).sum();
                assert!(
                    sum <= 1.0 + 1e-12 && sum >= at_least,
                    "{text} {command} {sum}"
                );
                for bin in &bins {
                    let width = bin.delivered.high - bin.delivered.low;
                    assert!(width <= 0.004 + 1e-12 && bin.delivered.high <= 1.0);
                }
                for pair in bins.windows(2) {
                    let coin = matches!(kind, Participation::Bernoulli { .. });
                    assert!(coin || pair[1].delivered.low <= pair[0].delivered.high);
                }
            }
        }
    }

    #[test]
    fn a_full_fleet_takes_every_larger_error() {
        // At u = 1 half of all errors deliver everything.
        let bins = Participation::Gaussian {
            sigma: 0.05,
            tail: 5.0,
        }
        .bins(1.0, 0.01);
        let last = bins.last().unwrap();
        assert!(last.delivered.high == 1.0 && last.delivered.low > 1.0 - 1e-15);
        assert!(last.probability > 0.5 - 1e-12 && last.probability <= 0.5);
    }

    #[test]
    fn coins_agree_with_the_library_and_with_chernoff() {
        let bins = coins(1000, 0.3, 0.01);
        let library = Binomial::new(0.3, 1000).unwrap();
        for bin in &bins {
            let (a, b) = (
                (bin.delivered.low * 1000.0).round() as u64,
                (bin.delivered.high * 1000.0).round() as u64,
            );
            let known = library.cdf(b) - if a == 0 { 0.0 } else { library.cdf(a - 1) };
            // The library's incomplete beta function is good to about 1e-10.
            assert!((bin.probability - known).abs() < 1e-9, "{bin:?} {known}");
        }
        // 25,000 chargers, 5 % off at u = 0.3 in one of 120 decisions: 3.7e-4 by Chernoff
        // and a union bound.
        let bins = coins(25_000, 0.3, 1.0 / 25_000.0);
        let off = |bin: &&Bin| (bin.delivered.mid() / 0.3 - 1.0).abs() < 0.05;
        let inside: f64 = bins.iter().filter(off).map(|bin| bin.probability).sum();
        assert!((1.0 - inside) * 120.0 < 3.7e-4);
    }

    #[test]
    fn all_coins_are_within_an_absolute_error_beside_the_relative_one() {
        let coins = Participation::Bernoulli { chargers: 25_000 };
        // A small command is missed by 10 % of itself: nothing is covered.
        assert_eq!(coins.all_within(1200, 0.1, 0.0), 0.0);
        // Three times the standard deviation at u = 1/2 is 0.0095; ten times is past all doubt.
        let bound = coins.all_within(1200, 0.1, 0.01);
        assert!(bound > 1.0 - 1e-6 && bound < 1.0, "{bound}");
        // No bound is above what the exact distribution leaves, for one draw and one command.
        let exact: f64 = super::cut::coins(25_000, 0.02, 1.0 / 25_000.0)
            .iter()
            .filter(|bin| (bin.delivered.mid() - 0.02).abs() <= 0.003)
            .map(|bin| bin.probability)
            .sum();
        assert!(coins.all_within(1, 0.1, 0.001) <= exact);
    }
}
