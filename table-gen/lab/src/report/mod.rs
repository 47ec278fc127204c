//! The report: one HTML page with the figures of the paper and more, and the figures as files.
//!
//! | module | holds |
//! |---|---|
//! | [`study`] | the runs of a spec, the same as `simulate`'s |
//! | [`answer`] | what a reader wants to know first |
//! | [`findings`] | results of other commands |
//! | [`digits`] | numbers as people read them |
//! | [`section`], [`figure`] | the page as data |
//! | [`responses`] | the event, the laws against the baseline, their robustness, Table II |
//! | [`record`] | the recorded event: replay and counterfactual |
//! | [`scorecard`] | the table beside no response, the droop and the limit, over the loss |
//! | [`fleet`] | every charger with its own firmware |
//! | [`limits`] | plants beyond the paper's, and what is outside the proof |
//! | [`proof`] | verdict, budget, spec and hashes |
//! | [`failure`] | the path that breaks a claim |
//! | `curves`, [`palette`], [`chart`] | the drawing |
//! | [`page`] | the page |

pub mod answer;
pub mod chart;
mod curves;
pub mod digits;
pub mod failure;
pub mod figure;
pub mod findings;
pub mod fleet;
pub mod limits;
pub mod page;
pub mod palette;
pub mod proof;
pub mod record;
pub mod rendered;
pub mod responses;
pub mod scorecard;
pub mod section;
pub mod study;

pub use findings::{Findings, FleetFinding};
use model::spec::Spec;
pub use rendered::{FigureFile, Rendered, ReportError};
use section::Section;
use study::Study;

/// Runs of the robustness section unless asked otherwise.
pub const ROBUSTNESS_RUNS: usize = 1000;
/// Chargers of the fleet's section unless asked otherwise.
pub const FLEET_CHARGERS: usize = 200;

/// The report of a spec and its table, with other specs beside it (such as the other direction of
/// charging).
///
/// `more` are sections that the caller has made, such as a recorded event.
///
/// # Errors
/// A table that cannot be run, or a figure that cannot be drawn.
pub fn render(
    spec: &Spec,
    table: &[u8],
    companions: &[(Spec, Vec<u8>)],
    findings: &Findings,
    more: Vec<Section>,
) -> Result<Rendered, ReportError> {
    let mut studies = vec![Study::new(spec, table, ROBUSTNESS_RUNS)?];
    for (spec, table) in companions {
        studies.push(Study::new(spec, table, ROBUSTNESS_RUNS)?);
    }
    render_studies(&studies, findings, more)
}

/// The report of studies, at least one; the first is the report's own spec.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn render_studies(
    studies: &[Study],
    findings: &Findings,
    more: Vec<Section>,
) -> Result<Rendered, ReportError> {
    let names: Vec<&str> = studies.iter().map(|s| s.spec.name.as_str()).collect();
    let title = format!("Holdfast report: {}", names.join(", "));
    let about = "Frequency response of EV chargers, from the firmware's own control loop on the bytes of its table. \
        Every number can be had again by the command that its caption names.";
    let mut sections = Vec::new();
    if let Some(first) = studies.first() {
        let (spec, name) = (&first.spec, first.spec.name.as_str());
        sections.push(answer::section(spec, findings));
        sections.extend(
            (findings.scorecard.iter())
                .map(|(config, found)| scorecard::scorecard(name, config, found)),
        );
        sections.extend(findings.fleet.iter().map(|found| fleet::fleet(name, found)));
        sections.push(responses::event(spec));
    }
    sections.extend(studies.iter().map(responses::laws));
    sections.push(responses::robustness(studies));
    if let Some(first) = studies.first() {
        sections.push(responses::table_two(&first.spec));
    }
    for study in studies {
        sections.push(limits::beyond(study)?);
    }
    sections.extend(more);
    sections.push(proof::verdict(findings.verdict.as_ref()));
    if let Some(first) = studies.first() {
        sections.extend(failure::section(findings.verdict.as_ref(), &first.spec));
    }
    sections.push(proof::budget(findings.budget.as_ref()));
    sections.extend(studies.iter().map(proof::origin));
    page::render(&title, about, &sections)
}
