//! Commands that act with a delay: what the games know, and the coefficients with which the device
//! predicts.
//!
//! A command decided at t acts over [t + δ, t + δ + τ), τ the period. The device decides on a
//! prediction ([`firmware::prediction`]); the games are played in its coordinate,
//!
//! ```text
//! ξ(t) = Φ_δ x̂(t) + Σ_j G_j u(t - j tick) + Γ_δ (-w₀) + r
//! x̂ = x + ε,  |ε| <= e,  w₀ the middle of the loss band
//! ```
//!
//! with r the error of the coefficients, |r| <= ρ. Write the net power as P u - w₀ + d: what it is
//! under the commands, and a deviation d that an adversary varies (loss within its band, delivered
//! participation). Then, with b the direction of the drive,
//!
//! ```text
//! x(t+δ) = ξ(t) - Φ_δ ε - r + ∫ exp(A (t+δ-s)) b d(s) ds        over [t, t+δ]        (1)
//! ```
//!
//! and, as x(t+τ+δ) = Φ_τ x(t+δ) + Γ_τ (P u - w₀) + ∫ exp(A (t+τ+δ-s)) b d(s) ds over [t+δ, t+τ+δ],
//! (1) at t and at t+τ give
//!
//! ```text
//! ξ(t+τ) = Φ_τ ξ(t) + Γ_τ (P u - w₀) - Φ_{τ+δ} ε - Φ_τ r + Φ_δ ε' + r'
//!          + ∫ exp(A σ) b d(t+τ+δ-σ) dσ        over [δ, τ+δ]        (2)
//! ```
//!
//! for what d does in [t+τ, t+τ+δ] enters x(t+τ+δ) and ξ(t+τ) is predicted without it: it cancels.
//! So the successor's box is
//!
//! ```text
//! Φ_τ cell + Γ_τ (P u - w₀)
//!     ±  ( |Φ_{τ+δ}| e + |Φ_δ| e + (|Φ_τ| + 1) ρ + ∫ |exp(A σ) b| |d| dσ over [δ, τ+δ] )
//! ```
//!
//! In the integral, σ in [δ, τ] (if δ < τ) is the time under u itself, whose d is known to lie in
//! the interval of that level; the rest, as long as min(δ, τ), is under commands decided before,
//! which the game does not know: there |d| is the largest over all levels. With δ = 0 this is the
//! games' box without a delay.
//!
//! By (1) the real state in which a command begins to act lies within
//!
//! ```text
//! E' = |Φ_δ| e + ∫ |exp(A σ) b| |d| dσ over [0, δ] + ρ
//! ```
//!
//! of ξ, whatever is under way. Where the delay is a range, δ is its least, and the time under u
//! begins with a changeover ([`crate::changeover`]). Targets shrink and containment rises by E' of
//! f, as they do by e without a delay; the guard between the samples widens the cell by E'.

use firmware::prediction::{MEASURED_MAX, PHI_FRACTION_BITS, RESPONSE_FRACTION_BITS};

use crate::abstraction::affine::{Drift, Errors};
use crate::changeover::Changeover;
use crate::drives::{expected_power, measurement_micro, net_power};
use model::flow::{
    Flow, Matrix, Vector, absolute_integral, absolute_integral_between, apply, largest,
};
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;

/// Room for ρ, and for states at the trigger outside the grid, in the bound of the states on which
/// ρ rests \[micro-units\].
const ROOM: f64 = 1e6;

/// The device's coefficients, as the table stores them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Coefficients {
    /// Φ_δ with [`PHI_FRACTION_BITS`] fractional bits.
    pub phi: [[i32; STATES]; STATES],
    /// Γ_δ (-w₀) \[micro-units\].
    pub loss: [i32; STATES],
    /// G_1 .. G_n a level, with [`RESPONSE_FRACTION_BITS`] fractional bits of a micro-unit.
    pub levels: Vec<[i32; STATES]>,
}

