//! Names and types: the parsed TOML table against the table of keys.

use strsim::levenshtein;
use toml::{Table, Value};

use super::SpecError;
use super::allowed::Allowed;
use super::keys::{self, Key};
use super::origin::Origin;

/// Checks that every key of the document exists and holds a value of its type.
///
/// # Errors
/// The first unknown key or wrong type. Whole numbers and choices are checked entirely, as they
/// have no other form in a [`super::Spec`]; ranges of numbers are left to `validate`.
pub(super) fn check(document: &Table, origin: &Origin) -> Result<(), SpecError> {
    // Sections nest two deep; a list of what is still to be seen bounds the loop by the size of the
    // document.
    let mut pending: Vec<(String, &Table)> = vec![(String::new(), document)];
    while let Some((section, table)) = pending.pop() {
        for (name, value) in table {
            let path = if section.is_empty() {
                name.clone()
            } else {
                format!("{section}.{name}")
            };
            if let Some(key) = keys::find(&path) {
                check_value(key, value, origin)?;
            } else if keys::is_section(&path) {
                let Value::Table(inner) = value else {
                    let allowed = format!(
                        "a section with the keys {}",
                        keys::names_in(&path).join(", ")
                    );
                    return Err(wrong_type(origin, &path, value, allowed));
                };
                pending.push((path, inner));
            } else {
                return Err(unknown_key(origin.of(&path), &path));
            }
        }
    }
    Ok(())
}

fn check_value(key: &'static Key, value: &Value, origin: &Origin) -> Result<(), SpecError> {
    let is_number = |value: &Value| matches!(value, Value::Float(_) | Value::Integer(_));
    let right_type = match (key.allowed, value) {
        (Allowed::Number(_) | Allowed::OptionalNumber(_), value) => is_number(value),
        (
            Allowed::Numbers { len, .. } | Allowed::OptionalNumbers { len, .. },
            Value::Array(items),
        ) => items.len() == len && items.iter().all(is_number),
        (Allowed::NumberOrInterval(_), Value::Array(items)) => {
            items.len() == 2 && items.iter().all(is_number)
        }
        (Allowed::NumberOrInterval(_), value) => is_number(value),
        (Allowed::Integer { .. }, Value::Integer(_)) => true,
        (Allowed::Flag, Value::Boolean(_)) => true,
        (Allowed::Choice(_) | Allowed::Name, Value::String(_)) => true,
        (allowed, Value::String(_)) => allowed.is_optional_text(),
        _ => false,
    };
    if !right_type {
        return Err(wrong_type(origin, key.path, value, key.allowed_text()));
    }
    let in_range = match (key.allowed, value) {
        (Allowed::Integer { min, max }, Value::Integer(n)) => {
            (i64::from(min)..=i64::from(max)).contains(n)
        }
        (Allowed::Choice(names), Value::String(text)) => names.contains(&text.as_str()),
        _ => true,
    };
    if in_range {
        return Ok(());
    }
    Err(SpecError::OutOfRange {
        origin: origin.of(key.path),
        key: key.path,
        found: value.to_string(),
        allowed: key.allowed_text(),
    })
}

fn wrong_type(origin: &Origin, path: &str, value: &Value, allowed: String) -> SpecError {
    let found_type = match value {
        Value::String(_) => "a string",
        Value::Integer(_) => "a whole number",
        Value::Float(_) => "a number with a decimal point",
        Value::Boolean(_) => "a flag",
        Value::Datetime(_) => "a date or time",
        Value::Array(items)
            if items
                .iter()
                .all(|item| item.is_float() || item.is_integer()) =>
        {
            match items.len() {
                0 => "an empty array",
                1 => "an array of 1 number",
                2 => "an array of 2 numbers",
                3 => "an array of 3 numbers",
                4 => "an array of 4 numbers",
                _ => "an array of more than 4 numbers",
            }
        }
        Value::Array(_) => "an array in which not every element is a number",
        Value::Table(_) => "a section",
    };
    SpecError::WrongType {
        origin: origin.of(path),
        key: path.to_owned(),
        found: value.to_string(),
        found_type,
        allowed,
    }
}

/// The error for a key that does not exist, with the nearest one that does.
pub(super) fn unknown_key(origin: String, path: &str) -> SpecError {
    // What is allowed is listed for the innermost section that exists: for `grid.lower.x` that is
    // `grid`.
    let mut section = keys::section_of(path);
    while !section.is_empty() && !keys::is_section(section) {
        section = keys::section_of(section);
    }
    SpecError::UnknownKey {
        origin,
        key: path.to_owned(),
        suggestion: nearest(path),
        allowed: keys::names_in(section).join(", "),
    }
}

/// The existing key or section most like `path`, if any is like it: few edits on the whole path,
/// the name without its unit, or the right name in the wrong section.
fn nearest(path: &str) -> Option<&'static str> {
    let name = last(path);
    let sections = keys::KEYS
        .iter()
        .map(Key::section)
        .filter(|section| !section.is_empty());
    keys::KEYS
        .iter()
        .map(|key| key.path)
        .chain(sections)
        .map(|candidate| (distance(path, candidate), candidate))
        .filter(|(distance, _)| *distance <= 1 + name.chars().count() / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// How unlike two paths are, in edits; another section or a missing unit counts as one.
fn distance(path: &str, candidate: &str) -> usize {
    let without_unit = candidate
        .strip_prefix(path)
        .is_some_and(|rest| rest.starts_with('_'));
    let moved = 1 + levenshtein(last(path), last(candidate));
    if without_unit {
        1
    } else {
        levenshtein(path, candidate).min(moved)
    }
}

fn last(path: &str) -> &str {
    path.rsplit_once('.').map_or(path, |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(levenshtein("", "abc"), 3);
        assert_eq!(levenshtein("kitten", "sitting"), 3);
        assert_eq!(levenshtein("same", "same"), 0);
    }

    #[test]
    fn the_nearest_key_is_suggested_and_a_distant_one_is_not() {
        assert_eq!(
            nearest("plant.inertia_gw_s_per_h"),
            Some("plant.inertia_gw_s_per_hz")
        );
        assert_eq!(nearest("plnat"), Some("plant"));
        assert_eq!(nearest("plant.chargers"), Some("fleet.chargers"));
        assert_eq!(nearest("uncertainty.loss"), Some("uncertainty.loss_gw"));
        assert_eq!(nearest("plant.zebra"), None);
    }
}
