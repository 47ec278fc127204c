//! What the state that the device decides on says of the real one, and of the state it will decide
//! on a period later.
//!
//! Without a delay the device decides on the estimate x̂ = x + ε, |ε| <= e. Where commands act δ
//! later it decides on the prediction ξ that it computes with the table's coefficients from x̂ and
//! from the commands under way ([`firmware::prediction`]). Let w₀ be the middle of the loss band, P
//! u - w₀ the expected net power under a command u, and d the deviation of the real one from it,
//! which the adversary chooses. Then
//!
//! ```text
//! ξ(t) = Φ_δ (x(t) + ε) + (response to the expected power of the commands under way) + r, |r| <= ρ
//! x(t+δ) = Φ_δ x(t) + (the same response) + ∫ exp(A (t+δ-s)) b d(s) ds over [t, t+δ]
//! ```
//!
//! so the real state in which the command begins to act is within `|Φ_δ| e + D |∫| over [0, δ] + ρ`
//! of ξ, where |d| <= D under whatever is under way. From there it flies a period under the new
//! command; ξ(t+τ) differs from x(t+τ+δ) by the same kind of error. In the sum the deviations in
//! [t+τ, t+τ+δ] cancel, for ξ(t+τ) does not know them either; those in [t, t+τ] remain, seen
//! through exp(A σ) b with σ from δ to δ+τ: at σ < τ under the new command, whose d is known to lie
//! in its own interval, later under unknown ones. So
//!
//! ```text
//! ξ(t+τ) = Φ_τ (ξ(t) - r) + Γ_τ (expected power) + ∫ exp(A σ) b d dσ over [δ, δ+τ]
//!          - Φ_{δ+τ} ε + Φ_δ ε' + r'
//! ```
//!
//! Where the delay is a range, δ is its least, and the time under the new command begins with a
//! changeover ([`super::changeover`]): σ up to τ, less the changeover, is under the new command,
//! the rest up to τ under a mean of it and any other.
//!
//! **ρ.** Each of the device's coefficients is compared with an enclosure of what it stands for.
//! Their deviations count with the largest values that they can meet: 31 levels at most, and
//! estimates of states within a period (or, right after the trigger, within δ) of where they are
//! known to be: the grid, or the set at the trigger, which must lie within the same bound. A
//! coefficient that is wrong so makes ρ large, and with it every set.

use firmware::prediction::{
    MEASURED_MAX, PHI_FRACTION_BITS, PredictionView, RESPONSE_FRACTION_BITS,
};
use firmware::table::TableView;
use model::flow::{Flow, Vector, absolute_integral, absolute_integral_between, apply, largest};
use model::interval::Interval;
use model::plant::STATES;
use model::spec::Spec;

use super::changeover::Changeover;
use super::closed_loop::{MICRO, Model, commands, micro, not_linear};
use super::drive::Drive;
use super::estimate_error::{CommandDelay, EstimateError, PeriodEffect, up};
use super::held_input::HeldInput;

/// By how much states at the trigger may lie outside the grid \[micro-units\].
const ROOM: f64 = 1e6;
/// Largest ρ that the bound of the estimates, on which ρ rests, has room for \[micro-units\].
const RHO_MAX: f64 = 1e5;

/// The closed loop of a table with a spec's plant and uncertainty.
pub(crate) fn closed_loop(table: &TableView<'_>, spec: &Spec) -> Model {
    let mut model = Model::without_delay(table, spec);
    let unexamined = model.known.limit.take();
    // What the grid does is the spec's, whatever the table predicts.
    let least_s = spec.uncertainty.actuation_delay_s.least_s();
    let late = spec.sampling.ticks_of(least_s);
    if late > 0 {
        let expected: Vec<Interval> = commands(table)
            .map(|ppm| expected_power(spec, ppm))
            .collect();
        model.known = of_prediction(table, &model, &expected, late);
    }
    if let Some(reason) = unexamined {
        model.known.limit = Some(reason);
    }
    let predicted = u32::from(table.header().delay_ticks);
    if predicted != late {
        model.known.limit = Some(format!(
            "the table predicts over {predicted} ticks, the spec's commands act {late} late"
        ));
    }
    if let Some(reason) = not_linear(spec) {
        model.known.limit = Some(reason);
    }
    model
}

