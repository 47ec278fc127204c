//! The disturbance behind a recorded frequency: an inverse filter of the plant, regularised by a random walk.
//!
//! ```text
//! x⁺ = Φ x - Γ d        d⁺ = d + q ξ        y = f + σ η        ξ, η standard normal
//! ```
//!
//! with one step a sample and d, the missing power \[GW\], constant over it. The Kalman filter and the smoother of Durbin and
//! Koopman (Time Series Analysis by State Space Methods, section 4.4; no matrix is inverted) give mean and variance of d
//! given the whole record; q and σ are those of the greatest likelihood on a grid of factors. Draws from the posterior are
//! made by their simulation smoother (section 4.9).

use nalgebra::{SMatrix, SVector};
use rand_pcg::Pcg64;

use crate::plant::{GridPlant, STATES};
use crate::simulation::chance::unit;
use crate::simulation::propagator::Propagator;

/// x and d.
const SIZE: usize = STATES + 1;
type Matrix = SMatrix<f64, SIZE, SIZE>;
type Vector = SVector<f64, SIZE>;

/// Standard deviations tried for the walk \[GW in a step\] and the readings \[Hz\].
const WALKS_GW: [f64; 12] = [
    0.003, 0.005, 0.008, 0.013, 0.02, 0.03, 0.05, 0.08, 0.13, 0.2, 0.3, 0.5,
];
const READINGS_HZ: [f64; 8] = [0.0003, 0.0005, 0.0008, 0.0013, 0.002, 0.003, 0.005, 0.008];
/// Doubt about the chain and d at the start \[GW\], standard deviations.
const START_CHAIN_GW: f64 = 0.1;
const START_MISSING_GW: f64 = 0.3;

/// The model of a record.
#[derive(Debug, Clone)]
pub struct Smoother {
    step: Matrix,
    start: Vector,
    start_deviation: Vector,
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

/// One step of the filter, kept for the way back.
struct Filtered {
    state: Vector,
    covariance: Matrix,
    innovation: f64,
    variance: f64,
    gain: Vector,
}

impl Smoother {
    /// The model for deviations from nominal \[Hz\] a time \[s\] apart, with the likeliest q and σ. There is at least one
    /// sample.
    pub fn fit(plant: &GridPlant, deviations: &[f64], step_s: f64) -> Self {
        let propagator = Propagator::new(plant, step_s);
        let mut step = Matrix::identity();
        for j in 0..STATES {
            let mut unit = [0.0; STATES];
            unit[j] = 1.0;
            let column = propagator.step(&unit, 0.0);
            for i in 0..STATES {
                step[(i, j)] = column[i];
            }
        }
        let response = propagator.step(&[0.0; STATES], -1.0);
        for i in 0..STATES {
            step[(i, STATES)] = response[i];
        }
        let f = deviations.first().copied().unwrap_or(0.0);
        let chain = plant.governor_gain * f;
        let missing = chain - plant.damping * f;
        let mut smoother = Self {
            step,
            start: Vector::from([f, chain, chain, chain, missing]),
            start_deviation: Vector::from([
                0.005,
                START_CHAIN_GW,
                START_CHAIN_GW,
                START_CHAIN_GW,
                START_MISSING_GW,
            ]),
            walk_gw: WALKS_GW[0],
            reading_hz: READINGS_HZ[0],
        };
        let mut best = (f64::NEG_INFINITY, smoother.walk_gw, smoother.reading_hz);
        for walk_gw in WALKS_GW {
            for reading_hz in READINGS_HZ {
                (smoother.walk_gw, smoother.reading_hz) = (walk_gw, reading_hz);
                let (_, likelihood) = smoother.filter(deviations);
                if likelihood > best.0 {
                    best = (likelihood, walk_gw, reading_hz);
                }
            }
        }
        (smoother.walk_gw, smoother.reading_hz) = (best.1, best.2);
        smoother
    }

    /// The filter, and twice the logarithm of the likelihood up to a constant.
    fn filter(&self, deviations: &[f64]) -> (Vec<Filtered>, f64) {
        let mut state = self.start;
        let mut covariance = Matrix::from_diagonal(&self.start_deviation.map(|s| s * s));
        let mut likelihood = 0.0;
        let mut steps = Vec::with_capacity(deviations.len());
        for y in deviations {
            let innovation = y - state[0];
            let variance = covariance[(0, 0)] + self.reading_hz * self.reading_hz;
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
            state = self.step * updated;
            covariance = self.step * known * self.step.transpose();
            covariance[(STATES, STATES)] += self.walk_gw * self.walk_gw;
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
        let mut initial = [0.0; STATES];
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
            missing_gw[index] = mean[STATES];
            deviation_gw[index] = covariance[(STATES, STATES)].max(0.0).sqrt();
            if index == 0 {
                initial = std::array::from_fn(|i| mean[i]);
            }
        }
        Disturbance {
            initial,
            missing_gw,
            deviation_gw,
        }
    }

    /// A draw of the disturbance from what is known of it; `known` is [`Smoother::smooth`] of the same record.
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
        let first: [f64; STATES] = std::array::from_fn(|i| z[i]);
        let count = known.missing_gw.len();
        let (mut readings, mut walk) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for _ in 0..count {
            readings.push(z[0] + self.reading_hz * normal());
            walk.push(z[STATES]);
            z = self.step * z;
            z[STATES] += self.walk_gw * normal();
        }
        let imagined = self.smooth(&readings);
        let moved = |drawn: f64, guess: f64, mean: f64| mean + drawn - guess;
        Disturbance {
            initial: std::array::from_fn(|i| {
                moved(first[i], imagined.initial[i], known.initial[i])
            }),
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
    use crate::spec::Spec;
    use rand::SeedableRng;

    #[test]
    fn a_known_loss_is_found_within_its_own_bounds() {
        let plant = GridPlant::new(&Spec::load("paper-bi", &[]).unwrap());
        let step = Propagator::new(&plant, 1.0);
        let mut random = Pcg64::seed_from_u64(5);
        let mut x = [0.0; STATES];
        let mut readings = Vec::new();
        let truth: Vec<f64> = (0..200).map(|k| if k < 50 { 0.0 } else { 1.5 }).collect();
        for loss in &truth {
            let noise = 0.001 * (2.0 * unit(&mut random) - 1.0);
            readings.push(x[0] + noise);
            x = step.step(&x, -loss);
        }
        let smoother = Smoother::fit(&plant, &readings, 1.0);
        let found = smoother.smooth(&readings);
        // Five standard deviations at each of 200 samples; the jump itself is no random walk and is left out by 3 s.
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
        let plant = GridPlant::new(&Spec::load("paper-bi", &[]).unwrap());
        let readings = vec![0.0; 60];
        let mut smoother = Smoother::fit(&plant, &readings, 1.0);
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
        // Standard errors: of the mean σ / √2000 = 2.2 %, of the deviation σ / √4000 = 1.6 %; four of each.
        assert!((mean - expected).abs() < 0.09 * stated, "{mean} {expected}");
        assert!(
            (deviation / stated - 1.0).abs() < 0.064,
            "{deviation} {stated}"
        );
    }
}
