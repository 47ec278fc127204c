//! The path that breaks a claim: sets of frequencies, and a real trajectory if one was found.

use model::spec::Spec;
use model::verdict::{ClaimName, Counterexample, RealPath, ShownStep, Verdict};

use super::curves::{bands, floor_hz};
use super::figure::{Axis, Curve, Figure, RangeOverTime, Stretch};
use super::palette::Colour;
use super::section::{DataTable, Section};
use crate::simulation::NOMINAL_HZ;

/// Rows of the table of the path: the last ones, which lead to the failure.
const ROWS: usize = 20;

/// The section of a verdict with a counterexample; none without one.
pub fn section(verdict: Option<&Verdict>, spec: &Spec) -> Option<Section> {
    let Counterexample {
        claim,
        what,
        path,
        real,
    } = verdict?.counterexample.as_ref()?;
    let answer = match real {
        Some(real) => format!(
            "{claim} is refuted by a real trajectory, replayed with the firmware: {} at {:.3} s after the event, which lies {:.4} s before the \
             first tick (disturbances: {}).",
            real.what, real.breach_s, real.first_tick_s, real.adversary
        ),
        None => format!(
            "{claim} is not proven: {what}. No real trajectory was found that breaks it, so the claim is open."
        ),
    };
    let mut section = Section::new(format!("How {claim} fails")).say(answer).say(
        "Each set contains every state with which the decisions up to it can have been made. The sets are shown at the decisions on the way to the failure; between the \
         decisions they are joined by straight lines, which is a drawing and no bound.",
    );
    section
        .figures
        .extend(figure(*claim, what, path, real.as_ref(), spec));
    section.tables.push(table(path));
    Some(section)
}

/// The real trajectory's frequency; time counts from the first tick, as in the sets.
fn trajectory(real: &RealPath) -> Vec<(f64, f64)> {
    let points = real.frequency.iter();
    points
        .map(|[time_s, f]| (time_s - real.first_tick_s, NOMINAL_HZ + f))
        .collect()
}

fn figure(
    claim: ClaimName,
    what: &str,
    steps: &[ShownStep],
    real: Option<&RealPath>,
    spec: &Spec,
) -> Option<Figure> {
    let mut curves = Vec::new();
    if let Some(real) = real {
        let points = trajectory(real);
        if !points.is_empty() {
            curves.push(Curve {
                name: "a real trajectory".to_owned(),
                colour: Colour::Baseline,
                points,
            });
        }
    }
    let spans: Vec<(f64, f64, f64)> = steps
        .iter()
        .map(|step| {
            let [low, high] = hz(step);
            (step.time_s, low, high)
        })
        .collect();
    let times = spans
        .iter()
        .map(|(time, ..)| *time)
        .chain(curves.iter().flat_map(|c| &c.points).map(|(time, _)| *time));
    let (start, end) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| {
        (low.min(time), high.max(time))
    });
    if start > end {
        return None;
    }
    // Room for what happens at the very end.
    let end = end + 0.05 * (end - start).max(1.0);
    let lows = spans.iter().map(|(_, low, _)| *low);
    let lowest = lows.fold(floor_hz(spec, &curves), f64::min);
    let highs = spans.iter().map(|(.., high)| *high);
    let highest = highs
        .chain(curves.iter().flat_map(|c| &c.points).map(|(_, f)| *f))
        .fold(NOMINAL_HZ, f64::max);
    Some(Figure {
        id: format!("failure-{claim}"),
        title: format!("The path on which {claim} fails"),
        description: format!(
            "Frequencies from the first tick after the event, {} sets up to {end:.1} s: {what}.",
            spans.len()
        ),
        value_label: "Frequency [Hz]",
        digits: 4,
        marks: Vec::new(),
        axis: Axis::Time,
        shown: (start, end),
        values: (lowest, highest + 0.05),
        curves,
        stretches: stretches(steps, end),
        bands: bands(spec, lowest),
        ranges: vec![RangeOverTime {
            name: "sets".to_owned(),
            colour: Colour::Symbolic,
            spans,
        }],
    })
}

/// The laws in force along the path.
fn stretches(steps: &[ShownStep], end_s: f64) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let name = step.phase.name();
        let until = steps.get(index + 1).map_or(end_s, |next| next.time_s);
        match found.last_mut() {
            Some(last) if last.name == name => last.end_s = until,
            _ => found.push(Stretch {
                name,
                colour: Colour::of_phase(name),
                start_s: step.time_s,
                end_s: until,
            }),
        }
    }
    found
}

