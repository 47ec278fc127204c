//! What a reader wants to know first: is it proven, for what, and is it better than the droop.

use super::digits;
use super::findings::{Findings, FleetFinding};
use super::section::{DataTable, Section};
use crate::compare::verdict::{Measure, grace_hz};
use crate::compare::{CompareConfig, Controller, Scorecard};
use crate::simulation::NOMINAL_HZ;
use model::plant_bands::{Parameter, PlantBands};
use model::spec::{LossProfile, Spec};
use model::verdict::Verdict;

/// The first section, from what is known.
pub fn section(spec: &Spec, findings: &Findings) -> Section {
    let verdict = findings.verdict.as_ref();
    let mut section = Section::new(format!("The answer: {}", spec.name)).say(proven(verdict, spec));
    if let Some((config, found)) = &findings.scorecard {
        section.words.push(against_droop(spec, config, found));
    }
    section.words.extend(findings.fleet.as_ref().map(wear));
    section.tables.extend(verdict.map(bounds));
    section
}

/// Whether it is proven, and for what.
fn proven(verdict: Option<&Verdict>, spec: &Spec) -> String {
    let answer = match verdict.map(|verdict| verdict.verified) {
        Some(true) => "Proven, from the bytes of the table",
        Some(false) => "NOT proven: a claim below fails. What was asked for",
        None => "Not checked in this folder. What is asked for",
    };
    format!("{answer}: {} {}", asked(spec), hypotheses(spec))
}

/// What the spec asks for.
fn asked(spec: &Spec) -> String {
    let requirements = &spec.requirements;
    let [low, high] = requirements.inner_hz.map(|f| digits::four(NOMINAL_HZ + f));
    let contained = requirements
        .containment_hz
        .map_or_else(String::new, |f_hz| {
            format!("f never below {} Hz; ", digits::four(NOMINAL_HZ + f_hz))
        });
    let (stay, time) = (
        if requirements.stay { ", for good" } else { "" },
        requirements.horizon_s.map_or_else(
            || "claimed for ever".to_owned(),
            |s| format!("claimed over {} s", digits::four(s)),
        ),
    );
    format!(
        "{contained}back in {low} to {high} Hz within {} s{stay}; {time}.",
        digits::four(requirements.settle_within_s)
    )
}

/// For what: the spec's uncertainties.
fn hypotheses(spec: &Spec) -> String {
    let uncertain = &spec.uncertainty;
    let [low, high] = uncertain.loss_gw.map(digits::four);
    let mut parts = vec![match uncertain.loss_profile {
        _ if low == high => format!("a loss of {low} GW"),
        LossProfile::Constant => format!("any loss from {low} to {high} GW, at once"),
        LossProfile::NonDecreasing => {
            format!("any losses that add up to {low} to {high} GW, one after the other")
        }
        LossProfile::Band => {
            format!("a loss anywhere in {low} to {high} GW that moves as it likes")
        }
    }];
    if uncertain.participation > 0.0 {
        let percent = digits::four(100.0 * uncertain.participation);
        parts.push(format!("delivery within {percent} %"));
    }
    if uncertain.measurement[0] > 0.0 {
        let mhz = digits::four(1000.0 * uncertain.measurement[0]);
        parts.push(format!("f measured within {mhz} mHz"));
    }
    let [least, most] = uncertain.actuation_delay_s.ends_s().map(digits::four);
    if most != "0" {
        parts.push(match least == most {
            true => format!("power {most} s after its decision"),
            false => format!("power {least} to {most} s after its decision, each charger its own"),
        });
    }
    if uncertain.own_clocks {
        parts.push("each charger with its own clock".to_owned());
    }
    let bands = PlantBands::of(spec);
    if !bands.holds(Parameter::Inertia) {
        let inertia = digits::four(spec.plant.inertia_gw_s_per_hz);
        parts.push(format!("H = {inertia} GW s/Hz"));
    }
    parts.extend(bands.words());
    format!(
        "For: {}; all else exactly as the spec says.",
        parts.join(", ")
    )
}

/// How lowest and final frequency stand against the droop's.
fn against_droop(spec: &Spec, config: &CompareConfig, found: &Scorecard) -> String {
    let grace_hz = grace_hz(&config.chargers);
    let [low, high] = spec.uncertainty.loss_gw.map(digits::four);
    let proven = if low == high {
        format!("{low} GW")
    } else {
        format!("{low} to {high} GW")
    };
    let standings = Measure::ALL.map(|measure| standing(measure, found, grace_hz));
    format!(
        "{} These are runs, at the losses and on the plants of the scorecard; what is proven is proven for {proven}.",
        standings.join(" ")
    )
}

/// At how many losses a measure is higher, and lower, with the table than with the droop.
fn standing(measure: Measure, found: &Scorecard, grace_hz: f64) -> String {
    let pairs = found.pairs(Controller::Droop, Controller::Table);
    let gains: Vec<(f64, f64)> = pairs
        .map(|(droop, table)| (table.loss_gw, measure.of(table) - measure.of(droop)))
        .collect();
    let side = |sign: f64, word: &str| {
        let of = || gains.iter().filter(|(_, gain)| sign * gain > grace_hz);
        let most = of().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        most.map(|(loss_gw, gain)| {
            format!(
                "{word} at {} of {}, most at {loss_gw:.1} GW by {} mHz",
                of().count(),
                gains.len(),
                digits::four((1000.0 * gain).abs().round())
            )
        })
    };
    let sides = [side(1.0, "higher"), side(-1.0, "LOWER")];
    let told: Vec<String> = sides.into_iter().flatten().collect();
    let told = if told.is_empty() {
        "the same at every loss".to_owned()
    } else {
        told.join("; ")
    };
    let name = match measure {
        Measure::Nadir => "Lowest frequency",
        Measure::Final => "Final frequency",
    };
    format!("{name} against the droop's: {told}.")
}

/// What it asks of a charger.
fn wear(found: &FleetFinding) -> String {
    let measures = &found.run.measures;
    format!(
        "In the {} s after a loss of {} GW a charger changes its set-point by 5 % or more {} times (at most {}), and its \
         contactor operates {} times (at most {}).",
        digits::four(found.duration_s),
        digits::four(found.loss_gw),
        digits::four(measures.changes_per_charger),
        measures.changes_per_charger_max,
        digits::four(measures.contactor_operations_per_charger),
        measures.contactor_operations_max
    )
}

/// The claims that have a bound.
fn bounds(verdict: &Verdict) -> DataTable {
    let caption = "Bounds that were proven, and what they must not pass (verify)";
    let mut table = DataTable::new(caption, &["Claim", "Answer", "Bound", "Limit"]);
    let none = || "–".to_owned();
    for claim in &verdict.claims {
        let Some(value) = claim.bound else { continue };
        let with_unit = |text: String| format!("{text} {}", claim.unit);
        table.row([
            format!("{}: {}", claim.name, claim.statement),
            if claim.holds { "holds" } else { "fails" }.to_owned(),
            with_unit(digits::bound(value, claim.limit)),
            claim
                .limit
                .map_or_else(none, |limit| with_unit(digits::four(limit))),
        ]);
    }
    table
}
