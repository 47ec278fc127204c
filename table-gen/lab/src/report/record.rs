//! The sections of a recorded event: what the firmware would have done, and what would have become
//! of the frequency.

use super::figure::{Axis, Curve, Figure, Stretch, thin};
use super::palette::Colour;
use super::section::{DataTable, Section};
use crate::counterfactual::grids::Role;
use crate::counterfactual::{Counterfactual, LIMITS, PlantAnswer};
use crate::record::Record;
use crate::replay::{REACTION_STEP_MAX_S, Replay};

/// Time from one drawn point to the next \[s\].
const POINT_S: f64 = 0.5;

fn curve(name: String, colour: Colour, points: impl Iterator<Item = (f64, f64)>) -> Curve {
    Curve {
        name,
        colour,
        points: thin(points, POINT_S, f64::INFINITY),
    }
}

fn extent(curves: &[Curve]) -> (f64, f64) {
    let values = || curves.iter().flat_map(|c| &c.points).map(|(_, v)| *v);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    (low - 0.05, high + 0.05)
}

/// The firmware on the record.
pub fn replay(spec: &str, record: &Record, replay: &Replay) -> Section {
    let stretches: Vec<Stretch> = replay
        .phases
        .iter()
        .map(|span| Stretch {
            name: span.phase,
            colour: Colour::of_phase(span.phase),
            start_s: span.start_s,
            end_s: span.end_s,
        })
        .collect();
    let reaction = match (replay.onset_s, replay.first_response_s) {
        (Some(onset), Some(first)) => format!(
            "The event begins at {onset:.1} s; the chargers respond at {first:.1} s, {:.1} s later.",
            first - onset
        ),
        (Some(onset), None) => {
            format!("The event begins at {onset:.1} s; the chargers do not respond.")
        }
        (None, _) if record.step_s > REACTION_STEP_MAX_S => format!(
            "Samples are {} s apart: too far to say when an event began.",
            record.step_s
        ),
        (None, _) => "There is no event in the record.".to_owned(),
    };
    let quiet_s = replay.onset_s.unwrap_or_else(|| record.end_s());
    let mut section = Section::new(format!("The recorded event: {spec}")).say(format!(
        "Record from {}, {} samples. {reaction} In the {quiet_s:.0} s without an event the chargers responded {} times. The grid \
         of a record does not feel the chargers.",
        record.start,
        record.samples.len(),
        replay.false_triggers
    ));
    let recorded = record.samples.iter().map(|s| (s.time_s, s.frequency_hz));
    let frequency = vec![curve("recorded".to_owned(), Colour::Without, recorded)];
    let participation = replay
        .samples
        .iter()
        .map(|s| (s.time_s, 100.0 * s.participation));
    let asked = vec![curve(
        "firmware".to_owned(),
        Colour::Symbolic,
        participation,
    )];
    let time_s = (0.0, record.end_s());
    section.figures.push(Figure {
        id: "replay-frequency".to_owned(),
        title: format!("Recorded frequency and the phases of {spec}"),
        description: reaction.clone(),
        value_label: "Frequency [Hz]",
        digits: 3,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: time_s,
        values: extent(&frequency),
        curves: frequency,
        stretches: stretches.clone(),
        bands: Vec::new(),
        ranges: Vec::new(),
    });
    section.figures.push(Figure {
        id: "replay-participation".to_owned(),
        title: format!("Participation that {spec} asks for on the record"),
        description: format!("At most {:.1} %.", 100.0 * replay.max_participation),
        value_label: "Participation [%]",
        digits: 1,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: time_s,
        values: (0.0, 105.0),
        curves: asked,
        stretches,
        bands: Vec::new(),
        ranges: Vec::new(),
    });
    section
}

/// What would have become of the record.
pub fn counterfactual(spec: &str, found: &Counterfactual) -> Section {
    let mut section = Section::new(format!("The recorded event with chargers: {spec}")).say(format!(
        "The recorded nadir is {:.3} Hz. The power that was missing is inferred from the record, and the event runs again with \
         the firmware, which sees the frequency alone.",
        found.recorded_nadir_hz
    ));
    if let Some(why) = &found.not_identified {
        section
            .words
            .push(format!("The record tells no plant: {why}."));
    }
    for plant in &found.plants {
        let role = match plant.role {
            Role::Comparison => "to compare with",
            Role::Answer => "the answer",
        };
        section.words.push(format!(
            "{} ({role}): up to {:.2} GW are missing; without chargers the plant follows the record within {:.1} mHz.",
            plant.name,
            plant.largest_missing_gw,
            1000.0 * plant.misfit_hz
        ));
        section.tables.extend(answers(plant));
        section.figures.push(frequency_figure(found, plant));
        section.figures.push(missing_figure(found, plant));
    }
    let limits = LIMITS.iter().map(|limit| format!("Limit: {limit}"));
    section.words.extend(limits);
    section
}

