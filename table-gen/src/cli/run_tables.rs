//! A run for people: its summary, its phases, and the points of a plot.

use lab::simulation::NOMINAL_HZ;
use lab::simulation::monitor::Summary;
use lab::simulation::trajectory::{PhaseSpan, Run};
use model::spec::Spec;

use super::output;

/// Time and absolute frequency of a run's samples.
pub(super) fn frequency(run: &Run) -> Vec<(f64, f64)> {
    let point = |sample: &lab::simulation::trajectory::Sample| {
        (sample.time_s, NOMINAL_HZ + sample.state[0])
    };
    run.samples.iter().map(point).collect()
}

/// Levels that a plot marks: the lower ends of I1 and I2, and the containment \[Hz\].
pub(super) fn levels_hz(spec: &Spec) -> Vec<f64> {
    let requirements = &spec.requirements;
    [requirements.outer_hz[0], requirements.inner_hz[0]]
        .into_iter()
        .chain(requirements.containment_hz)
        .map(|deviation| NOMINAL_HZ + deviation)
        .collect()
}

/// A summary as a table on stdout.
pub(super) fn summary(summary: &Summary) {
    let mut table = output::table(&["measure", "value"]);
    let yes = |flag: bool| if flag { "yes" } else { "no" }.to_owned();
    let rows = [
        (
            "nadir",
            format!(
                "{:.4} Hz at {:.2} s",
                summary.nadir_hz, summary.nadir_time_s
            ),
        ),
        ("final", format!("{:.4} Hz", summary.final_hz)),
        (
            "largest participation",
            format!("{:.3}", summary.max_participation),
        ),
        (
            "below 49.5 Hz",
            format!("{:.2} s", summary.seconds_below_49_5),
        ),
        (
            "containment breached",
            summary
                .containment_breached
                .map_or_else(|| "no limit stated".to_owned(), yes),
        ),
        (
            "back in I1 after",
            format!("{} s", output::seconds(summary.entered_outer_s)),
        ),
        (
            "back in I2 after",
            format!("{} s", output::seconds(summary.entered_inner_s)),
        ),
        ("stayed in I2", yes(summary.stayed_in_inner)),
        ("satisfies psi", yes(summary.satisfies_psi)),
    ];
    for (name, value) in rows {
        table.add_row(vec![name.to_owned(), value]);
    }
    if summary.fallback_s > 0.0 {
        let value = format!("{:.1} s", summary.fallback_s);
        table.add_row(vec!["droop as the fallback".to_owned(), value]);
    }
    output::line(table);
}

/// Phases as a table on stdout.
pub(super) fn phases(phases: &[PhaseSpan]) {
    if phases.is_empty() {
        return;
    }
    let mut table = output::table(&["phase", "from s", "to s"]);
    for span in phases {
        table.add_row(vec![
            span.phase.to_owned(),
            format!("{:.1}", span.start_s),
            format!("{:.1}", span.end_s),
        ]);
    }
    output::line(table);
}
