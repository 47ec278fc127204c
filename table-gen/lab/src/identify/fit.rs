//! Least squares on a record, by the method of Levenberg and Marquardt.
//!
//! Each free parameter is a place in its range, and the method works on the logit of the place, so
//! that no value leaves its range. Whatever it evaluates is remembered: every point that explains
//! the record well enough belongs to the answer, however it was found.

use std::cell::{Cell, RefCell};

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::course::{Stage, deviations};
use super::parameters::{COUNT, Parameter, Values};

/// Places nearer to an end than this are started from here: at the ends the logit is infinite.
const END: f64 = 1e-3;
/// Step of a difference quotient, in the logit.
const DIFFERENCE: f64 = 3e-4;
/// Residuals are in mHz, so that sums of squares are near 1.
const MHZ: f64 = 1e3;
/// A fit that has a sum to reach gives up once a step brings it nearer by less than this share of
/// what is left to go.
const PROGRESS: f64 = 0.03;
/// Readings that differ by less are equal \[Hz\]: far below any step of a record.
const SAME_HZ: f64 = 1e-9;
/// Readings within this time count as one \[s\]: a rounding's error may stay the same for that long
/// though the readings differ.
const ONE_ERROR_S: f64 = 1.0;
/// Times that differ by less are equal \[s\].
const SAME_S: f64 = 1e-6;
/// Points that are kept of those that explain the record well enough.
const KEPT: usize = 4000;

/// A record, and the ranges in which the parameters are looked for.
#[derive(Debug, Clone)]
pub struct Data {
    /// Times of the samples \[s\].
    pub times_s: Vec<f64>,
    /// Deviations from nominal \[Hz\].
    pub readings_hz: Vec<f64>,
    /// Known losses; none: one of unknown size.
    pub stages: Vec<Stage>,
    /// Ranges.
    pub ranges: [Parameter; COUNT],
}

impl Data {
    /// What the record has more than the values would give \[mHz\].
    pub fn residuals(&self, values: &Values) -> Vec<f64> {
        let course = deviations(values, &self.stages, &self.times_s);
        let pairs = self.readings_hz.iter().zip(course);
        pairs.map(|(reading, f)| MHZ * (reading - f)).collect()
    }

    /// The same with readings whose errors are nearly one error taken as one: the mean of their
    /// residuals. Those are the readings of a run of equal ones, and those within a second.
    /// That is what fits are judged by.
    ///
    /// A reading is f rounded, and so off by at most half a step. Where f moves by less than a step
    /// from one sample to the next, the errors of a run are nearly one error, which no number of
    /// samples averages away; counted as many, they would tell more than the record does: ten
    /// seconds of rest at ten samples a second would tell the rest to a tenth of what it is rounded
    /// by. Where f moves by about a whole number of steps from sample to sample, the errors go
    /// round slowly, and neighbours have nearly the same one though their readings differ. The mean
    /// of some errors is bounded by half a step as one reading's is; how much less it is nobody
    /// knows, so a mean counts as one reading does ([`Noise`](super::intervals::Noise) takes at
    /// least the variance of one rounding). Samples a second apart that differ stand for
    /// themselves.
    pub fn misfits(&self, values: &Values) -> Vec<f64> {
        let residuals = self.residuals(values);
        let mut out: Vec<f64> = Vec::with_capacity(residuals.len());
        let mut length = 0.0;
        let mut before = f64::NAN;
        let mut begin_s = f64::NEG_INFINITY;
        let samples = self.times_s.iter().zip(&self.readings_hz);
        for ((time, reading), residual) in samples.zip(residuals) {
            let near = time - begin_s < ONE_ERROR_S - SAME_S;
            match out.last_mut() {
                // The readings are decimal numbers: a run repeats one of them, bit for bit, but for
                // the subtraction of the nominal frequency.
                Some(mean) if near || (reading - before).abs() < SAME_HZ => {
                    length += 1.0;
                    *mean += (residual - *mean) / length;
                }
                _ => {
                    length = 1.0;
                    begin_s = *time;
                    out.push(residual);
                }
            }
            before = *reading;
        }
        out
    }
}

