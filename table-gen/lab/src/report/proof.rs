//! Verdict, budget, spec and hashes.

use model::budget::Budget;
use model::hex::hex;
use model::verdict::Verdict;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::digits;
use super::section::{DataTable, Section};
use super::study::Study;

/// What `verify` found.
pub fn verdict(verdict: Option<&Verdict>) -> Section {
    let section = Section::new("Verdict of the proof");
    let Some(verdict) = verdict else {
        return section.say(
            "This table has not been verified in this folder: nothing here is proved. Run verify, or build, which does.",
        );
    };
    let mut section = section.say(if verdict.verified {
        "The bytes of the table are verified: every claim below holds for every uncertainty of the spec."
    } else {
        "The table is NOT verified: at least one claim below fails."
    });
    let mut table = DataTable::new("Claims (verify)", &["Claim", "Answer", "Bound"]);
    for claim in &verdict.claims {
        let bound = claim.bound.map_or_else(
            || "–".to_owned(),
            |bound| format!("{} {}", digits::bound(bound, claim.limit), claim.unit),
        );
        table.row([
            claim.name.to_string(),
            if claim.holds { "holds" } else { "fails" }.to_owned(),
            bound,
        ]);
    }
    section.tables.push(table);
    section
        .listings
        .push(("The verdict in full".to_owned(), pretty(verdict)));
    section
}

/// What `budget` found.
pub fn budget(budget: Option<&Budget>) -> Section {
    let mut section = Section::new("Budget");
    let Some(budget) = budget else {
        return section.say("No budget in this folder. Run budget, or build, which does.");
    };
    let mut plain = DataTable::new("Budget", &["Part", "Value"]);
    let measured = &budget.measured;
    for (part, value) in [
        ("table [bytes]", Some(budget.table_bytes as u64)),
        (
            "header and checksum [bytes]",
            Some(budget.header_bytes as u64),
        ),
        (
            "code for the charger, measured [bytes]",
            measured.core_bytes,
        ),
        (
            "worst lookup, measured [instructions]",
            measured.lookup_instructions,
        ),
    ] {
        plain.row([part.to_owned(), number(value)]);
    }
    section.tables.push(plain);
    let header = [
        "Law",
        "Domain [bytes]",
        "Inputs [bytes]",
        "Worst visits",
        "Mean visits",
    ];
    let mut laws = DataTable::new("Laws (budget)", &header);
    for law in &budget.laws {
        laws.row([
            law.law.to_string(),
            law.domain_bytes.to_string(),
            law.inputs_bytes.to_string(),
            law.worst_visits.to_string(),
            format!("{:.1}", law.mean_visits),
        ]);
    }
    section.tables.push(laws);
    let header = [
        "Microcontroller",
        "Core",
        "Flash [KiB]",
        "Left [bytes]",
        "Taken",
    ];
    let mut rooms = DataTable::new("Flash left (budget)", &header);
    for room in &budget.rooms {
        rooms.row([
            room.part.name.clone(),
            room.part.core.clone(),
            room.part.flash_kib.to_string(),
            room.left_bytes.to_string(),
            format!("{} %", digits::four(100.0 * room.share)),
        ]);
    }
    section.tables.push(rooms);
    section
}

/// Where a study comes from: its spec, and hashes of spec and table.
pub fn origin(study: &Study) -> Section {
    let mut section = Section::new(format!("Origin: {}", study.spec.name));
    let mut table = DataTable::new("What this report was made from", &["What", "Value"]);
    table.row(["spec hash".to_owned(), hex(&study.spec.hash())]);
    table.row(["table".to_owned(), format!("{} bytes", study.table.len())]);
    table.row([
        "SHA-256 of the table".to_owned(),
        hex(&Sha256::digest(&study.table)),
    ]);
    let version = env!("CARGO_PKG_VERSION");
    table.row(["generator".to_owned(), format!("table-gen {version}")]);
    section.tables.push(table);
    // A spec that was read from TOML can be written as TOML.
    let spec = toml::to_string_pretty(&study.spec).unwrap_or_else(|error| error.to_string());
    section
        .listings
        .push(("The spec, with every default".to_owned(), spec));
    section
}

/// A number in a cell, or a dash.
fn number<N: ToString>(value: Option<N>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| value.to_string())
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).unwrap_or_else(|error| error.to_string())
}
