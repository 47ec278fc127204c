//! The firmware's own control loop against a grid, from the bytes of a table.
//!
//! Time goes in ticks of the table. At each tick the state is measured (with this run's measurement
//! error, floored to micro-units, as the device stores it), the firmware answers, and the grid
//! moves to the next tick. With an actuation delay the command acts later; a delay that is no whole
//! number of ticks splits each tick in two. The first tick comes `event_offset_s` after the event.

use firmware::control_loop::{Action, ControlLoop};
use firmware::observer::{Observer, ObserverConfig, ObserverError};
use firmware::phase::Phase;
use firmware::table::TableView;
use firmware::units::{MICRO, State};

use super::beyond::Disturbances;
use super::beyond::plant::BeyondPlant;
use super::beyond::system::BeyondSystem;
use super::chance::Chance;
use super::monitor::{Monitor, Summary};
use super::power_system::{LinearSystem, Part, PartLengths, PowerSystem};
use super::recorder::{History, Recorder};
use super::scenario::Scenario;
use super::trajectory::{Run, Sample};
use model::governor::Governor;
use model::plant::{Plant, STATES};
use model::propagator::Propagator;
use model::spec::Spec;

/// Shorter parts of a tick are rounding dust \[s\].
const DUST_S: f64 = 1e-9;

/// How the firmware comes to know the grid state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// It is told (the paper's assumption).
    FullState,
    /// It reconstructs g, l and p from f.
    Observer,
}

/// Why the loop cannot run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LoopError {
    /// The table's plant has a time constant that the observer cannot follow at its tick.
    #[error("the observer cannot be made: {0:?}")]
    Observer(ObserverError),
}

/// A state as the device stores it.
#[inline]
pub fn measured(x: &[f64; STATES]) -> State {
    // Saturates far outside every grid.
    State(x.map(|value| (value * f64::from(MICRO)).floor() as i32))
}

/// Firmware, grid parameters and buffers; made once and run as often as wanted without allocating.
#[derive(Debug, Clone)]
pub struct ClosedLoop<'t> {
    plant: Plant,
    governor: Governor,
    tick_s: f64,
    tick_step: Propagator,
    monitor: Monitor,
    firmware: ControlLoop<'t>,
    observer: Option<ObserverConfig>,
    /// Commands on their way, oldest at `at`.
    pending: Vec<f64>,
    at: usize,
}

impl<'t> ClosedLoop<'t> {
    /// The firmware on a table, against a spec's plant.
    ///
    /// # Errors
    /// A plant that the observer cannot follow, if it is asked for.
    pub fn new(
        spec: &Spec,
        table: &TableView<'t>,
        estimator: Estimator,
    ) -> Result<Self, LoopError> {
        let header = table.header();
        let plant = Plant::new(spec);
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let observer = match estimator {
            Estimator::FullState => None,
            Estimator::Observer => {
                let config = ObserverConfig::new(&header.plant, header.tick_ms)
                    .map_err(LoopError::Observer)?;
                Some(config)
            }
        };
        Ok(Self {
            plant,
            governor: Governor::of(spec),
            tick_s,
            tick_step: Propagator::new(&plant, tick_s),
            monitor: Monitor::new(spec),
            firmware: ControlLoop::with_table(Ok(table.clone())),
            observer,
            pending: Vec::new(),
            at: 0,
        })
    }

    /// Runs from now on are on this plant; the firmware and its observer know nothing of it.
    pub fn set_plant(&mut self, plant: Plant) {
        self.plant = plant;
        self.tick_step = Propagator::new(&plant, self.tick_s);
    }

    /// Whole ticks of a delay, and the lengths of the parts of a tick.
    pub fn parts(&self, scenario: &Scenario) -> (usize, PartLengths) {
        let whole = (scenario.delay_s / self.tick_s + DUST_S).floor();
        let early = scenario.delay_s - whole * self.tick_s;
        let early = if early < DUST_S { 0.0 } else { early };
        let parts = [scenario.event_offset_s, early, self.tick_s - early];
        (whole as usize, parts)
    }

