//! A recorded event, counterfactually: what would the frequency have been if the fleet had responded?
//!
//! The power that was missing is inferred from the record through the plant ([`smoother`]), and the plant runs once more with
//! it, now with the firmware in the loop, which sees the frequency alone. The answer inherits the plant: the inferred power
//! holds whatever the plant does not model, such as responses other than its governors and demand that was disconnected.
//! [`LIMITS`] says it in full.

pub mod smoother;

use firmware::table::TableView;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::Serialize;

use crate::plant::{GridPlant, STATES};
use crate::replay::trace::Trace;
use crate::simulation::NOMINAL_HZ;
use crate::simulation::closed_loop::{ClosedLoop, Estimator, LoopError};
use crate::simulation::grid::{Grid, Part, PartLengths};
use crate::simulation::monitor::{Knot, Monitor, Summary};
use crate::simulation::monte_carlo::statistics::Quantiles;
use crate::simulation::propagator::Propagator;
use crate::simulation::recorder::{History, Recorder};
use crate::simulation::scenario::Scenario;
use crate::spec::Spec;
use smoother::{Disturbance, Smoother};

/// Where the low-frequency relays begin to disconnect demand \[Hz\].
pub const RELAY_HZ: f64 = 48.8;
/// Levels that chargers could have kept the frequency above \[Hz\]: the containment, and the relays.
pub const LEVELS_HZ: [f64; 2] = [49.2, RELAY_HZ];
/// Fleet powers tried for the levels \[GW\]: in steps of this, up to [`FLEET_MAX_GW`].
const FLEET_STEP_GW: f64 = 0.05;
/// See [`FLEET_STEP_GW`].
const FLEET_MAX_GW: f64 = 5.0;

/// What the answer does not know.
pub const LIMITS: [&str; 6] = [
    "The missing power is what the plant needs to explain the record: it holds every response that the plant does not model, and every error of the plant's parameters.",
    "The governors of the plant answer every deviation in proportion and without limit. On the day response ran out; with chargers beside them the governors of the plant would give less, those of the day perhaps no less.",
    "The record has one sample a second: a loss within a second is smeared over it, and the first second's slope is uncertain.",
    "Demand that relays disconnected at 48.8 Hz is in the record as power that came back. Where the chargers keep the frequency higher this would not have happened: the second variant takes it out, by the amount stated.",
    "Embedded generation that tripped because the frequency fell so low is in the record as missing power; with the chargers some of it would have stayed. This makes the answer pessimistic by an amount that nobody knows.",
    "The law was synthesised for its spec's loss, not for this event: nothing here is proved.",
];

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CounterfactualError {
    /// The trace's samples do not fall on the firmware's ticks.
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
    pub fleets_gw: Vec<f64>,
    /// Demand that relays disconnected at [`RELAY_HZ`] \[GW\].
    pub relieved_gw: f64,
    /// Draws from the posterior of the disturbance.
    pub draws: usize,
    /// Their seed.
    pub seed: u64,
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
}

/// Chargers that keep the frequency above a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LevelAnswer {
    /// The level \[Hz\].
    pub level_hz: f64,
    /// Power of the fleet from which on every larger one tried keeps it \[GW\]; `null` if none up to 5 GW does.
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

/// The whole answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Counterfactual {
    /// The recorded frequency \[s, Hz\].
    pub recorded: Vec<(f64, f64)>,
    /// What was missing.
    pub disturbance: Disturbance,
    /// Walk and readings of the fit \[GW in a step, Hz\].
    pub fit: (f64, f64),
    /// Largest distance of the plant's frequency without chargers from the record \[Hz\].
    pub misfit_hz: f64,
    /// Lowest recorded frequency \[Hz\].
    pub recorded_nadir_hz: f64,
    /// When the record first passes 48.8 Hz \[s\].
    pub relay_s: Option<f64>,
    /// With what relays disconnected left in, and taken out.
    pub variants: Vec<Variant>,
    /// Frequency and participation with each fleet, in the last variant \[s, Hz, 1\].
    pub curves: Vec<(f64, Vec<(f64, f64, f64)>)>,
}

