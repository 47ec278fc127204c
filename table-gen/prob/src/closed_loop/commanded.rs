//! Nodes whose decision is made already: tables with Hold, and commands that act late.
//!
//! Such a node has the phase and the level that were decided, and the set in which the command
//! begins to act. Its step flies that set through the bins of the draw, and its branches lead to
//! all the decisions that [`super::ahead`] allows at their ends.

use firmware::phase::{Decision, Phase, PhaseState};
use firmware::units::{AXIS_F, STATES, State};
use model::interval::Interval;

use super::ahead::Ahead;
use super::expand::push;
use super::{
    BELOW_HZ, Branches, ClosedLoopError, Decided, Ends, Expanded, FIRST_CELLS_MAX, Failure,
    Failures, Key, Loop, Start,
};
use crate::flight::{Ball, NetPower};
use crate::participation::Bin;

/// Where a step ends: what the machine remembers, and what was delivered.
#[derive(Clone, Copy)]
struct End {
    state: PhaseState,
    /// The band that the phase watches was left in the middle of a period.
    left: bool,
    /// Of the decision that follows, if it is a law.
    age: u16,
    /// What the last command delivers \[GW\].
    delivered: Interval,
}

impl Loop<'_> {
    /// The one decided state of a node.
    pub(super) fn carried_out(&self, key: &Key, ahead: &Ahead) -> Expanded {
        let mut failures = Failures::default();
        let decided = self.carry_out(key, ahead, &mut failures);
        match decided.failure {
            Some(Failure::Containment) => failures.containment += 1,
            Some(Failure::Uncovered) => failures.uncovered += 1,
            Some(Failure::Late) => failures.late += 1,
            Some(Failure::Left) => failures.left += 1,
            None => {}
        }
        Expanded {
            decided: vec![decided],
            failures,
        }
    }

    fn carry_out(&self, key: &Key, ahead: &Ahead, failures: &mut Failures) -> Decided {
        let failed = |why| Decided {
            branches: vec![(1.0, Ends::Failed)],
            ticks_below: 0,
            failure: Some(why),
        };
        let ball = self.cover.ball(key.cell, key.left);
        let bins = self.bins.get(usize::from(key.level));
        let known = ahead.knows(&self.regions.magnitude(&ball));
        let Some(bins) = bins.filter(|_| key.phase != Phase::Fallback && known) else {
            return failed(Failure::Uncovered);
        };
        // I2 is reached when the command that finds it reached begins to act. A law decides for a
        // period: that is after it at the earliest.
        let ran = key.age.max(1);
        let until = match key.phase {
            Phase::Fixed | Phase::Hold if key.age == 0 => 0,
            Phase::Fixed | Phase::Hold => u32::from(key.age) + ahead.ticks,
            _ => u32::from(ran) + self.ticks + ahead.ticks,
        };
        if until > self.settle_ticks {
            return failed(Failure::Late);
        }
        let hull = bins.iter().map(|bin| bin.delivered).reduce(Interval::join);
        let hull = hull.unwrap_or(Interval::ZERO);
        let all = self.net(hull);
        let (range, beside) = self.frequencies(&ball, key, ahead, hull);
        if range.low < self.containment {
            return failed(Failure::Containment);
        }
        if key.phase == Phase::Hold
            && (range.low < ahead.inner.low || range.high > ahead.inner.high)
        {
            return failed(Failure::Left);
        }
        let ticks_below = if range.low < BELOW_HZ {
            let limit = (BELOW_HZ - beside.low).next_up();
            self.flights.ticks_below(&ball, all, self.ticks, limit)
        } else {
            0
        };
        let branches = match key.phase {
            Phase::Fixed => self.fixed_ahead(&ball, key, bins, (ahead, failures)),
            _ => self.period_ahead(&ball, key, bins, (ahead, failures)),
        };
        Decided {
            branches,
            ticks_below,
            failure: None,
        }
    }

    /// The frequencies of a node's period under any draw of these deliveries, and what a changeover
    /// adds to f at most.
    ///
    /// The varying mixture of old and new is the new one and an impulse. It is also a power that
    /// moves within the hull of both, which says more in the first ticks: little has come of it
    /// yet. Where f's answer to an impulse is not negative, a power that moves within an interval
    /// moves f no farther than one that is held anywhere in it.
    pub(super) fn frequencies(
        &self,
        ball: &Ball,
        key: &Key,
        ahead: &Ahead,
        hull: Interval,
    ) -> (Interval, Interval) {
        let all = self.net(hull);
        let delivered = self.fleet * hull;
        let (Some(changeover), Some(impulse)) =
            (&ahead.changeover, self.impulse(key, ahead, delivered))
        else {
            let range = self.flights.range(ball, all, 0..self.ticks);
            return (range, Interval::ZERO);
        };
        let old = key.before.map_or(delivered, |before| self.power(before));
        let mixed = NetPower {
            range: delivered.join(old) - Interval::point(self.loss.mid()),
            moving: all.moving,
        };
        let beside = changeover.to_f(impulse);
        let first = changeover.first_ticks().min(self.ticks);
        let mut range: Option<Interval> = None;
        if first > 0 {
            range = Some(self.flights.range(ball, mixed, 0..first));
        }
        if first < self.ticks {
            let after = self.flights.range(ball, all, first..self.ticks) + beside;
            range = Some(range.map_or(after, |range| range.join(after)));
        }
        (range.unwrap_or(Interval::ZERO), beside)
    }

    /// The impulse of a changeover, if the node begins with one.
    pub(super) fn impulse(
        &self,
        key: &Key,
        ahead: &Ahead,
        delivered: Interval,
    ) -> Option<Interval> {
        let changeover = ahead.changeover.as_ref()?;
        // Fixed keeps the draw before for its own end: nothing changes over.
        let before = key.before.filter(|_| key.phase != Phase::Fixed)?;
        Some(changeover.impulse(self.power(before), delivered))
    }

    /// A period of a law, or of Hold.
    pub(super) fn period_ahead(
        &self,
        ball: &Ball,
        key: &Key,
        bins: &[Bin],
        (ahead, failures): (&Ahead, &mut Failures),
    ) -> Branches {
        let free = self.flights.free(&ball.centre, self.ticks);
        let mut out = Branches::new();
        for bin in bins {
            let net = self.net(bin.delivered);
            let after = self.flights.after(free, &ball.radius, net, self.ticks);
            let end = End {
                state: key.state(),
                left: false,
                age: self.age_after(key),
                delivered: self.fleet * bin.delivered,
            };
            let beside = self.beside(key.level, bin.delivered);
            let mut keys = Vec::new();
            let mut follow = |set: &Ball| {
                let seen = ahead.decided_on(&self.flights, set, beside);
                let cell = self.cover.cell(set, end.left);
                self.decisions(cell, &seen, end, (ahead, &mut *failures), &mut keys)
            };
            let fits = match (&ahead.changeover, self.impulse(key, ahead, end.delivered)) {
                (Some(changeover), Some(impulse)) => changeover.pieces(impulse).all(|by| {
                    let at = std::array::from_fn(|i| Interval::point(after.centre[i]) + by[i]);
                    follow(&self.flights.pushed(&after, &at))
                }),
                _ => follow(&after),
            };
            let ends = if fits { Ends::In(keys) } else { Ends::Failed };
            push(&mut out, bin.probability, ends);
        }
        out
    }

    /// Fixed: until f, as it is predicted, leaves I2, at most a period.
    pub(super) fn fixed_ahead(
        &self,
        ball: &Ball,
        key: &Key,
        bins: &[Bin],
        (ahead, failures): (&Ahead, &mut Failures),
    ) -> Branches {
        let free: Vec<_> = (0..=self.ticks)
            .map(|t| self.flights.free(&ball.centre, t))
            .collect();
        let before = key.before.map(|before| self.power(before));
        let mut out = Branches::new();
        for bin in bins {
            let net = self.net(bin.delivered);
            let own = self.beside(key.level, bin.delivered);
            // A window that begins before this draw acts holds some of the one before.
            let both = before.map_or(own, |power| NetPower {
                range: own.range.join(power - self.commanded(key.level)),
                ..own
            });
            let (mut keys, mut fits) = (Vec::new(), true);
            for tick in 1..=self.ticks {
                let free = free[tick as usize];
                let after = self.flights.after(free, &ball.radius, net, tick);
                let beside = if tick < ahead.ticks { both } else { own };
                let seen = ahead.decided_on(&self.flights, &after, beside);
                let inside = ahead.regions.inside(&seen);
                // At the period's end all of the set is asked about: there is a new draw.
                let ends = tick == self.ticks && inside.may;
                if ends || inside.may_not {
                    let end = End {
                        state: key.state(),
                        left: !ends,
                        age: 0,
                        delivered: self.fleet * bin.delivered,
                    };
                    let cell = self.cover.cell(&after, end.left);
                    fits &= self.decisions(cell, &seen, end, (ahead, &mut *failures), &mut keys);
                }
                if !inside.may {
                    break;
                }
            }
            let ends = if fits { Ends::In(keys) } else { Ends::Failed };
            push(&mut out, bin.probability, ends);
        }
        out
    }

    /// Adds what may be decided on the states `seen` while the command begins to act in the set of
    /// a cell; none where the set fits no cell. False where that fails for certain.
    fn decisions(
        &self,
        cell: Option<[i32; STATES]>,
        seen: &Ball,
        end: End,
        (ahead, failures): (&Ahead, &mut Failures),
        keys: &mut Vec<Key>,
    ) -> bool {
        let Some(cell) = cell else {
            failures.not_fitting += 1;
            return false;
        };
        let first = end.state.phase == Phase::NoControl && ahead.ticks > 0;
        // What was measured lies below I1; where, does not matter.
        let mut below = State::default();
        below.0[AXIS_F] = self.table.header().outer.low_uhz.saturating_sub(1);
        let mut kept = true;
        ahead.regions.each_region(seen, &mut |state| {
            let (next, decision) = if first {
                end.state.step_ahead(self.table, below, || state)
            } else {
                end.state.step(self.table, state)
            };
            // The band was left: a part of the set that is still inside is followed elsewhere.
            if end.left && next == end.state {
                return;
            }
            kept &= end.state.phase != Phase::Hold || next.phase == Phase::Hold;
            let key = self.key(next, decision, end, cell, ahead);
            if !keys.contains(&key) {
                keys.push(key);
            }
        });
        if !kept {
            failures.left += 1;
        }
        kept
    }

    /// The node of a decision.
    fn key(
        &self,
        next: PhaseState,
        decision: Decision,
        end: End,
        cell: [i32; STATES],
        ahead: &Ahead,
    ) -> Key {
        let nowhere = decision == Decision::Outside;
        let phase = match next.phase {
            // They decide alike.
            Phase::C2 => Phase::C1,
            phase => phase,
        };
        let counts = match phase {
            Phase::Fixed => ahead.ticks > 0,
            Phase::Fallback => false,
            _ => ahead.changeover.is_some() && next.level != end.state.level,
        };
        Key {
            phase,
            level: if nowhere { 0 } else { next.level },
            left: end.left,
            age: if nowhere { 0 } else { end.age },
            cell,
            before: counts.then(|| self.bins_of(end.delivered)),
        }
    }

    /// Age of the decision after a period, where it is a law or ends an excursion.
    fn age_after(&self, key: &Key) -> u16 {
        let law = matches!(key.phase, Phase::C1 | Phase::C2);
        if self.ages && law {
            key.age.max(1) + self.ticks as u16
        } else {
            0
        }
    }

    /// From a set at the trigger to the first decision. `below` is the ticks before it in which f
    /// may be below [`BELOW_HZ`].
    pub(super) fn first_decision(
        &self,
        trigger: &Ball,
        net: NetPower,
        below: u32,
        ahead: &Ahead,
        out: &mut Start,
    ) -> Result<(), ClosedLoopError> {
        let lowest = self.flights.lowest(trigger, net, ahead.ticks);
        if !ahead.reaches(&self.regions.magnitude(trigger)) || lowest < self.containment {
            out.ends.push(Ends::Failed);
            return Ok(());
        }
        let ticks = self
            .flights
            .ticks_below(trigger, net, ahead.ticks, BELOW_HZ);
        out.ticks_below = out.ticks_below.max(below + ticks);
        let free = self.flights.free(&trigger.centre, ahead.ticks);
        let set = self.flights.after(free, &trigger.radius, net, ahead.ticks);
        let nothing = NetPower {
            range: Interval::ZERO,
            moving: net.moving,
        };
        let end = End {
            state: PhaseState::INITIAL,
            left: true,
            age: 0,
            delivered: Interval::ZERO,
        };
        let (mut keys, mut failures) = (Vec::new(), Failures::default());
        let cells = self.cover.cells(&set, true, FIRST_CELLS_MAX);
        let cells = cells.ok_or_else(ClosedLoopError::too_wide)?;
        let alone = cells.len() == 1;
        for cell in cells {
            // A set that is one cell's is smaller than all of the cell.
            let of_cell = self.cover.ball(cell, true);
            let set = if alone { &set } else { &of_cell };
            let seen = ahead.decided_on(&self.flights, set, nothing);
            self.decisions(Some(cell), &seen, end, (ahead, &mut failures), &mut keys);
        }
        let ends = Ends::In(keys);
        if !out.ends.contains(&ends) {
            out.ends.push(ends);
        }
        Ok(())
    }
}