/// A coefficient of the prediction that is not the nearest to what it stands for, if there is one.
///
/// The proof bears any coefficient, at the price of ρ; but a table whose coefficients are not those
/// of its spec is another table.
pub(crate) fn misrounded(table: &TableView<'_>, spec: &Spec) -> Option<String> {
    /// Half of the last place, and the rounding of that comparison.
    const HALF: f64 = 0.5 + 1e-9;
    let part = table.prediction()?;
    let model = Model::without_delay(table, spec);
    let expected: Vec<Interval> = commands(table)
        .map(|ppm| expected_power(spec, ppm))
        .collect();
    let ticks = u32::from(table.header().delay_ticks);
    for d in 0..STATES {
        let coefficients = coefficients(table, &part, &model, &expected, ticks, d);
        let off = coefficients.into_iter().find(|one| {
            let off = one.stored - one.exact;
            (off.mid().abs() - off.radius()) * one.scale > HALF
        });
        if let Some(one) = off {
            return Some(format!(
                "the prediction's coefficient {} of state {d} is not the spec's",
                one.name
            ));
        }
    }
    None
}

/// What is known in a loop whose commands act `ticks` late. `expected` is the net power \[kW\] of
/// each level as the device expects it.
fn of_prediction(
    table: &TableView<'_>,
    model: &Model,
    expected: &[Interval],
    ticks: u32,
) -> EstimateError {
    let (a, b, e) = (&model.a, &model.b, &model.error);
    let header = table.header();
    let ms = u32::from(header.tick_ms);
    // Milliseconds first, as for the period.
    let seconds = |ticks: u32| f64::from(ms * ticks) / 1000.0;
    let (delay_s, period_s) = (seconds(ticks), seconds(model.period_ticks));
    let later_s = seconds(ticks + model.period_ticks);
    let segment = HeldInput::new(a, b, delay_s);
    let both = Flow::over(a, b, later_s);

    // The deviation of every level from what is expected, as an interval.
    let deviations: Vec<Interval> = model
        .drives
        .iter()
        .zip(expected)
        .map(|(drive, expected)| drive.range() - *expected)
        .collect();
    let unknown = deviations.iter().map(|d| d.magnitude()).fold(0.0, f64::max);

    // Without ρ yet: how far the real state may be from ξ.
    let apart = |d: usize| up(times(&segment.flow.phi[d], e) + up(segment.absolute[d] * unknown));
    let reach: [f64; STATES] = std::array::from_fn(|d| {
        let low = f64::from(header.grid.lower_edge()[d]);
        let width = f64::from(header.grid.width()[d]);
        let high = low + width * f64::from(header.grid.count()[d]);
        up(low.abs().max(high.abs()) + ROOM.max(up(apart(d) + RHO_MAX)))
    });
    let (estimates, inside) = estimates(model, delay_s.max(period_s), &reach);
    let rho = match table.prediction() {
        Some(part) if inside => rho(table, &part, model, expected, &estimates, ticks),
        _ => [f64::INFINITY; STATES],
    };
    let limit = rho.iter().any(|rho| *rho > RHO_MAX).then(|| {
        "the table's prediction coefficients are not those of the spec's plant and delay".to_owned()
    });
    let first = std::array::from_fn(|d| up(times(&segment.flow.phi[d], e) + rho[d]));
    let real = std::array::from_fn(|d| up(apart(d) + rho[d]));

    // Under the new command for σ in [δ, τ], if the delay is the shorter; under unknown ones for
    // the rest.
    let own_until_s = model
        .changeover
        .as_ref()
        .map_or(period_s, Changeover::rest_s);
    let own = absolute_integral_between(a, b, (delay_s, own_until_s));
    let others = absolute_integral_between(a, b, (delay_s.max(period_s), later_s));
    let shared = Flow::over(a, b, delay_s.min(period_s));
    let drifts = deviations
        .iter()
        .zip(expected)
        .map(|(deviation, expected)| {
            let mid = Interval::point(deviation.mid());
            let centre = std::array::from_fn(|d| {
                let (whole, shared) = (model.period.flow.gamma[d], shared.gamma[d]);
                let kept = if delay_s < period_s {
                    whole - shared
                } else {
                    Interval::ZERO
                };
                whole * *expected + kept * mid
            });
            let radius = std::array::from_fn(|d| {
                let errors = up(times(&both.phi[d], e) + first[d]);
                let varied = up(up(own[d] * deviation.radius()) + up(others[d] * unknown));
                up(errors + varied)
            });
            let mut effect = PeriodEffect { centre, radius };
            if let Some(changeover) = &model.changeover {
                let any = changeover.any.range() - *expected;
                changeover.replace(&mut effect, (a, b), (deviation.mid(), any));
            }
            effect
        });
    EstimateError {
        first,
        before: rho,
        real,
        drifts: drifts.collect(),
        delay: Some(CommandDelay {
            ticks,
            segment,
            expected: Drive::of(expected.first().copied().unwrap_or(Interval::ZERO)),
            reach,
            estimates,
        }),
        limit,
    }
}