/// Sum of squares.
pub fn sum_of_squares(residuals: &[f64]) -> f64 {
    let sum: f64 = residuals.iter().map(|r| r * r).sum();
    // What overflows explains nothing.
    if sum.is_finite() { sum } else { f64::MAX }
}

/// Everything that was tried and explains the record well enough.
#[derive(Debug, Clone)]
pub struct Seen {
    /// The best, with its sum of squares \[mHz²\].
    pub best: (f64, Values),
    /// Largest sum of squares that is well enough \[mHz²\].
    pub enough: f64,
    /// Of each parameter the points with the least and the greatest value among those that are well
    /// enough; none before the first.
    pub extremes: Option<[(Values, Values); COUNT]>,
    /// Some of those points.
    pub kept: Vec<Values>,
    passed: usize,
}

impl Seen {
    /// Nothing yet.
    pub fn new() -> Self {
        Self {
            best: (f64::MAX, [0.0; COUNT]),
            enough: f64::NEG_INFINITY,
            extremes: None,
            kept: Vec::new(),
            passed: 0,
        }
    }

    /// Begins again with a limit.
    pub fn with_limit(&mut self, enough: f64) {
        let best = self.best;
        *self = Self {
            best,
            enough,
            ..Self::new()
        };
        self.take(best.0, &best.1);
    }

    /// Remembers a point.
    pub fn take(&mut self, sum: f64, values: &Values) {
        if sum < self.best.0 {
            self.best = (sum, *values);
        }
        if sum > self.enough {
            return;
        }
        let extremes = self.extremes.get_or_insert([(*values, *values); COUNT]);
        for (index, (least, greatest)) in extremes.iter_mut().enumerate() {
            if values[index] < least[index] {
                *least = *values;
            }
            if values[index] > greatest[index] {
                *greatest = *values;
            }
        }
        // Once full, every second, fourth, ... point replaces an old one.
        self.passed += 1;
        if self.kept.len() < KEPT {
            self.kept.push(*values);
        } else if self.passed.is_multiple_of(self.passed / KEPT + 1) {
            let at = self.passed % KEPT;
            self.kept[at] = *values;
        }
    }
}

impl Default for Seen {
    fn default() -> Self {
        Self::new()
    }
}

/// The fit of some parameters, the others held.
struct Problem<'a> {
    data: &'a Data,
    free: &'a [usize],
    values: Values,
    logits: DVector<f64>,
    /// A sum of squares that is good enough \[mHz²\].
    stop_at: Option<f64>,
    /// Sum of squares at the step before.
    before: Cell<f64>,
    seen: &'a RefCell<Seen>,
}

impl Problem<'_> {
    fn values_at(&self, logits: &DVector<f64>) -> Values {
        let mut values = self.values;
        for (index, logit) in self.free.iter().zip(logits.iter()) {
            values[*index] = self.data.ranges[*index].value(1.0 / (1.0 + (-logit).exp()));
        }
        values
    }

    fn residuals_at(&self, logits: &DVector<f64>) -> Vec<f64> {
        let values = self.values_at(logits);
        let residuals = self.data.misfits(&values);
        self.seen
            .borrow_mut()
            .take(sum_of_squares(&residuals), &values);
        residuals
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, logits: &DVector<f64>) {
        self.logits.copy_from(logits);
    }

    fn params(&self) -> DVector<f64> {
        self.logits.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(DVector::from_vec(self.residuals_at(&self.logits)))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let base = self.residuals_at(&self.logits);
        if let Some(stop) = self.stop_at {
            let sum = sum_of_squares(&base);
            let nearer = self.before.replace(sum) - sum;
            if sum <= stop || nearer < PROGRESS * (sum - stop) {
                // The method ends where there is no slope.
                return None;
            }
        }
        let mut jacobian = DMatrix::zeros(base.len(), self.free.len());
        for column in 0..self.free.len() {
            let mut moved = self.logits.clone();
            // Towards the middle of the range.
            let step = if moved[column] > 0.0 {
                -DIFFERENCE
            } else {
                DIFFERENCE
            };
            moved[column] += step;
            for (row, (there, here)) in self.residuals_at(&moved).iter().zip(&base).enumerate() {
                jacobian[(row, column)] = (there - here) / step;
            }
        }
        Some(jacobian)
    }
}

