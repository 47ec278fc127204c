//! A delay that is a range: while the chargers change over from one command to the next.
//!
//! A command decided at t acts on each charger from t + d on, d anywhere in `[a, b]`, each charger
//! its own, changing as it likes. At a time s a charger so follows one of the commands decided in
//! [s - b, s - a], and the fleet's mean lies in the convex hull of theirs. Commands change at
//! decisions only, which are a period τ or more apart. Let **b <= τ**. Then
//!
//! - the window [s - b, s - a] holds one change at most: the hull is that of two commands, u⁻ and
//!   the new u, for s in [t + a, t + b); before it is u⁻, after it u;
//! - at the next decision, at t + τ or later, every charger follows u.
//!
//! **The device predicts over a, the least.** In [t, t + a) all follow u⁻, which it knows, so the
//! prediction errs by what it errs with a fixed delay of a ([`crate::delay`]): its bound E' has no
//! part of the range in it. With any later nominal moment it would have one.
//!
//! **The successor** so is that of a fixed delay of a, but for the first w = b - a of the time
//! under the new command: there the net power is not in the interval V_u of its level but in the
//! hull of V_u and V_u⁻. In the integral of [`crate::delay`] (2) these are the σ in [τ - w, τ], for
//! σ = τ is the moment t + a. The game's state holds no u⁻, so all levels count:
//!
//! ```text
//! x(t+a) -> Φ_τ cell + ∫ exp(A σ) b v dσ over [0, τ],    v in V_u, but for σ in [τ - w, τ] in V
//! V = hull of V_0 .. V_n
//! ```
//!
//! V is not symmetric about V_u: the middle of the box moves, too.
//!
//! **Between the samples** the period begins with the same w ([`crate::abstraction::tube`]).

use model::flow::{Flow, Matrix, Vector, absolute_integral_between};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

use crate::abstraction::affine::Drift;

/// The first part of a period, in which some chargers still follow the command before.
#[derive(Debug, Clone, PartialEq)]
pub struct Changeover {
    /// w: its length \[s\], above 0.
    pub length_s: f64,
    /// τ - w: what is left of the period \[s\].
    pub rest_s: f64,
    /// Net power within it, whatever the two commands are.
    pub drive: Interval,
}

impl Changeover {
    /// The changeover of a spec whose levels have these net powers; none where the delay is known.
    pub fn of(spec: &Spec, levels: impl IntoIterator<Item = Interval>) -> Option<Self> {
        let length_ms = spec.uncertainty.actuation_delay_s.span_ms();
        let drive = levels.into_iter().reduce(Interval::join)?;
        // The spec allows a period at most.
        let period_ms = spec.sampling.period_ms();
        let length_ms = length_ms.min(period_ms);
        (length_ms > 0).then(|| Self {
            length_s: f64::from(length_ms) / 1000.0,
            rest_s: f64::from(period_ms - length_ms) / 1000.0,
            drive,
        })
    }

    /// What a level adds over a period where commands begin to act at once: its net power is in
    /// `level` but for the changeover.
    pub fn drift(
        &self,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        period_s: f64,
        level: Interval,
    ) -> Drift<STATES> {
        let flow = Flow::over(a, b, period_s);
        let rest = absolute_integral_between(a, b, (0.0, self.rest_s));
        let radius = rest.map(|rest| (rest * level.radius()).next_up());
        let centre = flow.gamma.map(|gamma| gamma * Interval::point(level.mid()));
        let mut drift = Drift { centre, radius };
        self.add_to(&mut drift, (a, b), period_s, level);
        drift
    }

    /// Adds what the changeover does to what a level adds over a period: to a centre that counts
    /// the middle of `level` over the changeover too, and to a radius that leaves it out.
    pub fn add_to(
        &self,
        drift: &mut Drift<STATES>,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        period_s: f64,
        level: Interval,
    ) {
        let (whole, rest) = (
            Flow::over(a, b, period_s).gamma,
            Flow::over(a, b, self.rest_s).gamma,
        );
        let varied = absolute_integral_between(a, b, (self.rest_s, period_s));
        let moved = Interval::point(self.drive.mid()) - Interval::point(level.mid());
        for d in 0..STATES {
            drift.centre[d] = drift.centre[d] + (whole[d] - rest[d]) * moved;
            let varied = (varied[d] * self.drive.radius()).next_up();
            drift.radius[d] = (drift.radius[d] + varied).next_up();
        }
    }
}
