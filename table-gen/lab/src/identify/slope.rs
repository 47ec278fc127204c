//! Inertia from the first second alone: `f' = -w / 2H` before anything has answered.
//!
//! Over that second the fall is in proportion to the integral of what was lost; the straight line
//! through the rest at the onset that fits the samples best has the slope 1/2H. Damping and
//! governors flatten the fall, so the H found is too large rather than too small; by how much is
//! for the whole fit to say.

use serde::Serialize;

use super::course::Stage;

/// Time after the onset within which samples count \[s\]; doubled until there are [`LEAST`].
const FIRST_S: f64 = 1.0;
/// Fewest samples.
const LEAST: usize = 2;

/// What the first second says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FromSlope {
    /// H \[GW s/Hz\].
    pub inertia_gw_s_per_hz: f64,
    /// Samples that it rests on.
    pub samples: usize,
    /// The last of them \[s after the onset\].
    pub until_s: f64,
}

/// H from samples (time after the onset \[s\], fall from the rest \[Hz\]) and the losses. Nothing
/// where nothing fell.
pub fn inertia(samples: &[(f64, f64)], stages: &[Stage]) -> Option<FromSlope> {
    let lost = |time: f64| -> f64 {
        let stages = stages.iter();
        stages
            .map(|s| s.power_gw * (time - s.after_s).max(0.0))
            .sum()
    };
    let mut until_s = FIRST_S;
    let mut used: Vec<(f64, f64)> = Vec::new();
    for _ in 0..4 {
        used = samples
            .iter()
            .copied()
            .filter(|(time, _)| *time > 0.0 && *time <= until_s)
            .collect();
        if used.len() >= LEAST {
            break;
        }
        until_s *= 2.0;
    }
    let products: f64 = used.iter().map(|(time, fall)| lost(*time) * fall).sum();
    let squares: f64 = used.iter().map(|(time, _)| lost(*time).powi(2)).sum();
    (products > 0.0).then(|| FromSlope {
        inertia_gw_s_per_hz: 0.5 * squares / products,
        samples: used.len(),
        until_s: used.last().map_or(0.0, |(time, _)| *time),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1.6 GW on 2H = 8: -0.2 Hz/s, so 0.02 Hz after 0.1 s and 0.2 Hz after a second.
    #[test]
    fn one_loss_by_hand() {
        let samples: Vec<(f64, f64)> = (1..=20)
            .map(|k| (0.1 * f64::from(k), 0.02 * f64::from(k)))
            .collect();
        let stage = Stage {
            after_s: 0.0,
            power_gw: 1.6,
            inertia_gw_s_per_hz: 0.0,
        };
        let found = inertia(&samples, &[stage]).unwrap();
        assert!((found.inertia_gw_s_per_hz - 4.0).abs() < 1e-12, "{found:?}");
        assert_eq!(found.samples, 10);
    }

    /// 1 GW at once and 1 GW more after half a second, 2H = 5: falls of 0.1 Hz at 0.5 s and 0.3 Hz
    /// at 1 s.
    #[test]
    fn two_losses_by_hand() {
        let stages = [0.0, 0.5].map(|after_s| Stage {
            after_s,
            power_gw: 1.0,
            inertia_gw_s_per_hz: 0.0,
        });
        let found = inertia(&[(0.5, 0.1), (1.0, 0.3)], &stages).unwrap();
        assert!((found.inertia_gw_s_per_hz - 2.5).abs() < 1e-12, "{found:?}");
        assert_eq!(inertia(&[(0.5, 0.0)], &stages), None);
    }
}
