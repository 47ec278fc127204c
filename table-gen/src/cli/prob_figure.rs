//! The figures of `prob`: what the bound may lose, over the horizon and over the size of the error,
//! and the report's section with both.

use ::prob::analysis::{Answer, Question};
use ::prob::closed_loop::Pace;
use ::prob::participation::{Drawn, Participation};
use ::prob::union::draws_in;
use firmware::table::Header;
use lab::report::figure::{Axis, Curve, Figure, Mark};
use lab::report::palette::Colour;
use lab::report::section::{DataTable, Section};
use model::spec::Spec;

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
    if let (Some(error), Some(kind)) = (proven(answer), &question.participation) {
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

/// The error that is proven for all bands that are proven at all.
fn proven(answer: &Answer) -> Option<f64> {
    let proven = answer.bands.iter().filter(|band| band.holds);
    proven
        .filter_map(|band| band.participation)
        .reduce(f64::min)
}

/// What may be lost over the horizon, over the size of the error: by the union of draws within the
/// error that is proven. A mark at the size that was asked about shows the
/// answer's own bound, which may be a chain's. Nothing where no error is proven, or where the
/// distribution has no size.
fn over_error(
    header: &Header,
    absolute: f64,
    question: &Question,
    answer: &Answer,
) -> Option<Figure> {
    let kind = question.participation?;
    let (asked, sized): (f64, &dyn Fn(f64) -> Participation) = match kind {
        Participation::Gaussian { sigma, tail } => {
            (sigma, &move |sigma| Participation::Gaussian { sigma, tail })
        }
        Participation::Uniform { bound } => (bound, &|bound| Participation::Uniform { bound }),
        Participation::Truncated { sigma, bound } => (sigma, &move |sigma| {
            Participation::Truncated { sigma, bound }
        }),
        Participation::Exact | Participation::Bernoulli { .. } => return None,
    };
    let error = proven(answer)?;
    let draws = draws(header, question, answer.horizon_s);
    // A normal error is rarely past four deviations; a uniform one never past its bound.
    let (from, to) = (0.125 * error.max(asked), (1.25 * error.max(asked)).min(1.0));
    let points: Vec<(f64, f64)> = (0..=POINTS)
        .map(|i| {
            let size = from + (to - from) * f64::from(i) / f64::from(POINTS);
            let bound = sized(size).all_within(draws, error, absolute);
            (100.0 * size, lost(bound))
        })
        .collect();
    let own = answer.layers.participation.as_ref()?.lower_bound;
    let least = points.iter().map(|(_, value)| *value);
    let least = least.fold(lost(own), f64::min);
    Some(Figure {
        id: "lost-over-error".to_owned(),
        title: "What may be lost, over the size of the error".to_owned(),
        description: "Logarithm of an upper bound of the probability that the promise is broken \
                      over the horizon, for larger and smaller errors of the delivery; certain is \
                      what the verifier proves."
            .to_owned(),
        value_label: "log10 of what may be lost",
        digits: 2,
        axis: Axis::DeliveryError,
        shown: (100.0 * from, 100.0 * to),
        values: (least - 0.5, 0.2),
        curves: vec![Curve {
            name: format!("{draws} draws within {:.4} %", 100.0 * error),
            colour: Colour::Symbolic,
            points,
        }],
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
        marks: vec![Mark {
            name: format!("{kind}: the answer"),
            colour: Colour::Baseline,
            place: 100.0 * asked,
            value: lost(own),
            filled: true,
        }],
    })
}

/// The section of a report: the layers, what they rest on, and the figures.
pub(super) fn section(
    spec: &Spec,
    header: &Header,
    question: &Question,
    answer: &Answer,
) -> Section {
    let kind = question.participation.map_or_else(
        || "as the spec bounds it".to_owned(),
        |kind| format!("drawn as {kind}"),
    );
    let mut section = Section::new("How likely the promise is kept").say(format!(
        "With the delivered participation {kind}, the promise is kept over {} s with a probability \
         of at least {:.9}: a bound with every rounding downwards, not an estimate. Most is lost \
         by {}. The command is `prob TABLE --spec {}`.",
        answer.horizon_s, answer.lower_bound, answer.dominates, spec.name
    ));
    if let Some(seconds) = answer.seconds_below_49_5 {
        section = section.say(format!(
            "Below 49.5 Hz at most {seconds:.3} s are expected, a run that may fail counted as all \
             of the time."
        ));
    }
    let mut table = DataTable::new("The layers of the bound", &["Layer", "At least", "How"]);
    let layers = &answer.layers;
    for (name, layer) in [
        ("size of the loss", Some(&layers.loss)),
        ("participation", layers.participation.as_ref()),
        ("noise", layers.noise.as_ref()),
    ] {
        if let Some(layer) = layer {
            table.row([
                name.to_owned(),
                format!("{:.9}", layer.lower_bound),
                layer.how.clone(),
            ]);
        }
    }
    section.tables.push(table);
    let mut rests = DataTable::new("What every number rests on", &["Assumed"]);
    for assumption in &answer.assumptions {
        rests.row([assumption.clone()]);
    }
    section.tables.push(rests);
    let absolute = spec.uncertainty.participation_absolute;
    section
        .figures
        .push(figure(header, absolute, question, answer));
    section
        .figures
        .extend(over_error(header, absolute, question, answer));
    section
}

/// Draws within a time.
fn draws(header: &Header, question: &Question, time_s: f64) -> u64 {
    if header.always_on {
        return draws_in(time_s, question.draw_interval_s);
    }
    let ticks = (time_s * 1e3 / f64::from(header.tick_ms)).ceil() as u32;
    u64::from(Pace::of(header).steps_in(ticks))
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
