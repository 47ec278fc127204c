//! Noise of the demand, drawn once for a run.

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::DemandNoise;
use crate::simulation::chance::unit;

/// The noise holds its value for this long \[s\].
pub(super) const HOLD_S: f64 = 0.1;
/// Stream of the generator, so that the noise shares no draw with the other errors of the same
/// seed.
const STREAM: u64 = 0xDE3A_4D00;

/// Values of the noise \[GW\], one each [`HOLD_S`].
#[derive(Debug, Clone)]
pub(super) struct Noise {
    values: Vec<f64>,
}

impl Noise {
    /// The exact discrete process: `n⁺ = a n + σ √(1 - a²) ξ` with `a = exp(-HOLD_S / time)` and
    /// standard normal ξ, from its stationary law.
    pub(super) fn new(noise: &DemandNoise, duration_s: f64, seed: u64) -> Self {
        if noise.deviation_gw == 0.0 {
            return Self { values: Vec::new() };
        }
        let mut random = Pcg64::seed_from_u64(seed ^ STREAM);
        let mut normal = || {
            // Box and Muller; 1 - u lies in (0, 1].
            let radius = (-2.0 * (1.0 - unit(&mut random)).ln()).sqrt();
            radius * (std::f64::consts::TAU * unit(&mut random)).cos()
        };
        let kept = (-HOLD_S / noise.time_s).exp();
        let fresh = noise.deviation_gw * (1.0 - kept * kept).sqrt();
        let mut value = noise.deviation_gw * normal();
        let count = (duration_s / HOLD_S).ceil() as usize + 1;
        let values = (0..count)
            .map(|_| {
                let now = value;
                value = kept * value + fresh * normal();
                now
            })
            .collect();
        Self { values }
    }

    /// The value at a time \[s\]; the last one past the end, 0 without noise.
    pub(super) fn at(&self, time_s: f64) -> f64 {
        let index = (time_s / HOLD_S).max(0.0) as usize;
        let last = self.values.last().copied().unwrap_or(0.0);
        self.values.get(index).copied().unwrap_or(last)
    }

    pub(super) fn is_silent(&self) -> bool {
        self.values.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_and_forgets_as_stated() {
        let process = DemandNoise {
            deviation_gw: 0.05,
            time_s: 2.0,
        };
        let noise = Noise::new(&process, 100_000.0, 3);
        let n = noise.values.len() as f64;
        let mean = noise.values.iter().sum::<f64>() / n;
        let variance = noise.values.iter().map(|v| v * v).sum::<f64>() / n;
        let pairs = noise.values.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        // 100,000 s / (2 x 2 s) = 25,000 independent values: the mean's standard error is 0.05 /
        // 158 = 3.2e-4, the variance's relative one sqrt(2 / 25,000) = 0.9 %; four of each.
        assert!(mean.abs() < 1.3e-3, "{mean}");
        assert!((variance / 0.0025 - 1.0).abs() < 0.036, "{variance}");
        // Correlation over one step: exp(-0.05), with a standard error of sqrt((1 - a²) / n) =
        // 3e-4; four.
        let kept = pairs / (n - 1.0) / variance;
        assert!((kept - (-0.05f64).exp()).abs() < 1.3e-3, "{kept}");
    }
}
