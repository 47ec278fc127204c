//! What the device decides on where it predicts, and what is claimed of Hold.
//!
//! # Late commands
//! A command of the tick t begins to act at t + δ. The sets of the chain are those of the real
//! states *there*, y(t) = x(t + δ): from y(t) on the grid flies under the new command alone (after
//! its changeover, if there is one), and the next decision's y is at the end of that flight. So
//! late commands change nothing in how sets fly.
//!
//! They change what is decided on. The device predicts ξ(t) from its estimate at t and from the
//! commands under way. In [t, t + δ) the fleet gives d(s) beside what was commanded, and the loss
//! is off its middle by w(s); in `verify`'s words
//!
//! ```text
//! ξ(t) = y(t) - ∫ exp(A (t + δ - s)) b (d(s) - w(s)) ds + error
//! ```
//!
//! with the error of [`verify::prediction_error`], for estimates that are not too large. δ is at
//! most a period, so all of [t, t + δ) is under *one* draw, the one before: its bin bounds d. In
//! Fixed the phase is examined every tick, and the window may begin under one draw and end under
//! the next: d is then in the hull of both.
//!
//! What the device decides is therefore asked where a branch ends: there the set and the bin are
//! known, and no pending command needs to be kept. The nodes of such a chain hold the decision that
//! was made, the sets of a branch all the decisions that its end allows.
//!
//! # The estimate is not too large
//! At the trigger the real state must be within the reach of the prediction. Every later estimate
//! is made on a flight of the step before (δ is at most a period), on which the state is bounded by
//! the largest entries of exp(A s) and by all that a fleet between nothing and everything adds.

use firmware::table::TableView;
use firmware::units::{MICRO, STATES};
use model::flow::{Matrix, Vector, absolute_integral, largest};
use model::interval::Interval;
use model::spec::Spec;
use verify::{PredictionError, prediction_error};

use super::changeover::Changeover;
use super::error::ClosedLoopError;
use crate::decisions::Regions;
use crate::flight::{Ball, Flights, NetPower};
use crate::modes::Modes;

/// What the device decides on, and Hold.
pub(super) struct Ahead {
    /// δ \[ticks\].
    pub(super) ticks: u32,
    /// The states that are decided on.
    pub(super) regions: Regions,
    /// What a change of the command does, where the delay is a range.
    pub(super) changeover: Option<Changeover>,
    /// I2 \[Hz\]: what Hold keeps to.
    pub(super) inner: Interval,
    known: PredictionError,
    error: [f64; STATES],
    grown: [[f64; STATES]; STATES],
    /// Most that the net power adds within a period \[micro-units\].
    driven: [f64; STATES],
}

impl Ahead {
    /// For a table with Hold, or whose commands act late; nothing for others.
    pub(super) fn new(
        table: &TableView<'_>,
        spec: &Spec,
        modes: &Modes,
        (a, b): (&Matrix<STATES>, &Vector<STATES>),
        bin_gw: f64,
    ) -> Result<Option<Self>, ClosedLoopError> {
        let header = table.header();
        let delay = spec.uncertainty.actuation_delay_s;
        let late = header.delay_ticks > 0 || delay.most_s() > 0.0;
        if !late && !header.stay {
            return Ok(None);
        }
        let known = prediction_error(table, spec).map_err(|what| ClosedLoopError::Unsupported {
            what,
            remedy: "a table made for the spec's delay, at most a period, is",
        })?;
        // Milliseconds first: the period is then one correctly rounded quotient.
        let period_ms = u32::from(header.tick_ms) * u32::from(header.period_ticks);
        let period_s = f64::from(period_ms) / 1000.0;
        let tick_s = f64::from(header.tick_ms) / 1000.0;
        let changeover = (delay.span_ms() > 0)
            .then(|| Changeover::new(modes, (a, b), delay.span_ms(), [tick_s, period_s], bin_gw));
        let fleet = Interval::hull(0.0, spec.fleet_power_gw().next_up());
        let loss = Interval::hull(spec.uncertainty.loss_gw[0], spec.uncertainty.loss_gw[1]);
        let power = (fleet - loss).magnitude();
        let micro = f64::from(MICRO);
        let error = spec.uncertainty.measurement.map(|e| (e * micro).next_up());
        let [low, high] = spec.requirements.inner_hz;
        Ok(Some(Self {
            ticks: u32::from(header.delay_ticks),
            regions: Regions::new(table, modes, known.error),
            changeover,
            inner: Interval::hull(low, high),
            known,
            error,
            grown: largest(a, period_s),
            driven: absolute_integral(a, b, period_s)
                .map(|by| ((by * power).next_up() * micro).next_up()),
        }))
    }

    /// The states that are decided on, from the set in which the command begins to act. `beside` is
    /// what was delivered until then beside what was commanded.
    pub(super) fn decided_on(&self, flights: &Flights, set: &Ball, beside: NetPower) -> Ball {
        flights.without(set, beside, self.ticks)
    }

    /// Whether the prediction's error is known at the trigger, by the largest magnitudes there.
    pub(super) fn reaches(&self, magnitude: &[f64; STATES]) -> bool {
        magnitude
            .iter()
            .zip(&self.known.reach)
            .all(|(at, most)| at <= most)
    }

    /// Whether it is known for every estimate of a period, by the largest magnitudes at its
    /// beginning.
    pub(super) fn knows(&self, magnitude: &[f64; STATES]) -> bool {
        (0..STATES).all(|d| {
            // One more for the floor of the stored state.
            let mut sum = ((self.driven[d] + self.error[d]).next_up() + 1.0).next_up();
            for (grown, from) in self.grown[d].iter().zip(magnitude) {
                sum = (sum + (grown * from).next_up()).next_up();
            }
            sum <= self.known.estimates[d]
        })
    }
}

#[cfg(test)]
mod tests;
