//! A grid whose governors have a dead band, a limited rate and a limited output: not linear, and no
//! affine piece is singled out. It goes through the interface for any plant with a growth bound.
//!
//! ```text
//! f' = (g + P u - w - D f) / 2H        g' = clamp((K z(f) - g) / T_G, ± rate), 0 at a limit of g
//! ```
//!
//! # Growth bound
//! Two solutions under one input are e apart. z has slopes between 0 and 1, the clamp too, and the
//! stop at a limit never drives two solutions apart. So, whatever the limits do,
//!
//! ```text
//! |e_f|' <= -D/2H |e_f| + 1/2H |e_g|        |e_g|' <= |K|/T_G |e_f| + 0 |e_g|
//! ```
//!
//! (the governor's own decay may stop, so it counts as 0), and `exp(L τ) r` with that L bounds how
//! a box grows.
//!
//! # The centre
//! The step of the centre is integrated in plain numbers, by Euler's method. An Euler step of h
//! takes the slope at its start for the whole step; within it |x'| <= M moves the state by at most
//! h M, and the slope by at most h |L| M, so the step errs by at most `h² |L| M`, with |L| the
//! magnitudes of the Lipschitz constants (for g its own 1/T_G too). Summed over τ and carried along
//! by the growth bound that is at most `h τ exp(L τ) |L| M`, which the radius has on top. At a
//! limit of g the step is cut back to the limit; the exact solution stops there, so that errs no
//! more.

use crate::abstraction::growth::{GrowthAbstraction, GrowthBound};
use crate::game::bitset::BitSet;
use model::flow::{self, Flow};
use model::governor::Governor;
use model::grid_shape::GridShape;
use model::interval::Interval;
use model::plant::Plant;

/// Period \[s\].
pub const PERIOD_S: f64 = 0.5;
/// Euler steps of a period.
const STEPS: u32 = 1000;
/// Lost power \[GW\].
pub const LOSS_GW: f64 = 1.4;
/// Participations.
pub const INPUTS: [f64; 3] = [0.0, 0.5, 1.0];
/// The plant; lead-lag and turbine are not used.
pub const PLANT: Plant = Plant {
    governor_gain: -5.0,
    governor_time: 2.5,
    turbine_time: 0.5,
    lead_time: 2.0,
    lag_time: 12.0,
    damping: 1.0,
    inertia: 4.0,
    fleet: 0.7,
};
/// Its governors.
pub const GOVERNOR: Governor = Governor {
    deadband_hz: 0.015,
    rate_gw_per_s: 0.3,
    output_gw: [0.0, 1.0],
};
/// The band to stay in \[Hz\].
pub const BAND_HZ: [f64; 2] = [-0.45, 0.0];

/// The sampled plant.
#[derive(Debug, Clone)]
pub struct LimitedGrid {
    governor: Governor,
    growth: [[f64; 2]; 2],
    error: [f64; 2],
}

/// x'.
pub fn derivative(governor: &Governor, [f, g]: [f64; 2], u: f64) -> [f64; 2] {
    let net = g + PLANT.fleet * u - LOSS_GW - PLANT.damping * f;
    [net / (2.0 * PLANT.inertia), governor.rate(&PLANT, f, g)]
}

impl LimitedGrid {
    /// With some governors.
    pub fn new(governor: Governor) -> Self {
        let point = Interval::point;
        let of_f = -(point(PLANT.damping) / point(2.0 * PLANT.inertia));
        let of_g = Interval::ONE / point(2.0 * PLANT.inertia);
        let gain = point(PLANT.governor_gain.abs()) / point(PLANT.governor_time);
        let l = [[of_f, of_g], [gain, Interval::ZERO]];
        let phi = Flow::over(&l, &[Interval::ZERO; 2], PERIOD_S).phi;
        let magnitudes = [
            [of_f.abs(), of_g],
            [gain, Interval::ONE / point(PLANT.governor_time)],
        ];
        let carried = flow::apply(&phi, &flow::apply(&magnitudes, &fastest()));
        let factor = point(PERIOD_S) * point(PERIOD_S) / point(f64::from(STEPS));
        Self {
            governor,
            growth: phi.map(|row| row.map(Interval::magnitude)),
            // Far above the rounding of a thousand sums of numbers below 2.
            error: carried.map(|entry| (factor * entry).magnitude() + 1e-11),
        }
    }
}

/// M: bounds of |f'| and |g'| for |f| below 1 Hz and g in 0 to 2 GW, more than the grid and what a
/// period can add.
fn fastest() -> [Interval; 2] {
    let point = Interval::point;
    let net = point(2.0 + PLANT.fleet + LOSS_GW + PLANT.damping);
    [
        net / point(2.0 * PLANT.inertia),
        point(PLANT.governor_gain.abs() + 2.0) / point(PLANT.governor_time),
    ]
}

impl GrowthBound<2> for LimitedGrid {
    fn inputs(&self) -> usize {
        INPUTS.len()
    }

    fn centre(&self, x: [f64; 2], input: usize) -> [f64; 2] {
        let h = PERIOD_S / f64::from(STEPS);
        let [low, high] = self.governor.output_gw;
        let mut x = x;
        for _ in 0..STEPS {
            let [df, dg] = derivative(&self.governor, x, INPUTS[input]);
            x = [x[0] + h * df, (x[1] + h * dg).clamp(low, high)];
        }
        x
    }

    fn radius(&self, _x: [f64; 2], r: [f64; 2], _input: usize) -> [f64; 2] {
        std::array::from_fn(|d| {
            let grown = self.growth[d][0] * r[0] + self.growth[d][1] * r[1];
            (grown + self.error[d]) * (1.0 + 1e-12)
        })
    }
}

/// The grid: f in the band, g from 0 to 1 GW and a cell beyond both.
pub fn shape() -> GridShape<2> {
    GridShape {
        lower: [BAND_HZ[0], -0.02],
        width: [0.005, 0.02],
        count: [90, 52],
    }
}

/// The abstraction with some governors.
pub fn abstraction(governor: Governor) -> GrowthAbstraction<LimitedGrid, 2> {
    GrowthAbstraction::new(shape(), LimitedGrid::new(governor))
}

/// Every cell: the grid is the band.
pub fn safe() -> BitSet {
    BitSet::full(shape().cells())
}
