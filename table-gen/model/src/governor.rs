//! The governors beyond the linear plant: dead band, limited rate, limited output.
//!
//! ```text
//! g' = clamp((K z(f) - g) / T_G, ± rate), and 0 where it would carry g past a limit
//! z(f) = f - clamp(f, -deadband, deadband)
//! ```
//!
//! The limits are on g, the output of the governors' first stage, which is where a set of real
//! governors runs out; lead-lag and turbine follow as in the linear plant. Without limits this is
//! the equation of [`Plant::derivative`].

use crate::plant::{Plant, STATES};
use crate::spec::Spec;

/// Limits of the governors; [`Governor::LINEAR`] has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Governor {
    /// Largest change of the governor's output \[GW/s\].
    pub rate_gw_per_s: f64,
    /// Least and greatest output \[GW\]; 0 lies between them.
    pub output_gw: [f64; 2],
    /// Deviation to either side that the governors do not see \[Hz\].
    pub deadband_hz: f64,
}

impl Governor {
    /// The governor of the paper.
    pub const LINEAR: Self = Self {
        rate_gw_per_s: f64::INFINITY,
        output_gw: [f64::NEG_INFINITY, f64::INFINITY],
        deadband_hz: 0.0,
    };

    /// The governors of a spec.
    pub fn of(spec: &Spec) -> Self {
        let keys = &spec.plant.governor;
        Self {
            rate_gw_per_s: keys.rate_gw_per_s.unwrap_or(f64::INFINITY),
            output_gw: [
                keys.lower_gw.unwrap_or(f64::NEG_INFINITY),
                keys.upper_gw.unwrap_or(f64::INFINITY),
            ],
            deadband_hz: keys.deadband_hz.unwrap_or(0.0),
        }
    }

    /// Whether this is the linear plant's.
    pub fn is_linear(&self) -> bool {
        *self == Self::LINEAR
    }

    /// z(f): what the governors see of a deviation \[Hz\].
    #[inline]
    pub fn seen(&self, f: f64) -> f64 {
        f - f.clamp(-self.deadband_hz, self.deadband_hz)
    }

    /// g' at a deviation \[Hz\] and an output \[GW\].
    #[inline]
    pub fn rate(&self, plant: &Plant, f: f64, g: f64) -> f64 {
        let wanted = (plant.governor_gain * self.seen(f) - g) / plant.governor_time;
        let [low, high] = self.output_gw;
        if (g >= high && wanted > 0.0) || (g <= low && wanted < 0.0) {
            0.0
        } else {
            wanted.clamp(-self.rate_gw_per_s, self.rate_gw_per_s)
        }
    }

    /// x' at a state for a net power `v = P u - w` \[GW\].
    #[inline]
    pub fn derivative(&self, plant: &Plant, x: &[f64; STATES], net_power: f64) -> [f64; STATES] {
        let [f, g, l, p] = *x;
        let dg = self.rate(plant, f, g);
        [
            (p + net_power - plant.damping * f) / (2.0 * plant.inertia),
            dg,
            (g + plant.lead_time * dg - l) / plant.lag_time,
            (l - p) / plant.turbine_time,
        ]
    }

    /// The output within its limits; a step may end past one by a rate times the step.
    #[inline]
    pub fn limit(&self, x: &mut [f64; STATES]) {
        let [low, high] = self.output_gw;
        x[1] = x[1].clamp(low, high);
    }

    /// Output of governors that have been at a deviation for long \[GW\].
    pub fn at_rest(&self, plant: &Plant, f: f64) -> f64 {
        let [low, high] = self.output_gw;
        (plant.governor_gain * self.seen(f)).clamp(low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Plant = Plant {
        governor_gain: -5.0,
        governor_time: 2.0,
        turbine_time: 0.5,
        lead_time: 2.0,
        lag_time: 12.0,
        damping: 1.0,
        inertia: 4.0,
        fleet: 1.4,
    };

    #[test]
    fn without_limits_it_is_the_linear_plant() {
        let x = [-0.31, 0.7, 0.2, 0.1];
        let limited = Governor::LINEAR.derivative(&PLANT, &x, -1.3);
        let linear = PLANT.derivative(x, -1.3);
        for (a, b) in limited.into_iter().zip(linear) {
            // The same sums in another order: a few roundings of numbers below 4.
            assert!((a - b).abs() < 16.0 * f64::EPSILON * 4.0, "{a} {b}");
        }
    }

    /// By hand: K z = -5 (-0.2 + 0.1) = 0.5 GW; from g = 0.1 that asks for 0.2 GW/s.
    #[test]
    fn each_limit_does_what_it_says() {
        let dead = Governor {
            deadband_hz: 0.1,
            ..Governor::LINEAR
        };
        assert!((dead.rate(&PLANT, -0.2, 0.1) - 0.2).abs() < 1e-15);
        assert_eq!(dead.rate(&PLANT, 0.1, 0.0), 0.0);
        let slow = Governor {
            rate_gw_per_s: 0.05,
            ..dead
        };
        assert_eq!(slow.rate(&PLANT, -0.2, 0.1), 0.05);
        assert_eq!(slow.rate(&PLANT, 0.0, 1.0), -0.05);
        let full = Governor {
            output_gw: [0.0, 0.1],
            ..dead
        };
        assert_eq!(full.rate(&PLANT, -0.2, 0.1), 0.0);
        assert_eq!(full.rate(&PLANT, 0.3, 0.0), 0.0);
        assert!(full.rate(&PLANT, 0.0, 0.1) < 0.0);
        assert_eq!(full.at_rest(&PLANT, -0.2), 0.1);
    }
}