impl Coefficients {
    /// The bytes of the table's prediction part.
    pub fn bytes(&self) -> Vec<u8> {
        let words = self
            .phi
            .iter()
            .flatten()
            .chain(&self.loss)
            .chain(self.levels.iter().flatten());
        words.flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// The delay of a spec, the least of a range \[all in micro-units\].
#[derive(Debug, Clone)]
pub struct Delay {
    /// Length in ticks of `sampling.watch_s`; not 0.
    pub ticks: u32,
    /// Φ_δ and Γ_δ.
    pub flow: Flow<STATES>,
    /// What the device predicts with.
    pub coefficients: Coefficients,
    /// ρ: bound of the prediction's own error, from coefficients and integers.
    pub rounding: [f64; STATES],
    /// E': how far the real state may be from the predicted one when the command begins to act.
    pub effective: [f64; STATES],
    /// What widens the cell, and its successor.
    pub errors: Errors<STATES>,
    /// What each level adds over a period.
    pub drifts: Vec<Drift<STATES>>,
}

/// A coefficient of the prediction that the table cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "uncertainty.actuation_delay_s: the plant moves too far within the delay for the table's 32-bit coefficients (|Φ| below 128, at most 8 388 607 kW \
     or µHz a level): take a shorter delay, or finer input.step"
)]
pub struct DelayError;

/// Length of the delay over which the device predicts: the least \[ticks of `sampling.watch_s`\].
pub fn ticks(spec: &Spec) -> u32 {
    spec.sampling
        .ticks_of(spec.uncertainty.actuation_delay_s.least_s())
}

impl Delay {
    /// The delay of a spec, if it has one.
    ///
    /// # Errors
    /// Coefficients that do not fit the table.
    pub fn of(spec: &Spec) -> Result<Option<Self>, DelayError> {
        let ticks = ticks(spec);
        if ticks == 0 {
            return Ok(None);
        }
        let (a, b) = Plant::new(spec).matrices();
        // Whole milliseconds: each time is one correctly rounded quotient.
        let seconds = |ms: u32| f64::from(ms) / 1000.0;
        let watch_ms = spec.sampling.watch_ms();
        let tick = Flow::over(&a, &b, seconds(watch_ms));
        let delay_s = seconds(watch_ms * ticks);
        let period_s = seconds(spec.sampling.period_ms());
        let later_s = seconds(watch_ms * ticks + spec.sampling.period_ms());
        let flow = Flow::over(&a, &b, delay_s);
        let period = Flow::over(&a, &b, period_s);
        let both = Flow::over(&a, &b, later_s);

        let expected: Vec<Interval> = (0..spec.input.levels())
            .map(|u| expected_power(spec, u))
            .collect();
        let possible: Vec<Interval> = (0..spec.input.levels())
            .map(|u| net_power(spec, u))
            .collect();
        let under_way = expected
            .iter()
            .zip(&possible)
            .map(|(expected, possible)| (*possible - *expected).magnitude())
            .fold(0.0, f64::max);

        let (coefficients, exact) = Self::coefficients(spec, &flow, &tick, ticks)?;
        let e = measurement_micro(spec);
        let spread = absolute_integral(&a, &b, delay_s);
        let apart =
            std::array::from_fn(|d| up(times(&flow.phi[d], &e) + up(spread[d] * under_way)));
        let states = states(spec, (&a, &b), delay_s.max(period_s), &possible, &apart);
        let rounding = rounding(spec, &coefficients, &exact, &states);
        if rounding.iter().any(|rho| *rho > ROOM) {
            return Err(DelayError);
        }
        let effective = std::array::from_fn(|d| up(apart[d] + rounding[d]));

        let changeover = Changeover::of(spec, possible.iter().copied());
        let own = delay_s < period_s;
        let shared_s = delay_s.min(period_s);
        let shared = Flow::over(&a, &b, shared_s);
        // The changeover adds its own part.
        let own_until_s = changeover.as_ref().map_or(period_s, |change| change.rest_s);
        let during = absolute_integral_between(&a, &b, (delay_s, own_until_s));
        let before = absolute_integral_between(&a, &b, (delay_s.max(period_s), later_s));
        let drifts = possible.iter().zip(&expected).map(|(possible, expected)| {
            let shift = Interval::point(possible.mid()) - *expected;
            let centre = std::array::from_fn(|d| {
                period.gamma[d] * Interval::point(possible.mid()) - shared.gamma[d] * shift
            });
            let radius = std::array::from_fn(|d| {
                let during = if own {
                    up(during[d] * possible.radius())
                } else {
                    0.0
                };
                up(during + up(before[d] * under_way))
            });
            let mut drift = Drift { centre, radius };
            if let Some(changeover) = &changeover {
                changeover.add_to(&mut drift, (&a, &b), period_s, *possible);
            }
            drift
        });
        let after = std::array::from_fn(|d| {
            up(times(&both.phi[d], &e) + up(times(&flow.phi[d], &e) + rounding[d]))
        });
        Ok(Some(Self {
            ticks,
            drifts: drifts.collect(),
            errors: Errors {
                before: rounding,
                after,
            },
            flow,
            coefficients,
            rounding,
            effective,
        }))
    }

