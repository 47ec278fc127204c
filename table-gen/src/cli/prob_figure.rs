//! The figure of `prob`: what the bound may lose, over the horizon, and for larger and smaller
//! errors than the one that was asked about.

use ::prob::analysis::{Answer, Question};
use ::prob::closed_loop::steps_in;
use ::prob::participation::{Drawn, Participation};
use ::prob::union::draws_in;
use firmware::table::Header;
use lab::report::figure::{Axis, Curve, Figure};
use lab::report::palette::Colour;

/// Points of a curve.
const POINTS: u32 = 60;
/// Where nothing is lost, the curve lies here: below what a sum of doubles can tell from 1.
const LEAST: f64 = -16.0;
/// Errors beside the one that was asked about, as factors of its deviation.
const BESIDE: [(f64, Colour); 5] = [
    (1.0, Colour::Symbolic),
    (0.8, Colour::Outer),
    (0.9, Colour::Inner),
    (1.1, Colour::Extra),
    (1.25, Colour::Baseline),
];

/// The figure: a curve for the chain, if there is one, and one for each size of the error by the
/// union of draws, if an error is proven. `absolute` is the delivery's error that the proof has
/// beside the relative one.
pub(super) fn figure(
    header: &Header,
    absolute: f64,
    question: &Question,
    answer: &Answer,
) -> Figure {
    let mut curves = Vec::new();
    if !answer.over_time.is_empty() {
        curves.push(Curve {
            name: "chain".to_owned(),
            colour: Colour::Without,
            points: answer
                .over_time
                .iter()
                .filter(|[time, _]| *time <= answer.horizon_s)
                .map(|[time, bound]| (*time, lost(*bound)))
                .collect(),
        });
    }
    // The worst of the bands that are proven.
    let proven = answer.bands.iter().filter(|band| band.holds);
    let proven = proven
        .filter_map(|band| band.participation)
        .reduce(f64::min);
    if let (Some(error), Some(kind)) = (proven, &question.participation) {
        for (kind, colour) in beside(kind) {
            let points = (0..=POINTS).map(|i| {
                let time = answer.horizon_s * f64::from(i) / f64::from(POINTS);
                let bound = kind.all_within(draws(header, question, time), error, absolute);
                (time, lost(bound))
            });
            curves.push(Curve {
                name: format!("{kind} within {:.4} %", 100.0 * error),
                colour,
                points: points.collect(),
            });
        }
    }
    let values = curves.iter().flat_map(|curve| &curve.points);
    let least = values.map(|(_, value)| *value).fold(0.0, f64::min);
    Figure {
        id: "lost-over-time".to_owned(),
        title: "What may be lost, over the horizon".to_owned(),
        description: "Logarithm of an upper bound of the probability that the promise is broken, \
                      over the time for which it is claimed; a curve for each size of the error."
            .to_owned(),
        value_label: "log10 of what may be lost",
        digits: 2,
        axis: Axis::Time,
        shown: (0.0, answer.horizon_s),
        values: (least - 0.5, 0.2),
        curves,
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
        marks: Vec::new(),
    }
}

/// Draws within a time.
fn draws(header: &Header, question: &Question, time_s: f64) -> u64 {
    if header.always_on {
        return draws_in(time_s, question.draw_interval_s);
    }
    let ticks = (time_s * 1e3 / f64::from(header.tick_ms)).ceil() as u32;
    u64::from(steps_in(ticks, u32::from(header.period_ticks)))
}

/// The distribution, and a normal one with other deviations.
fn beside(kind: &Participation) -> Vec<(Participation, Colour)> {
    match *kind {
        Participation::Gaussian { sigma, tail } => BESIDE
            .map(|(factor, colour)| {
                let sigma = sigma * factor;
                (Participation::Gaussian { sigma, tail }, colour)
            })
            .to_vec(),
        other => vec![(other, Colour::Symbolic)],
    }
}

fn lost(bound: f64) -> f64 {
    (1.0 - bound).log10().max(LEAST)
}
