//! From the event to the first decision: No control, tick by tick. Nothing is commanded and nothing
//! is drawn.

use firmware::phase::PhaseState;
use firmware::units::STATES;
use model::flow::{Flow, Matrix, Vector, absolute_integral, apply, product, tube};
use model::interval::Interval;
use model::spec::Spec;

use super::{BELOW_HZ, ClosedLoopError, Ends, Key, Loop, Start};
use crate::flight::{Ball, NetPower};
use crate::modes::Modes;

/// Pieces into which the unknown moment of the event is cut.
const PIECES: u32 = 64;

impl Loop<'_> {
    /// From the event to the first decision: the nodes in which it may come, or failure where f
    /// breaks the containment before. A set that never decides is safe.
    pub(super) fn start(
        &self,
        modes: &Modes,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        spec: &Spec,
        horizon_ticks: u32,
    ) -> Result<Start, ClosedLoopError> {
        let tick_s = self.tick_s;
        let initial = &spec.uncertainty.initial;
        let from: Vector<STATES> =
            std::array::from_fn(|d| Interval::hull(initial.lower[d], initial.upper[d]));
        let net = self.net(Interval::ZERO);
        let h = (tick_s / f64::from(PIECES)).next_up();
        let (within, step) = (tube(a, h), Flow::over(a, b, h));
        let time = Interval { low: 0.0, high: h };
        let moved = absolute_integral(a, b, tick_s);
        let mut at = Flow::identity();
        let mut out = Start {
            ends: Vec::new(),
            ticks_below: 0,
        };
        for _ in 0..PIECES {
            let flows = product(&within, &at.phi);
            let driven = apply(&flows, b);
            let free = apply(&flows, &from);
            // The first tick comes in this piece of time. A loss that moves adds what it can in a
            // whole tick.
            let x: Vector<STATES> = std::array::from_fn(|d| {
                let known = free[d] + (at.gamma[d] + time * driven[d]) * net.range;
                let most = (moved[d] * net.moving).next_up();
                known + Interval::hull(-most, most)
            });
            if x[0].low < self.containment {
                out.ends.push(Ends::Failed);
            }
            // f within the tick of the event is in the hull of its pieces.
            let before = u32::from(x[0].low < BELOW_HZ);
            let m = modes.vector(&x);
            let spread = m.map(|axis| Interval::point(axis.radius()));
            let ball = Ball {
                centre: m.map(Interval::mid),
                radius: modes
                    .blocks
                    .iter()
                    .map(|block| Modes::length(&spread, *block))
                    .collect(),
            };
            self.watch(ball, net, (horizon_ticks, before), &mut out)?;
            at = at.then(&step);
        }
        Ok(out)
    }

    /// Follows No control tick by tick.
    fn watch(
        &self,
        mut ball: Ball,
        net: NetPower,
        (horizon_ticks, before): (u32, u32),
        out: &mut Start,
    ) -> Result<(), ClosedLoopError> {
        let mut below = before;
        let state = PhaseState::INITIAL;
        for _ in 0..=horizon_ticks {
            let outcomes = self.regions.outcomes(self.table, state, &ball);
            if outcomes.iter().any(|(next, _)| *next != state) {
                let Some(cell) = self.cover.cell(&ball, true) else {
                    return Err(ClosedLoopError::Unsupported {
                        what: "an initial set that is wider than the sets of the chain".to_owned(),
                        remedy: "a smaller uncertainty.initial or wider bins are",
                    });
                };
                let (phase, level) = (state.phase, state.level);
                let key = Key {
                    phase,
                    level,
                    left: true,
                    age: 0,
                    cell,
                };
                let ends = Ends::In(vec![key]);
                if !out.ends.contains(&ends) {
                    out.ends.push(ends);
                }
                out.ticks_below = out.ticks_below.max(below);
            }
            if outcomes.iter().all(|(next, _)| *next != state) {
                return Ok(());
            }
            let lowest = self.flights.lowest(&ball, net, 1);
            if lowest < self.containment {
                out.ends.push(Ends::Failed);
            }
            below += u32::from(lowest < BELOW_HZ);
            out.ticks_below = out.ticks_below.max(below);
            let free = self.flights.free(&ball.centre, 1);
            ball = self.flights.after(free, &ball.radius, net, 1);
        }
        Ok(())
    }
}
