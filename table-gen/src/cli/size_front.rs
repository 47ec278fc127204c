//! The figure of `budget --sweep`: worst time to I2 over bytes, a point for each variant.

use lab::report::figure::{Axis, Figure, Mark};
use lab::report::palette::Colour;
use synth::budget::sweep::{Outcome, Variant};

/// Every variant that has a table; those that nothing beats are filled.
pub(super) fn figure(outcomes: &[Outcome]) -> Figure {
    let marks: Vec<Mark> = outcomes.iter().filter_map(mark).collect();
    let (fewest, most) = ends(marks.iter().map(|mark| mark.place), (2.0, 3.0));
    let (soonest, latest) = ends(marks.iter().map(|mark| mark.value), (0.0, 60.0));
    let room = (0.1 * (latest - soonest)).max(0.5);
    Figure {
        id: "size-front".to_owned(),
        title: "Guarantee against bytes".to_owned(),
        description: "Worst time to I2 over the bytes of the table, a point for each variant of \
                      the spec; filled where nothing is smaller, faster and bears more."
            .to_owned(),
        value_label: "Worst time to I2 [s]",
        digits: 1,
        axis: Axis::TableBytes,
        shown: (fewest - 0.1, most + 0.3),
        values: (soonest - room, latest + room),
        curves: Vec::new(),
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
        marks,
    }
}

fn mark(outcome: &Outcome) -> Option<Mark> {
    let Variant {
        width_factor,
        period_s,
        participation,
    } = outcome.variant;
    Some(Mark {
        name: format!(
            "x{width_factor}, {period_s} s, ±{:.0} %",
            100.0 * participation
        ),
        colour: Colour::Symbolic,
        place: (outcome.table_bytes? as f64).log10(),
        value: outcome.settle_s?,
        filled: outcome.pareto,
    })
}

fn ends(values: impl Iterator<Item = f64>, empty: (f64, f64)) -> (f64, f64) {
    let bounds = (f64::INFINITY, f64::NEG_INFINITY);
    match values.fold(bounds, |(low, high), x| (low.min(x), high.max(x))) {
        (low, high) if low <= high => (low, high),
        _ => empty,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
mod tests {
    use super::*;
    use lab::report::chart;

    #[test]
    fn the_picture_names_every_variant_that_has_a_table() {
        let outcome = |participation, table_bytes, pareto| Outcome {
            variant: Variant {
                width_factor: 1.0,
                period_s: 1.0,
                participation,
            },
            table_bytes,
            settle_s: Some(20.0),
            winning_cells: None,
            reason: None,
            pareto,
        };
        let outcomes = [
            outcome(0.0, Some(2000), true),
            outcome(0.1, Some(9000), false),
            outcome(0.2, None, false),
        ];
        let picture = chart::svg(&figure(&outcomes)).unwrap();
        assert_eq!(picture.matches("<circle").count(), 2);
        assert!(picture.contains("x1, 1 s, ±0 %") && picture.contains("x1, 1 s, ±10 %"));
        assert!(
            chart::svg(&figure(&[]))
                .unwrap()
                .contains("Worst time to I2")
        );
    }
}
