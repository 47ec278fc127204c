//! A delay that is a range: the time in which chargers change over to a new command.
//!
//! A charger's power at s is what was commanded at s - d, and d is anywhere in `[a, b]`: another
//! for each charger, and changing. So the mean of the fleet at s is a mean of commands that were
//! given in [s - b, s - a]. Let two changes of the command be at least a period τ apart (they are:
//! C1, C2 and Hold decide once a period, and No control and Fixed only ever change it by handing
//! over to one of these, a tick or more after the last period's end), and let b <= τ.
//!
//! - Take the change of the moment t, from u⁻ to u. A mean over [s - b, s - a] with s < t + a knows
//!   nothing of it, one with s >= t + b knows nothing of u⁻. Between, no other change is in the
//!   window, for b - a <= τ. So in [t + a, t + b) the fleet gives a mean of u⁻ and u, and the net
//!   power lies in the hull of the two levels' intervals. From t + b on it is under u alone.
//!   (The intervals bound the whole fleet under one command. They bound a mixture if no charger
//!   gives less under a larger command than under a smaller one: the mixture then lies between what
//!   the fleet would give under u⁻ alone and under u alone. This is assumed of the chargers.)
//! - The next decision comes at t + τ >= t + b. What acts from there until its command can act is
//!   u, for all chargers: what the device predicts with the least delay a is as exact as with a
//!   fixed delay of a. [`super::delayed_loop`] derives that error, and holds for δ = a.
//!
//! The sets of states are those at t + a, where the command of t begins to act. So a period begins
//! with b - a seconds under the hull and goes on with the rest under u. Where the levels are known
//! (tight sets carry the level that was in force) the hull is that of the two; where a cell alone
//! is known, it is that of all levels of the table. If u = u⁻ nothing changes over.

use model::flow::{Flow, Matrix, Vector, absolute_integral_between};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

use super::drive::Drive;
use super::estimate_error::{PeriodEffect, up};
use super::held_input::{HeldInput, Linear};
use super::zonotope::Zonotope;

/// How a period begins after a change of the command.
#[derive(Debug, Clone)]
pub(crate) struct Changeover {
    /// b - a.
    during: HeldInput,
    /// What is left of the period; none if nothing is.
    after: Option<HeldInput>,
    /// The times at which the two end, counted back from the period's end \[s\].
    back_s: (f64, f64),
    /// Net power under any level of the table.
    pub(crate) any: Drive,
}

impl Changeover {
    /// The changeover of a spec in periods of so many milliseconds, between levels of these net
    /// powers; `None` where the delay is known.
    ///
    /// # Errors
    /// A range that this derivation does not cover, in words.
    pub(crate) fn new(
        spec: &Spec,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        period_ms: u32,
        levels: &[Drive],
    ) -> Result<Option<Self>, String> {
        let delay = spec.uncertainty.actuation_delay_s;
        let Some(any) = levels
            .iter()
            .map(|level| level.range())
            .reduce(Interval::join)
        else {
            return Ok(None);
        };
        if delay.exact_s().is_some() {
            return Ok(None);
        }
        // Rounded up, each of them: a longer changeover holds a shorter one.
        let most_ms = (delay.most_s() * 1e3 - 1e-6).ceil();
        let length_ms = delay.span_ms();
        let rest_ms = period_ms.checked_sub(length_ms);
        let Some(rest_ms) = rest_ms.filter(|_| most_ms <= f64::from(period_ms)) else {
            return Err(format!(
                "not examined: a command may act {} s after the tick at which it was decided, and \
                 the next may be decided after a period of {} s",
                delay.most_s(),
                f64::from(period_ms) / 1e3
            ));
        };
        let (length_s, rest_s) = (f64::from(length_ms) / 1e3, f64::from(rest_ms) / 1e3);
        Ok(Some(Self {
            during: HeldInput::new(a, b, length_s),
            after: (rest_ms > 0).then(|| HeldInput::new(a, b, rest_s)),
            back_s: (f64::from(period_ms) / 1e3, rest_s),
            any: Drive::of(any),
        }))
    }

    /// A set a period after a command began to change over, and the frequencies until then
    /// \[µHz\]. `mixed` is the net power of the old and the new command, `new` of the new one.
    pub(super) fn period(&self, set: &Zonotope, mixed: Drive, new: Drive) -> (Interval, Zonotope) {
        let range = self.during.frequency(set, mixed);
        let set = set.after(&self.during, mixed);
        match &self.after {
            None => (range, set),
            Some(after) => {
                let range = range.join(after.frequency(&set, new));
                (range, set.after(after, new))
            }
        }
    }

    /// The frequencies of such a period from a box \[µHz\], whatever the old command was.
    pub(super) fn frequency(&self, from: &[Interval; STATES], new: Drive) -> Interval {
        let range = self.during.frequency(from, self.any);
        let Some(after) = &self.after else {
            return range;
        };
        let flow = &self.during.flow;
        let mid = Interval::point(self.any.mid);
        let at = std::array::from_fn(|d| {
            let varied = Interval::point(up(self.during.absolute[d] * self.any.radius));
            from.range(&flow.phi[d]) + flow.gamma[d] * mid + varied.symmetric()
        });
        range.join(after.frequency(&at, new))
    }

    /// Replaces, in what a level adds over a period to the state that is decided on, its own net
    /// power by any level's for the time of the changeover: the last of it, counted back from the
    /// period's end. `any` is that of any level beside what the effect's centre counts all the
    /// same, and `own_mid` the level's own middle beside it, which the centre holds; its radius
    /// holds nothing for that time.
    pub(super) fn replace(
        &self,
        effect: &mut PeriodEffect,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        (own_mid, any): (f64, Interval),
    ) {
        let (period_s, rest_s) = self.back_s;
        let (all, rest) = (Flow::over(a, b, period_s), Flow::over(a, b, rest_s));
        let varied = absolute_integral_between(a, b, (rest_s, period_s));
        let moved = Interval::point(any.mid()) - Interval::point(own_mid);
        for d in 0..STATES {
            effect.centre[d] = effect.centre[d] + (all.gamma[d] - rest.gamma[d]) * moved;
            effect.radius[d] = up(effect.radius[d] + up(varied[d] * any.radius()));
        }
    }

    /// Until when a level's own net power is certain, counted back from the period's end \[s\].
    pub(super) const fn rest_s(&self) -> f64 {
        self.back_s.1
    }
}

/// The net power of a mean of two commands.
pub(super) fn mixed(old: Drive, new: Drive) -> Drive {
    Drive::of(old.range().join(new.range()))
}
