//! A figure as data: what is drawn, told in words, and written as CSV.

use std::fmt::Write as _;

use super::palette::Colour;

/// Intervals of the table of a figure over time.
const TABLE_INTERVALS: u32 = 24;

/// What a figure is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Time since the start \[s\].
    Time,
    /// Lost infeed \[GW\].
    Loss,
    /// Logarithm to base 10 of a table's bytes, told in bytes.
    TableBytes,
    /// Size of the error of the delivered participation \[%\].
    DeliveryError,
}

impl Axis {
    /// Label below the chart.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Time => "Time since the start [s]",
            Self::Loss => "Lost infeed [GW]",
            Self::TableBytes => "Table [bytes]",
            Self::DeliveryError => "Error of the delivered participation [%]",
        }
    }

    /// Head of the column in the table.
    pub const fn head(self) -> &'static str {
        match self {
            Self::Time => "Time [s]",
            Self::Loss => "Loss [GW]",
            Self::TableBytes => "Bytes",
            Self::DeliveryError => "Error [%]",
        }
    }

    /// Name of the column in the data.
    pub const fn column(self) -> &'static str {
        match self {
            Self::Time => "time_s",
            Self::Loss => "loss_gw",
            Self::TableBytes => "log10_bytes",
            Self::DeliveryError => "error_percent",
        }
    }

    /// A place as it is told.
    pub fn text(self, place: f64) -> String {
        match self {
            Self::Time => format!("{place:.0}"),
            Self::Loss => format!("{place:.1}"),
            Self::TableBytes => format!("{:.0}", 10f64.powf(place)),
            Self::DeliveryError => format!("{place:.2}"),
        }
    }
}

/// A curve over the axis: time, unless the figure says otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend and the data.
    pub name: String,
    /// How it is drawn.
    pub colour: Colour,
    /// Place on the axis (time \[s\] or loss \[GW\]) and value, places rising.
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

/// A point with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Its name.
    pub name: String,
    /// How it is drawn.
    pub colour: Colour,
    /// Place on the axis.
    pub place: f64,
    /// Value.
    pub value: f64,
    /// Whether it is filled.
    pub filled: bool,
}

/// A chart over its axis.
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
    /// What it is drawn over.
    pub axis: Axis,
    /// Part of the axis that is shown \[s or GW\].
    pub shown: (f64, f64),
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
    /// Points.
    pub marks: Vec<Mark>,
}

impl Figure {
    /// Everything that is drawn, one value a line: kind, name, place on the axis and value for
    /// curves, and the ends of stretches and bands.
    pub fn csv(&self) -> String {
        let mut out = format!("kind,name,{},value\n", self.axis.column());
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
        for mark in &self.marks {
            let _ = writeln!(
                out,
                "mark,{},{:.3},{:.6}",
                mark.name, mark.place, mark.value
            );
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

    /// Rows of the text alternative: a place on the axis and each curve's value. Time is cut into
    /// even intervals; losses are shown at every point of the first curve.
    pub fn table(&self) -> Vec<(f64, Vec<Option<f64>>)> {
        let (start, end) = self.shown;
        let places: Vec<f64> = match self.axis {
            Axis::Time => (0..=TABLE_INTERVALS)
                .map(|row| start + (end - start) * f64::from(row) / f64::from(TABLE_INTERVALS))
                .collect(),
            Axis::Loss | Axis::TableBytes | Axis::DeliveryError => {
                let first = self.curves.first();
                first.map_or(Vec::new(), |c| c.points.iter().map(|(x, _)| *x).collect())
            }
        };
        let row = |x: f64| (x, self.curves.iter().map(|c| c.at(x)).collect());
        places.into_iter().map(row).collect()
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
