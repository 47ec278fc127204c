//! Verdict, budget, spec and hashes.

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::section::{DataTable, Section};
use super::study::Study;

/// What `verify` found.
pub fn verdict(verdict: Option<&Value>) -> Section {
    let section = Section::new("Verdict of the proof");
    let Some(verdict) = verdict else {
        return section.say(
            "This table has not been verified in this folder: nothing here is proved. Run verify, or build, which does.",
        );
    };
    let answer = match verdict.get("verified").and_then(Value::as_bool) {
        Some(true) => {
            "The bytes of the table are verified: every claim below holds for every uncertainty of the spec."
        }
        Some(false) => "The table is NOT verified: at least one claim below fails.",
        None => "The verdict does not say whether the table is verified.",
    };
    let mut section = section.say(answer);
    if let Some(claims) = verdict.get("claims").and_then(Value::as_array) {
        let mut table = DataTable::new("Claims (verify)", &["Claim", "Answer", "Bound"]);
        for claim in claims {
            let answer = match claim.get("holds").and_then(Value::as_bool) {
                Some(true) => "holds",
                Some(false) => "fails",
                None => "open",
            };
            let field = |name: &str| claim.get(name).map_or_else(String::new, text);
            table.row([field("name"), answer.to_owned(), field("bound")]);
        }
        section.tables.push(table);
    }
    section
        .listings
        .push(("The verdict in full".to_owned(), pretty(verdict)));
    section
}

/// What `budget` found.
pub fn budget(budget: Option<&Value>) -> Section {
    let section = Section::new("Budget");
    let Some(budget) = budget else {
        return section.say("No budget in this folder. Run budget, or build, which does.");
    };
    let mut section = section;
    let Some(fields) = budget.as_object() else {
        section
            .listings
            .push(("The budget in full".to_owned(), pretty(budget)));
        return section;
    };
    let mut plain = DataTable::new("Budget", &["Part", "Value"]);
    for (key, value) in fields {
        match value {
            Value::Array(rows) if rows.iter().any(Value::is_object) => {
                section.tables.push(records(key, rows));
            }
            Value::Object(inner) => {
                for (name, value) in inner {
                    plain.row([format!("{key}: {name}"), text(value)]);
                }
            }
            _ => plain.row([key.clone(), text(value)]),
        }
    }
    section.tables.insert(0, plain);
    section
}

/// Objects with the same keys as a table.
fn records(caption: &str, rows: &[Value]) -> DataTable {
    let keys: Vec<&str> = rows
        .iter()
        .find_map(Value::as_object)
        .map(|first| first.keys().map(String::as_str).collect())
        .unwrap_or_default();
    let mut table = DataTable::new(caption, &keys);
    for row in rows {
        table.row(
            keys.iter()
                .map(|key| row.get(*key).map_or_else(String::new, text)),
        );
    }
    table
}

/// Where a study comes from: its spec, and hashes of spec and table.
pub fn origin(study: &Study) -> Section {
    let mut section = Section::new(format!("Origin: {}", study.spec.name));
    let mut table = DataTable::new("What this report was made from", &["What", "Value"]);
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02x}")).collect::<String>();
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

/// A JSON value in a cell.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        other => other.to_string(),
    }
}

fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).unwrap_or_else(|error| error.to_string())
}