/// `P u - w` \[kW\] as a device expects it under a command \[ppm\]: all of it is delivered, the
/// loss is in the middle of its band.
fn expected_power(spec: &Spec, ppm: u32) -> Interval {
    let [low, high] = spec.uncertainty.loss_gw;
    let fleet = micro(spec.fleet_power_gw());
    let loss = (micro(low) + micro(high)) * Interval::point(0.5);
    fleet * Interval::point(f64::from(ppm)) / Interval::point(MICRO) - loss
}

/// Bound of the estimates from which a prediction may start \[micro-units\], and whether the device
/// takes them as they are.
fn estimates(model: &Model, time_s: f64, reach: &[f64; STATES]) -> ([f64; STATES], bool) {
    let grown = largest(&model.a, time_s);
    let driven = absolute_integral(&model.a, &model.b, time_s);
    let power = model
        .drives
        .iter()
        .map(|drive| drive.range().magnitude())
        .fold(0.0, f64::max);
    let bound = std::array::from_fn(|d| {
        // One more for the floor of the stored state.
        let mut sum = up(up(up(driven[d] * power) + model.error[d]) + 1.0);
        for j in 0..STATES {
            sum = up(sum + up(grown[d][j] * reach[j]));
        }
        sum
    });
    let inside = bound.iter().all(|bound| *bound < f64::from(MEASURED_MAX));
    (bound, inside)
}

/// A coefficient as it is stored, beside an enclosure of what it stands for.
struct Coefficient {
    name: &'static str,
    stored: Interval,
    exact: Interval,
    /// Last places in a unit.
    scale: f64,
    /// Bound of what it is multiplied with.
    of: f64,
}

/// The coefficients of one state: of the loss, of the estimate, of each command under way.
fn coefficients(
    table: &TableView<'_>,
    part: &PredictionView<'_>,
    model: &Model,
    expected: &[Interval],
    ticks: u32,
    d: usize,
) -> Vec<Coefficient> {
    let header = table.header();
    let at = |name, stored: i32, bits: u32, exact, of| Coefficient {
        name,
        stored: Interval::point(f64::from(stored)) / Interval::point(f64::from(1u32 << bits)),
        exact,
        scale: f64::from(1u32 << bits),
        of,
    };
    let delay_s = f64::from(u32::from(header.tick_ms) * ticks) / 1000.0;
    let flow = Flow::over(&model.a, &model.b, delay_s);
    let none = expected.first().copied().unwrap_or(Interval::ZERO);
    let mut all = vec![at(
        "of the loss",
        part.loss(d),
        0,
        flow.gamma[d] * none,
        1.0,
    )];
    for j in 0..STATES {
        let stored = part.phi(d, j);
        all.push(at(
            "of the estimate",
            stored,
            PHI_FRACTION_BITS,
            flow.phi[d][j],
            0.0,
        ));
    }
    // The power of one level, and of the last, which is as many times that.
    let last = usize::from(header.levels) - 1;
    let level = match expected.get(last) {
        Some(power) if last > 0 => (*power - none) / Interval::point(last as f64),
        _ => Interval::ZERO,
    };
    let tick = &model.tick.flow;
    let mut response = tick.gamma.map(|gamma| gamma * level);
    for ago in 1..=ticks as usize {
        let stored = part.level(ago, d);
        let bits = RESPONSE_FRACTION_BITS;
        all.push(at("of a command", stored, bits, response[d], last as f64));
        response = apply(&tick.phi, &response);
    }
    all
}

/// ρ: the table's coefficients against enclosures of what they stand for, and the floor of the
/// measured state. The final floor moves no state out of its cell.
fn rho(
    table: &TableView<'_>,
    part: &PredictionView<'_>,
    model: &Model,
    expected: &[Interval],
    estimates: &[f64; STATES],
    ticks: u32,
) -> [f64; STATES] {
    std::array::from_fn(|d| {
        let all = coefficients(table, part, model, expected, ticks, d);
        let mut sum = 0.0;
        for (at, one) in all.iter().enumerate() {
            let off = (one.stored - one.exact).magnitude();
            // The first is a sum by itself, those of the estimate follow it, state by state.
            sum = match at.checked_sub(1) {
                Some(j) if j < STATES => {
                    up(up(sum + up(off * estimates[j])) + one.stored.magnitude())
                }
                _ => up(sum + up(off * one.of)),
            };
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
