//! Formula on a trace: how far it is from being true or false.
//!
//! The robustness of an atom is the distance of the signal from the atom's edge, positive inside:
//! Hz for f, GW for the loss. Not is minus, and and always are the least, or and eventually the
//! greatest (Donzé and Maler's semantics). A positive value means true, a negative one false, and a
//! trace that differs by less than its magnitude everywhere has the same answer.
//!
//! A trace is a finite list of samples; time ends with it. So "always" speaks of the samples there
//! are, "eventually" must happen on the trace, and between samples nothing is claimed (the verifier
//! does that).

use model::logic::{Comparison, Formula, Interval, Signal};

/// One sample of a trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time \[s\]; strictly ascending along the trace.
    pub time_s: f64,
    /// Deviation of the frequency \[Hz\].
    pub f_hz: f64,
    /// Lost infeed \[GW\]; NaN if it is not recorded.
    pub loss_gw: f64,
}

/// Why a formula has no value on a trace.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobustnessError {
    /// No sample.
    #[error("the trace has no sample")]
    Empty,
    /// Times that do not ascend, or values that are no numbers.
    #[error("sample {index}: time or value is out of order or no number")]
    BadSample {
        /// Index of the sample, from 0.
        index: usize,
    },
    /// An interval's name without a meaning.
    #[error("no interval is named `{name}`")]
    UnknownInterval {
        /// The name.
        name: String,
    },
}

/// Robustness of a formula at the first sample of a trace. `named` gives the intervals their ends.
///
/// # Errors
/// An empty or disordered trace, or a name without a meaning.
pub fn robustness(
    formula: &Formula,
    trace: &[Sample],
    named: &[(&str, [f64; 2])],
) -> Result<f64, RobustnessError> {
    check(trace)?;
    let values = Evaluation { trace, named }.values(formula)?;
    values.first().copied().ok_or(RobustnessError::Empty)
}

fn check(trace: &[Sample]) -> Result<(), RobustnessError> {
    if trace.is_empty() {
        return Err(RobustnessError::Empty);
    }
    for (index, sample) in trace.iter().enumerate() {
        let ordered = index == 0 || trace[index - 1].time_s < sample.time_s;
        if !(ordered && sample.time_s.is_finite() && sample.f_hz.is_finite()) {
            return Err(RobustnessError::BadSample { index });
        }
    }
    Ok(())
}

struct Evaluation<'a> {
    trace: &'a [Sample],
    named: &'a [(&'a str, [f64; 2])],
}

