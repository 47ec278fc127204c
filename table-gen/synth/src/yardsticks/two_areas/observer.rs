//! The observer of two areas: five states from two frequencies, and the game on what it knows.
//!
//! Each area reads its own frequency, within [`METER_HZ`], and tells it to the other, once a period
//! τ. Participations are known, losses to within their bands. With Φ the step of the plant, m what
//! the participations and the middles of the losses add to it, and y the readings of both
//! frequencies (y = C x + v):
//!
//! ```text
//! before the reading   x⁻ = Φ x̂ + m
//! after it             x̂ = x⁻ + L (y - C x⁻)
//! ```
//!
//! **Its error** e = x - x̂. A loss off the middle of its band adds d, |d| <= the absolute integral
//! of its effect; so with M = (1 - L C) Φ
//!
//! ```text
//! e⁺ = M e + (1 - L C) d - L v
//! |e| <= Σ |M^k (1 - L C)| |d| + |M^k L| |v|     from e = 0
//! ```
//!
//! The sum is taken up to a power N whose rows' absolute sums are at most ρ < 1. With S the part up
//! to there, e is M^N of an earlier e and what S bounds. So the largest of |e| is at most that of S
//! over 1 - ρ, and each entry at most its own of S and its row of |M^N| times that. Any L of which
//! the sum ends is sound; [`GAINS`] are those of a Kalman filter for these bounds, to two digits.
//!
//! **The game on the estimate.** The estimate moves by
//!
//! ```text
//! x̂⁺ = Φ x̂ + m + L r,      |r| <= |C Φ| |e| + |C| |d| + |v|
//! ```
//!
//! and the controller knows x̂ itself. So its cells have no error, the drift is wider by |L| |r|,
//! and what is asked of f is asked of the estimate by the error of f more. A game on the state, of
//! which the cell is known to within e, would widen by e before and after each step.

use super::{
    PERIOD_S, STATES, abstraction_of, avoid_below, band_within, drifts, matrices, net_powers,
};
use crate::abstraction::affine::{AbstractionError, AffineAbstraction};
use crate::game::bitset::BitSet;
use model::flow::{Flow, Matrix, Vector, absolute_integral, apply, product};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Largest error of a reading of a frequency \[Hz\].
pub const METER_HZ: f64 = 0.002;
/// L: of the two innovations \[Hz\] on each state.
pub const GAINS: [[f64; 2]; STATES] = [
    [0.74, 0.0],
    [0.0, 0.68],
    [-0.05, 0.15],
    [-0.01, 0.01],
    [0.02, 0.03],
];
/// Powers of M up to which the error is summed. Its largest eigenvalue is 0.96; that of |M|, by
/// which the widths of its powers grow, is above 1.
const POWERS: usize = 150;

/// What the observer is made of.
#[derive(Debug, Clone)]
pub struct Observer {
    flows: [Flow<STATES>; 2],
    estimate: [f64; STATES],
}

impl Observer {
    /// An observer that knows the state.
    pub fn new(state: [f64; STATES]) -> Self {
        Self {
            flows: flows(),
            estimate: state,
        }
    }

    /// What it says of the state.
    pub const fn estimate(&self) -> [f64; STATES] {
        self.estimate
    }

    /// A period under an input of the abstraction, and the readings of both frequencies at its end.
    pub fn step(&mut self, input: usize, readings: [f64; 2]) {
        let powers = net_powers(input).map(Interval::mid);
        let [first, second] = &self.flows;
        let before: [f64; STATES] = std::array::from_fn(|d| {
            let row = first.phi[d].iter().zip(&self.estimate);
            let of_state: f64 = row.map(|(phi, x)| phi.mid() * x).sum();
            of_state + first.gamma[d].mid() * powers[0] + second.gamma[d].mid() * powers[1]
        });
        let innovations = [readings[0] - before[0], readings[1] - before[1]];
        for (d, gains) in GAINS.iter().enumerate() {
            self.estimate[d] = before[d] + gains[0] * innovations[0] + gains[1] * innovations[1];
        }
    }
}

/// The steps over a period, each with the direction of one area's power.
fn flows() -> [Flow<STATES>; 2] {
    let (a, b) = matrices();
    b.map(|b| Flow::over(&a, &b, PERIOD_S))
}

