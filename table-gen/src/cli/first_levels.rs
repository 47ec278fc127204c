//! The levels with which `maximise` begins.

use std::str::FromStr;

use ::prob::closed_loop::Settings;
use ::prob::maximise;
use ::prob::participation::Participation;
use firmware::table::TableView;
use model::spec::Spec;
use synth::chosen::{Chosen, ChosenError};
use synth::problem::Problem;

use super::chain_args::view;
use super::{Failure, progress};

/// What the first levels are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum First {
    /// Those of the table.
    Table,
    /// One for every cell: the best of all levels in runs.
    Search,
    /// One for every cell: this participation.
    Participation(f64),
}

impl FromStr for First {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("table", _) => Ok(Self::Table),
            ("search", _) => Ok(Self::Search),
            (_, Ok(u)) if (0.0..=1.0).contains(&u) => Ok(Self::Participation(u)),
            _ => Err("allowed: table, search, or a participation from 0 to 1".to_owned()),
        }
    }
}

/// The question that the levels are for.
pub(super) struct Asked<'a> {
    pub(super) problem: &'a Problem,
    pub(super) spec: &'a Spec,
    pub(super) kind: Participation,
    pub(super) settings: Settings,
}

impl First {
    /// The first levels, on the cells and laws of a table, and the participation that all of them
    /// ask for, if they do.
    pub(super) fn levels(
        self,
        asked: &Asked<'_>,
        table: &TableView<'_>,
    ) -> Result<(Chosen, Option<f64>), Failure> {
        let own = Chosen::of(asked.problem, table).map_err(Failure::bad)?;
        let header = table.header();
        let all = 0..header.levels;
        let level = match self {
            Self::Table => return Ok((own, None)),
            Self::Participation(u) => all
                .clone()
                .find(|level| {
                    (f64::from(header.participation(*level).ppm()) / 1e6 - u).abs() < 1e-6
                })
                .ok_or_else(|| {
                    Failure::BadInput(format!(
                        "--first = {u}: no level of the table; it has {} from 0 to 1",
                        header.levels
                    ))
                })?,
            Self::Search => best(asked, &own, all)?,
        };
        let mut even = own;
        even.fill(level);
        Ok((
            even,
            Some(f64::from(header.participation(level).ppm()) / 1e6),
        ))
    }
}

/// The level with most runs that keep the promise; the lowest of equals, which asks least of cars.
fn best(asked: &Asked<'_>, own: &Chosen, levels: std::ops::Range<u8>) -> Result<u8, Failure> {
    let bar = progress::share("levels");
    let (count, mut best) = (f64::from(levels.end.max(1)), (0, 0));
    for level in levels {
        let mut even = own.clone();
        even.fill(level);
        let dense = even.dense(asked.problem);
        let dense = dense.map_err(|error: ChosenError| Failure::bad(error))?;
        let share = f64::from(level) / count;
        let kept = maximise::kept(
            &view(&dense)?,
            asked.spec,
            asked.kind,
            asked.settings.horizon_s,
            &|| bar(share),
        );
        let kept = kept.ok_or_else(|| Failure::No("interrupted".to_owned()))?;
        if kept > best.0 {
            best = (kept, level);
        }
    }
    Ok(best.1)
}
