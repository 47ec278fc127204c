//! The section of the scorecard: nadir and final frequency over the loss, four lines each.

use super::figure::{Axis, Curve, Figure};
use super::palette::Colour;
use super::section::{DataTable, Section};
use crate::compare::verdict::{Measure, Verdict};
use crate::compare::views::View;
use crate::compare::{CompareConfig, Controller, Row, Scorecard};

/// Room above and below the curves \[Hz\].
const MARGIN_HZ: f64 = 0.02;

/// The scorecard of a spec, with two figures for each plant that was asked for, and two for the
/// worst of its bands.
pub fn scorecard(spec: &str, config: &CompareConfig, found: &Scorecard) -> Section {
    let fleet = &config.chargers;
    let verdict = Verdict::of(found, fleet);
    let mut section = Section::new(format!("Scorecard: {spec}"))
        .say(format!("{}.", verdict.sentence()))
        .say(format!(
            "Droop and table run on {} chargers with own clocks, meters within {} Hz and delays of {} to {} s; the limit is \
             everything at the moment f passes {} Hz, without delay. Runs of {} s. Command: compare {spec}.",
            fleet.number,
            fleet.meter_hz,
            fleet.delay_s[0],
            fleet.delay_s[1],
            config.trigger_hz,
            config.duration_s
        ));
    for view in found.views(&config.grids) {
        section.tables.push(table(&view));
    }
    section.figures = figures(spec, config, found);
    section
}

/// The figures of the scorecard: for each of its views the nadir, then the final frequency.
pub fn figures(spec: &str, config: &CompareConfig, found: &Scorecard) -> Vec<Figure> {
    let views = found.views(&config.grids).into_iter();
    views
        .flat_map(|view| Measure::ALL.map(|measure| figure(spec, measure, &view)))
        .collect()
}

fn figure(spec: &str, measure: Measure, view: &View) -> Figure {
    let name = measure.name();
    let curves = Controller::ALL.map(|controller| Curve {
        name: controller.name().to_owned(),
        colour: match controller {
            Controller::None => Colour::Without,
            Controller::Droop => Colour::Baseline,
            Controller::Table => Colour::Symbolic,
            Controller::Limit => Colour::Extra,
        },
        points: view.rows[controller as usize]
            .iter()
            .map(|row| (row.loss_gw, measure.of(row)))
            .collect(),
    });
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let (low, high) = ends(&mut points().map(|(_, value)| *value));
    let (first, last) = ends(&mut points().map(|(loss, _)| *loss));
    Figure {
        id: format!("{spec}-compare-{name}-{}", view.id),
        title: format!("{spec}: {name} frequency over the loss, {}", view.caption),
        description: format!(
            "The {name} frequency after losses of {first} to {last} GW with no response, with the droop, with the table and at \
             the limit."
        ),
        value_label: match measure {
            Measure::Nadir => "Nadir [Hz]",
            Measure::Final => "Final frequency [Hz]",
        },
        digits: 4,
        marks: Vec::new(),
        axis: Axis::Loss,
        shown: (first, last),
        values: (low - MARGIN_HZ, high + MARGIN_HZ),
        curves: curves.into(),
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
    }
}

fn table(view: &View) -> DataTable {
    let mut table = DataTable::new(view.caption.clone(), &HEADER);
    for cells in rows(view) {
        table.row(cells);
    }
    table
}

/// Heads of the columns of [`rows`].
pub const HEADER: [&str; 11] = [
    "loss GW",
    "none",
    "droop",
    "table",
    "limit",
    "final droop",
    "final table",
    "below 49.5 s",
    "table GW s",
    "changes",
    "ripple mHz",
];

/// A view of the scorecard as texts, a row a loss: four nadirs, then what else the table is
/// judged by.
pub fn rows(view: &View) -> Vec<[String; HEADER.len()]> {
    let [none, droop, table, limit] = view.rows.each_ref().map(|rows| rows.iter());
    let hz = |value: f64| format!("{value:.3}");
    let row = |(((none, droop), table), limit): (((&Row, &Row), &Row), &Row)| {
        let (droop, table) = (&droop.outcome, (&table.outcome, table.loss_gw));
        let (table, loss_gw) = table;
        [
            format!("{loss_gw:.1}"),
            hz(none.outcome.nadir_hz),
            hz(droop.nadir_hz),
            hz(table.nadir_hz),
            hz(limit.outcome.nadir_hz),
            hz(droop.final_hz),
            hz(table.final_hz),
            format!("{:.2}", table.seconds_below_49_5),
            format!("{:.1}", table.participation_gw_s),
            format!("{:.1}", table.changes_per_charger),
            format!("{:.1}", 1e3 * table.ripple_hz),
        ]
    };
    none.zip(droop).zip(table).zip(limit).map(row).collect()
}
