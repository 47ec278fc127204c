//! One real trajectory of the closed loop: the firmware's control loop against an adversary.
//!
//! The plant comes from the spec alone, integrated in plain numbers by its exact step; what is
//! commanded comes from the firmware alone. Nothing of the verifier is used, so that an error in
//! its model does not hide itself here. A trajectory that breaks a claim by more than the
//! arithmetic's error is a real counterexample, whatever the sets say.

use firmware::control_loop::{ControlLoop, Source};
use firmware::phase::Phase;
use firmware::prediction::History;
use firmware::table::{Law, TableView};
use firmware::units::{AXIS_F, State};
use model::plant::{Plant, STATES};
use model::propagator::Propagator;
use model::spec::Spec;
use model::verdict::ClaimName;

use super::observer::{self, Chain, ChainStep};
use super::under_way::{Command, Lateness, Part, UnderWay};

/// Pieces of a tick at which the frequency between ticks is looked at.
const PIECES: usize = 5;
/// Distance past a limit that counts \[Hz\]: far above the arithmetic's error, far below anything
/// that matters.
const MARGIN_HZ: f64 = 1e-6;
/// Micro-units in a unit.
const MICRO: f64 = firmware::units::MICRO as f64;

/// What is left to chance and malice.
pub trait Adversary {
    /// Initial state as a point of the initial box, each axis in \[0, 1\], and the moment of the
    /// event within its tick, in \[0, 1\).
    fn event(&mut self) -> ([f64; STATES], f64);
    /// For the tick that begins, at a state in Hz and GW: the net power within its interval and the
    /// estimate's error within its bound, both in \[-1, 1\]. The error goes into this tick's
    /// measurement, the power acts until the next.
    fn tick(&mut self, x: &[f64; STATES]) -> (f64, [f64; STATES]);
    /// Where the delay is a range: the share of the fleet, in \[0, 1\], that follows the latest
    /// command that a charger may follow in the tick that begins; the others follow the oldest. 1
    /// is a fleet that answers after the least delay, 0 one that answers after the most.
    fn early(&mut self, x: &[f64; STATES]) -> f64;
}

/// The loop as it stands at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time from the event \[s\].
    pub time_s: f64,
    /// Real state: f \[Hz\], g, l, p \[GW\].
    pub x: [f64; STATES],
    /// Law in force.
    pub phase: Phase,
    /// Its input level.
    pub level: u8,
    /// The phase whose command acts; behind `phase` by the delay.
    pub acting: Phase,
}

/// How a trajectory broke a claim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breach {
    /// The claim.
    pub claim: ClaimName,
    /// Time from the event \[s\].
    pub time_s: f64,
    /// Real frequency deviation \[Hz\].
    pub f_hz: f64,
    /// Ticks since the first after the event.
    pub tick: u32,
}

/// A table on a spec's plant, prepared for many trajectories.
pub struct Trajectories<'a> {
    table: &'a TableView<'a>,
    spec: &'a Spec,
    plant: Plant,
    /// What the device's observer computes of g, l and p, which knows the plant's own governor gain
    /// alone, as a share of them.
    observed: [f64; STATES],
    /// The plant that the observer knows, where it has other time constants.
    nominal: Option<Plant>,
    tick_s: f64,
    lateness: Lateness,
    /// The plant over 1..=PIECES pieces of each part of a tick.
    pieces: Vec<Vec<Propagator>>,
    /// The observer's chain over each part of a tick, where it is not the plant's.
    chains: Vec<Option<ChainStep>>,
    settle_ticks: u32,
}

impl<'a> Trajectories<'a> {
    /// Trajectories of a table on a spec's plant.
    pub fn new(table: &'a TableView<'a>, spec: &'a Spec) -> Self {
        Self::on(table, spec, Plant::new(spec))
    }

    /// Trajectories of a table on another plant, of which the chargers know nothing.
    pub fn on(table: &'a TableView<'a>, spec: &'a Spec, plant: Plant) -> Self {
        let share = spec.plant.governor_gain_gw_per_hz / plant.governor_gain;
        let tick_s = f64::from(spec.sampling.watch_ms()) / 1000.0;
        let lateness = Lateness::of(spec, tick_s);
        let pieces = |part: &Part| {
            let length_s = part.length_s / PIECES as f64;
            (1..=PIECES)
                .map(|n| Propagator::new(&plant, length_s * n as f64))
                .collect()
        };
        let known = Plant::new(spec);
        let nominal = observer::differs(&plant, &known).then_some(known);
        let chain = |part: &Part| Some(ChainStep::new(&plant, nominal.as_ref()?, part.length_s));
        Self {
            table,
            spec,
            plant,
            observed: [1.0, share, share, share],
            nominal,
            chains: lateness.parts.iter().map(chain).collect(),
            tick_s,
            pieces: lateness.parts.iter().map(pieces).collect(),
            lateness,
            settle_ticks: (spec.requirements.settle_within_s / tick_s).floor() as u32,
        }
    }

    /// Length of a tick \[s\].
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// How far a sample is from breaking a claim \[Hz\]; not positive where it does.
    pub fn margin_hz(&self, sample: &Sample) -> f64 {
        let f = sample.x[AXIS_F];
        let limit = self.spec.requirements.containment_hz;
        let contained = limit.map_or(f64::INFINITY, |limit| f - limit);
        if sample.acting != Phase::Hold {
            return contained;
        }
        let [low, high] = self.spec.requirements.inner_hz;
        contained.min(f - low).min(high - f)
    }

