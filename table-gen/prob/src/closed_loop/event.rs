//! From the event to the first decision: No control, tick by tick. Nothing is commanded and nothing
//! is drawn.

use firmware::phase::PhaseState;
use firmware::units::STATES;
use model::flow::{Flow, Matrix, Vector, absolute_integral, apply, product, tube};
use model::interval::Interval;
use model::spec::Spec;

use super::{BELOW_HZ, ClosedLoopError, Ends, FIRST_CELLS_MAX, Key, Loop, Start};
use crate::flight::{Ball, NetPower};
use crate::modes::Modes;

/// Pieces into which the unknown moment of the event is cut.
const PIECES: u32 = 64;
/// Most pieces into which the states at the event are cut along an axis.
const BOXES_MAX: f64 = 4.0;

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
        let boxes = self.initial(modes, spec);
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
            for from in &boxes {
                let free = apply(&flows, from);
                // The first tick comes in this piece of time. A loss that moves adds what it can in
                // a whole tick.
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
            }
            at = at.then(&step);
        }
        Ok(out)
    }

    /// The states at the event, in boxes that are small beside the sets of the chain where a few
    /// pieces are enough for that.
    fn initial(&self, modes: &Modes, spec: &Spec) -> Vec<Vector<STATES>> {
        let initial = &spec.uncertainty.initial;
        let radii = self.cover.radius();
        let mut boxes: Vec<Vector<STATES>> = vec![[Interval::ZERO; STATES]];
        for axis in 0..STATES {
            let (low, high) = (initial.lower[axis], initial.upper[axis]);
            // A quarter of half a radius for each axis.
            let blocks = modes.blocks.iter().zip(radii);
            let share = blocks.map(|(block, radius)| {
                let row = |i: usize| modes.into[i][axis].magnitude();
                let effect = block.axes().map(row).fold(0.0, f64::max);
                0.5 * (high - low) * effect / (0.125 * radius)
            });
            let count = share.fold(1.0, f64::max).ceil().min(BOXES_MAX);
            let edge = |i: f64| {
                if i == count {
                    high
                } else {
                    low + (high - low) * i / count
                }
            };
            // Neighbours share the very same edge.
            let along: Vec<Interval> = (0..count as u32)
                .map(|i| Interval::hull(edge(f64::from(i)), edge(f64::from(i) + 1.0)))
                .collect();
            boxes = boxes
                .into_iter()
                .flat_map(|from| {
                    along.iter().map(move |range| {
                        let mut from = from;
                        from[axis] = *range;
                        from
                    })
                })
                .collect();
        }
        boxes
    }

    /// The nodes in which the first decision is made.
    fn at_the_trigger(
        &self,
        ball: &Ball,
        state: PhaseState,
        out: &mut Start,
    ) -> Result<(), ClosedLoopError> {
        let cells = self.cover.cells(ball, true, FIRST_CELLS_MAX);
        let keys = cells
            .ok_or_else(ClosedLoopError::too_wide)?
            .into_iter()
            .map(|cell| Key {
                phase: state.phase,
                level: state.level,
                left: true,
                age: 0,
                cell,
                before: None,
            });
        let ends = Ends::In(keys.collect());
        if !out.ends.contains(&ends) {
            out.ends.push(ends);
        }
        Ok(())
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
                match &self.ahead {
                    Some(ahead) => self.first_decision(&ball, net, below, ahead, out)?,
                    None => self.at_the_trigger(&ball, state, out)?,
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
