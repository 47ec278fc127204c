//! The grid: one definition of the equations (the paper's equation 5, states in the order f, g, l,
//! p).
//!
//! ```text
//! f' = (p + P u - w - D f) / 2H          g' = (K f - g) / T_G        K = 1/R_eq
//! l' = (g + T_1 g' - l) / T_2            p' = (l - p) / T_t
//! ```
//!
//! Units: f in Hz, powers in GW, times in s. The matrices of every other module are read off
//! [`Plant::derivative`], which is evaluated in `f64` or in intervals.

use crate::flow::{Matrix, Vector};
use crate::interval::{Interval, Scalar};
use crate::spec::Spec;

/// Number of states.
pub const STATES: usize = firmware::units::STATES;

/// Parameters of the grid model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plant {
    /// K = 1/R_eq \[GW/Hz\], negative.
    pub governor_gain: f64,
    /// T_G \[s\].
    pub governor_time: f64,
    /// T_t \[s\].
    pub turbine_time: f64,
    /// T_1 \[s\].
    pub lead_time: f64,
    /// T_2 \[s\].
    pub lag_time: f64,
    /// D \[GW/Hz\].
    pub damping: f64,
    /// H \[GW s/Hz\]; 2H multiplies f'.
    pub inertia: f64,
    /// P = N_ev p_av \[GW\].
    pub fleet: f64,
}

impl Plant {
    /// The plant of a spec.
    pub fn new(spec: &Spec) -> Self {
        Self {
            governor_gain: spec.plant.governor_gain_gw_per_hz,
            governor_time: spec.plant.governor_time_s,
            turbine_time: spec.plant.turbine_time_s,
            lead_time: spec.plant.lead_time_s,
            lag_time: spec.plant.lag_time_s,
            damping: spec.plant.damping_gw_per_hz,
            inertia: spec.plant.inertia_gw_s_per_hz,
            fleet: spec.fleet_power_gw(),
        }
    }

    /// x' at a state for a net power `v = P u - w` \[GW\].
    pub fn derivative<S: Scalar>(&self, x: [S; STATES], net_power: S) -> [S; STATES] {
        let [f, g, l, p] = x;
        let k = S::of(self.governor_gain);
        let df = (p + net_power - S::of(self.damping) * f) / (S::of(2.0) * S::of(self.inertia));
        let dg = (k * f - g) / S::of(self.governor_time);
        // l' is written with g' substituted, so that its coefficients come out once each.
        let lead = S::of(self.lead_time) / S::of(self.governor_time);
        let dl = (lead * k * f + (S::of(1.0) - lead) * g - l) / S::of(self.lag_time);
        let dp = (l - p) / S::of(self.turbine_time);
        [df, dg, dl, dp]
    }

    /// A and b of `x' = A x + b v`, read off the equations.
    pub fn matrices(&self) -> (Matrix<STATES>, Vector<STATES>) {
        let zero = [Interval::ZERO; STATES];
        let mut a = [zero; STATES];
        for j in 0..STATES {
            let mut unit = zero;
            unit[j] = Interval::ONE;
            let column = self.derivative(unit, Interval::ZERO);
            for i in 0..STATES {
                a[i][j] = column[i];
            }
        }
        (a, self.derivative(zero, Interval::ONE))
    }

    /// The same in plain numbers, for simulation.
    pub fn matrices_f64(&self) -> ([[f64; STATES]; STATES], [f64; STATES]) {
        let zero = [0.0; STATES];
        let mut a = [zero; STATES];
        for j in 0..STATES {
            let mut unit = zero;
            unit[j] = 1.0;
            let column = self.derivative(unit, 0.0);
            for i in 0..STATES {
                a[i][j] = column[i];
            }
        }
        (a, self.derivative(zero, 1.0))
    }
}