fn answers(plant: &PlantAnswer) -> [DataTable; 2] {
    let header = [
        "Disturbance",
        "Fleet [GW]",
        "Chargers",
        "Nadir [Hz]",
        "5 % [Hz]",
        "95 % [Hz]",
        "Over plants [Hz]",
    ];
    let mut fleets = DataTable::new(format!("counterfactual: {}, by fleet", plant.name), &header);
    let header = ["Disturbance", "Above [Hz]", "Fleet [GW]", "Chargers"];
    let mut levels = DataTable::new(format!("counterfactual: {}, by level", plant.name), &header);
    let none = || "–".to_owned();
    for variant in &plant.variants {
        for fleet in &variant.fleets {
            let at = fleet.nadir_hz.at;
            fleets.row([
                variant.name.to_owned(),
                format!("{:.2}", fleet.fleet_gw),
                fleet.chargers.to_string(),
                format!("{:.3}", fleet.summary.nadir_hz),
                at.map_or_else(none, |at| format!("{:.3}", at.p05)),
                at.map_or_else(none, |at| format!("{:.3}", at.p95)),
                fleet
                    .nadir_over_plants_hz
                    .map_or_else(none, |[low, high]| format!("{low:.3} to {high:.3}")),
            ]);
        }
        for level in &variant.levels {
            levels.row([
                variant.name.to_owned(),
                format!("{:.1}", level.level_hz),
                level
                    .fleet_gw
                    .map_or_else(|| "more than 5".to_owned(), |gw| format!("{gw:.2}")),
                level.chargers.map_or_else(none, |n| n.to_string()),
            ]);
        }
    }
    [fleets, levels]
}

/// Name of a plant in a file name.
fn slug(plant: &PlantAnswer) -> String {
    plant.name.replace("'", "").replace(' ', "-")
}

fn frequency_figure(found: &Counterfactual, plant: &PlantAnswer) -> Figure {
    let colours = [Colour::Extra, Colour::Symbolic, Colour::Baseline];
    let recorded = found.recorded.iter().copied();
    let mut curves = vec![curve("recorded".to_owned(), Colour::Without, recorded)];
    for ((fleet_gw, points), colour) in plant.curves.iter().zip(colours) {
        let points = points.iter().map(|(time, f, _)| (*time, *f));
        curves.push(curve(format!("with {fleet_gw} GW"), colour, points));
    }
    let relief = plant.variants.last().map_or("", |variant| variant.name);
    Figure {
        id: format!("counterfactual-frequency-{}", slug(plant)),
        title: format!("Frequency with chargers: {}, {relief}", plant.name),
        description: "The recorded frequency, and what it would have been with each fleet."
            .to_owned(),
        value_label: "Frequency [Hz]",
        digits: 3,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (0.0, found.recorded.last().map_or(1.0, |(time, _)| *time)),
        values: extent(&curves),
        curves,
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
    }
}

fn missing_figure(found: &Counterfactual, plant: &PlantAnswer) -> Figure {
    let known = &plant.disturbance;
    let times = || found.recorded.iter().map(|(time, _)| *time);
    let off = |factor: f64| {
        let rows = known.missing_gw.iter().zip(&known.deviation_gw);
        let values: Vec<f64> = rows.map(|(mean, sigma)| mean + factor * sigma).collect();
        times().zip(values)
    };
    let curves = vec![
        curve("mean".to_owned(), Colour::Symbolic, off(0.0)),
        curve(
            "two standard deviations less".to_owned(),
            Colour::Without,
            off(-2.0),
        ),
        curve("two more".to_owned(), Colour::Without, off(2.0)),
    ];
    Figure {
        id: format!("counterfactual-missing-{}", slug(plant)),
        title: format!("Power that was missing: {}", plant.name),
        description: format!(
            "Inferred through the plant; at most {:.2} GW.",
            plant.largest_missing_gw
        ),
        value_label: "Missing power [GW]",
        digits: 2,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (0.0, found.recorded.last().map_or(1.0, |(time, _)| *time)),
        values: extent(&curves),
        curves,
        stretches: Vec::new(),
        bands: Vec::new(),
        ranges: Vec::new(),
    }
}