impl Evaluation<'_> {
    /// Robustness at every sample. The depth of the recursion is that of the formula, which the
    /// parser bounds.
    fn values(&self, formula: &Formula) -> Result<Vec<f64>, RobustnessError> {
        Ok(match formula {
            Formula::True => vec![f64::INFINITY; self.trace.len()],
            Formula::Compare(signal, comparison, value) => {
                let distance = |at: f64| match comparison {
                    Comparison::AtMost => value - at,
                    Comparison::AtLeast => at - value,
                };
                self.signal(*signal)?.into_iter().map(distance).collect()
            }
            Formula::In(signal, interval) => {
                let [low, high] = self.ends(interval)?;
                let distance = |at: f64| (at - low).min(high - at);
                self.signal(*signal)?.into_iter().map(distance).collect()
            }
            Formula::Not(of) => self.values(of)?.into_iter().map(|v| -v).collect(),
            Formula::And(a, b) => self.both(a, b, f64::min)?,
            Formula::Or(a, b) => self.both(a, b, f64::max)?,
            Formula::Implies(a, b) => self.both(a, b, |a, b| (-a).max(b))?,
            Formula::Always(within_s, of) => {
                let negated: Vec<f64> = self.values(of)?.into_iter().map(|v| -v).collect();
                let greatest = self.greatest(&negated, *within_s);
                greatest.into_iter().map(|v| -v).collect()
            }
            Formula::Eventually(within_s, of) => self.greatest(&self.values(of)?, *within_s),
            Formula::Until(within_s, a, b) => {
                self.until(&self.values(a)?, &self.values(b)?, *within_s)
            }
        })
    }

    fn both(
        &self,
        a: &Formula,
        b: &Formula,
        join: impl Fn(f64, f64) -> f64,
    ) -> Result<Vec<f64>, RobustnessError> {
        let (a, b) = (self.values(a)?, self.values(b)?);
        Ok(a.into_iter().zip(b).map(|(a, b)| join(a, b)).collect())
    }

    fn signal(&self, signal: Signal) -> Result<Vec<f64>, RobustnessError> {
        let value = |sample: &Sample| match signal {
            Signal::Frequency => sample.f_hz,
            Signal::Loss => sample.loss_gw,
        };
        let values: Vec<f64> = self.trace.iter().map(value).collect();
        match values.iter().position(|v| v.is_nan()) {
            Some(index) => Err(RobustnessError::BadSample { index }),
            None => Ok(values),
        }
    }

    fn ends(&self, interval: &Interval) -> Result<[f64; 2], RobustnessError> {
        match interval {
            Interval::Ends(low, high) => Ok([*low, *high]),
            Interval::Named(name) => self
                .named
                .iter()
                .find(|(known, _)| known == name)
                .map(|(_, ends)| *ends)
                .ok_or_else(|| RobustnessError::UnknownInterval { name: name.clone() }),
        }
    }

    /// Greatest value from each sample on, within so long: a sliding window from the end, linear in
    /// the trace.
    fn greatest(&self, values: &[f64], within_s: Option<f64>) -> Vec<f64> {
        let mut out = vec![f64::NEG_INFINITY; values.len()];
        // Indices of the window whose values descend towards its far end.
        let mut window = std::collections::VecDeque::new();
        for index in (0..values.len()).rev() {
            while window
                .front()
                .is_some_and(|next: &usize| values[*next] <= values[index])
            {
                window.pop_front();
            }
            window.push_front(index);
            let from_s = self.trace[index].time_s;
            let late = |at: &usize| within_s.is_some_and(|s| self.trace[*at].time_s - from_s > s);
            while window.back().is_some_and(late) {
                window.pop_back();
            }
            out[index] = window.back().map_or(f64::NEG_INFINITY, |at| values[*at]);
        }
        out
    }

    /// The greatest over later samples of the lesser of b there and a until then.
    fn until(&self, a: &[f64], b: &[f64], within_s: Option<f64>) -> Vec<f64> {
        (0..a.len())
            .map(|start| {
                let (mut best, mut held) = (f64::NEG_INFINITY, f64::INFINITY);
                for at in start..a.len() {
                    let after_s = self.trace[at].time_s - self.trace[start].time_s;
                    if within_s.is_some_and(|s| after_s > s) || held <= best {
                        break;
                    }
                    best = best.max(held.min(b[at]));
                    held = held.min(a[at]);
                }
                best
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::logic::parse;
    use proptest::prelude::*;

    fn trace(values: &[f64]) -> Vec<Sample> {
        let sample = |(i, f_hz): (usize, &f64)| Sample {
            time_s: i as f64,
            f_hz: *f_hz,
            loss_gw: 2.0,
        };
        values.iter().enumerate().map(sample).collect()
    }

    fn value(text: &str, values: &[f64]) -> f64 {
        let named = [("I1", [-0.3, 0.0]), ("I2", [-0.15, 0.0])];
        robustness(&parse(text).unwrap(), &trace(values), &named).unwrap()
    }

    #[test]
    fn hand_computed_values() {
        let dip = [0.0, -0.5, -0.2, -0.1];
        let close = |text: &str, expected: f64| {
            let found = value(text, &dip);
            // Differences of two numbers below 1.
            assert!((found - expected).abs() < 1e-15, "{text}: {found}");
        };
        close("G(f >= -0.8)", 0.3);
        close("G(f >= -0.4)", -0.1);
        close("F f in I2", 0.05);
        close("F[<=1s] f in [-0.6, -0.4]", 0.1);
        close("F[<=0s] f in [-0.6, -0.4]", -0.4);
        // The first sample lies on the edge of I1.
        close("G(!(f in I1) -> F[<=1s] f in I1)", 0.0);
        close("G(!(f in [-0.3, 0.1]) -> F[<=1s] f in [-0.3, 0.1])", 0.1);
        close("f >= -0.05 U f <= -0.45", 0.05);
        close("f >= -0.05 U[<=0s] f <= -0.45", -0.45);
        close("loss <= 1.32", -0.68);
    }

    #[test]
    fn bad_traces_and_names_are_errors() {
        let formula = parse("G(f in I9)").unwrap();
        assert_eq!(robustness(&formula, &[], &[]), Err(RobustnessError::Empty));
        assert!(matches!(
            robustness(&formula, &trace(&[0.0]), &[]),
            Err(RobustnessError::UnknownInterval { .. })
        ));
        let mut disordered = trace(&[0.0, 0.0]);
        disordered[1].time_s = 0.0;
        let formula = parse("G(f >= 0)").unwrap();
        assert_eq!(
            robustness(&formula, &disordered, &[]),
            Err(RobustnessError::BadSample { index: 1 })
        );
    }

    proptest! {
        /// The sliding window against the definition, and the dualities of the logic.
        #[test]
        fn windows_equal_their_definition(
            values in proptest::collection::vec(-1.0f64..1.0, 1..40),
            within in 0u32..12,
        ) {
            let end = values.len().min(within as usize + 1);
            let greatest = values[..end].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = values[..end].iter().copied().fold(f64::INFINITY, f64::min);
            prop_assert_eq!(value(&format!("F[<={within}s] f >= 0"), &values), greatest);
            prop_assert_eq!(value(&format!("G[<={within}s] f >= 0"), &values), least);
            let until = value(&format!("true U[<={within}s] f >= 0"), &values);
            prop_assert_eq!(until, greatest);
            prop_assert_eq!(value("!(G f >= 0)", &values), value("F !(f >= 0)", &values));
        }
    }
}