/// |d|: what losses off the middles of their bands add within a period.
fn disturbance() -> Vector<STATES> {
    let (a, b) = matrices();
    let mut sum = [Interval::ZERO; STATES];
    for (b, power) in b.iter().zip(net_powers(0)) {
        let absolute = absolute_integral(&a, b, PERIOD_S);
        for d in 0..STATES {
            sum[d] = sum[d] + Interval::point(absolute[d]) * Interval::point(power.radius());
        }
    }
    sum
}

/// |A| x for x that is not negative.
fn absolute(a: &Matrix<STATES>, x: &Vector<STATES>) -> Vector<STATES> {
    apply(&a.map(|row| row.map(Interval::abs)), x)
}

/// 1 - L C, and L with nothing in the columns of what is not measured.
fn correction() -> [Matrix<STATES>; 2] {
    let mut kept = [[Interval::ZERO; STATES]; STATES];
    let mut gains = kept;
    for d in 0..STATES {
        kept[d][d] = Interval::ONE;
        for (i, gain) in GAINS[d].into_iter().enumerate() {
            let gain = Interval::point(gain);
            kept[d][i] = kept[d][i] - gain;
            gains[d][i] = gain;
        }
    }
    [kept, gains]
}

/// The largest error of each state, whatever losses and readings do within their bounds, if the
/// observer began without one. `None` if the sum does not end with these gains.
pub fn error() -> Option<[f64; STATES]> {
    let [kept, gains] = correction();
    let step = product(&kept, &flows()[0].phi);
    let (disturbance, noise) = (disturbance(), [Interval::point(METER_HZ); STATES]);
    let mut sum = [Interval::ZERO; STATES];
    let mut power = Flow::<STATES>::identity().phi;
    for _ in 0..POWERS {
        let of_losses = absolute(&product(&power, &kept), &disturbance);
        let of_readings = absolute(&product(&power, &gains), &noise);
        for d in 0..STATES {
            sum[d] = sum[d] + of_losses[d] + of_readings[d];
        }
        power = product(&step, &power);
    }
    let shares = absolute(&power, &[Interval::ONE; STATES]);
    let most = |vector: &Vector<STATES>| vector.iter().map(|v| v.high).fold(0.0, f64::max);
    let share = most(&shares);
    if share.is_nan() || share >= 1.0 {
        return None;
    }
    let whole = Interval::point(most(&sum)) / (Interval::ONE - Interval::point(share));
    Some(std::array::from_fn(|d| {
        (sum[d] + shares[d] * Interval::point(whole.high)).high
    }))
}

/// |L| |r|: what a correction may add to the estimate.
fn corrections(error: &[f64; STATES]) -> [f64; STATES] {
    let disturbance = disturbance();
    let of_error = absolute(&flows()[0].phi, &error.map(Interval::point));
    let innovation = |i: usize| of_error[i] + disturbance[i] + Interval::point(METER_HZ);
    let innovations = [innovation(0), innovation(1)];
    GAINS.map(|gains| {
        let parts = gains.map(|gain| Interval::point(gain).abs());
        (parts[0] * innovations[0] + parts[1] * innovations[1]).high
    })
}

/// The game on the estimate.
#[derive(Debug)]
pub struct OnEstimate {
    /// Its abstraction, with the inputs of [`super::abstraction`]. Losses stand at the middles of
    /// their bands: what else they do is in the corrections.
    pub abstraction: AffineAbstraction<STATES>,
    /// Cells in which both estimated frequencies say that the real ones are in the band.
    pub band: BitSet,
    /// Cells in which one of the real frequencies may lie below containment.
    pub avoid: BitSet,
}

/// The game on a grid, for an error that [`error`] gave.
///
/// # Errors
/// As [`AffineAbstraction::new`].
pub fn on_estimate(
    shape: &GridShape<STATES>,
    error: &[f64; STATES],
) -> Result<OnEstimate, AbstractionError> {
    let of_f = error[0].max(error[1]);
    let middles = |input| net_powers(input).map(|power| Interval::point(power.mid()));
    Ok(OnEstimate {
        abstraction: abstraction_of(shape, &drifts(middles, corrections(error)))?,
        band: band_within(shape, of_f),
        avoid: avoid_below(shape, of_f),
    })
}
