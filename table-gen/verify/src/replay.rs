//! One real trajectory of the closed loop, with the firmware's control loop, against an adversary.
//!
//! Plain numbers, no intervals: a trajectory that breaks a claim here by more than the arithmetic's error is a real
//! counterexample, whatever the sets say.

use std::collections::VecDeque;

use firmware::phase::{Phase, PhaseState, Step};
use firmware::prediction::History;
use firmware::table::TableView;
use firmware::units::{AXIS_F, State};

use super::closed_loop::Model;
use super::tally::{Violation, missed_handover};
use model::flow::Flow;
use model::interval::Interval;
use model::plant::STATES;

/// Pieces of a tick at which the frequency between ticks is looked at.
const PIECES: usize = 5;
/// Distance past a limit that counts \[µHz\]: far above the arithmetic's error, far below anything that matters.
const MARGIN_UHZ: f64 = 1.0;

/// What is left to chance and malice.
pub(crate) trait Adversary {
    /// Initial state as a point of the initial box, each axis in \[0, 1\], and the moment of the event within its tick,
    /// in \[0, 1\).
    fn event(&mut self) -> ([f64; STATES], f64);
    /// For the tick that begins: the net power within its interval and the estimate's error within its bound, both in
    /// \[-1, 1\]. The error goes into this tick's measurement, the power acts until the next.
    fn tick(&mut self, x: &[f64; STATES], state: PhaseState) -> (f64, [f64; STATES]);
}

/// The loop as it stands at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Time from the event \[s\].
    pub(crate) time_s: f64,
    /// Real state \[micro-units\].
    pub(crate) x: [f64; STATES],
    pub(crate) phase: Phase,
    pub(crate) level: u8,
    /// The phase whose command acts; behind `phase` by the delay.
    pub(crate) acting: Phase,
}

/// How a trajectory broke a claim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Breach {
    pub(crate) kind: Violation,
    /// Time from the event \[s\].
    pub(crate) time_s: f64,
    /// Real frequency \[µHz\].
    pub(crate) f: f64,
    /// Ticks since the first after the event.
    pub(crate) tick: u32,
}

/// The closed loop, prepared for many trajectories.
pub(crate) struct Replay<'a> {
    table: &'a TableView<'a>,
    model: &'a Model,
    /// Φ and Γ over 1..=PIECES pieces of a tick.
    pieces: Vec<([[f64; STATES]; STATES], [f64; STATES])>,
    inner: [f64; 2],
    settle_ticks: u32,
}

impl<'a> Replay<'a> {
    pub(crate) fn new(
        table: &'a TableView<'a>,
        model: &'a Model,
        inner: [f64; 2],
        settle_ticks: u32,
    ) -> Self {
        let length = model.tick_s / PIECES as f64;
        let pieces = (1..=PIECES)
            .map(|n| plain(&Flow::over(&model.a, &model.b, length * n as f64)))
            .collect();
        Self {
            table,
            model,
            pieces,
            inner,
            settle_ticks,
        }
    }

    /// How far a sample is from breaking a claim \[µHz\]; not positive where it does.
    pub(crate) fn margin(&self, sample: &Sample) -> f64 {
        let f = sample.x[AXIS_F];
        let contained = self
            .model
            .containment
            .map_or(f64::INFINITY, |limit| f - limit);
        if sample.acting != Phase::Hold {
            return contained;
        }
        contained.min(f - self.inner[0]).min(self.inner[1] - f)
    }