fn table(steps: &[ShownStep]) -> DataTable {
    let header = [
        "Time [s]",
        "Law",
        "Level",
        "Lowest f [Hz]",
        "Highest f [Hz]",
    ];
    let mut table = DataTable::new(
        "verify TABLE --spec SPEC: the last sets of the path",
        &header,
    );
    for step in steps.iter().rev().take(ROWS).rev() {
        let [low, high] = hz(step);
        table.row([
            format!("{:.2}", step.time_s),
            step.phase.name().to_owned(),
            step.level.to_string(),
            format!("{low:.4}"),
            format!("{high:.4}"),
        ]);
    }
    table
}

/// Lowest and highest frequency of a set.
fn hz(step: &ShownStep) -> [f64; 2] {
    [NOMINAL_HZ + step.f_low_hz, NOMINAL_HZ + step.f_high_hz]
}

#[cfg(test)]
mod tests {
    use super::super::chart;
    use super::*;
    use firmware::phase::Phase;
    use model::verdict::{Counts, Method};

    fn spec() -> Spec {
        Spec::load("paper-bi", &[]).unwrap()
    }

    fn verdict(real: Option<RealPath>) -> Verdict {
        let step = |time_s, phase, f_low_hz, f_high_hz| ShownStep {
            time_s,
            phase,
            level: 3,
            cell: None,
            f_low_hz,
            f_high_hz,
        };
        Verdict {
            verified: false,
            spec: "paper-bi".to_owned(),
            claims: Vec::new(),
            reachable_cells: 0,
            counterexample: Some(Counterexample {
                claim: ClaimName::Containment,
                what: "f may fall to -0.8100 Hz".to_owned(),
                path: vec![
                    step(0.0, Phase::NoControl, -0.02, 0.0),
                    step(1.3, Phase::C1, -0.31, -0.3),
                    step(2.8, Phase::C1, -0.82, -0.5),
                ],
                real,
            }),
            hostile_share: None,
            plant: Vec::new(),
            spec_hash: String::new(),
            table_spec_hash: String::new(),
            table_sha256: String::new(),
            table_bytes: 0,
            method: Method::TightSets,
            counts: Counts::default(),
            tool_version: String::new(),
            failures: Vec::new(),
        }
    }

    #[test]
    fn the_sets_and_the_real_trajectory_share_a_clock_and_are_drawn() {
        let real = RealPath {
            what: "f falls to -0.8100 Hz".to_owned(),
            breach_s: 2.05,
            first_tick_s: 0.05,
            initial: [0.0; 4],
            adversary: "none".to_owned(),
            points: Vec::new(),
            frequency: vec![[0.0, 0.0], [0.05, -0.01], [2.05, -0.81]],
        };
        let section = section(Some(&verdict(Some(real))), &spec()).unwrap();
        assert!(section.words[0].contains("refuted") && section.words[0].contains("2.050 s"));
        let [figure] = &section.figures[..] else {
            panic!("one figure")
        };
        let spans = [(0.0, 49.98, 50.0), (1.3, 49.69, 49.7), (2.8, 49.18, 49.5)];
        assert_eq!(figure.ranges[0].spans, spans);
        let points = &figure.curves[0].points;
        // The event is 0.05 s before the first tick, from which the sets count.
        assert_eq!(points.first(), Some(&(-0.05, 50.0)));
        assert_eq!(points.last(), Some(&(2.05 - 0.05, 50.0 - 0.81)));
        let laws: Vec<&str> = figure.stretches.iter().map(|s| s.name).collect();
        assert_eq!(laws, ["no-control", "C1"]);
        // Everything is inside the axes.
        assert!(figure.values.0 <= 49.18 && figure.values.1 > 50.0);
        let svg = chart::svg(figure).unwrap();
        let colour = Colour::Symbolic.hex();
        assert!(svg.contains("<polygon") && svg.contains("<circle") && svg.contains(&colour));
        assert_eq!(section.tables[0].rows.len(), 3);
    }

    #[test]
    fn without_a_real_trajectory_the_claim_is_open() {
        let section = section(Some(&verdict(None)), &spec()).unwrap();
        assert!(section.words[0].contains("not proven") && section.words[0].contains("open"));
        assert!(section.figures[0].curves.is_empty());
        chart::svg(&section.figures[0]).unwrap();
    }

    #[test]
    fn a_verdict_without_a_counterexample_has_no_such_section() {
        assert_eq!(section(None, &spec()), None);
        let proven = Verdict {
            verified: true,
            counterexample: None,
            ..verdict(None)
        };
        assert_eq!(section(Some(&proven), &spec()), None);
    }
}
