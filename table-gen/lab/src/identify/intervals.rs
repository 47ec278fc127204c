//! Intervals by profile likelihood.
//!
//! With errors that are independent and normal with variance σ², the values whose sum of squares
//! exceeds the least by no more than `p σ² F(p, n - p)` hold all p true values at once with the
//! probability of F's quantile (Seber and Wild, Nonlinear Regression, section 5.2). The interval of
//! one parameter is the projection of that region: its value is moved away from the best, the
//! others are fitted anew, until no fit is good enough. So the intervals hold *together*, and a
//! parameter that others can stand in for is as wide as they let it be.
//!
//! Errors of a record are not independent: readings are rounded, demand wanders. A run of equal
//! readings counts as one, and so do those within a second ([`Data::misfits`]). σ² is that of the
//! residuals, at least that of rounding to 1 mHz, times (1 + ρ)/(1 - ρ) with ρ the correlation of
//! neighbouring residuals: as if only so many samples were independent.
//!
//! Ends are outward: where the profile crosses the limit between two places, the farther one.

use std::cell::RefCell;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::fit::{Data, Seen, fit, half_widths};
use super::parameters::{COUNT, Told, Values};

/// Probability with which all intervals hold at once, under the assumptions.
pub const CONFIDENCE: f64 = 0.99;
/// Step of the readings \[mHz\].
const RESOLUTION_MHZ: f64 = 1.0;
/// Steps outward on each side, and by how much each is longer than the last.
const STEPS: usize = 14;
const LONGER: f64 = 1.6;
/// Halvings between the last place that is good enough and the first that is not.
const HALVINGS: usize = 2;
/// Times that all is begun again because a better fit was found on the way.
const RESTARTS: usize = 6;
/// A fit that is better by this share of the rise begins all again.
const BETTER: f64 = 0.02;
/// Evaluations of a fit for each parameter, for profiles.
const PATIENCE: usize = 4;

/// How well a record is explained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the residuals \[mHz\].
    pub residual_mhz: f64,
    /// Correlation of neighbouring residuals.
    pub correlation: f64,
    /// Variance that counts \[mHz²\].
    pub variance: f64,
    /// By how much a sum of squares may exceed the least \[mHz²\].
    pub rise: f64,
}

impl Noise {
    /// Of a fit with so many free parameters.
    pub fn of(residuals: &[f64], free: usize) -> Self {
        let count = residuals.len() as f64;
        let freedom = (count - free as f64).max(1.0);
        let sum: f64 = residuals.iter().map(|r| r * r).sum();
        let pairs: f64 = residuals.windows(2).map(|w| w[0] * w[1]).sum();
        let correlation = if sum > 0.0 {
            (pairs / sum).clamp(0.0, 0.98)
        } else {
            0.0
        };
        let own = (sum / freedom).max(RESOLUTION_MHZ * RESOLUTION_MHZ / 12.0);
        let variance = own * (1.0 + correlation) / (1.0 - correlation);
        // Both are at least 1, for which the distribution exists.
        let quantile = FisherSnedecor::new((free as f64).max(1.0), freedom)
            .map_or(f64::INFINITY, |f| f.inverse_cdf(CONFIDENCE));
        Self {
            residual_mhz: (sum / freedom).sqrt(),
            correlation,
            variance,
            rise: free as f64 * variance * quantile,
        }
    }
}

/// An interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The end nearer to the start of the parameter's range.
    pub near: f64,
    /// The other.
    pub far: f64,
    /// Which of them the record tells.
    pub told: Told,
}

