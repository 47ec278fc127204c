//! One node: what the firmware may decide on its set, and where each bin of the draw may end.

use firmware::phase::{Decision, Phase, PhaseState};
use model::interval::Interval;

use super::{BELOW_HZ, Branches, Decided, Ends, Expanded, Failure, Failures, Key, Loop};
use crate::flight::Ball;
use crate::participation::Bin;

impl Loop<'_> {
    /// The decided states of a node.
    pub(super) fn expand(&self, key: &Key) -> Expanded {
        if let Some(ahead) = &self.ahead {
            return self.carried_out(key, ahead);
        }
        let ball = self.cover.ball(key.cell, key.left);
        let state = key.state();
        let mut out = Expanded {
            decided: Vec::new(),
            failures: Failures::default(),
        };
        for (next, decision) in self.regions.outcomes(self.table, state, &ball) {
            // The band was left: a part of the set that is still inside is followed elsewhere.
            if key.left && next == state {
                continue;
            }
            let decided = self.decided(key, &ball, next, decision);
            match decided.failure {
                Some(Failure::Containment) => out.failures.containment += 1,
                Some(Failure::Uncovered) => out.failures.uncovered += 1,
                Some(Failure::Late) => out.failures.late += 1,
                Some(Failure::Left) => out.failures.left += 1,
                None => {
                    let fits = |(_, ends): &&(f64, Ends)| *ends == Ends::Failed;
                    out.failures.not_fitting += decided.branches.iter().filter(fits).count();
                }
            }
            out.decided.push(decided);
        }
        out
    }

    /// One decided state of a node.
    pub(super) fn decided(
        &self,
        key: &Key,
        ball: &Ball,
        next: PhaseState,
        decision: Decision,
    ) -> Decided {
        let failed = |why| Decided {
            branches: vec![(1.0, Ends::Failed)],
            ticks_below: 0,
            failure: Some(why),
        };
        let Decision::Level(level) = decision else {
            return failed(Failure::Uncovered);
        };
        let Some(bins) = self.bins.get(usize::from(level)) else {
            return failed(Failure::Uncovered);
        };
        // A law decides for a period: I2 is found reached after it at the earliest.
        let ran = key.age.max(1);
        let until = match next.phase {
            Phase::Fixed => u32::from(key.age),
            _ => u32::from(ran) + self.ticks,
        };
        if until > self.settle_ticks {
            return failed(Failure::Late);
        }
        let hull = bins.iter().map(|bin| bin.delivered).reduce(Interval::join);
        let all = self.net(hull.unwrap_or(Interval::ZERO));
        let lowest = self.flights.lowest(ball, all, self.ticks);
        if lowest < self.containment {
            return failed(Failure::Containment);
        }
        let ticks_below = if lowest < BELOW_HZ {
            self.flights.ticks_below(ball, all, self.ticks, BELOW_HZ)
        } else {
            0
        };
        let branches = match next.phase {
            Phase::Fixed => self.fixed(ball, level, bins),
            _ => {
                // Within a horizon of `settle_within_s` nothing can be late: no age is kept.
                let age = if self.ages {
                    ran + self.ticks as u16
                } else {
                    0
                };
                self.period(ball, (level, age), bins)
            }
        };
        Decided {
            branches,
            ticks_below,
            failure: None,
        }
    }

    /// A period of a law.
    pub(super) fn period(&self, ball: &Ball, (level, age): (u8, u16), bins: &[Bin]) -> Branches {
        let free = self.flights.free(&ball.centre, self.ticks);
        let mut out = Branches::new();
        for bin in bins {
            let net = self.net(bin.delivered);
            let after = self.flights.after(free, &ball.radius, net, self.ticks);
            let ends = match self.cover.cell(&after, false) {
                Some(cell) => {
                    // C1 and C2 decide alike, and the held level counts only where Fixed may begin.
                    let held = self.regions.inside(&self.cover.ball(cell, false)).may;
                    let level = if held { level } else { 0 };
                    Ends::In(vec![Key {
                        phase: Phase::C1,
                        level,
                        left: false,
                        age,
                        cell,
                        before: None,
                    }])
                }
                None => Ends::Failed,
            };
            push(&mut out, bin.probability, ends);
        }
        out
    }

    /// Fixed: until f leaves I2, at most a period.
    pub(super) fn fixed(&self, ball: &Ball, level: u8, bins: &[Bin]) -> Branches {
        let free: Vec<_> = (0..=self.ticks)
            .map(|t| self.flights.free(&ball.centre, t))
            .collect();
        let mut out = Branches::new();
        let key = |left, cell| Key {
            phase: Phase::Fixed,
            level,
            left,
            age: 0,
            cell,
            before: None,
        };
        for bin in bins {
            let net = self.net(bin.delivered);
            let (mut keys, mut fits) = (Vec::new(), true);
            for tick in 1..=self.ticks {
                let free = free[tick as usize];
                let after = self.flights.after(free, &ball.radius, net, tick);
                let inside = self.regions.inside(&after);
                if tick == self.ticks && inside.may {
                    // A new draw; the phase machine is asked about all of the set.
                    match self.cover.cell(&after, false) {
                        Some(cell) => keys.push(key(false, cell)),
                        None => fits = false,
                    }
                } else if inside.may_not {
                    match self.cover.cell(&after, true) {
                        Some(cell) => keys.push(key(true, cell)),
                        None => fits = false,
                    }
                }
                if !inside.may {
                    break;
                }
            }
            push(
                &mut out,
                bin.probability,
                if fits { Ends::In(keys) } else { Ends::Failed },
            );
        }
        out
    }
}

/// Adds a branch; one that ends as the last does is added to it, rounded down.
pub(super) fn push(out: &mut Branches, probability: f64, ends: Ends) {
    match out.last_mut() {
        Some((sum, last)) if *last == ends => {
            let whole = *sum + probability;
            // The one bin of a certain draw stays certain.
            *sum = if probability == 0.0 {
                *sum
            } else {
                whole.next_down().max(0.0)
            };
        }
        _ => out.push((probability, ends)),
    }
}
