//! SCOTS' examples for the reference that stores transitions: dynamics, growth bounds and sets from
//! their published parameters, in plain floating point and independent of the engine's own.

use crate::transition_lists::{Axis, Sampled, Transitions, runge_kutta};

/// Transitions and the set that the game is about.
pub struct Example {
    /// All transitions.
    pub transitions: Transitions,
    /// Target (reach) or safe cells (safety).
    pub set: Vec<bool>,
}

impl Example {
    /// Cells that can stay in the set for ever.
    pub fn winning_safely(&self) -> usize {
        let kernel = self.transitions.safety(&self.set);
        kernel.into_iter().filter(|cell| *cell).count()
    }

    /// Cells from which the set is reached for certain, its own not counted.
    pub fn winning_by_reach(&self) -> usize {
        let won = self.transitions.reach(&self.set);
        won.into_iter().filter(|cell| *cell).count()
    }
}

/// The boost converter: `x' = A x + b` with the switch's A, on 801 x 801 cells.
pub fn boost_converter() -> Example {
    const WIDTH: f64 = 2.0 / 4e3;
    let (x_c, x_l, r_c, r_l, r_o, v_s) = (70.0, 3.0, 0.005, 0.05, 1.0, 1.0);
    let leak = -1.0 / (x_c * (r_o + r_c));
    let parallel = r_o * r_c / (r_o + r_c);
    let modes = [
        [[-r_l / x_l, 0.0], [0.0, leak]],
        [
            [-(r_l + parallel) / x_l, -r_o / (5.0 * (r_o + r_c)) / x_l],
            [5.0 * r_o / (r_o + r_c) / x_c, leak],
        ],
    ];
    let post = |x: &mut [f64], input: usize| {
        let a = modes[input];
        let f = |x: &[f64], out: &mut [f64]| {
            out[0] = a[0][0] * x[0] + a[0][1] * x[1] + v_s / x_l;
            out[1] = a[1][0] * x[0] + a[1][1] * x[1];
        };
        runge_kutta(f, x, 0.5, 5);
    };
    let radius = |r: &mut [f64], input: usize| {
        let a = modes[input];
        let f = |r: &[f64], out: &mut [f64]| {
            out[0] = a[0][0] * r[0] + a[0][1].abs() * r[1];
            out[1] = a[1][0].abs() * r[0] + a[1][1] * r[1];
        };
        runge_kutta(f, r, 0.5, 5);
    };
    let sampled = Sampled {
        axes: vec![(1.15, WIDTH, 801), (5.45, WIDTH, 801)],
        inputs: 2,
        post: &post,
        radius: &radius,
    };
    let inside = |low: f64, x: f64| low <= x - 0.5 * WIDTH && x + 0.5 * WIDTH <= low + 0.4;
    let set = (0..sampled.cells())
        .map(|cell| {
            let x = sampled.centre(cell);
            inside(1.15, x[0]) && inside(5.45, x[1])
        })
        .collect();
    Example {
        transitions: sampled.transitions(&|_| false),
        set,
    }
}

/// The vehicle, with the walls of its maze.
pub fn unicycle(walls: &[[f64; 4]], target: [f64; 4]) -> Example {
    const WIDTH: f64 = 0.2;
    const TAU: f64 = 0.3;
    let value = |k: usize| 0.3 * (k as f64 - 3.0);
    let post = |x: &mut [f64], input: usize| {
        let (speed, steering) = (value(input % 7), value(input / 7));
        let alpha = (steering.tan() / 2.0).atan();
        let f = |x: &[f64], out: &mut [f64]| {
            out[0] = speed * (alpha + x[2]).cos() / alpha.cos();
            out[1] = speed * (alpha + x[2]).sin() / alpha.cos();
            out[2] = speed * steering.tan();
        };
        runge_kutta(f, x, TAU, 10);
    };
    let radius = |r: &mut [f64], input: usize| {
        let (speed, steering) = (value(input % 7), value(input / 7));
        let c = speed.abs() * (steering.tan() * steering.tan() / 4.0 + 1.0).sqrt();
        r[0] += c * r[2] * TAU;
        r[1] += c * r[2] * TAU;
    };
    let axes: Vec<Axis> = vec![(0.0, WIDTH, 51), (0.0, WIDTH, 51), (-3.4, WIDTH, 35)];
    let sampled = Sampled {
        axes,
        inputs: 49,
        post: &post,
        radius: &radius,
    };
    let touch = 0.5 * WIDTH + 1e-10;
    let avoid = |x: &[f64]| {
        walls.iter().any(|wall| {
            wall[0] - touch <= x[0]
                && x[0] <= wall[1] + touch
                && wall[2] - touch <= x[1]
                && x[1] <= wall[3] + touch
        })
    };
    // A cell's end may miss the target's by a rounding.
    let half = 0.5 * WIDTH - 1e-10;
    let set = (0..sampled.cells())
        .map(|cell| {
            let x = sampled.centre(cell);
            target[0] <= x[0] - half
                && x[0] + half <= target[1]
                && target[2] <= x[1] - half
                && x[1] + half <= target[3]
        })
        .collect();
    Example {
        transitions: sampled.transitions(&avoid),
        set,
    }
}
