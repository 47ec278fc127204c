//! Figures of frequency and participation over time, and their parts.

use super::figure::{Axis, Curve, Figure, Stretch, ValueBand, thin};
use super::palette::Colour;
use crate::simulation::NOMINAL_HZ;
use crate::simulation::trajectory::{PhaseSpan, Run};
use model::spec::Spec;

/// Time from one drawn point to the next \[s\].
const POINT_S: f64 = 0.1;
/// Time that the figures show \[s\].
const SHOWN_S: f64 = 120.0;

/// A curve of what is shown, thinned to what can be seen.
pub(super) fn curve(name: &str, colour: Colour, points: impl Iterator<Item = (f64, f64)>) -> Curve {
    Curve {
        name: name.to_owned(),
        colour,
        points: thin(points, POINT_S, SHOWN_S),
    }
}

/// Participation, commanded or delivered \[%\].
pub(super) fn percent(run: &Run, delivered: bool) -> impl Iterator<Item = (f64, f64)> + '_ {
    run.samples.iter().map(move |sample| {
        let u = if delivered {
            sample.delivered
        } else {
            sample.participation
        };
        (sample.time_s, 100.0 * u)
    })
}

fn stretches(phases: &[PhaseSpan]) -> Vec<Stretch> {
    phases
        .iter()
        .map(|span| Stretch {
            name: span.phase,
            colour: Colour::of_phase(span.phase),
            start_s: span.start_s,
            end_s: span.end_s.min(SHOWN_S),
        })
        .filter(|stretch| stretch.start_s < stretch.end_s)
        .collect()
}

/// Least frequency that a figure shows \[Hz\]: a little below everything of interest.
pub(super) fn floor_hz(spec: &Spec, curves: &[Curve]) -> f64 {
    let lowest = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(|(_, f)| *f)
        .fold(f64::INFINITY, f64::min);
    let limit = spec
        .requirements
        .containment_hz
        .map_or(lowest, |hz| NOMINAL_HZ + hz);
    // Whole steps of 0.05 Hz.
    ((lowest.min(limit) - 0.05) * 20.0).floor() / 20.0
}

/// The bands of a spec as boxes; the containment zone reaches down to `floor`.
pub(super) fn bands(spec: &Spec, floor: f64) -> Vec<ValueBand> {
    let requirements = &spec.requirements;
    let band = |name: &str, colour: Colour, [low, high]: [f64; 2]| ValueBand {
        name: name.to_owned(),
        colour,
        low: NOMINAL_HZ + low,
        high: NOMINAL_HZ + high,
        filled: false,
    };
    let mut bands = vec![
        band("I1", Colour::Outer, requirements.outer_hz),
        band("I2", Colour::Inner, requirements.inner_hz),
    ];
    if let Some(limit) = requirements.containment_hz {
        bands.push(ValueBand {
            filled: true,
            ..band(
                "containment zone",
                Colour::Zone,
                [floor - NOMINAL_HZ, limit],
            )
        });
    }
    bands
}

/// Frequency over time, with the spec's bands.
pub(super) fn frequency_figure(
    spec: &Spec,
    id: String,
    title: String,
    description: String,
    curves: Vec<Curve>,
    phases: &[PhaseSpan],
) -> Figure {
    let floor = floor_hz(spec, &curves);
    let ceiling = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(|(_, f)| *f)
        .fold(NOMINAL_HZ, f64::max);
    Figure {
        id,
        title,
        description,
        value_label: "Frequency [Hz]",
        digits: 4,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (0.0, SHOWN_S),
        values: (floor, ceiling + 0.05),
        curves,
        stretches: stretches(phases),
        bands: bands(spec, floor),
        ranges: Vec::new(),
    }
}

/// Participation over time.
pub(super) fn participation_figure(
    id: String,
    title: String,
    description: String,
    curves: Vec<Curve>,
    phases: &[PhaseSpan],
) -> Figure {
    Figure {
        id,
        title,
        description,
        value_label: "Participation [%]",
        digits: 1,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (0.0, SHOWN_S),
        values: (0.0, 105.0),
        curves,
        stretches: stretches(phases),
        bands: Vec::new(),
        ranges: Vec::new(),
    }
}
