//! Where the values of a spec come from: a file, and options on top of it.

use super::SpecError;

/// Where values come from, so that an error names the `--set` that caused it rather than the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Origin {
    file: String,
    overrides: Vec<(String, String)>,
}

impl Origin {
    /// Values that all come from one file.
    pub(super) fn file(name: &str) -> Self {
        Self {
            file: name.to_owned(),
            overrides: Vec::new(),
        }
    }

    /// The same file under overrides: the path and the text of each, in order.
    pub(super) fn with_overrides<'a>(
        &self,
        overrides: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Self {
        let owned = |(path, text): (&str, &str)| (path.to_owned(), text.to_owned());
        Self {
            file: self.file.clone(),
            overrides: overrides.into_iter().map(owned).collect(),
        }
    }

    /// What gave `path` its value: the last override of it or of a section around it, else the
    /// file.
    pub(super) fn of(&self, path: &str) -> String {
        let covers = |set: &str| {
            path.strip_prefix(set)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        match self.overrides.iter().rev().find(|(set, _)| covers(set)) {
            Some((_, text)) => format!("{} with --set {text}", self.file),
            None => self.file.clone(),
        }
    }
}

/// A value in its own range that does not go with the others.
pub(super) fn inconsistent(
    origin: &Origin,
    key: &'static str,
    found: impl Into<String>,
    allowed: impl Into<String>,
) -> SpecError {
    SpecError::Inconsistent {
        origin: origin.of(key),
        key,
        found: found.into(),
        allowed: allowed.into(),
    }
}
