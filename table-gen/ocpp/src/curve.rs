//! The frequency-watt curve `v2xFreqWattCurve`.

use crate::messages::FreqWattPoint;

/// Points that the standard allows; `LocalFrequency` needs two.
pub const POINTS: std::ops::RangeInclusive<usize> = 2..=20;

/// A value that a field cannot have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: found {found}; allowed: {allowed}")]
pub struct FieldError {
    /// The field, with its place in the message.
    pub field: String,
    /// What is there.
    pub found: String,
    /// What may be there.
    pub allowed: String,
}

impl FieldError {
    pub(crate) fn new(
        field: impl Into<String>,
        found: impl std::fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            field: field.into(),
            found: found.to_string(),
            allowed: allowed.into(),
        }
    }
}

/// A curve whose points are finite and rise in frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct FreqWattCurve {
    /// Added to the curve \[W\].
    baseline_w: f64,
    points: Vec<FreqWattPoint>,
}

impl FreqWattCurve {
    /// Checks a curve. `path` is where the schedule period stands in the message.
    ///
    /// # Errors
    /// Fewer than two points or more than twenty, a frequency that does not rise, a number that is
    /// none.
    pub fn new(path: &str, baseline_w: f64, points: &[FreqWattPoint]) -> Result<Self, FieldError> {
        let curve = format!("{path}v2xFreqWattCurve");
        if !POINTS.contains(&points.len()) {
            let found = format!("{} points", points.len());
            return Err(FieldError::new(curve, found, "2 to 20 points"));
        }
        finite(format!("{path}v2xBaseline"), baseline_w)?;
        for (index, point) in points.iter().enumerate() {
            finite(format!("{curve}[{index}].frequency"), point.frequency)?;
            finite(format!("{curve}[{index}].power"), point.power)?;
            let before = index.checked_sub(1).map(|before| points[before].frequency);
            if let Some(before) = before.filter(|before| point.frequency <= *before) {
                let allowed = format!("above {before}, for frequencies rise from point to point");
                let field = format!("{curve}[{index}].frequency");
                return Err(FieldError::new(field, point.frequency, allowed));
            }
        }
        Ok(Self {
            baseline_w,
            points: points.to_vec(),
        })
    }

    /// Power drawn from the grid at a frequency \[W\], the baseline included.
    pub fn power_w(&self, frequency_hz: f64) -> f64 {
        let after = self.points.partition_point(|p| p.frequency <= frequency_hz);
        let on_curve = match (after.checked_sub(1), self.points.get(after)) {
            (None, Some(first)) => first.power,
            (Some(before), Some(right)) => {
                let left = &self.points[before];
                let share = (frequency_hz - left.frequency) / (right.frequency - left.frequency);
                left.power + share * (right.power - left.power)
            }
            (_, None) => self.points[self.points.len() - 1].power,
        };
        self.baseline_w + on_curve
    }

    /// Added to the curve \[W\].
    pub fn baseline_w(&self) -> f64 {
        self.baseline_w
    }

    /// The points, rising in frequency.
    pub fn points(&self) -> &[FreqWattPoint] {
        &self.points
    }
}

fn finite(field: String, value: f64) -> Result<(), FieldError> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(FieldError::new(field, value, "a finite number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(baseline_w: f64, points: &[(f64, f64)]) -> Result<FreqWattCurve, FieldError> {
        let point = |(frequency, power): &(f64, f64)| FreqWattPoint {
            frequency: *frequency,
            power: *power,
        };
        let points: Vec<FreqWattPoint> = points.iter().map(point).collect();
        FreqWattCurve::new("", baseline_w, &points)
    }

    #[test]
    fn the_middle_of_a_line_is_half_its_power() {
        let points = [(49.5, -7000.0), (50.0, 0.0)];
        assert_eq!(curve(0.0, &points).unwrap().power_w(49.75), -3500.0);
        assert_eq!(curve(2000.0, &points).unwrap().power_w(49.75), -1500.0);
    }

    #[test]
    fn knots_and_ends_are_exact() {
        let curve = curve(100.0, &[(49.0, -9.0), (49.5, -7.0), (50.0, 0.0)]).unwrap();
        for (frequency_hz, power_w) in [
            (0.0, 91.0),
            (49.0, 91.0),
            (49.5, 93.0),
            (50.0, 100.0),
            (99.0, 100.0),
        ] {
            assert_eq!(curve.power_w(frequency_hz), power_w);
        }
    }

    #[test]
    fn what_is_no_curve_is_refused_by_its_field() {
        let field =
            |baseline_w, points: &[(f64, f64)]| curve(baseline_w, points).unwrap_err().field;
        assert_eq!(field(0.0, &[(50.0, 0.0)]), "v2xFreqWattCurve");
        assert_eq!(field(0.0, &[(0.0, 0.0); 21]), "v2xFreqWattCurve");
        assert_eq!(
            field(0.0, &[(50.0, 0.0), (49.5, -7.0)]),
            "v2xFreqWattCurve[1].frequency"
        );
        assert_eq!(
            field(0.0, &[(50.0, 0.0), (50.0, -7.0)]),
            "v2xFreqWattCurve[1].frequency"
        );
        assert_eq!(
            field(0.0, &[(f64::NAN, 0.0), (50.0, 0.0)]),
            "v2xFreqWattCurve[0].frequency"
        );
        assert_eq!(
            field(0.0, &[(49.0, 0.0), (50.0, f64::INFINITY)]),
            "v2xFreqWattCurve[1].power"
        );
        assert_eq!(field(f64::NAN, &[(49.0, 0.0), (50.0, 0.0)]), "v2xBaseline");
    }
}
