//! A recorded event, counterfactually: what would the frequency have been if the fleet had
//! responded?
//!
//! The power that was missing is inferred from the record through the plant ([`smoother`]), and the
//! plant runs once more with it, now with the firmware in the loop, which sees the frequency alone
//! ([`rerun`]). The answer inherits the plant, so it is given for two ([`grids`]): the one that the
//! record itself tells, and the spec's with linear governors to compare with. [`LIMITS`] says what
//! neither knows.

pub mod grids;
pub mod rerun;
pub mod smoother;

use std::borrow::Cow;

use firmware::table::TableView;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;

use crate::identify::{Identified, Known};
use crate::record::Record;
use crate::simulation::NOMINAL_HZ;
use crate::simulation::closed_loop::LoopError;
use crate::simulation::monitor::Summary;
use crate::simulation::monte_carlo::statistics::Quantiles;
use crate::simulation::recorder::History;
use grids::{Candidate, Grid, Role, Source};
use model::spec::Spec;
use rerun::Rerun;
use smoother::{Disturbance, Smoother};

/// Where the low-frequency relays begin to disconnect demand \[Hz\].
pub const RELAY_HZ: f64 = 48.8;
/// Levels that chargers could have kept the frequency above \[Hz\]: the containment, and the
/// relays.
pub const LEVELS_HZ: [f64; 2] = [49.2, RELAY_HZ];
/// Fleet powers tried for the levels \[GW\]: in steps of this, up to [`FLEET_MAX_GW`].
const FLEET_STEP_GW: f64 = 0.05;
/// See [`FLEET_STEP_GW`].
const FLEET_MAX_GW: f64 = 5.0;

/// What the answer does not know.
pub const LIMITS: [&str; 7] = [
    "The missing power is what the plant needs to explain the record: it holds every response that the plant does not model, and every error of the plant's parameters.",
    "Governors without limits answer in proportion: they explain a fall to 48.8 Hz by far more missing power than was lost, and take back what the chargers give. Limited governors stop at the response stated or identified; with them the inferred loss can be compared with the reported one.",
    "A record does not tell one plant: many explain it as well as the best, and the nadir is given over some of them. How large all powers are rests on the loss that is stated, or else on the spec's inertia; and no plant here knows what else answered on the day.",
    "The record has one sample a second: a loss within a second is smeared over it, and the first second's slope is uncertain.",
    "Demand that relays disconnected at 48.8 Hz is in the record as power that came back. Where the chargers keep the frequency higher this would not have happened: one variant takes it out, by the amount stated, from the sample at which the record passes 48.8 Hz.",
    "Embedded generation that tripped because the frequency fell so low is in the record as missing power; with the chargers some of it would have stayed. This makes the answer pessimistic by an amount that is not known here.",
    "The law was synthesised for its spec's loss and fleet, not for this event: nothing here is proved. Where no law covers the state, the chargers follow the droop.",
];

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CounterfactualError {
    /// The levels of the relays are those of a system of 50 Hz.
    #[error(
        "a system of {found_hz} Hz; allowed: 50 Hz, for the relays' levels are Great Britain's"
    )]
    Nominal {
        /// Frequency of the record's system at rest \[Hz\].
        found_hz: f64,
    },
    /// The record's samples do not fall on the firmware's ticks.
    #[error("samples are {step_s} s apart; allowed: a whole number of ticks of {tick_s} s")]
    Step {
        /// Time between samples \[s\].
        step_s: f64,
        /// The table's tick \[s\].
        tick_s: f64,
    },
    /// The loop cannot run.
    #[error(transparent)]
    Loop(#[from] LoopError),
}

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Fleets to try \[GW\].
    pub fleets_gw: Cow<'static, [f64]>,
    /// Demand that relays disconnected at [`RELAY_HZ`] \[GW\].
    pub relieved_gw: f64,
    /// The grid on which the event runs again.
    pub grid: Grid,
    /// Response that the governors held on the day \[GW\], for the second of the stated plants.
    pub governor_max_gw: f64,
    /// Draws from the posterior of the disturbance.
    pub draws: usize,
    /// Their seed.
    pub seed: u64,
}

impl Question {
    /// The paper's two fleets on 9 August 2019: about 1 GW of demand was disconnected, and about 1
    /// GW of response was held.
    pub const PAPER: Self = Self {
        fleets_gw: Cow::Borrowed(&[0.7, 1.4]),
        relieved_gw: 1.0,
        grid: Grid::Identified(Known {
            stages: Vec::new(),
            given: Vec::new(),
            until_s: grids::UNTIL_S,
        }),
        governor_max_gw: 1.0,
        draws: 50,
        seed: 0,
    };
}

/// One fleet's answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetAnswer {
    /// Power of the fleet \[GW\].
    pub fleet_gw: f64,
    /// Chargers of the spec's power that make it up.
    pub chargers: u64,
    /// With the disturbance's mean.
    pub summary: Summary,
    /// Nadir over draws of the disturbance \[Hz\].
    pub nadir_hz: Quantiles,
    /// Least and greatest nadir over plants that explain the record \[Hz\]; none where the plant is
    /// not identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nadir_over_plants_hz: Option<[f64; 2]>,
}

