//! The sections of the event: the paper's figures and tables, from the same runs as `simulate`.

use super::curves::{curve, frequency_figure, participation_figure, percent};
use super::digits;
use super::figure::{Curve, Figure};
use super::palette::Colour;
use super::section::{DataTable, Section};
use super::study::{BaselineEvent, PAPER_ERROR, Study, frequency, steady_states};
use crate::simulation::monitor::Summary;
use crate::simulation::trajectory::PhaseSpan;
use model::spec::Spec;

/// Rows of summaries, one a run.
pub fn summaries(caption: impl Into<String>, runs: &[(&str, &Summary)]) -> DataTable {
    let header = [
        "Run",
        "Nadir [Hz]",
        "at [s]",
        "Final [Hz]",
        "Largest participation",
        "Below 49.5 Hz [s]",
        "Back in I1 [s]",
        "Back in I2 [s]",
        "Stays in I2",
        "ψ",
    ];
    let mut table = DataTable::new(caption, &header);
    let time = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), digits::four);
    for (name, summary) in runs {
        table.row([
            (*name).to_owned(),
            digits::hz(summary.nadir_hz),
            digits::four(summary.nadir_time_s),
            digits::hz(summary.final_hz),
            digits::four(summary.max_participation),
            digits::four(summary.seconds_below_49_5),
            time(summary.entered_outer_s),
            time(summary.entered_inner_s),
            if summary.stayed_in_inner { "yes" } else { "no" }.to_owned(),
            if summary.satisfies_psi {
                "satisfied"
            } else {
                "missed"
            }
            .to_owned(),
        ]);
    }
    table
}

/// The loss under the baseline droop: the paper's Fig. 3.
pub fn event(spec: &Spec) -> Section {
    let event = BaselineEvent::new(spec);
    let runs = [
        ("no response", Colour::Without, &event.none),
        (
            "unidirectional, 28 kW",
            Colour::Extra,
            &event.unidirectional,
        ),
        (
            "bidirectional, 56 kW",
            Colour::Baseline,
            &event.bidirectional,
        ),
    ];
    let loss = crate::simulation::scenario::Scenario::of(spec).loss_gw;
    let curves: Vec<Curve> = runs
        .iter()
        .map(|(name, colour, run)| curve(name, *colour, frequency(run)))
        .collect();
    let description = format!(
        "Frequency after the loss of {loss} GW. Without response it falls to {:.3} Hz, with unidirectional chargers to {:.3} Hz, with bidirectional ones to {:.3} Hz.",
        event.none.summary.nadir_hz,
        event.unidirectional.summary.nadir_hz,
        event.bidirectional.summary.nadir_hz
    );
    let title = format!("Loss of {loss} GW under the baseline droop");
    let mut figure = frequency_figure(
        spec,
        "event-baseline".to_owned(),
        title,
        description,
        curves,
        &[],
    );
    // I1 and I2 are the laws' targets, and each fleet has its own.
    figure.bands.retain(|band| band.filled);
    let rows = runs.map(|(name, _, run)| (name, &run.summary));
    let chargers = spec.fleet.chargers;
    let mut section = Section::new("The event under the baseline").say(format!(
        "{chargers} chargers that stop charging (28 kW each) or reverse it (56 kW each), under the droop of the paper's comparison."
    ));
    section.tables.push(summaries(
        "simulate --controller none | baseline --set fleet.power_per_charger_kw=28 | 56",
        &rows,
    ));
    section.figures.push(figure);
    section
}

/// The laws of a table against the baseline.
pub fn laws(study: &Study) -> Section {
    let (spec, name) = (&study.spec, study.spec.name.as_str());
    let (symbolic, baseline) = (&study.symbolic, &study.baseline);
    let mut section = Section::new(format!("Synthesised laws against the baseline: {name}"));
    section = section.say(story(name, &symbolic.summary, &symbolic.phases));
    section.tables.push(summaries(
        format!("simulate {name} [--controller baseline]"),
        &[
            ("firmware", &symbolic.summary),
            ("baseline", &baseline.summary),
        ],
    ));
    let curves = vec![
        curve("firmware", Colour::Symbolic, frequency(symbolic)),
        curve("baseline", Colour::Baseline, frequency(baseline)),
    ];
    section.figures.push(frequency_figure(
        spec,
        format!("{name}-frequency"),
        format!("{name}: frequency"),
        story(name, &symbolic.summary, &symbolic.phases),
        curves,
        &symbolic.phases,
    ));
    let curves = vec![
        curve("firmware", Colour::Symbolic, percent(symbolic, false)),
        curve("baseline", Colour::Baseline, percent(baseline, false)),
    ];
    section.figures.push(participation_figure(
        format!("{name}-participation"),
        format!("{name}: participation"),
        format!(
            "Share of the fleet that responds. The firmware asks for at most {:.1} %, the baseline for {:.1} %.",
            100.0 * symbolic.summary.max_participation,
            100.0 * baseline.summary.max_participation
        ),
        curves,
        &symbolic.phases,
    ));
    section
}

