//! The section of the fleet: what its chargers give together, against what one firmware that knows
//! the state asks for.

use super::digits;
use super::figure::{Axis, Curve, Figure, thin};
use super::findings::FleetFinding;
use super::palette::Colour;
use super::responses::summaries;
use super::section::{DataTable, Section};
use crate::fleet::FleetSample;
use crate::fleet::measure::FleetMeasures;

/// Time from one drawn point to the next \[s\].
const POINT_S: f64 = 0.1;

/// A run of the fleet.
pub fn fleet(spec: &str, found: &FleetFinding) -> Section {
    let (config, run) = (&found.config, &found.run);
    let measures = &run.measures;
    let mut section = Section::new(format!("The fleet: {spec}")).say(format!(
        "{} instances of the firmware, each with its own meter (within {} mHz), clock, delay ({} to {} s), threshold and dispatch; \
         {} of them never respond.",
        config.instances,
        digits::four(1000.0 * config.noise_hz),
        digits::four(config.delay_s[0]),
        digits::four(config.delay_s[1]),
        measures.failed
    ));
    section.tables.push(summaries(
        format!(
            "fleet {spec} --chargers {} --loss-gw {}",
            config.instances, found.loss_gw
        ),
        &[("fleet", &run.summary)],
    ));
    section.tables.push(wear(measures));
    let curve = |name: &str, colour: Colour, value: fn(&FleetSample) -> f64| {
        let points = run.samples.iter().map(|s| (s.time_s, 100.0 * value(s)));
        Curve {
            name: name.to_owned(),
            colour,
            points: thin(points, POINT_S, f64::INFINITY),
        }
    };
    section.figures.push(Figure {
        id: format!("{spec}-fleet"),
        title: format!("{spec}: what the chargers ask for and give together"),
        description: "Participation that one firmware told the true state asks for, the mean of what the chargers ask for, and what the fleet gives.".to_owned(),
        value_label: "Participation [%]",
        digits: 1,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (0.0, run.samples.last().map_or(1.0, |s| s.time_s)),
        values: (0.0, 105.0),
        curves: vec![
            curve("told the state", Colour::Without, |s| s.told),
            curve("asked, mean", Colour::Baseline, |s| s.asked),
            curve("given", Colour::Symbolic, |s| s.given),
        ],
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
    });
    section
}

/// What the run asks of the chargers, and what the grid gets back at once.
fn wear(measures: &FleetMeasures) -> DataTable {
    let mean = |mean: f64, most: u32, unit: &str| {
        format!("{} {unit} on average, {most} at most", digits::four(mean))
    };
    let rows = [
        (
            "changes of a charger's set-point by 5 % or more",
            mean(
                measures.changes_per_charger,
                measures.changes_per_charger_max,
                "times",
            ),
        ),
        (
            "changes of a charger's set-point, all",
            mean(measures.changes_mean, measures.changes_max, "times"),
        ),
        (
            "operations of a charger's contactor",
            mean(
                measures.contactor_operations_per_charger,
                measures.contactor_operations_max,
                "times",
            ),
        ),
        (
            "time outside what the proof assumes of a fleet",
            match measures.outside_proven_hull_s {
                Some(time_s) => format!("{} s", digits::four(time_s)),
                None => "not measured: this proof knows one participation".to_owned(),
            },
        ),
        (
            "largest rise of the response in a second",
            format!("{} GW", digits::four(measures.rise_gw_per_s)),
        ),
        (
            "largest fall of the response in a second",
            format!("{} GW", digits::four(measures.fall_gw_per_s)),
        ),
        (
            "most chargers that changed in one tick",
            format!("{:.0} %", 100.0 * measures.changed_at_once),
        ),
        (
            "highest frequency after the nadir",
            format!("{} Hz", digits::hz(measures.rebound_hz)),
        ),
        (
            "ticks without a reading",
            format!("{} %", digits::four(100.0 * measures.missed_share)),
        ),
    ];
    let caption = "What it asks of the chargers, and what comes back at once";
    let mut table = DataTable::new(caption, &["Measure", "Value"]);
    for (name, value) in rows {
        table.row([name.to_owned(), value]);
    }
    table
}