/// Chargers that keep the frequency above a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LevelAnswer {
    /// The level \[Hz\].
    pub level_hz: f64,
    /// Power of the fleet from which on every larger one tried keeps it \[GW\]; `null` if none up
    /// to 5 GW does.
    pub fleet_gw: Option<f64>,
    /// The same in chargers of the spec's power.
    pub chargers: Option<u64>,
}

/// The answers for one reading of the disturbance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Variant {
    /// Which.
    pub name: &'static str,
    /// Demand put back from the moment at which the record passes 48.8 Hz \[GW\].
    pub put_back_gw: f64,
    /// By fleet.
    pub fleets: Vec<FleetAnswer>,
    /// By level.
    pub levels: Vec<LevelAnswer>,
}

/// Points of a curve with its band: time, value, half-width.
pub type Curve = Vec<(f64, f64, f64)>;

/// The answers on one plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlantAnswer {
    /// Which plant.
    pub name: &'static str,
    /// What it is for.
    pub role: Role,
    /// Standard deviation of the fitted walk \[GW in a step\].
    pub walk_gw: f64,
    /// Standard deviation of the fitted readings \[Hz\].
    pub reading_hz: f64,
    /// Largest distance of this plant's frequency without chargers from the record \[Hz\].
    pub misfit_hz: f64,
    /// The most power that was missing \[GW\].
    pub largest_missing_gw: f64,
    /// With what relays disconnected left in, and taken out.
    pub variants: Vec<Variant>,
    /// What was missing.
    #[serde(skip)]
    pub disturbance: Disturbance,
    /// Frequency and participation with each fleet, in the last variant \[s, Hz, 1\].
    #[serde(skip)]
    pub curves: Vec<(f64, Curve)>,
}

/// The whole answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Counterfactual {
    /// The recorded frequency \[s, Hz\].
    pub recorded: Vec<(f64, f64)>,
    /// Lowest recorded frequency \[Hz\].
    pub recorded_nadir_hz: f64,
    /// When the record first passes 48.8 Hz \[s\].
    pub relay_s: Option<f64>,
    /// Where the plant of the answer comes from.
    pub source: Source,
    /// What the record tells of the plant, where it was asked.
    pub identified: Option<Identified>,
    /// Why it was asked and did not tell.
    pub not_identified: Option<String>,
    /// On each plant: the comparison, then the answer.
    pub plants: Vec<PlantAnswer>,
}

/// Answers the question for a recorded event.
///
/// # Errors
/// Samples that are no whole number of ticks apart, or a plant that the observer cannot follow.
pub fn answer(
    spec: &Spec,
    table: &TableView<'_>,
    record: &Record,
    question: &Question,
) -> Result<Counterfactual, CounterfactualError> {
    if record.nominal_hz != NOMINAL_HZ {
        return Err(CounterfactualError::Nominal {
            found_hz: record.nominal_hz,
        });
    }
    let step_s = record.step_s;
    let tick_s = f64::from(table.header().tick_ms) / 1000.0;
    let ticks = step_s / tick_s;
    if (ticks - ticks.round()).abs() > 1e-6 || ticks < 0.5 {
        return Err(CounterfactualError::Step { step_s, tick_s });
    }
    let recorded: Vec<(f64, f64)> = record
        .samples
        .iter()
        .map(|sample| (sample.time_s, sample.frequency_hz))
        .collect();
    let relay = recorded.iter().position(|(_, f)| *f <= RELAY_HZ);
    let grids = grids::of(spec, record, &question.grid, question.governor_max_gw);
    let plants = grids
        .candidates
        .iter()
        .map(|candidate| {
            let rerun = Rerun {
                spec,
                table,
                plant: candidate.plant,
                governor: candidate.governor,
                step_s,
            };
            let ticks = ticks.round() as usize;
            on_plant(candidate, &rerun, &recorded, relay, ticks, question)
        })
        .collect::<Result<Vec<_>, LoopError>>()?;
    Ok(Counterfactual {
        recorded_nadir_hz: recorded.iter().map(|p| p.1).fold(f64::INFINITY, f64::min),
        relay_s: relay.map(|index| recorded[index].0),
        recorded,
        source: grids.source,
        identified: grids.identified,
        not_identified: grids.not_identified,
        plants,
    })
}