    /// Runs a trajectory for a number of ticks, or until it breaks a claim; `see` is shown the
    /// event and every tick.
    pub fn run(
        &self,
        adversary: &mut dyn Adversary,
        ticks: u32,
        see: &mut dyn FnMut(&Sample),
    ) -> Option<Breach> {
        let uncertainty = &self.spec.uncertainty;
        let (corner, moment) = adversary.event();
        let initial = &uncertainty.initial;
        let mut x: [f64; STATES] = std::array::from_fn(|d| {
            let start = initial.lower[d] + corner[d] * (initial.upper[d] - initial.lower[d]);
            start / self.observed[d]
        });
        let offset_s = moment * self.tick_s;
        see(&Sample {
            time_s: 0.0,
            x,
            phase: Phase::NoControl,
            level: 0,
            acting: Phase::NoControl,
        });
        let mut under_way = UnderWay::new(&self.lateness);
        let (share, _) = adversary.tick(&x);
        let power = self.net_power(Command::NONE.participation, share);
        // The observer knows the chain at the event.
        let mut chain: Chain = std::array::from_fn(|i| self.observed[i + 1] * x[i + 1]);
        if let Some(nominal) = &self.nominal {
            let step = ChainStep::new(&self.plant, nominal, offset_s);
            chain = step.step(&x, &chain, power);
        }
        x = Propagator::new(&self.plant, offset_s).step(&x, power);
        let mut control = ControlLoop::with_table(Ok(self.table.clone()));
        // What the device predicts, for the claim that C1 hands over: the loop does not show it.
        let mut history = History::NONE;
        let mut since = None;
        for tick in 0..ticks {
            let time_s = offset_s + f64::from(tick) * self.tick_s;
            let (share, error) = adversary.tick(&x);
            let measured = State(std::array::from_fn(|d| {
                let known = match d.checked_sub(1) {
                    Some(i) if self.nominal.is_some() => chain[i],
                    _ => self.observed[d] * x[d],
                };
                ((known + error[d] * uncertainty.measurement[d]) * MICRO).floor() as i32
            }));
            let decided_on = match self.table.prediction() {
                Some(prediction) => prediction.predict(measured, &history),
                None => measured,
            };
            let action = control.step(measured);
            let state = control.phase_state();
            history.push(state.level);
            under_way.note(Command {
                phase: state.phase,
                participation: f64::from(action.participation.ppm()) / MICRO,
            });
            let acting = under_way.latest();
            see(&Sample {
                time_s,
                x,
                phase: state.phase,
                level: state.level,
                acting: acting.phase,
            });
            let breach = |claim, f_hz| {
                Some(Breach {
                    claim,
                    time_s,
                    f_hz,
                    tick,
                })
            };
            if action.source != Source::Table {
                return breach(ClaimName::Table, x[AXIS_F]);
            }
            let decided = state.ticks_left + 1 == self.table.header().period_ticks;
            if decided && state.phase == Phase::C1 && self.is_for_c2(decided_on) {
                return breach(ClaimName::HandOver, x[AXIS_F]);
            }
            match state.phase {
                Phase::C1 | Phase::C2 => {
                    let since = *since.get_or_insert(tick.saturating_sub(1));
                    if tick - since > self.settle_ticks {
                        return breach(ClaimName::Settle, x[AXIS_F]);
                    }
                }
                _ => since = None,
            }
            let early = if self.lateness.is_range {
                adversary.early(&x)
            } else {
                1.0
            };
            let parts = self.lateness.parts.iter().zip(&self.pieces);
            for ((part, pieces), step) in parts.zip(&self.chains) {
                let power = self.net_power(under_way.given(part, early), share);
                for piece in pieces {
                    let f = piece.step(&x, power)[AXIS_F];
                    if let Some(claim) = self.broken(acting.phase, f) {
                        return breach(claim, f);
                    }
                }
                if let Some(step) = step {
                    chain = step.step(&x, &chain, power);
                }
                x = pieces.last().map_or(x, |part| part.step(&x, power));
            }
        }
        None
    }

    /// Whether C2 should decide on a state: f is in I1 and the table has that law.
    fn is_for_c2(&self, state: State) -> bool {
        self.table.law(Law::C2).is_some() && self.table.header().outer.contains(state)
    }

    fn broken(&self, acting: Phase, f: f64) -> Option<ClaimName> {
        let requirements = &self.spec.requirements;
        let limit = requirements.containment_hz;
        if limit.is_some_and(|limit| f < limit - MARGIN_HZ) {
            return Some(ClaimName::Containment);
        }
        let [low, high] = requirements.inner_hz;
        let outside = f < low - MARGIN_HZ || f > high + MARGIN_HZ;
        (acting == Phase::Hold && outside).then_some(ClaimName::Stay)
    }

    /// `P u' - w` \[GW\] at a point of its interval: u' within the participation error and what the
    /// hostile share gives or refuses, at most the whole fleet, w within its band; the ends are -1
    /// and 1.
    fn net_power(&self, participation: f64, share: f64) -> f64 {
        let uncertainty = &self.spec.uncertainty;
        let error = uncertainty.participation;
        let hostile = uncertainty.hostile();
        let honest = participation * (1.0 - hostile);
        let least = (honest * (1.0 - error)).max(0.0);
        let most = (honest * (1.0 + error) + hostile).min(1.0);
        let [loss_least, loss_most] = uncertainty.loss_gw;
        let low = self.plant.fleet * least - loss_most;
        let high = self.plant.fleet * most - loss_least;
        0.5 * (low + high) + 0.5 * share.clamp(-1.0, 1.0) * (high - low)
    }
}
