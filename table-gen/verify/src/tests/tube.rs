//! The bound of f between the samples, held against real trajectories.

use super::Random;
use crate::drive::Drive;
use crate::held_input::HeldInput;
use model::interval::Interval;
use model::plant::{Plant, STATES};
use model::spec::Spec;
use proptest::prelude::*;

/// Steps of the integrator in a period: RK4 at 1 ms errs by about h^4 per second, 1e-12 relative
/// here.
const STEPS: u32 = 1500;

fn derivative(plant: &Plant, x: &[f64; STATES], v: f64) -> [f64; STATES] {
    plant.derivative(*x, v)
}

fn runge_kutta(plant: &Plant, x: &[f64; STATES], v: f64, h: f64) -> [f64; STATES] {
    let at = |k: &[f64; STATES], f: f64| std::array::from_fn(|d| x[d] + f * k[d]);
    let k1 = derivative(plant, x, v);
    let k2 = derivative(plant, &at(&k1, h / 2.0), v);
    let k3 = derivative(plant, &at(&k2, h / 2.0), v);
    let k4 = derivative(plant, &at(&k3, h), v);
    std::array::from_fn(|d| x[d] + h / 6.0 * (k1[d] + 2.0 * k2[d] + 2.0 * k3[d] + k4[d]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Trajectories from points of a box under a drive that switches at random stay within the
    /// bound, at 1500 times of the period; and the bound is not loose: with nothing uncertain it is
    /// within 50 µHz of the extremes seen.
    #[test]
    fn real_trajectories_stay_within_the_tube(
        corner in proptest::array::uniform4(-1.0f64..1.0),
        width in 0.0f64..60_000.0,
        mid in -2_000_000.0f64..1_000_000.0,
        radius in prop_oneof![Just(0.0), 0.0f64..300_000.0],
        seed in 0u64..1000,
    ) {
        let plant = Plant::new(&Spec::load("paper-bi", &[]).unwrap());
        let (a, b) = plant.matrices();
        let segment = HeldInput::new(&a, &b, 1.5);
        // States of up to 1 Hz and 3 GW, in micro-units.
        let scale = [1e6, 3e6, 2e6, 2e6];
        let set: [Interval; STATES] = std::array::from_fn(|d| {
            let low = corner[d] * scale[d];
            Interval { low, high: low + width }
        });
        let bound = segment.frequency(&set, Drive { mid, radius });
        let mut random = Random::new(seed);
        let mut x: [f64; STATES] = std::array::from_fn(|d| set[d].low + width * random.unit());
        let mut share = random.sign();
        let h = 1.5 / f64::from(STEPS);
        let (mut lowest, mut highest) = (x[0], x[0]);
        for _ in 0..STEPS {
            // The integrator's own error: 1e-12 of 3e6 micro-units, far below a thousandth.
            prop_assert!(bound.low - 1e-3 <= x[0] && x[0] <= bound.high + 1e-3, "{} {bound:?}", x[0]);
            lowest = lowest.min(x[0]);
            highest = highest.max(x[0]);
            if random.unit() < 0.01 {
                share = random.sign();
            }
            x = runge_kutta(&plant, &x, mid + share * radius, h);
        }
        if width == 0.0 && radius == 0.0 {
            prop_assert!(lowest - bound.low < 50.0 && bound.high - highest < 50.0);
        }
    }
}