/// The linear plant under a missing power that changes at the samples of a trace.
#[derive(Debug, Clone)]
struct RecordedGrid<'d> {
    plant: GridPlant,
    steps: [Option<Propagator>; 3],
    lengths: PartLengths,
    missing_gw: &'d [f64],
    step_s: f64,
    x: [f64; STATES],
}

impl Grid for RecordedGrid<'_> {
    fn state(&self) -> [f64; STATES] {
        self.x
    }

    fn advance(&mut self, part: Part, from_s: f64, fleet_gw: f64, monitor: &mut Monitor) {
        let Some(step) = &self.steps[part as usize] else {
            return;
        };
        let length = self.lengths[part as usize];
        let index = ((from_s + 0.5 * length) / self.step_s) as usize;
        let last = self.missing_gw.last().copied().unwrap_or(0.0);
        let net = fleet_gw - self.missing_gw.get(index).copied().unwrap_or(last);
        let next = step.step(&self.x, net);
        let knot = |time_s: f64, x: &[f64; STATES]| Knot {
            time_s,
            f: x[0],
            df: self.plant.derivative(*x, net)[0],
        };
        monitor.segment(knot(from_s, &self.x), knot(from_s + length, &next));
        self.x = next;
    }
}

/// What a run needs besides the disturbance.
struct Bench<'a> {
    spec: &'a Spec,
    table: &'a TableView<'a>,
    step_s: f64,
}

impl Bench<'_> {
    /// The event with a fleet of this power.
    fn run(
        &self,
        fleet_gw: f64,
        initial: [f64; STATES],
        missing_gw: &[f64],
        recorder: &mut impl Recorder,
    ) -> Result<Summary, LoopError> {
        let mut spec = self.spec.clone();
        // One charger that is as strong as the fleet: the plant sees the product alone.
        spec.fleet.chargers = 1;
        spec.fleet.power_per_charger_kw = 1e6 * fleet_gw;
        let plant = GridPlant::new(&spec);
        let mut closed_loop = ClosedLoop::new(&spec, self.table, Estimator::Observer)?;
        let scenario = Scenario {
            duration_s: self.step_s * (missing_gw.len() - 1) as f64,
            initial,
            ..Scenario::of(&spec)
        };
        let (_, lengths) = closed_loop.parts(&scenario);
        let step = |length: f64| (length > 0.0).then(|| Propagator::new(&plant, length));
        let mut grid = RecordedGrid {
            plant,
            steps: lengths.map(step),
            lengths,
            missing_gw,
            step_s: self.step_s,
            x: initial,
        };
        Ok(closed_loop.run_on(&mut grid, &scenario, recorder))
    }
}