/// The intervals of all parameters around the best of some fits, which they may better. Fits in
/// other valleys count where they are good enough.
pub fn intervals(
    data: &Data,
    free: &[usize],
    fits: &[(f64, Values)],
    seen: &RefCell<Seen>,
) -> (Noise, [Interval; COUNT]) {
    let mut found = None;
    for _ in 0..RESTARTS {
        let (least, best) = seen.borrow().best;
        let noise = Noise::of(&data.misfits(&best), free.len());
        let limit = least + noise.rise;
        seen.borrow_mut().with_limit(limit);
        for (sum, values) in fits {
            seen.borrow_mut().take(*sum, values);
        }
        let widths = half_widths(data, &best, free, noise.rise);
        let mut ends = [(None, None); COUNT];
        for (index, width) in free.iter().zip(&widths) {
            let side = |towards| Profile {
                data,
                free,
                index: *index,
                towards,
                best: &best,
                limit,
                seen,
            };
            ends[*index] = (side(-1.0).end(*width), side(1.0).end(*width));
            if seen.borrow().best.0 < least - BETTER * noise.rise {
                break;
            }
        }
        let better = seen.borrow().best.0 < least - BETTER * noise.rise;
        found = Some((noise, ends, best));
        if !better {
            break;
        }
    }
    let (noise, ends, best) = found.unwrap_or((
        Noise::of(&[], 1),
        [(None, None); COUNT],
        seen.borrow().best.1,
    ));
    let extremes = seen.borrow().extremes;
    let answer = std::array::from_fn(|index| {
        if !free.contains(&index) {
            let value = best[index];
            return Interval {
                near: value,
                far: value,
                told: Told::Given,
            };
        }
        let range = &data.ranges[index];
        let places = extremes.map_or([0.5, 0.5], |extremes| {
            let (least, greatest) = extremes[index];
            [range.place(least[index]), range.place(greatest[index])]
        });
        let (low, high) = (places[0].min(places[1]), places[0].max(places[1]));
        let (near, far) = ends[index];
        Interval {
            near: range.value(near.map_or(0.0, |place: f64| place.min(low))),
            far: range.value(far.map_or(1.0, |place: f64| place.max(high))),
            told: match (near, far) {
                (Some(_), Some(_)) => Told::BothEnds,
                (None, Some(_)) => Told::AtMost,
                (Some(_), None) => Told::AtLeast,
                (None, None) => Told::Nothing,
            },
        }
    });
    (noise, answer)
}

/// One side of one parameter's profile.
struct Profile<'a> {
    data: &'a Data,
    free: &'a [usize],
    index: usize,
    /// -1 towards place 0, 1 towards place 1.
    towards: f64,
    best: &'a Values,
    limit: f64,
    seen: &'a RefCell<Seen>,
}

impl Profile<'_> {
    /// The first place at which no fit is good enough; nothing if the end of the range is.
    fn end(&self, width: f64) -> Option<f64> {
        let range = &self.data.ranges[self.index];
        // From the farthest point that explains the record, in whatever valley it lies.
        let mut start = self.farthest();
        let mut inside = range.place(start[self.index]);
        let mut step = 0.4 * width;
        let mut outside = None;
        for number in 0..STEPS {
            let last = if self.towards > 0.0 { 1.0 } else { 0.0 };
            let ahead = inside + self.towards * step;
            // The last step is to the range's end, whatever its length.
            let place = if number + 1 == STEPS {
                last
            } else {
                ahead.clamp(0.0, 1.0)
            };
            match self.explained(place, &start) {
                Some(values) if place == last => {
                    let _ = values;
                    return None;
                }
                Some(values) => (inside, start) = (place, values),
                None => {
                    outside = Some(place);
                    break;
                }
            }
            step *= LONGER;
        }
        let mut outside = outside?;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            match self.explained(middle, &start) {
                Some(values) => (inside, start) = (middle, values),
                None => outside = middle,
            }
        }
        Some(outside)
    }

    /// Values with the parameter at a place that explain the record well enough, if any are found.
    fn explained(&self, place: f64, start: &Values) -> Option<Values> {
        let others: Vec<usize> = self
            .free
            .iter()
            .copied()
            .filter(|index| *index != self.index)
            .collect();
        let value = self.data.ranges[self.index].value(place);
        // From the last place, then from the best fit.
        for from in [*start, *self.best] {
            let mut from = from;
            from[self.index] = value;
            let (sum, values) = fit(
                self.data,
                &from,
                &others,
                PATIENCE,
                Some(self.limit),
                self.seen,
            );
            if sum <= self.limit {
                return Some(values);
            }
        }
        None
    }
}

impl Profile<'_> {
    /// The point that explains the record and is farthest on this side.
    fn farthest(&self) -> Values {
        let range = &self.data.ranges[self.index];
        let Some(extremes) = self.seen.borrow().extremes else {
            return *self.best;
        };
        let (least, greatest) = extremes[self.index];
        let place = |values: &Values| self.towards * range.place(values[self.index]);
        if place(&least) > place(&greatest) {
            least
        } else {
            greatest
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten residuals of 2 mHz that alternate in sign: no positive correlation, a variance of
    /// 40 / (10 - 2) = 5 mHz²; F(2, 8) at 99 % is 8.649 in every table.
    #[test]
    fn the_limit_is_that_of_the_tables() {
        let residuals: Vec<f64> = (0..10)
            .map(|k| if k % 2 == 0 { 2.0 } else { -2.0 })
            .collect();
        let noise = Noise::of(&residuals, 2);
        assert!((noise.variance - 5.0).abs() < 1e-12 && noise.correlation == 0.0);
        assert!((noise.rise - 2.0 * 5.0 * 8.649).abs() < 0.01, "{noise:?}");
    }
}
