//! A vehicle that parks behind a maze: SCOTS' example `vehicle` (Zamani, Pola, Mazo and Tabuada,
//! IEEE TAC 57(7), 2012; Reissig, Weber and Rungger, IEEE TAC 62(4), 2017).
//!
//! Place (x, y) and heading θ of a vehicle with two axles; the inputs are the speed u and the
//! tangent of the steering angle. With t half that tangent,
//!
//! ```text
//! x' = u (cos θ - t sin θ)        y' = u (sin θ + t cos θ)        θ' = 2 t u
//! ```
//!
//! which is `u cos(α + θ)/cos α`, `u sin(α + θ)/cos α`, `u tan(steering)` with `tan α = t`. Over a
//! period τ the heading turns by `2φ = 2 t u τ`, and the means of sine and cosine on the way are
//! `sinc φ` times those of the heading in the middle: the step is exact. The growth bound is
//! SCOTS': a heading off by r moves the place by at most `|u| √(1 + t²) τ r`.

use crate::abstraction::Abstraction;
use crate::abstraction::invariant::{InvariantAbstraction, InvariantError, InvariantPlant};
use crate::game::bitset::BitSet;
use crate::trigonometry::{sin_cos, sinc, sqrt, tan};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Period \[s\], as tenths: 0.3 is no binary number.
const PERIOD_TENTHS: f64 = 3.0;
/// Speeds and steering angles are these multiples of 0.3, each.
const STEPS: std::ops::RangeInclusive<i32> = -3..=3;
/// Width of a cell on every axis (m, m, rad).
pub const WIDTH: f64 = 0.2;
/// Cells on each axis. Their centres are multiples of the width: from 0 to 10 m, and from -3.4 to
/// 3.4 rad.
pub const COUNT: [u32; 3] = [51, 51, 35];

/// Walls of the maze: x from and to, y from and to \[m\].
pub const OBSTACLES: [[f64; 4]; 15] = [
    [1.0, 1.2, 0.0, 9.0],
    [2.2, 2.4, 0.0, 5.0],
    [2.2, 2.4, 6.0, 10.0],
    [3.4, 3.6, 0.0, 9.0],
    [4.6, 4.8, 1.0, 10.0],
    [5.8, 6.0, 0.0, 6.0],
    [5.8, 6.0, 7.0, 10.0],
    [7.0, 7.2, 1.0, 10.0],
    [8.2, 8.4, 0.0, 8.5],
    [8.4, 9.3, 8.3, 8.5],
    [9.3, 10.0, 7.1, 7.3],
    [8.4, 9.3, 5.9, 6.1],
    [9.3, 10.0, 4.7, 4.9],
    [8.4, 9.3, 3.5, 3.7],
    [9.3, 10.0, 2.3, 2.5],
];
/// Where it must park: x from and to, y from and to \[m\].
pub const TARGET: [f64; 4] = [9.0, 9.5, 0.0, 0.5];

/// The vehicle.
#[derive(Debug, Clone)]
pub struct Unicycle {
    /// Speed and half the tangent of the steering angle, of each input.
    inputs: Vec<(Interval, Interval)>,
}

impl Unicycle {
    /// SCOTS' inputs: seven speeds times seven steering angles, speed the faster index.
    pub fn new() -> Self {
        let tenths = |k: i32| Interval::point(f64::from(3 * k)) / Interval::point(10.0);
        let half = Interval::point(0.5);
        let inputs = STEPS
            .flat_map(|angle| STEPS.map(move |speed| (tenths(speed), tan(tenths(angle)) * half)))
            .collect();
        Self { inputs }
    }
}

impl Default for Unicycle {
    fn default() -> Self {
        Self::new()
    }
}

/// τ.
fn period() -> Interval {
    Interval::point(PERIOD_TENTHS) / Interval::point(10.0)
}

impl InvariantPlant<3> for Unicycle {
    fn inputs(&self) -> usize {
        self.inputs.len()
    }

    fn invariant(&self) -> [bool; 3] {
        [true, true, false]
    }

    fn displacement(&self, x: [Interval; 3], input: usize) -> [Interval; 3] {
        let (speed, t) = self.inputs[input];
        let way = speed * period();
        let half_turn = t * way;
        let (sine, cosine) = sin_cos(x[2] + half_turn);
        let mean = sinc(half_turn) * way;
        [
            mean * (cosine - t * sine),
            mean * (sine + t * cosine),
            half_turn + half_turn,
        ]
    }

    fn radius(&self, _x: [Interval; 3], r: [Interval; 3], input: usize) -> [Interval; 3] {
        let (speed, t) = self.inputs[input];
        let grown = speed.abs() * sqrt(Interval::ONE + t * t) * period() * r[2];
        [r[0] + grown, r[1] + grown, r[2]]
    }
}

/// SCOTS' grid.
pub fn shape() -> GridShape<3> {
    GridShape {
        lower: [-0.1, -0.1, -3.5],
        width: [WIDTH; 3],
        count: COUNT,
    }
}

/// The abstraction on SCOTS' grid.
///
/// # Errors
/// As [`InvariantAbstraction::new`].
pub fn abstraction() -> Result<InvariantAbstraction<3>, InvariantError> {
    InvariantAbstraction::new(shape(), &Unicycle::new())
}

/// Ends of a cell's place in twentieths of a metre: the ends of cells and walls are whole numbers
/// of them, so that no comparison hangs on a rounding.
fn twentieths(cell: u32) -> (i64, i64) {
    let middle = 4 * i64::from(cell);
    (middle - 2, middle + 2)
}

fn in_twentieths(metres: f64) -> i64 {
    (20.0 * metres).round() as i64
}

/// Cells chosen by the ends of their places in x and y, all headings.
fn by_place(choose: impl Fn((i64, i64), (i64, i64)) -> bool) -> BitSet {
    let shape = shape();
    let mut set = BitSet::new(shape.cells());
    for index in 0..shape.cells() {
        let [x, y, _] = shape.cell(index);
        if choose(twentieths(x), twentieths(y)) {
            set.insert(index);
        }
    }
    set
}

/// Cells that lie wholly in the target.
pub fn target() -> BitSet {
    let [left, right, bottom, top] = TARGET.map(in_twentieths);
    by_place(|x, y| left <= x.0 && x.1 <= right && bottom <= y.0 && y.1 <= top)
}

/// Cells that touch an obstacle.
pub fn avoid() -> BitSet {
    by_place(|x, y| {
        OBSTACLES.iter().any(|wall| {
            let [left, right, bottom, top] = wall.map(in_twentieths);
            left <= x.1 && x.0 <= right && bottom <= y.1 && y.0 <= top
        })
    })
}

/// A cell of SCOTS' start: at (0.4, 0.4), heading 0.
pub fn start(abstraction: &impl Abstraction<3>) -> usize {
    abstraction.shape().index([2, 2, 17])
}
