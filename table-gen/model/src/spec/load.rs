//! From a name, a path or a text to a validated [`Spec`].

use std::fs::File;
use std::io::{self, Read};

use toml::Table;

use super::origin::Origin;
use super::overrides::Override;
use super::{Spec, SpecError, formula, resolve, shipped};

/// Longest file that is read: a hundred times the longest shipped spec.
const FILE_LEN_MAX: u64 = 1 << 20;

impl Spec {
    /// Loads a spec: the shipped one named `arg`, or the file at the path `arg` (`./paper-bi` for a
    /// file with a shipped spec's name), with `overrides` of the form `KEY=VALUE` applied in order.
    ///
    /// # Errors
    /// Everything in [`SpecError`].
    pub fn load(arg: &str, overrides: &[String]) -> Result<Self, SpecError> {
        match shipped::text(arg) {
            Some(text) => Self::from_toml(text, &format!("shipped spec {arg}"), overrides),
            None => Self::from_toml(&read(arg)?, arg, overrides),
        }
    }

    /// Names of the shipped specs.
    #[must_use]
    pub fn shipped_names() -> &'static [&'static str] {
        shipped::NAMES
    }

    /// Reads a spec from TOML text; `origin` is what error messages call the text, usually its
    /// path.
    ///
    /// # Errors
    /// Everything in [`SpecError`] except that the text cannot be found or read.
    pub fn from_toml(text: &str, origin: &str, overrides: &[String]) -> Result<Self, SpecError> {
        let file = Origin::file(origin);
        let mut document: Table =
            toml::from_str(text).map_err(|error| syntax(text, origin, &error))?;
        resolve::check(&document, &file)?;

        let overrides = overrides
            .iter()
            .map(|text| Override::parse(text))
            .collect::<Result<Vec<_>, _>>()?;
        for item in &overrides {
            item.apply(&mut document);
            // Each in turn: the next may reach into a section that this one replaced.
            resolve::check(
                &document,
                &file.with_overrides(overrides.iter().map(Override::named)),
            )?;
        }

        formula::expand(
            &mut document,
            &file.with_overrides(overrides.iter().map(Override::named)),
        )?;
        let spec: Self =
            document
                .try_into()
                .map_err(|error: toml::de::Error| SpecError::Malformed {
                    origin: origin.to_owned(),
                    message: error.message().to_owned(),
                })?;
        spec.validate_from(&file.with_overrides(overrides.iter().map(Override::named)))?;
        Ok(spec)
    }
}

fn read(path: &str) -> Result<String, SpecError> {
    let unreadable = |source| SpecError::Unreadable {
        origin: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => SpecError::UnknownSpec {
            arg: path.to_owned(),
            shipped: Spec::shipped_names().join(", "),
        },
        _ => unreadable(source),
    })?;
    let mut text = String::new();
    let len = file
        .take(FILE_LEN_MAX + 1)
        .read_to_string(&mut text)
        .map_err(unreadable)?;
    if len as u64 > FILE_LEN_MAX {
        return Err(SpecError::TooLong {
            origin: path.to_owned(),
            limit: FILE_LEN_MAX,
        });
    }
    Ok(text)
}

fn syntax(text: &str, origin: &str, error: &toml::de::Error) -> SpecError {
    let offset = error.span().map_or(0, |span| span.start);
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    SpecError::Syntax {
        origin: origin.to_owned(),
        line: before.matches('\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        message: error.message().replace('\n', "; "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_loaded_by_its_path() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("mine.toml");
        std::fs::write(&path, "name = \"mine\"\n[sampling]\nperiod_s = 2\n").unwrap();
        let spec = Spec::load(path.to_str().unwrap(), &[]).unwrap();
        assert_eq!((spec.name.as_str(), spec.sampling.period_s), ("mine", 2.0));
    }

    #[test]
    fn a_name_that_is_neither_shipped_nor_a_file_lists_the_shipped() {
        let message = Spec::load("papre-bi", &[]).unwrap_err().to_string();
        assert!(message.starts_with("papre-bi: no such spec"), "{message}");
        assert!(message.contains("paper-bi, paper-uni"), "{message}");
    }

    #[test]
    fn what_cannot_be_read_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let load = |path: &std::path::Path| Spec::load(path.to_str().unwrap(), &[]).unwrap_err();
        assert!(matches!(load(dir.path()), SpecError::Unreadable { .. }));

        let binary = dir.path().join("binary");
        std::fs::write(&binary, [0xff, 0xfe]).unwrap();
        assert!(matches!(load(&binary), SpecError::Unreadable { .. }));

        let long = dir.path().join("long");
        std::fs::write(&long, vec![b'\n'; FILE_LEN_MAX as usize + 1]).unwrap();
        assert!(matches!(load(&long), SpecError::TooLong { .. }));
    }

    #[test]
    fn a_syntax_error_gives_line_and_column() {
        let error = Spec::from_toml(
            "name = \"é\"\n[plant]\ndamping_gw_per_hz = = 1\n",
            "a.toml",
            &[],
        )
        .unwrap_err();
        assert!(
            matches!(
                error,
                SpecError::Syntax {
                    line: 3,
                    column: 21,
                    ..
                }
            ),
            "{error:?}"
        );
        let message = error.to_string();
        assert!(
            message.starts_with("a.toml: line 3, column 21: "),
            "{message}"
        );

        let twice = Spec::from_toml("[plant]\nlag_time_s = 1\nlag_time_s = 2\n", "a.toml", &[])
            .unwrap_err();
        assert!(
            matches!(
                twice,
                SpecError::Syntax {
                    line: 3,
                    column: 1,
                    ..
                }
            ),
            "{twice:?}"
        );
    }
}
