//! A figure as data: what is drawn, told in words, and written as CSV.

use std::fmt::Write as _;

use super::palette::Colour;

/// A curve over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend and the data.
    pub name: String,
    /// How it is drawn.
    pub colour: Colour,
    /// Time \[s\] and value, times rising.
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// The value at a time: of the last point not after it.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        // Times of ticks are multiples in floating point: a nanosecond of grace.
        let after = self.points.partition_point(|(t, _)| *t <= time_s + 1e-9);
        self.points
            .get(after.checked_sub(1)?)
            .map(|(_, value)| *value)
    }
}

/// A stretch of time in the background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Its name.
    pub name: &'static str,
    /// Its fill.
    pub colour: Colour,
    /// From \[s\].
    pub start_s: f64,
    /// To \[s\].
    pub end_s: f64,
}

/// A band of values, drawn as a box.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueBand {
    /// Its name.
    pub name: String,
    /// Its edges.
    pub colour: Colour,
    /// From.
    pub low: f64,
    /// To.
    pub high: f64,
    /// Whether it is filled too: a zone that must not be visited.
    pub filled: bool,
}

/// A set of values over time: what it spans at some times.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeOverTime {
    /// Name in the legend and the data.
    pub name: String,
    /// How it is drawn.
    pub colour: Colour,
    /// Time \[s\], lowest and highest value, times rising.
    pub spans: Vec<(f64, f64, f64)>,
}

/// A chart over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without its ending, and identifier in the page.
    pub id: String,
    /// Title.
    pub title: String,
    /// What it shows, for those who do not see it.
    pub description: String,
    /// Label of the values, with their unit.
    pub value_label: &'static str,
    /// Digits of a value in the table.
    pub digits: usize,
    /// Time shown \[s\].
    pub time_s: (f64, f64),
    /// Values shown.
    pub values: (f64, f64),
    /// Curves.
    pub curves: Vec<Curve>,
    /// Background.
    pub stretches: Vec<Stretch>,
    /// Boxes.
    pub bands: Vec<ValueBand>,
    /// Sets: a bar at each time, joined by a pale area.
    pub ranges: Vec<RangeOverTime>,
}

impl Figure {
    /// Everything that is drawn, one value a line: `curve,time_s,value` for curves, and the ends of stretches and bands.
    pub fn csv(&self) -> String {
        let mut out = String::from("kind,name,time_s,value\n");
        // Writing to a string cannot fail.
        for curve in &self.curves {
            for (time, value) in &curve.points {
                let _ = writeln!(out, "curve,{},{time:.3},{value:.6}", curve.name);
            }
        }
        for range in &self.ranges {
            for (time, low, high) in &range.spans {
                for value in [low, high] {
                    let _ = writeln!(out, "set,{},{time:.3},{value:.6}", range.name);
                }
            }
        }
        for stretch in &self.stretches {
            for end in [stretch.start_s, stretch.end_s] {
                let _ = writeln!(out, "phase,{},{end:.3},", stretch.name);
            }
        }
        for band in &self.bands {
            for end in [band.low, band.high] {
                let _ = writeln!(out, "band,{},,{end:.6}", band.name);
            }
        }
        out
    }

    /// Rows of the text alternative: a time and each curve's value, at about `rows` even times.
    pub fn table(&self, rows: usize) -> Vec<(f64, Vec<Option<f64>>)> {
        let (start, end) = self.time_s;
        let rows = rows.max(1);
        (0..=rows)
            .map(|row| start + (end - start) * row as f64 / rows as f64)
            .map(|time| (time, self.curves.iter().map(|c| c.at(time)).collect()))
            .collect()
    }
}

/// Keeps every point up to a time \[s\] that is at least `step_s` after the last kept one.
pub fn thin(points: impl Iterator<Item = (f64, f64)>, step_s: f64, end_s: f64) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for (time, value) in points.take_while(|(time, _)| *time <= end_s + 1e-9) {
        if kept
            .last()
            .is_none_or(|(last, _)| time - last >= step_s - 1e-9)
        {
            kept.push((time, value));
        }
    }
    kept
}
