//! The spec's hash: which spec a table was made for.
//!
//! # Design
//! SHA-256 over a canonical text, cut to 16 bytes. The text begins with the line `holdfast-spec-1`;
//! then every key of the table in `keys`, in that order, defaults included, gives one line
//! `path=value` ending in `\n`, with the value
//!
//! | kind | written as |
//! |---|---|
//! | number | 16 lower-case hexadecimal digits: its binary64 bits, highest first; -0 as 0 |
//! | numbers | the same, joined by `,` |
//! | whole number | decimal |
//! | flag | `true` or `false` |
//! | name, choice | the characters themselves (a name cannot contain a line break) |
//! | formula | as it is printed, whatever its spaces and words; without one no such line |
//! | absent | `none`; for keys that came after the first tables no such line |
//!
//! Nothing in it depends on the platform, on the order of keys in the file or on how a number was
//! written there. A new key changes every hash: a table must then be built and verified again,
//! which is intended. The keys of `[charger]` are the laboratory's alone, and those of `[chance]`
//! change neither a table nor a proof: they stand in no hash.

use std::fmt::Write as _;

use sha2::{Digest, Sha256};

use super::Spec;
use super::key_value::KeyValue;
use super::keys::{CHANGES, FORMULA, KEYS, RECOVERY};

/// Sections that no table depends on: the laboratory's cars, and what is drawn.
const NOT_OF_THE_TABLE: [&str; 2] = ["charger", "chance"];
/// Section of which a key that is absent gives no line: it came after the first tables.
const GOVERNOR: &str = "plant.governor";
/// Other keys that give no line where they are absent.
const LATER: [&str; 11] = [
    FORMULA,
    RECOVERY,
    CHANGES,
    "uncertainty.participation_confidence",
    "uncertainty.hostile_share",
    "uncertainty.level_discrepancy",
    INERTIA_LOST,
    "uncertainty.governor_time_s",
    "uncertainty.turbine_time_s",
    "uncertainty.lead_time_s",
    "uncertainty.lag_time_s",
];
/// See [`LATER`].
const INERTIA_LOST: &str = "uncertainty.inertia_lost_s_per_hz";
const HEADING: &str = "holdfast-spec-1\n";

impl Spec {
    /// The first 16 bytes of SHA-256 over the canonical text of the resolved spec (all keys with
    /// their defaults): the same on every platform, and different for specs that differ in any key.
    #[must_use]
    pub fn hash(&self) -> [u8; 16] {
        let digest = Sha256::digest(self.canonical_text().as_bytes());
        std::array::from_fn(|i| digest[i])
    }

    fn canonical_text(&self) -> String {
        let mut text = HEADING.to_owned();
        for key in KEYS {
            let value = (key.get)(self);
            let came_later = LATER.contains(&key.path) || key.section() == GOVERNOR;
            let absent = value == KeyValue::Absent;
            if NOT_OF_THE_TABLE.contains(&key.section()) || (absent && came_later) {
                continue;
            }
            text.push_str(key.path);
            text.push('=');
            push_value(&mut text, value);
            text.push('\n');
        }
        text
    }
}

fn push_value(text: &mut String, value: KeyValue<'_>) {
    match value {
        KeyValue::Number(x) => push_number(text, x),
        KeyValue::Numbers(xs) => {
            for (i, x) in xs.iter().enumerate() {
                if i > 0 {
                    text.push(',');
                }
                push_number(text, *x);
            }
        }
        KeyValue::Integer(n) => text.push_str(&n.to_string()),
        KeyValue::Flag(flag) => text.push_str(if flag { "true" } else { "false" }),
        KeyValue::Text(word) => text.push_str(word),
        KeyValue::Absent => text.push_str("none"),
    }
}

fn push_number(text: &mut String, x: f64) {
    // -0 + 0 is +0: two ways to write the same number must not give two hashes.
    let bits = (x + 0.0).to_bits();
    // Writing to a String cannot fail.
    let _ = write!(text, "{bits:016x}");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed outside this program, with Python's tomllib, struct and hashlib from the
    /// description above.
    const PAPER_BI: &str = "c18c51cde84a6837d0f04e7d3e61b73f";

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn the_hash_of_paper_bi_is_golden() {
        let spec = Spec::load("paper-bi", &[]).unwrap();
        assert_eq!(hex(&spec.hash()), PAPER_BI);
    }

    #[test]
    fn the_canonical_text_is_as_documented() {
        let text = Spec::default().canonical_text();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("holdfast-spec-1"));
        assert_eq!(lines.next(), Some("name=unnamed"));
        assert_eq!(
            lines.next(),
            Some("plant.governor_gain_gw_per_hz=c014000000000000")
        );
        assert!(text.contains("\nfleet.chargers=25000\n"));
        assert!(text.contains("\nuncertainty.loss_gw=4000000000000000,4000000000000000\n"));
        assert!(text.contains("\nrequirements.containment_hz=none\n"));
        assert!(text.ends_with("\nmethod.between_samples=false\n"));
        // The heading, and every key but the later ones, which are absent, and those that no table
        // depends on.
        let left_out = |key: &&super::super::keys::Key| {
            let section = key.section();
            NOT_OF_THE_TABLE.contains(&section) || section == GOVERNOR || LATER.contains(&key.path)
        };
        let left_out = KEYS.iter().filter(left_out);
        assert_eq!(text.lines().count(), 1 + KEYS.len() - left_out.count());
    }

    #[test]
    fn a_key_that_came_later_is_in_the_hash_only_where_it_is_stated() {
        let text = |set: &[String]| Spec::load("paper-bi", set).unwrap().canonical_text();
        assert!(LATER.iter().all(|key| !text(&[]).contains(key)));
        let stated = text(&[format!("{CHANGES}=30")]);
        assert!(stated.contains("\nrequirements.changes_per_300_s=403e000000000000\n"));
    }

    #[test]
    fn a_key_that_came_later_counts_where_it_is_there() {
        let hash = |set: &[&str]| {
            let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
            Spec::load("gb-bi", &set).unwrap().hash()
        };
        let some = hash(&["uncertainty.hostile_share=0.02"]);
        assert_ne!(some, hash(&[]));
        assert_ne!(some, hash(&["uncertainty.hostile_share=0"]));
        assert_eq!(hash(&["uncertainty.hostile_share=none"]), hash(&[]));
    }

    #[test]
    fn the_sign_of_zero_and_the_way_a_number_is_written_do_not_matter() {
        let hash = |text: &str| Spec::from_toml(text, "test", &[]).unwrap().hash();
        assert_eq!(hash("uncertainty.participation = -0.0"), hash(""));
        assert_eq!(
            hash("sampling.period_s = 15e-1"),
            hash("[sampling]\nwatch_s = 0.10\nperiod_s = 1.50")
        );
    }
}
