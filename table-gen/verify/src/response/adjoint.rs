//! A lower bound of one linear functional of the trajectory, by one sweep backwards.
//!
//! # Derivation
//! Let `q·x(k) + Σ c_j f(k - j)` be the functional. For *any* row vectors λ, the sum telescopes:
//!
//! ```text
//! λ(i+1)·x(i+1) = (λ(i+1) E) x(i) + ∫ λ(i+1) exp(A (h - s)) b (P u(s) - w) ds
//!                  + (what unknown parameters add)
//! ```
//!
//! With β(s) the factor of u in the integral, β+ and β- the integrals of its positive and negative
//! parts, u at least `a f(i-j) + c` and at most `a' f(i-j') + c'` at all times of the step, the
//! integral is at least `β+ (a f + c) - β- (a' f + c')`: constants go to the bound, the factors of
//! earlier samples of f are kept until the sweep arrives there and then join λ. The loss is
//! constant, so its factors are summed and its worst end is taken once; where it may rise, its
//! whole rise is put at the moment at which it does most harm, since for `w = w0 + Σ rises` the
//! bound is linear in each rise and their sum is limited. The sweep ends at the event, in the box
//! of initial states, or after a *memory*, in bounds of the state that are known there.
//!
//! λ need not be the exact adjoint: what rounding makes of it is a residual `ε·x(i)`, and |x| is
//! bounded. The constant [`EPS`] covers sixteen roundings each time, and the residuals are
//! subtracted from the bound.

use model::interval::Interval;
use model::plant::STATES;

use super::fleet_loop::{FleetLoop, LossProfile};
use super::governor::Disturbance;
use super::lines::{LINES, Line};
use super::unknown::{self, OfStep, dot};

/// Sixteen half units in the last place, relative.
const EPS: f64 = 16.0 * f64::EPSILON;

/// What is known of one step, from sample i to sample i + 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// Lines below the delivered participation.
    pub(super) below: [Line; LINES],
    /// Lines above it.
    pub(super) above: [Line; LINES],
    /// What acts where the plant is not known.
    pub(super) unknown: OfStep,
    /// How far f may leave the chord between the step's samples \[Hz\].
    pub(super) slack: f64,
    /// Bound of |f'| in the step \[Hz/s\].
    pub(super) rate: f64,
    /// What limits of the governors add to their input in the step \[GW\].
    pub(super) governor: Option<Disturbance>,
}

/// The steps so far, and what bounds the state where a sweep ends early.
#[derive(Debug, Clone)]
pub(super) struct Past<'a> {
    /// Numbers of the loop.
    pub(super) loop_: &'a FleetLoop,
    /// Steps from the event on, or the one step that repeats.
    pub(super) steps: Vec<Step>,
    /// Whether `steps` has one element that stands for every step.
    pub(super) repeats: bool,
    /// Bounds of the states at the samples, or one element for all.
    pub(super) states: Vec<[Interval; STATES]>,
    /// Steps after which a sweep ends; 0: it goes back to the event.
    pub(super) memory: usize,
    /// Bound of |x| at all samples.
    pub(super) most: [f64; STATES],
    /// Bounds of the states before the first sample; nothing: the rest before an event.
    pub(super) before: Option<[Interval; STATES]>,
}

/// `row · x(k) + Σ factor · f(k - back) + rate · w`.
#[derive(Debug, Clone)]
pub(super) struct Functional {
    /// Factors of the state.
    pub(super) row: [f64; STATES],
    /// Factors of earlier samples of f.
    pub(super) earlier: Vec<(usize, f64)>,
    /// Factor of the loss at the sample.
    pub(super) loss: f64,
}

impl Functional {
    /// One state.
    pub(super) fn state(axis: usize) -> Self {
        let mut row = [0.0; STATES];
        row[axis] = 1.0;
        Self {
            row,
            earlier: Vec::new(),
            loss: 0.0,
        }
    }

    /// f less the f of some steps ago.
    pub(super) fn change(back: usize) -> Self {
        Self {
            earlier: vec![(back, -1.0)],
            ..Self::state(0)
        }
    }

    fn negated(&self) -> Self {
        Self {
            row: self.row.map(|v| -v),
            earlier: self.earlier.iter().map(|(b, v)| (*b, -v)).collect(),
            loss: -self.loss,
        }
    }
}

/// Which lines a sweep uses: indices into [`Step::below`] and [`Step::above`].
pub(super) type Choice = (usize, usize);

/// All choices.
pub(super) fn choices() -> impl Iterator<Item = Choice> {
    (0..LINES).flat_map(|below| (0..LINES).map(move |above| (below, above)))
}

/// Factors of samples of f before the first: their sum, the sum of their magnitudes, and what they
/// make of a constant rate.
#[derive(Debug, Default)]
struct Before {
    f: f64,
    magnitude: f64,
    rate: f64,
}

