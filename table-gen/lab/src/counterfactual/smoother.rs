//! The disturbance behind a recorded frequency: an inverse filter of the plant, regularised by a
//! random walk.
//!
//! The governors' chain is driven by the frequency alone, so its output p follows from the record,
//! with whatever limits the governors have. What is left is linear, with one step a sample:
//!
//! ```text
//! f⁺ = a f + b (p - d)        d⁺ = d + q ξ        y = f + σ η
//! a = exp(-D h / 2H)          b = (1 - a) / D
//! ```
//!
//! ξ and η standard normal; d is the missing power \[GW\], constant over a step, and p its mean
//! over the step. The Kalman filter and the smoother of Durbin and Koopman (Time Series Analysis by
//! State Space Methods, section 4.4; no matrix is inverted) give mean and variance of d given the
//! whole record; q is that of the greatest likelihood on a grid. Draws from the posterior are made
//! by their simulation smoother (section 4.9).

use nalgebra::{SMatrix, SVector};
use rand_pcg::Pcg64;

use crate::simulation::beyond::plant::{BeyondPlant, runge_kutta};
use crate::simulation::beyond::{Disturbances, Governor};
use crate::simulation::chance::unit;
use model::plant::{Plant, STATES};

/// f and d.
const SIZE: usize = 2;
const F: usize = 0;
const D: usize = 1;
type Matrix = SMatrix<f64, SIZE, SIZE>;
type Vector = SVector<f64, SIZE>;

/// Steps of the chain in one step of the record.
const CHAIN_STEPS: usize = 100;
/// Standard deviations tried for the walk \[GW in a step\].
const WALKS_GW: [f64; 14] = [
    0.003, 0.005, 0.008, 0.013, 0.02, 0.03, 0.05, 0.08, 0.13, 0.2, 0.3, 0.5, 0.8, 1.3,
];
/// Standard deviation of a reading \[Hz\]: records are published to 1 mHz, and the moment of a
/// sample within its second is not known to better than some milliseconds of a fall of 0.15 Hz/s.
/// It is not fitted: losses are jumps, no Gaussian walk, and the likelihood would rather call the
/// readings bad.
const READING_HZ: f64 = 0.002;
/// Doubt about f \[Hz\] and d \[GW\] at the start, standard deviations. The grid is taken to have
/// been there for long.
const START_HZ: f64 = 0.005;
const START_GW: f64 = 0.3;

/// The model of a record.
#[derive(Debug, Clone)]
pub struct Smoother {
    step: Matrix,
    /// b p of each step.
    push: Vec<f64>,
    start: Vector,
    start_deviation: Vector,
    /// Output of the chain at the first sample \[GW\].
    chain_gw: f64,
    /// q \[GW in a step\].
    pub walk_gw: f64,
    /// σ \[Hz\].
    pub reading_hz: f64,
}

/// What is known of d after the record.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// State at the first sample.
    pub initial: [f64; STATES],
    /// Missing power over the step after each sample \[GW\].
    pub missing_gw: Vec<f64>,
    /// Its standard deviation \[GW\].
    pub deviation_gw: Vec<f64>,
}

/// Mean output of the governors' chain over the step after each sample, for the recorded frequency.
fn chain(plant: &Plant, governor: Governor, deviations: &[f64], step_s: f64) -> Vec<f64> {
    let disturbances = Disturbances {
        governor,
        ..Disturbances::step(0.0)
    };
    let limited = BeyondPlant::new(*plant, &disturbances, 0.0, 0);
    let drive = limited.drive(0.0);
    let first = deviations.first().copied().unwrap_or(0.0);
    let rest = rest(plant, governor, first);
    let mut x = [first, rest, rest, rest];
    let h = step_s / CHAIN_STEPS as f64;
    let last = deviations.last().copied().unwrap_or(0.0);
    let ends = deviations.iter().skip(1).copied().chain([last]);
    deviations
        .iter()
        .zip(ends)
        .map(|(from, to)| {
            let slope = (to - from) / step_s;
            let mut sum = 0.0;
            for part in 0..CHAIN_STEPS {
                x[0] = from + slope * h * part as f64;
                // The frequency is the record's, whatever the plant says.
                let derivative = |x: &[f64; STATES]| {
                    let [_, dg, dl, dp] = limited.derivative(x, &drive, 0.0);
                    [slope, dg, dl, dp]
                };
                let before = x[3];
                x = runge_kutta(&derivative, &x, derivative(&x), h);
                limited.limit(&mut x);
                sum += 0.5 * (before + x[3]);
            }
            sum / CHAIN_STEPS as f64
        })
        .collect()
}

