//! The section of the fleet: what its chargers give together, against what one firmware that knows
//! the state asks for.

use super::figure::{Axis, Curve, Figure, thin};
use super::palette::Colour;
use super::responses::summaries;
use super::section::{DataTable, Section};
use crate::fleet::{FleetConfig, FleetRun, FleetSample};

/// Time from one drawn point to the next \[s\].
const POINT_S: f64 = 0.1;

/// A run of the fleet.
pub fn fleet(spec: &str, config: &FleetConfig, run: &FleetRun) -> Section {
    let measures = &run.measures;
    let mut section = Section::new(format!("The fleet: {spec}")).say(format!(
        "{} instances of the firmware, each with its own meter (within {} Hz), clock, threshold and dispatch; {} of them never \
         respond. Simulation only: the proof knows one participation.",
        config.instances, config.noise_hz, measures.failed
    ));
    let chargers = config.instances.to_string();
    section.tables.push(summaries(
        format!("fleet {spec} --chargers {chargers}"),
        &[("fleet", &run.summary)],
    ));
    let mut table = DataTable::new(
        "What moves at once, and what comes back",
        &["Measure", "Value"],
    );
    for (name, value) in [
        (
            "largest rise of the response in a second [GW]",
            measures.rise_gw_per_s,
        ),
        (
            "largest fall of the response in a second [GW]",
            measures.fall_gw_per_s,
        ),
        (
            "largest share of chargers that changed in one tick",
            measures.changed_at_once,
        ),
        (
            "highest frequency after the nadir [Hz]",
            measures.rebound_hz,
        ),
        (
            "changes of a charger's set-point, on average",
            measures.changes_mean,
        ),
        ("share of ticks without a reading", measures.missed_share),
    ] {
        table.row([name.to_owned(), format!("{value:.4}")]);
    }
    section.tables.push(table);
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