    /// Runs a trajectory for a number of ticks, or until it breaks a claim; `see` is shown every tick.
    pub(crate) fn run(
        &self,
        adversary: &mut dyn Adversary,
        ticks: u32,
        see: &mut dyn FnMut(&Sample),
    ) -> Option<Breach> {
        let (corner, moment) = adversary.event();
        let mut x: [f64; STATES] = std::array::from_fn(|d| {
            let axis = self.model.initial[d];
            axis.low + corner[d] * (axis.high - axis.low)
        });
        let mut state = PhaseState::INITIAL;
        let offset_s = moment * self.model.tick_s;
        let start = Sample {
            time_s: 0.0,
            x,
            phase: state.phase,
            level: 0,
            acting: state.phase,
        };
        see(&start);
        let mut history = History::NONE;
        let mut under_way: VecDeque<PhaseState> =
            (0..self.model.delay_ticks()).map(|_| state).collect();
        let (share, _) = adversary.tick(&x, state);
        let first = plain(&Flow::over(&self.model.a, &self.model.b, offset_s));
        x = fly(&first, &x, self.power(0, share));
        let mut since = None;
        for tick in 0..ticks {
            let time_s = offset_s + f64::from(tick) * self.model.tick_s;
            let (share, error) = adversary.tick(&x, state);
            let measured =
                std::array::from_fn(|d| (x[d] + error[d] * self.model.error[d]).floor() as i32);
            let measured = State(measured);
            let ahead = || match self.table.prediction() {
                Some(prediction) => prediction.predict(measured, &history),
                None => measured,
            };
            let decided_on = ahead();
            let (next, step) = state.step_ahead(self.table, measured, ahead);
            state = next;
            history.push(state.level);
            under_way.push_back(state);
            // As many as there are ticks of delay, and this one.
            let acting = under_way.pop_front().unwrap_or(state);
            see(&Sample {
                time_s,
                x,
                phase: state.phase,
                level: state.level,
                acting: acting.phase,
            });
            let breach = |kind, f| {
                Some(Breach {
                    kind,
                    time_s,
                    f,
                    tick,
                })
            };
            if step == Step::Outside {
                return breach(Violation::Uncovered, x[AXIS_F]);
            }
            if missed_handover(self.table, state.phase, decided_on)
                && state.ticks_left + 1 == self.table.header().period_ticks
            {
                return breach(Violation::Handover, x[AXIS_F]);
            }
            match state.phase {
                Phase::C1 | Phase::C2 => {
                    let since = *since.get_or_insert(tick.saturating_sub(1));
                    if tick - since > self.settle_ticks {
                        return breach(Violation::Late, x[AXIS_F]);
                    }
                }
                _ => since = None,
            }
            let power = self.power(usize::from(acting.level), share);
            for piece in &self.pieces {
                let f = fly(piece, &x, power)[AXIS_F];
                if let Some(kind) = self.broken(acting.phase, f) {
                    return breach(kind, f);
                }
            }
            x = self.pieces.last().map_or(x, |tick| fly(tick, &x, power));
        }
        None
    }

    fn broken(&self, phase: Phase, f: f64) -> Option<Violation> {
        if self
            .model
            .containment
            .is_some_and(|limit| f < limit - MARGIN_UHZ)
        {
            return Some(Violation::Containment);
        }
        let outside = f < self.inner[0] - MARGIN_UHZ || f > self.inner[1] + MARGIN_UHZ;
        (phase == Phase::Hold && outside).then_some(Violation::Left)
    }

    fn power(&self, level: usize, share: f64) -> f64 {
        match self.model.drives.get(level) {
            Some(drive) => drive.mid + share.clamp(-1.0, 1.0) * drive.radius,
            None => 0.0,
        }
    }
}

fn plain(flow: &Flow<STATES>) -> ([[f64; STATES]; STATES], [f64; STATES]) {
    (
        flow.phi.map(|row| row.map(Interval::mid)),
        flow.gamma.map(Interval::mid),
    )
}

fn fly(
    (phi, gamma): &([[f64; STATES]; STATES], [f64; STATES]),
    x: &[f64; STATES],
    power: f64,
) -> [f64; STATES] {
    std::array::from_fn(|d| {
        let mut sum = gamma[d] * power;
        for j in 0..STATES {
            sum += phi[d][j] * x[j];
        }
        sum
    })
}