    /// What is predicted, with nothing under way, from `centre + generators radius ± spread`;
    /// `generators` are those of the prediction. Lowest and highest \[micro-units\].
    pub fn predicted(
        &self,
        centre: &Vector<STATES>,
        generators: &Matrix<STATES>,
        radius: &[f64; STATES],
        spread: &[f64; STATES],
    ) -> ([f64; STATES], [f64; STATES]) {
        let (mut low, mut high) = ([0.0; STATES], [0.0; STATES]);
        for d in 0..STATES {
            let mut middle = Interval::point(f64::from(self.coefficients.loss[d]));
            for (phi, centre) in self.flow.phi[d].iter().zip(centre) {
                middle = middle + *phi * *centre;
            }
            let reach = times(&generators[d], radius) + times(&self.flow.phi[d], spread);
            low[d] = middle.low - reach - self.rounding[d];
            high[d] = middle.high + reach + self.rounding[d];
        }
        (low, high)
    }

    /// What is predicted, with nothing under way, from estimates within `spread` of a box.
    pub fn predicted_box(
        &self,
        low: [f64; STATES],
        high: [f64; STATES],
        spread: &[f64; STATES],
    ) -> ([f64; STATES], [f64; STATES]) {
        let centre = std::array::from_fn(|d| Interval::point(0.5 * (low[d] + high[d])));
        let radius = std::array::from_fn(|d| 0.5 * (high[d] - low[d]));
        self.predicted(&centre, &self.flow.phi, &radius, spread)
    }

    /// The coefficients to the nearest, and what they stand for.
    fn coefficients(
        spec: &Spec,
        flow: &Flow<STATES>,
        tick: &Flow<STATES>,
        ticks: u32,
    ) -> Result<(Coefficients, Exact), DelayError> {
        let nearest = |value: Interval, bits: u32| {
            let scaled = (value.mid() * f64::from(1u32 << bits)).round();
            let fits = scaled.abs() < f64::from(i32::MAX);
            fits.then_some(scaled as i32).ok_or(DelayError)
        };
        let row = |row: Vector<STATES>, bits| -> Result<[i32; STATES], DelayError> {
            let mut out = [0; STATES];
            for (out, value) in out.iter_mut().zip(row) {
                *out = nearest(value, bits)?;
            }
            Ok(out)
        };
        let loss_power = expected_power(spec, 0);
        let loss = flow.gamma.map(|gamma| gamma * loss_power);
        let level_power = expected_power(spec, 1) - loss_power;
        let mut levels = Vec::with_capacity(ticks as usize);
        let mut impulse = tick.gamma.map(|gamma| gamma * level_power);
        for _ in 0..ticks {
            levels.push(impulse);
            impulse = apply(&tick.phi, &impulse);
        }
        let mut phi = [[0; STATES]; STATES];
        for (out, exact) in phi.iter_mut().zip(flow.phi) {
            *out = row(exact, PHI_FRACTION_BITS)?;
        }
        let stored = Coefficients {
            phi,
            loss: row(loss, 0)?,
            levels: levels
                .iter()
                .map(|level| row(*level, RESPONSE_FRACTION_BITS))
                .collect::<Result<_, _>>()?,
        };
        let exact = Exact {
            phi: flow.phi,
            loss,
            levels,
        };
        Ok((stored, exact))
    }
}