/// Output of governors that have been at a deviation for long \[GW\].
fn rest(plant: &Plant, governor: Governor, f: f64) -> f64 {
    let seen = f - f.clamp(-governor.deadband_hz, governor.deadband_hz);
    let [low, high] = governor.output_gw;
    (plant.governor_gain * seen).clamp(low, high)
}

impl Smoother {
    /// The model for deviations from nominal \[Hz\] a time \[s\] apart, with the likeliest q. There
    /// is at least one sample.
    pub fn fit(plant: &Plant, governor: Governor, deviations: &[f64], step_s: f64) -> Self {
        let twice_inertia = 2.0 * plant.inertia;
        let kept = (-plant.damping * step_s / twice_inertia).exp();
        let b = if plant.damping > 0.0 {
            (1.0 - kept) / plant.damping
        } else {
            step_s / twice_inertia
        };
        let f = deviations.first().copied().unwrap_or(0.0);
        let chain_gw = rest(plant, governor, f);
        let outputs = chain(plant, governor, deviations, step_s);
        let mut smoother = Self {
            step: Matrix::new(kept, -b, 0.0, 1.0),
            push: outputs.iter().map(|p| b * p).collect(),
            start: Vector::new(f, chain_gw - plant.damping * f),
            start_deviation: Vector::new(START_HZ, START_GW),
            chain_gw,
            walk_gw: WALKS_GW[0],
            reading_hz: READING_HZ,
        };
        let mut best = (f64::NEG_INFINITY, smoother.walk_gw);
        for walk_gw in WALKS_GW {
            smoother.walk_gw = walk_gw;
            let (_, likelihood) = smoother.filter(deviations);
            if likelihood > best.0 {
                best = (likelihood, walk_gw);
            }
        }
        smoother.walk_gw = best.1;
        smoother
    }

    /// The state after a step.
    fn next(&self, index: usize, state: Vector) -> Vector {
        let mut next = self.step * state;
        next[F] += self.push.get(index).copied().unwrap_or(0.0);
        next
    }

    /// State of the plant at the first sample.
    fn initial(&self, f: f64) -> [f64; STATES] {
        [f, self.chain_gw, self.chain_gw, self.chain_gw]
    }
}

/// One step of the filter, kept for the way back.
struct Filtered {
    state: Vector,
    covariance: Matrix,
    innovation: f64,
    variance: f64,
    gain: Vector,
}

impl Smoother {
    /// The filter, and twice the logarithm of the likelihood up to a constant.
    fn filter(&self, deviations: &[f64]) -> (Vec<Filtered>, f64) {
        let mut state = self.start;
        let mut covariance = Matrix::from_diagonal(&self.start_deviation.map(|s| s * s));
        let mut likelihood = 0.0;
        let mut steps = Vec::with_capacity(deviations.len());
        for (index, y) in deviations.iter().enumerate() {
            let innovation = y - state[F];
            let variance = covariance[(F, F)] + self.reading_hz * self.reading_hz;
            let gain: Vector = covariance.column(0) / variance;
            likelihood -= variance.ln() + innovation * innovation / variance;
            steps.push(Filtered {
                state,
                covariance,
                innovation,
                variance,
                gain,
            });
            let updated = state + gain * innovation;
            let known = covariance - gain * covariance.row(0);
            state = self.next(index, updated);
            covariance = self.step * known * self.step.transpose();
            covariance[(D, D)] += self.walk_gw * self.walk_gw;
            // Rounding must not make it lopsided.
            covariance = 0.5 * (covariance + covariance.transpose());
        }
        (steps, likelihood)
    }

    /// Mean and deviation of the disturbance given the record.
    pub fn smooth(&self, deviations: &[f64]) -> Disturbance {
        let (steps, _) = self.filter(deviations);
        let mut missing_gw = vec![0.0; steps.len()];
        let mut deviation_gw = vec![0.0; steps.len()];
        let mut initial = self.initial(self.start[F]);
        let mut r = Vector::zeros();
        let mut n = Matrix::zeros();
        for (index, step) in steps.iter().enumerate().rev() {
            // L = F (I - K H), with H the first unit row.
            let mut l = self.step;
            let lost = self.step * step.gain;
            for i in 0..SIZE {
                l[(i, 0)] -= lost[i];
            }
            r = l.transpose() * r;
            r[0] += step.innovation / step.variance;
            n = l.transpose() * n * l;
            n[(0, 0)] += 1.0 / step.variance;
            let mean = step.state + step.covariance * r;
            let covariance = step.covariance - step.covariance * n * step.covariance;
            missing_gw[index] = mean[D];
            deviation_gw[index] = covariance[(D, D)].max(0.0).sqrt();
            if index == 0 {
                initial = self.initial(mean[F]);
            }
        }
        Disturbance {
            initial,
            missing_gw,
            deviation_gw,
        }
    }