fn story(name: &str, summary: &Summary, phases: &[PhaseSpan]) -> String {
    let back = |time: Option<f64>, band: &str| match time {
        Some(s) => format!("is back in {band} after {} s", digits::four(s)),
        None => format!("does not come back into {band}"),
    };
    let stays = if summary.stayed_in_inner {
        "and stays there"
    } else {
        "and does not stay there"
    };
    format!(
        "Under {name} the frequency falls to {:.3} Hz at {} s, {}, {} {stays}. {} changes of phase in the run.",
        summary.nadir_hz,
        digits::four(summary.nadir_time_s),
        back(summary.entered_outer_s, "I1"),
        back(summary.entered_inner_s, "I2"),
        phases.len().saturating_sub(1)
    )
}

/// The same under the paper's error of participation: one run to look at, and many.
pub fn robustness(studies: &[Study]) -> Section {
    let percent_error = 100.0 * PAPER_ERROR;
    let mut section = Section::new(format!("Under {percent_error:.0} % of participation error")).say(
        "The fleet delivers what is asked for with a relative error that is drawn anew each tick, uniformly. The runs besides \
         draw loss, delay, start and the time from the event to the first tick from the spec's uncertainty.",
    );
    let header = [
        "Spec",
        "Runs",
        "Satisfy ψ",
        "95 % interval [%]",
        "Stay in I2 [%]",
        "Worst nadir [Hz]",
        "Back in I1 by [s]",
        "Back in I2 by [s]",
        "Worst seed",
    ];
    let caption = format!("simulate SPEC --runs N --participation-error {PAPER_ERROR}");
    let mut table = DataTable::new(caption, &header);
    for study in studies {
        let many = &study.robustness;
        let greatest = |q: &crate::simulation::monte_carlo::statistics::Quantiles| {
            let late =
                q.at.map_or_else(|| "–".to_owned(), |at| digits::four(at.max));
            match q.without {
                0 => late,
                never => format!("{late}, never in {never}"),
            }
        };
        table.row([
            study.spec.name.clone(),
            many.runs.to_string(),
            many.psi.count.to_string(),
            format!(
                "{} to {}",
                digits::four(100.0 * many.psi.low),
                digits::four(100.0 * many.psi.high)
            ),
            digits::four(100.0 * many.stayed_in_inner.share),
            digits::hz(many.worst.summary.nadir_hz),
            greatest(&many.entered_outer_s),
            greatest(&many.entered_inner_s),
            many.worst.seed.to_string(),
        ]);
        section.words.push(verdict_on(study));
    }
    section.tables.push(table);
    for study in studies {
        section.figures.extend(uncertain_figures(study));
    }
    section
}

fn verdict_on(study: &Study) -> String {
    let (name, many) = (&study.spec.name, &study.robustness);
    let missed = many.runs - many.psi.count;
    if missed == 0 {
        return format!("{name} satisfies ψ in all {} runs.", many.runs);
    }
    let why = match (many.breached.count, many.entered_inner_s.without) {
        (0, 0) => {
            "f comes back into I2 too late, or leaves it again where the spec says it must stay"
                .to_owned()
        }
        (0, never) => format!("f never comes back into I2 in {never}"),
        (breached, never) => {
            format!(
                "f falls below the containment in {breached} and never comes back into I2 in {never}"
            )
        }
    };
    format!("{name} misses ψ in {missed} of {} runs: {why}.", many.runs)
}

fn uncertain_figures(study: &Study) -> [Figure; 2] {
    let name = study.spec.name.as_str();
    let (run, baseline) = (&study.uncertain, &study.baseline);
    let curves = vec![
        curve("firmware", Colour::Symbolic, frequency(run)),
        curve("baseline, no error", Colour::Baseline, frequency(baseline)),
    ];
    let frequency = frequency_figure(
        &study.spec,
        format!("{name}-uncertain-frequency"),
        format!("{name}: frequency under participation error, seed 0"),
        story(name, &run.summary, &run.phases),
        curves,
        &run.phases,
    );
    let curves = vec![
        curve("delivered", Colour::Without, percent(run, true)),
        curve("commanded", Colour::Symbolic, percent(run, false)),
    ];
    let participation = participation_figure(
        format!("{name}-uncertain-participation"),
        format!("{name}: participation under participation error, seed 0"),
        "Share of the fleet that is asked for, and what it delivers.".to_owned(),
        curves,
        &run.phases,
    );
    [frequency, participation]
}

/// The paper's Table II.
pub fn table_two(spec: &Spec) -> Section {
    let mut section = Section::new("Where the baseline settles, by dead band (Table II)");
    let caption = "simulate --controller baseline --deadband-hz X: frequency after 300 s [Hz]";
    let mut table = DataTable::new(
        caption,
        &["Dead band [Hz]", "Unidirectional", "Bidirectional"],
    );
    for row in steady_states(spec) {
        table.row([
            format!("{:.2}", row.deadband_hz),
            digits::hz(row.unidirectional_hz),
            digits::hz(row.bidirectional_hz),
        ]);
    }
    section.tables.push(table);
    section
}
