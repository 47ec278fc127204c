//! `requirements.formula`: requirements written as one formula of temporal logic.
//!
//! A formula is compiled into the keys that say the same ([`super::compile`]), which is what
//! synthesis and the verifier read. A key that is given beside the formula must agree with it; what
//! the formula does not speak of keeps its key's value or default; a formula with one band alone
//! means it as both. The names `I1` and `I2` in it are `requirements.outer_hz` and
//! `requirements.inner_hz`. The spec keeps the formula as it is printed, whatever spaces and words
//! it was written with.

use toml::{Table, Value};

use super::compile::{Compiled, compile};
use super::keys::FORMULA as KEY;
use super::origin::Origin;
use super::{Spec, SpecError, keys};
use crate::logic;

const LOSS: &str = "uncertainty.loss_gw";

/// Puts what the formula of a checked document says in the place of the keys, if there is a
/// formula.
///
/// # Errors
/// No formula of the language or of the supported fragment, a key beside it that says something
/// else, or a bound of the loss on one side alone.
pub(super) fn expand(document: &mut Table, origin: &Origin) -> Result<(), SpecError> {
    let Some(Value::String(text)) = lookup(document, KEY) else {
        return Ok(());
    };
    let text = text.clone();
    // The bands that the names stand for, from the keys or the defaults.
    let mut keys_alone = document.clone();
    insert(&mut keys_alone, KEY, None);
    let keys_alone: Spec =
        keys_alone
            .try_into()
            .map_err(|error: toml::de::Error| SpecError::Malformed {
                origin: origin.of(KEY),
                message: error.message().to_owned(),
            })?;
    let (canonical, compiled) = compiled(&text, &keys_alone, origin)?;
    let has_loss = lookup(document, LOSS).is_some();
    for (path, value) in determined(&compiled, &keys_alone, has_loss, &text, origin)? {
        if let Some(given) = lookup(document, path) {
            if !same(given, &value) {
                return Err(conflict(path, given, &value, origin));
            }
        } else {
            insert(document, path, Some(value));
        }
    }
    // With one band there is one step: the other band is the same, unless it is given.
    let (outer, inner) = ("requirements.outer_hz", "requirements.inner_hz");
    for (from, to) in [(inner, outer), (outer, inner)] {
        let determined = compiled.outer_hz.is_some() || compiled.inner_hz.is_some();
        if determined
            && lookup(document, to).is_none()
            && let Some(band) = lookup(document, from).cloned()
        {
            insert(document, to, Some(band));
        }
    }
    insert(document, KEY, Some(Value::String(canonical)));
    Ok(())
}

/// Checks that a spec's keys say what its formula says: they may have been changed in code.
///
/// # Errors
/// As [`expand`].
pub(super) fn check(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let Some(text) = &spec.requirements.formula else {
        return Ok(());
    };
    let (_, compiled) = compiled(text, spec, origin)?;
    for (path, value) in determined(&compiled, spec, true, text, origin)? {
        let given = keys::find(path).map(|key| (key.get)(spec).to_string());
        let Some(given) = given.and_then(|given| given.parse::<Value>().ok()) else {
            continue;
        };
        if !same(&given, &value) {
            return Err(conflict(path, &given, &value, origin));
        }
    }
    Ok(())
}

fn compiled(text: &str, spec: &Spec, origin: &Origin) -> Result<(String, Compiled), SpecError> {
    let refused = |reason: String| SpecError::Formula {
        origin: origin.of(KEY),
        found: text.to_owned(),
        reason,
    };
    let formula = logic::parse(text).map_err(|error| refused(error.to_string()))?;
    let compiled = compile(&formula, spec).map_err(|error| refused(error.to_string()))?;
    Ok((formula.to_string(), compiled))
}

/// The keys that the formula determines, with their values.
fn determined(
    compiled: &Compiled,
    spec: &Spec,
    has_loss: bool,
    text: &str,
    origin: &Origin,
) -> Result<Vec<(&'static str, Value)>, SpecError> {
    let number = Value::Float;
    let interval = |[low, high]: [f64; 2]| Value::Array(vec![number(low), number(high)]);
    let mut found = Vec::new();
    if let Some(hz) = compiled.containment_hz {
        found.push(("requirements.containment_hz", number(hz)));
    }
    if let Some(outer) = compiled.outer_hz {
        found.push(("requirements.outer_hz", interval(outer)));
    }
    if let Some(inner) = compiled.inner_hz {
        found.push(("requirements.inner_hz", interval(inner)));
    }
    if let Some(s) = compiled.settle_within_s {
        found.push(("requirements.settle_within_s", number(s)));
    }
    if compiled.stay {
        found.push(("requirements.stay", Value::Boolean(true)));
    }
    let [low, high] = spec.uncertainty.loss_gw;
    match (compiled.loss_at_least_gw, compiled.loss_at_most_gw) {
        (None, None) => {}
        (Some(least), Some(most)) => found.push((LOSS, interval([least, most]))),
        (Some(least), None) if has_loss => found.push((LOSS, interval([least, high]))),
        (None, Some(most)) if has_loss => found.push((LOSS, interval([low, most]))),
        _ => {
            return Err(SpecError::Formula {
                origin: origin.of(KEY),
                found: text.to_owned(),
                reason: format!(
                    "it bounds the loss on one side; allowed: loss in [LOW, HIGH] -> ..., or {LOSS} for the other side"
                ),
            });
        }
    }
    Ok(found)
}

fn conflict(path: &str, given: &Value, value: &Value, origin: &Origin) -> SpecError {
    // Every path here is a key of the table.
    let key = keys::find(path).map_or(KEY, |key| key.path);
    SpecError::Inconsistent {
        origin: origin.of(path),
        key,
        found: format!("{given} beside a formula that says {value}"),
        allowed: format!("{value}, or no such key: {KEY} gives it"),
    }
}

/// Whether two TOML values are the same to the spec: 1 and 1.0 are.
fn same(a: &Value, b: &Value) -> bool {
    let number = |value: &Value| match value {
        Value::Float(x) => Some(*x),
        Value::Integer(n) => Some(*n as f64),
        _ => None,
    };
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| number(a) == number(b))
        }
        (Value::Boolean(a), Value::Boolean(b)) => a == b,
        (a, b) => number(a).is_some() && number(a) == number(b),
    }
}

fn lookup<'a>(document: &'a Table, path: &str) -> Option<&'a Value> {
    let (section, name) = path.split_once('.')?;
    document.get(section)?.as_table()?.get(name)
}

fn insert(document: &mut Table, path: &str, value: Option<Value>) {
    let Some((section, name)) = path.split_once('.') else {
        return;
    };
    let section = document
        .entry(section)
        .or_insert_with(|| Value::Table(Table::new()));
    // A checked document has a table here.
    if let Value::Table(table) = section {
        match value {
            Some(value) => drop(table.insert(name.to_owned(), value)),
            None => drop(table.remove(name)),
        }
    }
}