    /// A draw of the disturbance from what is known of it; `known` is [`Smoother::smooth`] of the
    /// same record.
    pub fn draw(&self, known: &Disturbance, random: &mut Pcg64) -> Disturbance {
        let mut normal = || {
            // Box and Muller; 1 - u lies in (0, 1].
            let radius = (-2.0 * (1.0 - unit(random)).ln()).sqrt();
            radius * (std::f64::consts::TAU * unit(random)).cos()
        };
        let mut z = self.start;
        for i in 0..SIZE {
            z[i] += self.start_deviation[i] * normal();
        }
        let first = z[F];
        let count = known.missing_gw.len();
        let (mut readings, mut walk) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for index in 0..count {
            readings.push(z[F] + self.reading_hz * normal());
            walk.push(z[D]);
            z = self.next(index, z);
            z[D] += self.walk_gw * normal();
        }
        let imagined = self.smooth(&readings);
        let moved = |drawn: f64, guess: f64, mean: f64| mean + drawn - guess;
        Disturbance {
            initial: self.initial(moved(first, imagined.initial[F], known.initial[F])),
            missing_gw: (0..count)
                .map(|k| moved(walk[k], imagined.missing_gw[k], known.missing_gw[k]))
                .collect(),
            deviation_gw: known.deviation_gw.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::spec::Spec;
    use rand::SeedableRng;

    #[test]
    fn a_known_loss_is_found_within_its_own_bounds() {
        let plant = Plant::new(&Spec::load("paper-bi", &[]).unwrap());
        let step = model::propagator::Propagator::new(&plant, 1.0);
        let mut random = Pcg64::seed_from_u64(5);
        let mut x = [0.0; STATES];
        let mut readings = Vec::new();
        let truth: Vec<f64> = (0..200).map(|k| if k < 50 { 0.0 } else { 1.5 }).collect();
        for loss in &truth {
            let noise = 0.001 * (2.0 * unit(&mut random) - 1.0);
            readings.push(x[0] + noise);
            x = step.step(&x, -loss);
        }
        let smoother = Smoother::fit(&plant, Governor::LINEAR, &readings, 1.0);
        let found = smoother.smooth(&readings);
        // Five standard deviations at each of 200 samples; the jump itself is no random walk and is
        // left out by 3 s.
        for (k, loss) in truth.iter().enumerate() {
            if (47..53).contains(&k) || k > 196 {
                continue;
            }
            let error = (found.missing_gw[k] - loss).abs();
            let bound = 5.0 * found.deviation_gw[k];
            assert!(error < bound, "{k}: {error} {bound}");
        }
        assert!(
            found.deviation_gw[100] < 0.15,
            "{}",
            found.deviation_gw[100]
        );
    }

    #[test]
    fn draws_scatter_as_the_smoother_says() {
        let plant = Plant::new(&Spec::load("paper-bi", &[]).unwrap());
        let readings = vec![0.0; 60];
        let mut smoother = Smoother::fit(&plant, Governor::LINEAR, &readings, 1.0);
        (smoother.walk_gw, smoother.reading_hz) = (0.05, 0.002);
        let known = smoother.smooth(&readings);
        let mut random = Pcg64::seed_from_u64(9);
        let draws = 2000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..draws {
            let d = smoother.draw(&known, &mut random).missing_gw[30];
            sum += d;
            squares += d * d;
        }
        let mean = sum / f64::from(draws);
        let deviation = (squares / f64::from(draws) - mean * mean).sqrt();
        let (expected, stated) = (known.missing_gw[30], known.deviation_gw[30]);
        // Standard errors: of the mean σ / √2000 = 2.2 %, of the deviation σ / √4000 = 1.6 %; four
        // of each.
        assert!((mean - expected).abs() < 0.09 * stated, "{mean} {expected}");
        assert!(
            (deviation / stated - 1.0).abs() < 0.064,
            "{deviation} {stated}"
        );
    }
}