    /// One run on the spec's plant, or on the one that was set.
    pub fn run(&mut self, scenario: &Scenario, recorder: &mut impl Recorder) -> Summary {
        let (_, parts) = self.parts(scenario);
        let (loss, initial) = (scenario.loss_gw, scenario.initial);
        if !self.governor.is_linear() {
            let disturbances = Disturbances {
                governor: self.governor,
                ..Disturbances::step(loss)
            };
            let plant = BeyondPlant::new(self.plant, &disturbances, 0.0, 0);
            let mut grid = BeyondSystem::new(plant, parts, initial);
            return self.run_on(&mut grid, scenario, recorder);
        }
        let mut grid = LinearSystem::new(self.plant, &self.tick_step, parts, loss, initial);
        self.run_on(&mut grid, scenario, recorder)
    }

    /// One run on any grid. `scenario.loss_gw` and `scenario.initial` are the grid's own matter.
    pub fn run_on(
        &mut self,
        grid: &mut impl PowerSystem,
        scenario: &Scenario,
        recorder: &mut impl Recorder,
    ) -> Summary {
        let (whole, lengths) = self.parts(scenario);
        let early_s = lengths[Part::Early as usize];
        self.pending.clear();
        self.pending.resize(whole + 1, 0.0);
        self.at = 0;
        self.firmware.reset();
        let mut observer = self.observer.as_ref().map(|config| {
            let f_uhz = measured(&grid.state()).frequency_uhz();
            Observer::at_rest(*config, f_uhz)
        });
        let mut chance = Chance::new(scenario);
        let mut monitor = self.monitor;
        let fleet_gw = self.plant.fleet;
        let ticks = (scenario.duration_s / self.tick_s).ceil().max(1.0) as usize;
        grid.advance(Part::Offset, 0.0, 0.0, &mut monitor);
        for tick in 0..=ticks {
            let time_s = scenario.event_offset_s + tick as f64 * self.tick_s;
            let x = grid.state();
            let state = measured(&chance.measure(x));
            let state = match &mut observer {
                None => state,
                Some(observer) => observer.step(state.frequency_uhz()),
            };
            let action = self.firmware.step(state);
            let command = participation(&action);
            let (older, newer) = self.send(command);
            let error = chance.participation();
            let delivered = |u: f64| (u * (1.0 + error)).clamp(0.0, 1.0);
            monitor.participation(command);
            if action.phase == Phase::Fallback {
                monitor.fallback(self.tick_s);
            }
            let sample = Sample {
                time_s,
                state: x,
                participation: command,
                delivered: delivered(if early_s > 0.0 { older } else { newer }),
            };
            let last = tick == ticks;
            recorder.tick(&sample, &action, if last { 0.0 } else { self.tick_s });
            if last {
                break;
            }
            let power = |u: f64| fleet_gw * delivered(u);
            if early_s > 0.0 {
                grid.advance(Part::Early, time_s, power(older), &mut monitor);
            }
            let late_s = time_s + early_s;
            grid.advance(Part::Late, late_s, power(newer), &mut monitor);
        }
        monitor.summary()
    }

    /// Sends a command on its way; returns what acts before and after the part of a tick that the
    /// delay leaves over.
    #[inline]
    fn send(&mut self, command: f64) -> (f64, f64) {
        let older = std::mem::replace(&mut self.pending[self.at], command);
        self.at += 1;
        if self.at == self.pending.len() {
            self.at = 0;
        }
        // The next oldest; without whole ticks of delay that is the command itself.
        (older, self.pending[self.at])
    }
}

/// Participation that an action asks for, 0..=1.
#[inline]
pub fn participation(action: &Action) -> f64 {
    f64::from(action.participation.ppm()) / f64::from(MICRO)
}

/// Runs the firmware on a table against a spec's plant, with all that happened.
///
/// # Errors
/// A plant that the observer cannot follow, if it is asked for.
pub fn simulate(
    spec: &Spec,
    table: &TableView<'_>,
    scenario: &Scenario,
    estimator: Estimator,
) -> Result<Run, LoopError> {
    let mut history = History::default();
    let summary = ClosedLoop::new(spec, table, estimator)?.run(scenario, &mut history);
    Ok(Run {
        samples: history.samples,
        phases: history.phases,
        summary,
    })
}
