//! `--set KEY=VALUE`: single keys replaced on top of a file.

use toml::{Table, Value};

use super::SpecError;
use super::allowed::Allowed;
use super::keys;
use super::resolve;

/// The word that removes an optional key.
const REMOVE: &str = "none";

/// One `KEY=VALUE`, read but not yet applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Override {
    /// Dotted path of a key or section that exists.
    path: String,
    /// The new value; absent to remove the key.
    value: Option<Value>,
    /// The option as given, for messages.
    text: String,
}

impl Override {
    /// Path and text, as [`super::origin::Origin`] takes them.
    pub(super) fn named(&self) -> (&str, &str) {
        (&self.path, &self.text)
    }

    /// Reads `KEY=VALUE`.
    ///
    /// VALUE is a TOML value; a bare word is a string, so that choices need no quotes; `none`
    /// removes an optional key. KEY may be a section with an inline table as VALUE, which replaces
    /// the whole section.
    ///
    /// # Errors
    /// Not of that form, a key that does not exist, or `none` for a key that cannot be absent.
    pub(super) fn parse(text: &str) -> Result<Self, SpecError> {
        let malformed = || SpecError::MalformedOverride {
            text: text.to_owned(),
        };
        let (path, raw) = text.split_once('=').ok_or_else(malformed)?;
        let (path, raw) = (path.trim(), raw.trim());
        if path.is_empty() || raw.is_empty() {
            return Err(malformed());
        }
        let key = keys::find(path);
        if key.is_none() && !keys::is_section(path) {
            return Err(resolve::unknown_key(format!("--set {text}"), path));
        }
        let value = match key {
            Some(key) if raw == REMOVE && key.allowed.is_optional() => None,
            _ if raw == REMOVE => return Err(not_optional(text, path)),
            // A name such as 2024 and a formula such as true need no quotes either.
            Some(key) if key.allowed == Allowed::Name || key.allowed.is_optional_text() => {
                Some(parse_name(raw))
            }
            _ => Some(parse_value(raw)),
        };
        Ok(Self {
            path: path.to_owned(),
            value,
            text: text.to_owned(),
        })
    }

    /// Applies the override to a document whose keys and types have been checked.
    pub(super) fn apply(&self, document: &mut Table) {
        let (section, name) = self.path.rsplit_once('.').unwrap_or(("", &self.path));
        let mut table = document;
        for part in section.split('.').filter(|part| !part.is_empty()) {
            let inner = table
                .entry(part)
                .or_insert_with(|| Value::Table(Table::new()));
            // A checked document has a table here.
            let Value::Table(inner) = inner else { return };
            table = inner;
        }
        match &self.value {
            Some(value) => {
                table.insert(name.to_owned(), value.clone());
            }
            None => {
                table.remove(name);
            }
        }
    }
}

fn parse_value(raw: &str) -> Value {
    raw.parse()
        .unwrap_or_else(|_| Value::String(raw.to_owned()))
}

fn parse_name(raw: &str) -> Value {
    match parse_value(raw) {
        Value::String(name) => Value::String(name),
        _ => Value::String(raw.to_owned()),
    }
}

fn not_optional(text: &str, path: &str) -> SpecError {
    let allowed = match keys::find(path) {
        Some(key) => key.allowed_text(),
        None => format!(
            "an inline table with the keys {}",
            keys::names_in(path).join(", ")
        ),
    };
    let optional: Vec<&str> = keys::KEYS
        .iter()
        .filter(|key| key.allowed.is_optional())
        .map(|key| key.path)
        .collect();
    SpecError::NotOptional {
        origin: format!("--set {text}"),
        key: path.to_owned(),
        allowed,
        optional: optional.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::super::origin::Origin;
    use super::*;

    fn value_of(text: &str) -> Option<Value> {
        Override::parse(text).unwrap().value
    }

    #[test]
    fn values_are_toml_or_bare_words() {
        assert_eq!(
            value_of("plant.damping_gw_per_hz=3"),
            Some(Value::Integer(3))
        );
        assert_eq!(
            value_of(" plant.damping_gw_per_hz = 2.5 "),
            Some(Value::Float(2.5))
        );
        assert_eq!(
            value_of("requirements.stay=true"),
            Some(Value::Boolean(true))
        );
        assert_eq!(
            value_of("grid.alignment=edges"),
            Some(Value::String("edges".into()))
        );
        assert_eq!(
            value_of("grid.alignment=\"edges\""),
            Some(Value::String("edges".into()))
        );
        assert_eq!(value_of("name=2024"), Some(Value::String("2024".into())));
        assert_eq!(value_of("requirements.horizon_s=none"), None);
        assert!(matches!(
            value_of("grid.width=[0.1, 0.1, 0.1, 0.1]"),
            Some(Value::Array(_))
        ));
    }

    #[test]
    fn a_second_line_cannot_be_smuggled_in() {
        let text = "plant.damping_gw_per_hz=1\nlead_time_s=2";
        assert_eq!(
            value_of(text),
            Some(Value::String("1\nlead_time_s=2".into()))
        );
    }

    #[test]
    fn forms_other_than_key_and_value_are_refused() {
        for text in [
            "",
            "=",
            "=3",
            "plant.damping_gw_per_hz",
            "plant.damping_gw_per_hz=",
            "grid.width= ",
        ] {
            assert!(
                matches!(
                    Override::parse(text),
                    Err(SpecError::MalformedOverride { .. })
                ),
                "{text:?}"
            );
        }
    }

    #[test]
    fn the_origin_is_the_last_override_that_covers_the_key() {
        let parse = |text| Override::parse(text).unwrap();
        let origin = Origin::file("a.toml").with_overrides([
            parse("grid.width=[1, 1, 1, 1]").named(),
            parse("uncertainty.initial={ lower = [0, 0, 0, 0] }").named(),
        ]);
        assert_eq!(origin.of("grid.lower"), "a.toml");
        assert_eq!(
            origin.of("grid.width"),
            "a.toml with --set grid.width=[1, 1, 1, 1]"
        );
        assert!(
            origin
                .of("uncertainty.initial.lower")
                .contains("--set uncertainty.initial=")
        );
    }
}
