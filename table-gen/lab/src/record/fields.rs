//! A line to its fields.

use std::borrow::Cow;

/// What stands between two fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Tab,
}

impl Separator {
    const fn character(self) -> char {
        match self {
            Self::Comma => ',',
            Self::Semicolon => ';',
            Self::Tab => '\t',
        }
    }

    /// The separator of a file, by its first line. Semicolon and tab come before the comma, which
    /// may be a decimal one.
    pub(super) fn of(header: &str) -> Self {
        [Self::Semicolon, Self::Tab]
            .into_iter()
            .find(|separator| header.contains(separator.character()))
            .unwrap_or(Self::Comma)
    }
}

/// The separator that a line `sep=;` declares, which Excel writes before the header.
pub(super) fn declared_separator(line: &str) -> Option<Separator> {
    match line.strip_prefix("sep=")?.trim_end_matches(['\r', '\n']) {
        "," => Some(Separator::Comma),
        ";" => Some(Separator::Semicolon),
        "\t" => Some(Separator::Tab),
        _ => None,
    }
}

/// The fields of a line, without blanks around them and without quotes.
///
/// # Errors
/// A quote that is not closed, or text after a closed one.
pub(super) fn split(line: &str, separator: Separator) -> Result<Vec<Cow<'_, str>>, String> {
    let separator = separator.character();
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let trimmed = rest.trim_start_matches(' ');
        let (field, after) = match trimmed.strip_prefix('"') {
            Some(quoted) => unquote(quoted)?,
            None => {
                let end = trimmed.find(separator).unwrap_or(trimmed.len());
                (Cow::Borrowed(trimmed[..end].trim()), &trimmed[end..])
            }
        };
        fields.push(field);
        let after = after.trim_start_matches(' ').trim_end_matches('\r');
        match after.strip_prefix(separator) {
            Some(next) => rest = next,
            None if after.is_empty() => return Ok(fields),
            None => return Err(format!("{after:?} after a closing quote")),
        }
    }
}

/// The content of a quoted field, and what follows its closing quote. Two quotes stand for one.
fn unquote(text: &str) -> Result<(Cow<'_, str>, &str), String> {
    let mut content = String::new();
    let mut rest = text;
    while let Some(end) = rest.find('"') {
        let (before, after) = (&rest[..end], &rest[end + 1..]);
        content.push_str(before);
        match after.strip_prefix('"') {
            Some(more) => {
                content.push('"');
                rest = more;
            }
            None => return Ok((Cow::Owned(content.trim().to_owned()), after)),
        }
    }
    Err("a quote that is not closed".to_owned())
}

/// A decimal number. One comma and no point: the comma is the decimal one.
///
/// # Errors
/// Anything else, not-a-number and infinity too.
pub(super) fn number(field: &str) -> Result<f64, String> {
    let refused = || {
        let allowed = "allowed: 49.98 or 49,98";
        if field.is_empty() {
            format!("no value; {allowed}")
        } else {
            format!("{field:?} is not a number; {allowed}")
        }
    };
    // Neither `nan` nor `inf` is spelt with these.
    let of_a_number =
        |c: char| c.is_ascii_digit() || matches!(c, '.' | ',' | '+' | '-' | '\u{2212}' | 'e' | 'E');
    if !field.chars().all(of_a_number) {
        return Err(refused());
    }
    let text = field.replace('\u{2212}', "-").replacen(',', ".", 1);
    text.parse().map_err(|_| refused())
}
