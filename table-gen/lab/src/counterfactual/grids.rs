//! The grids on which a recorded event runs again: one that answers, and one to compare with.
//!
//! - Identified, and the record tells a plant: the one that explains it best answers, the spec's
//!   with linear governors is compared.
//! - The spec's governors are limited: its plant answers, the same without limits is compared.
//! - Stated, or the record has no fall: the spec's plant with governors that stop at the response
//!   stated answers, the spec's plant is compared.

use serde::Serialize;

use crate::identify::parameters::{
    GOVERNOR_TIME, INERTIA, LAG_TIME, LEAD_TIME, TURBINE_TIME, Values, governor, plant,
};
use crate::identify::{Identified, Known, identify};
use crate::record::Record;
use crate::simulation::beyond::Governor;
use model::plant::Plant;
use model::spec::Spec;

/// Time after the steepest second up to which a record tells the plant, unless said otherwise
/// \[s\]: governors have answered by then, and a second loss has seldom come.
pub const UNTIL_S: f64 = 40.0;
/// Other plants that explain the record and that the event runs on as well, at most.
const OTHERS: usize = 20;

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Grid {
    /// The spec's plant, with the response held as a limit.
    Stated,
    /// The plant that the record tells, with what else is known of the event. Time constants that
    /// are not given are the spec's, and so is the inertia where no loss is known.
    Identified(Known),
}

/// Where the plant of the answer comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The record.
    Identified,
    /// The spec, whose governors are limited.
    Spec,
    /// The spec, with the response stated as a limit.
    Stated,
}

/// What a plant is there for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// To compare with.
    Comparison,
    /// To answer the question.
    Answer,
}

/// One grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its name.
    pub name: &'static str,
    /// What it is for.
    pub role: Role,
    /// Its parameters.
    pub plant: Plant,
    /// Its governors.
    pub governor: Governor,
    /// Others that explain the record as well.
    pub others: Vec<(Plant, Governor)>,
}

/// The two grids, and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Grids {
    /// The comparison, then the answer.
    pub candidates: [Candidate; 2],
    /// Where the answer's comes from.
    pub source: Source,
    /// What the record tells.
    pub identified: Option<Identified>,
    /// Why it tells nothing.
    pub not_identified: Option<String>,
}

/// The grids for what is asked; `held_gw` is the response that the governors held, where it is
/// stated.
pub fn of(spec: &Spec, record: &Record, asked: &Grid, held_gw: f64) -> Grids {
    let own = Governor::of(spec);
    let stated = Plant::new(spec);
    let candidate = |name, role, governor| Candidate {
        name,
        role,
        plant: stated,
        governor,
        others: Vec::new(),
    };
    let mut not_identified = None;
    if let (Grid::Identified(known), true) = (asked, own.is_linear()) {
        match identify(record, &completed(known, spec)) {
            Ok(found) => {
                return Grids {
                    candidates: [
                        candidate("linear governors", Role::Comparison, Governor::LINEAR),
                        best(&found, stated.fleet),
                    ],
                    source: Source::Identified,
                    identified: Some(found),
                    not_identified: None,
                };
            }
            Err(error) => not_identified = Some(error.to_string()),
        }
    }
    let (candidates, source) = if own.is_linear() {
        let limited = Governor {
            output_gw: [f64::NEG_INFINITY, held_gw],
            ..Governor::LINEAR
        };
        let pair = [
            candidate("spec's governors", Role::Comparison, own),
            candidate("limited governors", Role::Answer, limited),
        ];
        (pair, Source::Stated)
    } else {
        let pair = [
            candidate("linear governors", Role::Comparison, Governor::LINEAR),
            candidate("spec's governors", Role::Answer, own),
        ];
        (pair, Source::Spec)
    };
    Grids {
        candidates,
        source,
        identified: None,
        not_identified,
    }
}

/// The plant that explains the record best, and some that explain it well enough.
fn best(found: &Identified, fleet: f64) -> Candidate {
    let grid = |values: &Values| {
        let plant = Plant {
            fleet,
            ..plant(values)
        };
        (plant, governor(values))
    };
    let every = found.others.len().div_ceil(OTHERS).max(1);
    let (plant, governor) = grid(&found.best);
    Candidate {
        name: "identified plant",
        role: Role::Answer,
        plant,
        governor,
        others: found.others.iter().step_by(every).map(grid).collect(),
    }
}

/// What is known, with what the spec says where nothing is said.
fn completed(known: &Known, spec: &Spec) -> Known {
    let plant = &spec.plant;
    let mut known = known.clone();
    let mut add = |index: usize, value: f64| {
        if known.given.iter().all(|(given, _)| *given != index) {
            known.given.push((index, value));
        }
    };
    add(GOVERNOR_TIME, plant.governor_time_s);
    add(TURBINE_TIME, plant.turbine_time_s);
    add(LEAD_TIME, plant.lead_time_s);
    add(LAG_TIME, plant.lag_time_s);
    if known.stages.is_empty() {
        // Only ratios are known then: something must say how large the grid is.
        if known.given.iter().all(|(given, _)| *given != INERTIA) {
            known.given.push((INERTIA, plant.inertia_gw_s_per_hz));
        }
    }
    known
}
