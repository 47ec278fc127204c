//! Curves in the terminal, in braille dots.

use textplots::{Chart, LabelBuilder, LabelFormat, Plot, Shape, TickDisplay, TickDisplayBuilder};

/// Size of a plot \[dots\]: 80 characters by 16 lines.
const WIDTH: u32 = 160;
const HEIGHT: u32 = 64;
/// Least height of the shown band \[Hz\].
const SPAN_MIN_HZ: f64 = 0.1;

/// A frequency \[Hz\] over time \[s\], with levels as dotted lines where they are in sight.
pub(super) fn frequency(points: &[(f64, f64)], levels_hz: &[f64]) -> String {
    let extent = |values: &dyn Fn(&(f64, f64)) -> f64| {
        let low = points.iter().map(values).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(values).fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    };
    let (start, end) = extent(&|point| point.0);
    let (low, high) = extent(&|point| point.1);
    if end.partial_cmp(&start) != Some(std::cmp::Ordering::Greater) {
        return String::new();
    }
    let margin = 0.04 * (high - low).max(SPAN_MIN_HZ);
    let (low, high) = (low - margin, high + margin);
    let line: Vec<(f32, f32)> = points.iter().map(|(x, y)| (*x as f32, *y as f32)).collect();
    let in_sight = levels_hz
        .iter()
        .filter(|level| (low..=high).contains(level));
    let dots: Vec<(f32, f32)> = in_sight
        .flat_map(|level| {
            let at = |dot: u32| start + (end - start) * f64::from(dot) / f64::from(WIDTH);
            (0..WIDTH)
                .step_by(4)
                .map(move |dot| (at(dot) as f32, *level as f32))
        })
        .collect();
    let mut chart = Chart::new_with_y_range(
        WIDTH,
        HEIGHT,
        start as f32,
        end as f32,
        low as f32,
        high as f32,
    );
    let (lines, dots) = (Shape::Lines(&line), Shape::Points(&dots));
    let chart = chart
        .lineplot(&lines)
        .lineplot(&dots)
        .x_label_format(LabelFormat::Custom(Box::new(|x| format!("{x:.0} s"))))
        .y_label_format(LabelFormat::Custom(Box::new(|y| format!("{y:.3} Hz"))))
        .y_tick_display(TickDisplay::Sparse);
    chart.figures();
    chart.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_is_drawn_with_its_labels() {
        let points: Vec<(f64, f64)> = (0..100)
            .map(|i| (f64::from(i), 50.0 - 0.005 * f64::from(i)))
            .collect();
        let plot = frequency(&points, &[49.7, 49.2]);
        assert!(plot.contains("99 s") && plot.contains("49.4"), "{plot}");
        assert!(plot.lines().count() >= 16, "{plot}");
        assert!(
            plot.chars()
                .filter(|c| ('\u{2801}'..='\u{28ff}').contains(c))
                .count()
                > 50
        );
    }

    #[test]
    fn nothing_is_drawn_without_two_moments() {
        assert_eq!(frequency(&[], &[]), "");
        assert_eq!(frequency(&[(1.0, 50.0)], &[]), "");
    }
}
