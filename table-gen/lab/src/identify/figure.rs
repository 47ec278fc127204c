//! The fit, drawn.

use super::Identified;
use crate::report::figure::{Axis, Curve, Figure};
use crate::report::palette::Colour;

/// Record and fit over time.
pub fn figure(found: &Identified, nominal_hz: f64) -> Figure {
    let points = |of: fn(&(f64, f64, f64)) -> f64| {
        found
            .curve
            .iter()
            .map(|point| (point.0, nominal_hz + of(point)))
            .collect::<Vec<_>>()
    };
    let (recorded, fitted) = (points(|p| p.1), points(|p| p.2));
    let all = || recorded.iter().chain(&fitted).map(|(_, f)| *f);
    let tenths = |f: f64| (f * 10.0).floor() / 10.0;
    let values = (
        tenths(all().fold(f64::INFINITY, f64::min)),
        tenths(all().fold(f64::NEG_INFINITY, f64::max)) + 0.1,
    );
    let end_s = found.curve.last().map_or(1.0, |point| point.0);
    Figure {
        id: "identified".to_owned(),
        title: "Recorded frequency and the identified plant".to_owned(),
        description: format!(
            "Frequency over time, as recorded and as the identified plant gives it; they differ by at most {:.1} mHz.",
            1e3 * found.largest_residual_hz
        ),
        value_label: "Frequency [Hz]",
        digits: 3,
        axis: Axis::Time,
        shown: (0.0, end_s),
        values,
        curves: vec![
            Curve {
                name: "recorded".to_owned(),
                colour: Colour::Without,
                points: recorded,
            },
            Curve {
                name: "identified plant".to_owned(),
                colour: Colour::Symbolic,
                points: fitted,
            },
        ],
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
        marks: Vec::new(),
    }
}