/// What the coefficients stand for.
struct Exact {
    phi: Matrix<STATES>,
    loss: Vector<STATES>,
    levels: Vec<Vector<STATES>>,
}

/// Bound of the estimates from which the device predicts \[micro-units\], for as long as the
/// predicted states have been in the grid: each state is at most a period after one that is within
/// E' of the grid, or at most the delay after the trigger.
fn states(
    spec: &Spec,
    (a, b): (&Matrix<STATES>, &Vector<STATES>),
    time_s: f64,
    possible: &[Interval],
    apart: &[f64; STATES],
) -> [f64; STATES] {
    let grown = largest(a, time_s);
    let driven = absolute_integral(a, b, time_s);
    let power = possible.iter().map(|v| v.magnitude()).fold(0.0, f64::max);
    let e = measurement_micro(spec);
    let (lower, width) = (spec.grid.lower_edges_micro(), spec.grid.widths_micro());
    let count = spec.grid.cell_counts();
    let grid: [f64; STATES] = std::array::from_fn(|d| {
        let low = f64::from(lower[d]);
        let high = low + f64::from(width[d]) * f64::from(count[d]);
        low.abs().max(high.abs()) + up(apart[d] + ROOM)
    });
    std::array::from_fn(|d| {
        let mut sum = up(up(driven[d] * power) + e[d]);
        for j in 0..STATES {
            sum = up(sum + up(grown[d][j] * grid[j]));
        }
        sum.min(f64::from(MEASURED_MAX))
    })
}

/// ρ: coefficients against what they stand for, and the floor of the measured state.
fn rounding(
    spec: &Spec,
    stored: &Coefficients,
    exact: &Exact,
    states: &[f64; STATES],
) -> [f64; STATES] {
    let off = |stored: i32, bits: u32, exact: Interval| {
        let value = f64::from(stored) / f64::from(1u32 << bits);
        (Interval::point(value) - exact).magnitude()
    };
    let most = spec.input.levels().saturating_sub(1) as f64;
    std::array::from_fn(|d| {
        let mut sum = off(stored.loss[d], 0, exact.loss[d]);
        for j in 0..STATES {
            sum =
                up(sum + up(off(stored.phi[d][j], PHI_FRACTION_BITS, exact.phi[d][j]) * states[j]));
            // The stored state is the floor of the estimate.
            sum =
                up(sum + f64::from(stored.phi[d][j].abs()) / f64::from(1u32 << PHI_FRACTION_BITS));
        }
        for (stored, exact) in stored.levels.iter().zip(&exact.levels) {
            sum = up(sum + up(off(stored[d], RESPONSE_FRACTION_BITS, exact[d]) * most));
        }
        sum
    })
}

/// `Σ |row_j| e_j`, rounded up.
fn times(row: &Vector<STATES>, e: &[f64; STATES]) -> f64 {
    row.iter()
        .zip(e)
        .fold(0.0, |sum, (row, e)| up(sum + up(row.magnitude() * e)))
}

fn up(value: f64) -> f64 {
    value.next_up()
}