/// Answers the question for a recorded event.
///
/// # Errors
/// Samples that are no whole number of ticks apart, or a plant that the observer cannot follow.
pub fn answer(
    spec: &Spec,
    table: &TableView<'_>,
    trace: &Trace,
    question: &Question,
) -> Result<Counterfactual, CounterfactualError> {
    let step_s = trace.samples[1].time_s - trace.samples[0].time_s;
    let tick_s = f64::from(table.header().tick_ms) / 1000.0;
    let ticks = step_s / tick_s;
    if (ticks - ticks.round()).abs() > 1e-6 || ticks < 0.5 {
        return Err(CounterfactualError::Step { step_s, tick_s });
    }
    let deviations: Vec<f64> = trace
        .samples
        .iter()
        .map(|sample| sample.frequency_hz - NOMINAL_HZ)
        .collect();
    let smoother = Smoother::fit(&GridPlant::new(spec), &deviations, step_s);
    let known = smoother.smooth(&deviations);
    let bench = Bench {
        spec,
        table,
        step_s,
    };
    let mut history = History::default();
    bench.run(0.0, known.initial, &known.missing_gw, &mut history)?;
    let per_sample = ticks.round() as usize;
    let misfit_hz = deviations
        .iter()
        .enumerate()
        .filter_map(|(k, f)| Some((history.samples.get(k * per_sample)?.state[0] - f).abs()))
        .fold(0.0, f64::max);
    let relay = trace
        .samples
        .iter()
        .position(|sample| sample.frequency_hz <= RELAY_HZ);
    let mut random = Pcg64::seed_from_u64(question.seed);
    let draws: Vec<Disturbance> = (0..question.draws)
        .map(|_| smoother.draw(&known, &mut random))
        .collect();
    let put_back = |missing: &[f64], gw: f64| -> Vec<f64> {
        let from = relay.unwrap_or(usize::MAX);
        let add = |(k, d): (usize, &f64)| if k >= from { d + gw } else { *d };
        missing.iter().enumerate().map(add).collect()
    };
    let mut variants = Vec::new();
    let names = [
        ("as recorded", 0.0),
        ("without the relays' relief", question.relieved_gw),
    ];
    for (name, put_back_gw) in names {
        let missing = put_back(&known.missing_gw, put_back_gw);
        let fleets = question
            .fleets_gw
            .iter()
            .map(|fleet_gw| {
                let summary = bench.run(*fleet_gw, known.initial, &missing, &mut ())?;
                let nadirs = draws
                    .iter()
                    .map(|draw| {
                        let missing = put_back(&draw.missing_gw, put_back_gw);
                        let run = bench.run(*fleet_gw, draw.initial, &missing, &mut ())?;
                        Ok(Some(run.nadir_hz))
                    })
                    .collect::<Result<Vec<_>, LoopError>>()?;
                Ok(FleetAnswer {
                    fleet_gw: *fleet_gw,
                    chargers: chargers(spec, *fleet_gw),
                    summary,
                    nadir_hz: Quantiles::of(nadirs.into_iter()),
                })
            })
            .collect::<Result<Vec<_>, LoopError>>()?;
        variants.push(Variant {
            name,
            put_back_gw,
            fleets,
            levels: levels(&bench, &known, &missing)?,
        });
    }
    let missing = put_back(&known.missing_gw, question.relieved_gw);
    let mut curves = Vec::new();
    for fleet_gw in &question.fleets_gw {
        let mut history = History::default();
        bench.run(*fleet_gw, known.initial, &missing, &mut history)?;
        let point = |s: &crate::simulation::trajectory::Sample| {
            (s.time_s, NOMINAL_HZ + s.state[0], s.participation)
        };
        curves.push((*fleet_gw, history.samples.iter().map(point).collect()));
    }
    let recorded: Vec<(f64, f64)> = trace
        .samples
        .iter()
        .map(|sample| (sample.time_s, sample.frequency_hz))
        .collect();
    Ok(Counterfactual {
        recorded_nadir_hz: recorded.iter().map(|p| p.1).fold(f64::INFINITY, f64::min),
        recorded,
        fit: (smoother.walk_gw, smoother.reading_hz),
        misfit_hz,
        relay_s: relay.map(|index| trace.samples[index].time_s),
        disturbance: known,
        variants,
        curves,
    })
}

/// Chargers of the spec's power that make up a fleet, rounded up.
fn chargers(spec: &Spec, fleet_gw: f64) -> u64 {
    (fleet_gw * 1e6 / spec.fleet.power_per_charger_kw).ceil() as u64
}

/// For each level the fleet from which on every larger one tried keeps the frequency above it. A scan, no bisection: more
/// chargers are not always better under a law that switches.
fn levels(
    bench: &Bench<'_>,
    known: &Disturbance,
    missing: &[f64],
) -> Result<Vec<LevelAnswer>, LoopError> {
    let tries = (FLEET_MAX_GW / FLEET_STEP_GW).round() as usize;
    let mut nadirs = Vec::with_capacity(tries + 1);
    for index in 0..=tries {
        let fleet_gw = index as f64 * FLEET_STEP_GW;
        let run = bench.run(fleet_gw, known.initial, missing, &mut ())?;
        nadirs.push((fleet_gw, run.nadir_hz));
    }
    let answer = |level_hz: f64| {
        let kept = nadirs
            .iter()
            .rev()
            .take_while(|(_, nadir)| *nadir >= level_hz);
        let fleet_gw = kept.last().map(|(fleet_gw, _)| *fleet_gw);
        LevelAnswer {
            level_hz,
            fleet_gw,
            chargers: fleet_gw.map(|fleet_gw| chargers(bench.spec, fleet_gw)),
        }
    };
    Ok(LEVELS_HZ.map(answer).to_vec())
}