/// The best values of the free parameters near a start, and their sum of squares \[mHz²\]; or the
/// first that are good enough, if it is said what is.
pub fn fit(
    data: &Data,
    start: &Values,
    free: &[usize],
    patience: usize,
    stop_at: Option<f64>,
    seen: &RefCell<Seen>,
) -> (f64, Values) {
    if free.is_empty() {
        let sum = sum_of_squares(&data.misfits(start));
        seen.borrow_mut().take(sum, start);
        return (sum, *start);
    }
    let logit = |index: &usize| {
        let place = data.ranges[*index]
            .place(start[*index])
            .clamp(END, 1.0 - END);
        (place / (1.0 - place)).ln()
    };
    let problem = Problem {
        data,
        free,
        values: *start,
        logits: DVector::from_iterator(free.len(), free.iter().map(logit)),
        stop_at,
        before: Cell::new(f64::INFINITY),
        seen,
    };
    let method = LevenbergMarquardt::new()
        .with_ftol(1e-5)
        .with_xtol(1e-6)
        .with_gtol(1e-9)
        .with_patience(patience);
    let (problem, _) = method.minimize(problem);
    // However it ended: what counts is how well the values explain the record.
    let values = problem.values_at(&problem.logits);
    (sum_of_squares(&data.misfits(&values)), values)
}

/// Half-widths, as shares of the ranges, at which the sum of squares would rise by `rise` if the
/// residuals were linear in the places; at most 1.
pub fn half_widths(data: &Data, at: &Values, free: &[usize], rise: f64) -> Vec<f64> {
    let base = data.misfits(at);
    let mut jacobian = DMatrix::zeros(base.len(), free.len());
    for (column, index) in free.iter().enumerate() {
        let range = &data.ranges[*index];
        let place = range.place(at[*index]);
        let step = if place > 0.5 { -DIFFERENCE } else { DIFFERENCE };
        let mut moved = *at;
        moved[*index] = range.value(place + step);
        for (row, (there, here)) in data.misfits(&moved).iter().zip(&base).enumerate() {
            jacobian[(row, column)] = (there - here) / step;
        }
    }
    // A ridge as if each place were known to one range's width: finite where the record says
    // nothing.
    let mut normal = jacobian.transpose() * &jacobian;
    for index in 0..free.len() {
        normal[(index, index)] += rise;
    }
    let Some(inverse) = normal.try_inverse() else {
        return vec![1.0; free.len()];
    };
    (0..free.len())
        .map(|index| {
            (rise * inverse[(index, index)].max(0.0))
                .sqrt()
                .clamp(1e-6, 1.0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{ONSET, PARAMETERS, REST};
    use super::*;

    /// At rest; residuals are the readings.
    fn at_rest(step_s: f64, readings_mhz: &[f64]) -> (Data, Values) {
        let data = Data {
            times_s: (0..readings_mhz.len()).map(|k| k as f64 * step_s).collect(),
            readings_hz: readings_mhz.iter().map(|reading| 1e-3 * reading).collect(),
            stages: Vec::new(),
            ranges: PARAMETERS,
        };
        let mut values = PARAMETERS.map(|p| p.value(0.5));
        (values[ONSET], values[REST]) = (100.0, 0.0);
        assert_eq!(data.residuals(&values).len(), readings_mhz.len());
        (data, values)
    }

    fn is(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    /// Readings of 1, 1, 1, 2 and 1 mHz, a second apart: three runs.
    #[test]
    fn equal_neighbours_are_one_reading() {
        let (data, values) = at_rest(1.0, &[1.0, 1.0, 1.0, 2.0, 1.0]);
        is(&data.misfits(&values), &[1.0, 2.0, 1.0]);
    }

    /// Four samples a second: 1, 2, 3, 4 are one; so are the next three and what equals the last
    /// of them, however long; what is left is the third.
    #[test]
    fn a_second_is_one_reading() {
        let (data, values) = at_rest(
            0.25,
            &[1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 9.0, 9.0, 9.0, 2.0],
        );
        is(&data.misfits(&values), &[2.5, 42.0 / 6.0, 2.0]);
    }
}
