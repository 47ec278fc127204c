//! Drawing a [`Figure`] as SVG with plotters.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::figure::Figure;
use super::palette::Colour;

/// Size \[px\].
const SIZE: (u32, u32) = (960, 400);
/// Height of the legend's row \[px\].
const LEGEND_PX: i32 = 24;
/// Mean width of a character of the labels \[px\]: for the legend's spacing alone.
const CHARACTER_PX: i32 = 6;
/// Size of labels \[px\].
const LABEL_PX: i32 = 13;

/// What plotters could not draw.
#[derive(Debug, thiserror::Error)]
#[error("figure {id}: {reason}")]
pub struct ChartError {
    id: String,
    reason: String,
}

/// The figure as a whole SVG document, with title and description for screen readers. It carries no
/// style sheet: see [`with_style`].
pub fn svg(figure: &Figure) -> Result<String, ChartError> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let drawn = draw(figure, &root).and_then(|()| root.present().map_err(|e| e.to_string()));
        drawn.map_err(|reason| ChartError {
            id: figure.id.clone(),
            reason,
        })?;
    }
    Ok(accessible(figure, &dashed(figure, text)))
}

/// The same document on its own, with its colours for light and dark.
pub fn with_style(svg: &str) -> String {
    let style = format!("<style>{}</style>", include_str!("report.css"));
    match svg.find("</desc>") {
        Some(at) => {
            let at = at + "</desc>".len();
            format!("{}{style}{}", &svg[..at], &svg[at..])
        }
        None => svg.to_owned(),
    }
}

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(figure: &Figure, root: &Root<'_>) -> Result<(), String> {
    let (legend, plot) = root.split_vertically(LEGEND_PX);
    draw_legend(figure, &legend).map_err(|error| error.to_string())?;
    let (start, end) = figure.shown;
    let (low, high) = figure.values;
    let label = |colour: Colour| ("sans-serif", LABEL_PX).into_font().color(&colour.rgb());
    let fail = |error: DrawingAreaErrorKind<std::io::Error>| error.to_string();
    let mut chart = ChartBuilder::on(&plot)
        .margin(6)
        .margin_right(24)
        .x_label_area_size(38)
        .y_label_area_size(58)
        .build_cartesian_2d(start..end, low..high)
        .map_err(fail)?;
    for stretch in &figure.stretches {
        let (from, to) = (stretch.start_s.max(start), stretch.end_s.min(end));
        if from < to {
            let style = stretch.colour.rgb().filled();
            let area = Rectangle::new([(from, low), (to, high)], style);
            chart.draw_series([area]).map_err(fail)?;
        }
    }
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(Colour::Mesh.rgb())
        .axis_style(Colour::Muted.rgb())
        .label_style(label(Colour::Muted))
        .x_desc(figure.axis.label())
        .y_desc(figure.value_label)
        .axis_desc_style(label(Colour::Ink))
        .x_labels(13)
        .x_label_formatter(&|place| figure.axis.text(*place))
        .y_labels(9)
        .draw()
        .map_err(fail)?;
    for band in &figure.bands {
        let corners = [(start, band.low.max(low)), (end, band.high.min(high))];
        let colour = band.colour.rgb();
        if band.filled {
            let fill = colour.mix(0.15).filled();
            chart
                .draw_series([Rectangle::new(corners, fill)])
                .map_err(fail)?;
        }
        let edge = colour.stroke_width(1);
        chart
            .draw_series([Rectangle::new(corners, edge)])
            .map_err(fail)?;
    }
    for range in &figure.ranges {
        let colour = range.colour.rgb();
        let upper = range.spans.iter().map(|(time, _, high)| (*time, *high));
        let lower = range.spans.iter().rev().map(|(time, low, _)| (*time, *low));
        let hull: Vec<(f64, f64)> = upper.chain(lower).collect();
        chart
            .draw_series([Polygon::new(hull, colour.mix(0.2).filled())])
            .map_err(fail)?;
        let bars = range.spans.iter().map(|(time, low, high)| {
            PathElement::new([(*time, *low), (*time, *high)], colour.stroke_width(2))
        });
        chart.draw_series(bars).map_err(fail)?;
        // A set may be too narrow to be seen as a bar.
        let ends = range
            .spans
            .iter()
            .flat_map(|(time, low, high)| [(*time, *low), (*time, *high)]);
        let dots = ends.map(|end| Circle::new(end, 3, colour.filled()));
        chart.draw_series(dots).map_err(fail)?;
    }
    for curve in &figure.curves {
        let style = curve.colour.rgb().stroke_width(2);
        let points = curve.points.iter().copied();
        chart
            .draw_series(LineSeries::new(points, style))
            .map_err(fail)?;
    }
    for mark in &figure.marks {
        let colour = mark.colour.rgb();
        let style = ShapeStyle {
            color: colour.to_rgba(),
            filled: mark.filled,
            stroke_width: 1,
        };
        let name = Text::new(mark.name.clone(), (8, -14), label(Colour::Muted));
        let drawn =
            EmptyElement::at((mark.place, mark.value)) + Circle::new((0, 0), 5, style) + name;
        chart.draw_series([drawn]).map_err(fail)?;
    }
    Ok(())
}

