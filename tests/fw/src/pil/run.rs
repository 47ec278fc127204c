//! Host and target in lock step: the same requests, answers compared to the bit, the target's
//! answer closing the loop.

use std::collections::VecDeque;

use firmware::fault::Mode;
use firmware::link::session::Session;
use firmware::link::{Request, Response, Setup};
use firmware::table::PlantParameters;
use model::plant::Plant;
use model::propagator::Propagator;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::mains::MainsModel;
use super::qemu::{PilError, Target};
use super::scenario::{Fault, Scenario};

/// The same session on both processors.
pub struct Pair<'s, 'w> {
    host: &'s mut Session<'w>,
    target: &'s mut Target,
    /// Largest cost of a tick seen: ticks of the system timer, and bytes of stack.
    pub worst: (u32, u32),
    /// Requests answered alike.
    pub agreed: u64,
}

impl<'s, 'w> Pair<'s, 'w> {
    /// Both sides, which must hold the same table.
    ///
    /// # Errors
    /// They do not.
    pub fn new(host: &'s mut Session<'w>, target: &'s mut Target) -> Result<Self, PilError> {
        let mut pair = Self {
            host,
            target,
            worst: (0, 0),
            agreed: 0,
        };
        pair.ask(&Request::Hello)?;
        Ok(pair)
    }

    /// Asks both and compares.
    ///
    /// # Errors
    /// The answers differ, or the link broke.
    pub fn ask(&mut self, request: &Request) -> Result<Response, PilError> {
        let reply = self.target.ask(request)?;
        let expected = self.host.handle(request);
        if reply.response != expected {
            return Err(PilError::Differs(format!(
                "after {} equal answers, {request:?}\nhost:   {expected:?}\ntarget: {:?}",
                self.agreed, reply.response
            )));
        }
        self.agreed += 1;
        if matches!(request, Request::Tick { .. }) {
            self.worst.0 = self.worst.0.max(reply.systick);
            self.worst.1 = self.worst.1.max(reply.stack);
        }
        Ok(expected)
    }
}

/// What a run came to, for a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Lowest deviation \[Hz\].
    pub lowest_hz: f64,
    /// Largest participation.
    pub most: f64,
    /// Ticks by mode's number.
    pub modes: [u32; Mode::ALL.len()],
    /// All faults seen.
    pub faults: u16,
}

impl Outcome {
    const NONE: Self = Self {
        lowest_hz: 0.0,
        most: 0.0,
        modes: [0; Mode::ALL.len()],
        faults: 0,
    };

    /// Adds another run's.
    pub fn add(&mut self, other: &Self) {
        self.lowest_hz = self.lowest_hz.min(other.lowest_hz);
        self.most = self.most.max(other.most);
        self.faults |= other.faults;
        for (sum, ticks) in self.modes.iter_mut().zip(other.modes) {
            *sum += ticks;
        }
    }

    fn note(&mut self, response: &Response) -> f64 {
        let Response::Tick { frame, .. } = response else {
            return 0.0;
        };
        let share = f64::from(frame.participation_ppm) * 1e-6;
        self.most = self.most.max(share);
        self.faults |= frame.faults;
        if let Some(ticks) = self.modes.get_mut(usize::from(frame.mode)) {
            *ticks += 1;
        }
        share
    }
}

/// The paper's plant with a fleet of this power.
pub fn plant(fleet_gw: f64) -> Plant {
    let micro = |value: u32| f64::from(value) * 1e-6;
    let table = PlantParameters::PAPER;
    Plant {
        governor_gain: f64::from(table.governor_gain_kw_per_hz) * 1e-6,
        governor_time: micro(table.governor_time_us),
        turbine_time: micro(table.turbine_time_us),
        lead_time: micro(table.lead_time_us),
        lag_time: micro(table.lag_time_us),
        damping: micro(table.damping_kw_per_hz),
        inertia: micro(table.inertia_kw_s_per_hz),
        fleet: fleet_gw,
    }
}

/// Plays a scenario in closed loop.
///
/// # Errors
/// As [`Pair::ask`].
pub fn closed_loop(pair: &mut Pair<'_, '_>, scenario: &Scenario) -> Result<Outcome, PilError> {
    const TICK_MS: u32 = 100;
    let tick_s = f64::from(TICK_MS) / 1000.0;
    let fleet_gw = f64::from(PlantParameters::PAPER.fleet_kw) * 1e-6;
    let step = Propagator::new(&plant(fleet_gw), tick_s);
    pair.ask(&Request::Start(scenario.setup))?;
    let mut random = Pcg64::seed_from_u64(scenario.seed);
    let mut mains = MainsModel::new(scenario.setup.source);
    let mut outcome = Outcome::NONE;
    let (mut x, mut now_ms) = ([0.0; 4], 0u32);
    let mut under_way = VecDeque::from(vec![0.0; usize::from(scenario.delay_ticks)]);
    for tick in 0..scenario.ticks {
        let noise = if scenario.noise_hz > 0.0 {
            random.random_range(-scenario.noise_hz..=scenario.noise_hz)
        } else {
            0.0
        };
        let mut seen = mains.tick(x[0] + noise, tick_s);
        let active = scenario
            .faults
            .iter()
            .filter(|(first, length, _)| (*first..first + length).contains(&tick));
        for (first, _, fault) in active {
            match fault {
                Fault::Late(ms) if tick == *first => now_ms = now_ms.wrapping_add_signed(*ms),
                fault => seen = fault.disturb(seen),
            }
        }
        let response = pair.ask(&Request::Tick {
            now_ms,
            mains: seen,
        })?;
        under_way.push_back(outcome.note(&response));
        let share = under_way.pop_front().unwrap_or(0.0);
        now_ms = now_ms.wrapping_add(TICK_MS);
        // Several losses may come and go; the last one that has begun counts.
        let loss = scenario
            .losses
            .iter()
            .filter(|(from, _)| *from <= tick)
            .max_by_key(|(from, _)| *from)
            .map_or(0.0, |(_, gw)| *gw);
        x = step.step(&x, fleet_gw * share - loss);
        outcome.lowest_hz = outcome.lowest_hz.min(x[0]);
    }
    Ok(outcome)
}

/// Plays a recorded frequency: one sample a second, held, as a deviation.
///
/// # Errors
/// As [`Pair::ask`].
pub fn recorded(
    pair: &mut Pair<'_, '_>,
    setup: Setup,
    deviations_hz: &[f64],
) -> Result<Outcome, PilError> {
    pair.ask(&Request::Start(setup))?;
    let mut mains = MainsModel::new(setup.source);
    let mut outcome = Outcome::NONE;
    let mut now_ms = 0;
    for hz in deviations_hz {
        for _ in 0..10 {
            let mains = mains.tick(*hz, 0.1);
            outcome.note(&pair.ask(&Request::Tick { now_ms, mains })?);
            outcome.lowest_hz = outcome.lowest_hz.min(*hz);
            now_ms += 100;
        }
    }
    Ok(outcome)
}