impl Past<'_> {
    fn step(&self, index: usize) -> Option<&Step> {
        self.steps.get(if self.repeats { 0 } else { index })
    }

    fn state(&self, index: usize) -> Option<&[Interval; STATES]> {
        self.states.get(if self.repeats { 0 } else { index })
    }

    /// Bounds of a functional at sample k, with the choices that gave them: the best of those
    /// given.
    pub(super) fn range(
        &self,
        k: usize,
        functional: &Functional,
        tried: &[Choice],
        best: &mut [Choice; 2],
    ) -> Interval {
        let mut ends = [f64::NEG_INFINITY; 2];
        for (end, side) in [functional.clone(), functional.negated()]
            .iter()
            .enumerate()
        {
            let first = best[end];
            for choice in std::iter::once(first).chain(tried.iter().copied()) {
                let bound = self.lower(k, side, choice);
                if bound > ends[end] {
                    ends[end] = bound;
                    best[end] = choice;
                }
            }
        }
        Interval {
            low: ends[0],
            high: (-ends[1]).max(ends[0]),
        }
    }

    /// A lower bound of a functional at sample k.
    pub(super) fn lower(&self, k: usize, functional: &Functional, choice: Choice) -> f64 {
        let number = self.loop_;
        let fleet = number.fleet_gw;
        let mut lambda = functional.row;
        // Factors of f at samples before the sweep's position.
        let mut waiting = vec![0.0f64; k + 1];
        let mut before = Before::default();
        let mut bound = 0.0f64;
        // Sum of the magnitudes that went into the bound, for its rounding; and residuals.
        let mut size = 0.0f64;
        let mut residual = 0.0f64;
        let add = |waiting: &mut [f64], before: &mut Before, at: usize, back: usize, v: f64| {
            if let Some(sample) = at.checked_sub(back) {
                waiting[sample] += v;
            } else {
                before.f += v;
                before.magnitude += v.abs();
                before.rate -= v * (back - at) as f64 * number.step_s;
            }
        };
        for &(back, factor) in &functional.earlier {
            add(&mut waiting, &mut before, k, back, factor);
        }
        lambda[0] += waiting[k];
        let mut loss = functional.loss;
        let mut rise_worst = loss.min(0.0);
        let [low, high] = [number.assumed.loss.low, number.assumed.loss.high];
        let there = number.loss_at(k, self.repeats);
        let mut moving = (loss * there.low).min(loss * there.high);
        let mut i = k;
        while i > 0 && (self.memory == 0 || k - i < self.memory) {
            i -= 1;
            let Some(step) = self.step(i) else {
                return f64::NEG_INFINITY;
            };
            let magnitude = lambda.map(f64::abs);
            let mean = dot(&lambda, &number.drive.map(|d| d.0));
            let (start, end) = (
                dot(&lambda, &number.drive_start),
                dot(&lambda, &number.drive_end),
            );
            let curvature =
                dot(&magnitude, &number.drive_curvature) * number.step_s * number.step_s / 8.0;
            let absolute = absolute_integral(start, end, curvature, number.step_s).max(mean.abs());
            let unsure = dot(&magnitude, &number.drive.map(|d| d.1 + EPS * d.0.abs()));
            let (plus, minus) = (
                fleet * 0.5 * (absolute + mean),
                fleet * 0.5 * (absolute - mean),
            );
            let below = &step.below[choice.0];
            let above = &step.above[choice.1];
            if plus > 0.0 {
                bound += plus * below.constant;
                size += (plus * below.constant).abs();
                add(&mut waiting, &mut before, i, below.back, plus * below.slope);
                residual += EPS * (plus * below.slope).abs() * self.most[0];
            }
            if minus > 0.0 {
                bound -= minus * above.constant;
                size += (minus * above.constant).abs();
                add(
                    &mut waiting,
                    &mut before,
                    i,
                    above.back,
                    -minus * above.slope,
                );
                residual += EPS * (minus * above.slope).abs() * self.most[0];
            }
            // Participations lie in [0, 1], and so does what a line says near the trajectory, up to
            // a few units.
            residual += unsure * (fleet * 8.0 + number.assumed.loss.magnitude())
                + EPS * fleet * absolute * 8.0;
            // A loss that moves as it likes takes its worst end while its factor is positive, and
            // the other while it is negative.
            if number.assumed.profile == LossProfile::Band {
                let here = number.loss_in_step(i, self.repeats);
                let (plus, minus) = (0.5 * (absolute + mean), 0.5 * (absolute - mean));
                moving -= plus * here.high - minus * here.low;
                size += (plus * here.high).abs() + (minus * here.low).abs();
            }
            // Within the step the sum lies between its ends, but for what changes sign.
            let ends = loss.min(loss - mean);
            loss -= mean;
            rise_worst = rise_worst.min(ends - (absolute - mean.abs()));
            // Unknown constant parameters, as if they varied.
            let unknown = unknown::most(number, &step.unknown, &magnitude);
            bound -= unknown;
            size += unknown;
            // What limits of the governors add: lines in the sample's f and g.
            let mut fed_back = [0.0; STATES];
            if let Some(lines) = &step.governor {
                let mean = dot(&lambda, &number.drive_gain.map(|d| d.0));
                let (start, end) = (
                    dot(&lambda, &number.gain_start),
                    dot(&lambda, &number.gain_end),
                );
                let curvature =
                    dot(&magnitude, &number.gain_curvature) * number.step_s * number.step_s / 8.0;
                let absolute =
                    absolute_integral(start, end, curvature, number.step_s).max(mean.abs());
                let unsure = dot(
                    &magnitude,
                    &number.drive_gain.map(|d| d.1 + EPS * d.0.abs()),
                );
                let (plus, minus) = (0.5 * (absolute + mean), 0.5 * (absolute - mean));
                let (low, high) = (&lines.low, &lines.high);
                let constant = plus * low.constant - minus * high.constant;
                bound += constant;
                fed_back[0] = plus * low.f - minus * high.f;
                fed_back[1] = plus * low.g - minus * high.g;
                let largest = |line: &super::governor::Affine| {
                    line.constant.abs() + line.f.abs() * self.most[0] + line.g.abs() * self.most[1]
                };
                size += (plus * low.constant).abs() + (minus * high.constant).abs();
                residual += (unsure + EPS * absolute) * (largest(low) + largest(high));
            }
            let mut next = [0.0; STATES];
            for (row, factor) in number.transition.iter().zip(lambda) {
                for (axis, (mid, radius)) in row.iter().enumerate() {
                    next[axis] += factor * mid;
                    residual += factor.abs() * (radius + EPS * mid.abs()) * self.most[axis];
                }
            }
            lambda = next;
            lambda[0] += fed_back[0];
            lambda[1] += fed_back[1];
            lambda[0] += waiting[i];
            residual += EPS * lambda[0].abs() * self.most[0];
            residual += EPS * fed_back[1].abs() * self.most[1];
        }
        let assumed = &number.assumed;
        let box_ends = self.at_the_end(i, lambda, &waiting, &before);
        bound += box_ends.0;
        size += box_ends.1;
        let of_loss = match assumed.profile {
            LossProfile::Constant => (loss * low).min(loss * high),
            LossProfile::Band => moving,
            LossProfile::NonDecreasing => {
                let risen = |from: f64| loss * from + rise_worst.min(0.0) * (high - from);
                if i == 0 {
                    risen(low)
                } else {
                    risen(low).min(risen(high))
                }
            }
        };
        let terms = (k + 16) as f64;
        bound + of_loss
            - residual * (1.0 + 1e-9)
            - EPS * terms * (size + of_loss.abs() + loss.abs() * high.abs())
    }

    /// What is left where a sweep ends: the least of the rest, and the sum of its magnitudes.
    fn at_the_end(
        &self,
        i: usize,
        mut lambda: [f64; STATES],
        waiting: &[f64],
        before: &Before,
    ) -> (f64, f64) {
        let number = self.loop_;
        let mut least = 0.0;
        let mut size = 0.0;
        let mut take = |v: f64| {
            least += v;
            size += v.abs();
        };
        match (&self.before, i) {
            // At rest f was the initial one less what a constant rate made of it.
            (None, 0) => {
                lambda[0] += before.f;
                for (factor, radius) in lambda.iter().zip(number.assumed.initial) {
                    take(-factor.abs() * radius);
                }
                take(-before.rate.abs() * number.rate_before);
                return (least, size);
            }
            (None, _) => {
                take(-before.magnitude * number.assumed.initial[0]);
                take(-before.rate.abs() * number.rate_before);
            }
            (Some(bounds), _) => take(-before.magnitude * bounds[0].magnitude()),
        }
        // Samples of f before the sweep's end, and the state at it.
        for (sample, factor) in waiting.iter().enumerate().take(i) {
            if *factor != 0.0 {
                match self.state(sample) {
                    Some(range) => take((factor * range[0].low).min(factor * range[0].high)),
                    None => take(f64::NEG_INFINITY),
                }
            }
        }
        let at = if i == 0 {
            self.before.as_ref()
        } else {
            self.state(i)
        };
        match at {
            Some(ranges) => {
                for (factor, range) in lambda.iter().zip(ranges) {
                    take((factor * range.low).min(factor * range.high));
                }
            }
            None => take(f64::NEG_INFINITY),
        }
        (least, size)
    }
}

/// Upper bound of `∫ |β|` over a step for β within `curvature` of the straight line from `start` to
/// `end`.
fn absolute_integral(start: f64, end: f64, curvature: f64, step_s: f64) -> f64 {
    let (a, b) = (start.abs(), end.abs());
    if start * end > 0.0 && a.min(b) > curvature {
        // No change of sign: the integral's magnitude is that of the mean, which the caller knows
        // exactly.
        return 0.0;
    }
    let chord = if start * end >= 0.0 {
        0.5 * (a + b)
    } else {
        0.5 * (a * a + b * b) / (a + b)
    };
    step_s * (chord + curvature) * (1.0 + EPS)
}