/// One row: curves as lines, boxes as outlines, phases as squares, each with its name.
fn draw_legend(
    figure: &Figure,
    root: &Root<'_>,
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let font = ("sans-serif", LABEL_PX)
        .into_font()
        .color(&Colour::Ink.rgb());
    let mut x = 60;
    let mut name = |text: &str| {
        let at = x;
        x += 22 + CHARACTER_PX * text.chars().count() as i32 + 14;
        root.draw(&Text::new(text.to_owned(), (at + 22, 8), font.clone()))?;
        Ok::<i32, DrawingAreaErrorKind<std::io::Error>>(at)
    };
    for curve in &figure.curves {
        let at = name(&curve.name)?;
        let style = curve.colour.rgb().stroke_width(2);
        root.draw(&PathElement::new([(at, 14), (at + 18, 14)], style))?;
    }
    for range in &figure.ranges {
        let at = name(&range.name)?;
        let corners = [(at + 3, 8), (at + 16, 20)];
        let fill = range.colour.rgb().mix(0.2).filled();
        root.draw(&Rectangle::new(corners, fill))?;
        let bar = [(at + 9, 8), (at + 9, 20)];
        root.draw(&PathElement::new(bar, range.colour.rgb().stroke_width(2)))?;
    }
    for band in &figure.bands {
        let at = name(&band.name)?;
        let corners = [(at + 3, 8), (at + 16, 20)];
        root.draw(&Rectangle::new(corners, band.colour.rgb().stroke_width(1)))?;
    }
    let mut seen: Vec<&str> = Vec::new();
    for stretch in &figure.stretches {
        if !seen.contains(&stretch.name) {
            seen.push(stretch.name);
            let at = name(stretch.name)?;
            let corners = [(at + 3, 8), (at + 16, 20)];
            root.draw(&Rectangle::new(corners, stretch.colour.rgb().filled()))?;
            let edge = Colour::Mesh.rgb().stroke_width(1);
            root.draw(&Rectangle::new(corners, edge))?;
        }
    }
    Ok(())
}

/// Curves told apart by dashes too: plotters' own dashes would be thousands of elements.
fn dashed(figure: &Figure, svg: String) -> String {
    let mut svg = svg;
    for colour in [Colour::Baseline, Colour::Without, Colour::Extra] {
        if let Some(dashes) = colour.dashes()
            && figure.curves.iter().any(|curve| curve.colour == colour)
        {
            let stroke = format!("stroke=\"{}\"", colour.hex());
            svg = svg.replace(&stroke, &format!("{stroke} stroke-dasharray=\"{dashes}\""));
        }
    }
    svg
}

/// Title and description, which a screen reader reads instead of the drawing.
fn accessible(figure: &Figure, svg: &str) -> String {
    let id = &figure.id;
    let names = format!("<svg role=\"img\" aria-labelledby=\"{id}-title {id}-desc\" ");
    let svg = svg.replacen("<svg ", &names, 1);
    let words = format!(
        "<title id=\"{id}-title\">{}</title><desc id=\"{id}-desc\">{}</desc>",
        escaped(&figure.title),
        escaped(&figure.description)
    );
    match svg.find('>') {
        Some(at) => format!("{}{words}{}", &svg[..=at], &svg[at + 1..]),
        None => svg,
    }
}

/// Text inside XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