/// The answers on one plant.
fn on_plant(
    candidate: &Candidate,
    rerun: &Rerun<'_>,
    recorded: &[(f64, f64)],
    relay: Option<usize>,
    ticks_per_sample: usize,
    question: &Question,
) -> Result<PlantAnswer, LoopError> {
    let deviations: Vec<f64> = recorded.iter().map(|(_, f)| f - NOMINAL_HZ).collect();
    let smoother = Smoother::fit(&rerun.plant, rerun.governor, &deviations, rerun.step_s);
    let known = smoother.smooth(&deviations);
    let mut history = History::default();
    rerun.run(0.0, &known, 0.0, None, &mut history)?;
    let misfit_hz = deviations
        .iter()
        .enumerate()
        .filter_map(|(k, f)| Some((history.samples.get(k * ticks_per_sample)?.state[0] - f).abs()))
        .fold(0.0, f64::max);
    let mut random = Pcg64::seed_from_u64(question.seed);
    let draws: Vec<Disturbance> = (0..question.draws)
        .map(|_| smoother.draw(&known, &mut random))
        .collect();
    // Other plants that explain the record, each with what was missing on it.
    let others: Vec<(Rerun<'_>, Disturbance)> = candidate
        .others
        .par_iter()
        .map(|(plant, governor)| {
            let (plant, governor) = (*plant, *governor);
            let smoother = Smoother::fit(&plant, governor, &deviations, rerun.step_s);
            let other = Rerun {
                plant,
                governor,
                ..*rerun
            };
            (other, smoother.smooth(&deviations))
        })
        .collect();
    let reliefs = [
        ("relays' relief as recorded", 0.0),
        ("relays' relief taken out", question.relieved_gw),
    ];
    let mut variants = Vec::new();
    for (name, put_back_gw) in reliefs {
        let fleets = question
            .fleets_gw
            .iter()
            .map(|fleet_gw| {
                let nadir = |draw: &Disturbance| {
                    let run = rerun.run(*fleet_gw, draw, put_back_gw, relay, &mut ())?;
                    Ok(run.nadir_hz)
                };
                let nadirs = draws
                    .par_iter()
                    .map(nadir)
                    .collect::<Result<Vec<f64>, LoopError>>()?;
                let summary = rerun.run(*fleet_gw, &known, put_back_gw, relay, &mut ())?;
                let over = others
                    .par_iter()
                    .map(|(other, known)| {
                        let run = other.run(*fleet_gw, known, put_back_gw, relay, &mut ())?;
                        Ok(run.nadir_hz)
                    })
                    .collect::<Result<Vec<f64>, LoopError>>()?;
                let own = [summary.nadir_hz; 2];
                let range = over.iter().fold(own, |[low, high], nadir| {
                    [low.min(*nadir), high.max(*nadir)]
                });
                Ok(FleetAnswer {
                    fleet_gw: *fleet_gw,
                    chargers: chargers(rerun.spec, *fleet_gw),
                    summary,
                    nadir_over_plants_hz: (!over.is_empty()).then_some(range),
                    nadir_hz: Quantiles::of(nadirs.into_iter().map(Some)),
                })
            })
            .collect::<Result<Vec<_>, LoopError>>()?;
        variants.push(Variant {
            name,
            put_back_gw,
            fleets,
            levels: levels(rerun, &known, put_back_gw, relay)?,
        });
    }
    let mut curves = Vec::new();
    for fleet_gw in question.fleets_gw.iter() {
        let mut history = History::default();
        rerun.run(*fleet_gw, &known, question.relieved_gw, relay, &mut history)?;
        let point = |s: &crate::simulation::trajectory::Sample| {
            (s.time_s, NOMINAL_HZ + s.state[0], s.participation)
        };
        curves.push((*fleet_gw, history.samples.iter().map(point).collect()));
    }
    Ok(PlantAnswer {
        name: candidate.name,
        role: candidate.role,
        walk_gw: smoother.walk_gw,
        reading_hz: smoother.reading_hz,
        misfit_hz,
        largest_missing_gw: known
            .missing_gw
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max),
        variants,
        disturbance: known,
        curves,
    })
}

/// Chargers of the spec's power that make up a fleet, rounded up.
fn chargers(spec: &Spec, fleet_gw: f64) -> u64 {
    (fleet_gw * 1e6 / spec.fleet.power_per_charger_kw).ceil() as u64
}

/// For each level the fleet from which on every larger one tried keeps the frequency above it. A
/// scan, no bisection: more chargers are not always better under a law that switches.
fn levels(
    rerun: &Rerun<'_>,
    known: &Disturbance,
    put_back_gw: f64,
    relay: Option<usize>,
) -> Result<Vec<LevelAnswer>, LoopError> {
    let tries = (FLEET_MAX_GW / FLEET_STEP_GW).round() as usize;
    let nadirs = (0..=tries)
        .into_par_iter()
        .map(|index| {
            let fleet_gw = index as f64 * FLEET_STEP_GW;
            let run = rerun.run(fleet_gw, known, put_back_gw, relay, &mut ())?;
            Ok((fleet_gw, run.nadir_hz))
        })
        .collect::<Result<Vec<_>, LoopError>>()?;
    let answer = |level_hz: f64| {
        let kept = nadirs
            .iter()
            .rev()
            .take_while(|(_, nadir)| *nadir >= level_hz);
        let fleet_gw = kept.last().map(|(fleet_gw, _)| *fleet_gw);
        LevelAnswer {
            level_hz,
            fleet_gw,
            chargers: fleet_gw.map(|fleet_gw| chargers(rerun.spec, fleet_gw)),
        }
    };
    Ok(LEVELS_HZ.map(answer).to_vec())
}
