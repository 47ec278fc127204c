//! The path that breaks a claim: sets of frequencies, and a real trajectory if one was found.

use serde_json::Value;

use super::curves::{bands, floor_hz};
use super::figure::{Curve, Figure, RangeOverTime, Stretch};
use super::palette::Colour;
use super::section::{DataTable, Section};
use crate::simulation::NOMINAL_HZ;
use model::spec::Spec;

/// Rows of the table of the path: the last ones, which lead to the failure.
const ROWS: usize = 20;

/// A step of the path.
struct Step {
    time_s: f64,
    phase: String,
    level: u64,
    low_hz: f64,
    high_hz: f64,
}

/// The section of a verdict with a counterexample; none without one.
pub fn section(verdict: Option<&Value>, spec: &Spec) -> Option<Section> {
    let example = verdict?.get("counterexample")?;
    let claim = example.get("claim")?.as_str()?;
    let what = text(example, "what");
    let steps = steps(example);
    let real = example.get("real").filter(|real| !real.is_null());
    let answer = match real {
        Some(real) => format!(
            "{claim} is refuted by a real trajectory, replayed with the firmware: {} at {:.3} s after the event, which lies {:.4} s before the \
             first tick (disturbances: {}).",
            text(real, "what"),
            number(real, "breach_s").unwrap_or_default(),
            number(real, "first_tick_s").unwrap_or_default(),
            text(real, "adversary")
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
        .extend(figure(claim, &what, &steps, real, spec));
    section.tables.push(table(&steps));
    Some(section)
}

fn steps(example: &Value) -> Vec<Step> {
    let path = example.get("path").and_then(Value::as_array);
    path.into_iter()
        .flatten()
        .filter_map(|step| {
            Some(Step {
                time_s: number(step, "time_s")?,
                phase: text(step, "phase"),
                level: step.get("level")?.as_u64()?,
                low_hz: NOMINAL_HZ + number(step, "f_low_hz")?,
                high_hz: NOMINAL_HZ + number(step, "f_high_hz")?,
            })
        })
        .collect()
}

/// The real trajectory's frequency; time counts from the first tick, as in the sets.
fn trajectory(real: &Value) -> Vec<(f64, f64)> {
    let first_tick_s = number(real, "first_tick_s").unwrap_or_default();
    let points = real.get("frequency").and_then(Value::as_array);
    points
        .into_iter()
        .flatten()
        .filter_map(|point| {
            let (time, f) = (point.get(0)?.as_f64()?, point.get(1)?.as_f64()?);
            Some((time - first_tick_s, NOMINAL_HZ + f))
        })
        .collect()
}

fn figure(
    claim: &str,
    what: &str,
    steps: &[Step],
    real: Option<&Value>,
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
        .map(|step| (step.time_s, step.low_hz, step.high_hz))
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
        time_s: (start, end),
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
fn stretches(steps: &[Step], end_s: f64) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let name = match step.phase.as_str() {
            "No control" => "no-control",
            "C1" => "C1",
            "C2" => "C2",
            "Hold" => "hold",
            "Fallback" => "fallback",
            _ => "fixed",
        };
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

fn table(steps: &[Step]) -> DataTable {
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
        table.row([
            format!("{:.2}", step.time_s),
            step.phase.clone(),
            step.level.to_string(),
            format!("{:.4}", step.low_hz),
            format!("{:.4}", step.high_hz),
        ]);
    }
    table
}

fn number(value: &Value, name: &str) -> Option<f64> {
    value.get(name)?.as_f64()
}

fn text(value: &Value, name: &str) -> String {
    value
        .get(name)
        .and_then(Value::as_str)
        .unwrap_or_default()
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::chart;
    use super::*;
    use serde_json::json;

    fn spec() -> Spec {
        Spec::load("paper-bi", &[]).unwrap()
    }

    fn verdict(real: &Value) -> Value {
        let step = |time_s: f64, phase: &str, low: f64, high: f64| json!({"time_s": time_s, "phase": phase, "level": 3, "cell": null, "f_low_hz": low, "f_high_hz": high});
        json!({"verified": false, "counterexample": {
            "claim": "containment",
            "what": "f may fall to -0.8100 Hz",
            "path": [step(0.0, "No control", -0.02, 0.0), step(1.3, "C1", -0.31, -0.3), step(2.8, "C1", -0.82, -0.5)],
            "real": real,
        }})
    }

    #[test]
    fn the_sets_and_the_real_trajectory_share_a_clock_and_are_drawn() {
        let real = json!({"what": "f falls to -0.8100 Hz", "breach_s": 2.05, "first_tick_s": 0.05, "adversary": "none",
            "frequency": [[0.0, 0.0], [0.05, -0.01], [2.05, -0.81]]});
        let section = section(Some(&verdict(&real)), &spec()).unwrap();
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
        let section = section(Some(&verdict(&Value::Null)), &spec()).unwrap();
        assert!(section.words[0].contains("not proven") && section.words[0].contains("open"));
        assert!(section.figures[0].curves.is_empty());
        chart::svg(&section.figures[0]).unwrap();
    }

    #[test]
    fn a_verdict_without_a_counterexample_has_no_such_section() {
        assert_eq!(section(None, &spec()), None);
        let proven = json!({"verified": true, "counterexample": null});
        assert_eq!(section(Some(&proven), &spec()), None);
        // A folder may hold a verdict of another version: what is not there is not drawn.
        let odd = json!({"counterexample": {"claim": "stay", "path": [{"phase": 1}]}});
        let section = section(Some(&odd), &spec()).unwrap();
        assert!(section.figures.is_empty());
    }
}
