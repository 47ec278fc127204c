//! The DC-DC boost converter, the standard example of switched systems in symbolic control (Girard,
//! Pola and Tabuada, IEEE TAC 55(1), 2010), and SCOTS' example `dcdc`.
//!
//! States: inductor current i and capacitor voltage v (per unit; v scaled by 5 as customary). The
//! switch chooses one of two affine modes; the game keeps both states in a box for ever.

use crate::abstraction::affine::{AbstractionError, AffineAbstraction, AffineInput, Growth};
use crate::game::bitset::BitSet;
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Switching period \[s\] (normalised).
pub const PERIOD_S: f64 = 0.5;
/// Inductance x_l, capacitance x_c, resistances r_l, r_c, r_o and source voltage v_s (per unit).
const X_L: f64 = 3.0;
const X_C: f64 = 70.0;
const R_L: f64 = 0.05;
const R_C: f64 = 0.005;
const R_O: f64 = 1.0;
const V_S: f64 = 1.0;
/// Scale of the voltage.
const SCALE: f64 = 5.0;

/// The safe box: current in [1.15, 1.55], scaled voltage in [5.45, 5.85], cut into so many cells an
/// axis.
pub fn shape(cells: u32) -> GridShape<2> {
    let width = 0.4 / f64::from(cells);
    GridShape {
        lower: [1.15, 5.45],
        width: [width, width],
        count: [cells, cells],
    }
}

/// Cells on each axis of SCOTS' grid.
const SCOTS_CELLS: u32 = 801;
/// Width of its cells.
pub const SCOTS_WIDTH: f64 = 2.0 / 4e3;

/// SCOTS' grid: centres from 1.15 to 1.55 and from 5.45 to 5.85, so that the cells at its border
/// stick out of the safe box by half.
pub fn scots_shape() -> GridShape<2> {
    GridShape {
        lower: [1.15 - 0.5 * SCOTS_WIDTH, 5.45 - 0.5 * SCOTS_WIDTH],
        width: [SCOTS_WIDTH; 2],
        count: [SCOTS_CELLS; 2],
    }
}

/// Cells of SCOTS' grid that lie wholly in the safe box: all but the border.
pub fn scots_safe() -> BitSet {
    let shape = scots_shape();
    let mut set = BitSet::new(shape.cells());
    for index in 0..shape.cells() {
        if shape
            .cell(index)
            .iter()
            .all(|i| (1..SCOTS_CELLS - 1).contains(i))
        {
            set.insert(index);
        }
    }
    set
}

/// The abstraction on SCOTS' grid with SCOTS' growth bound.
///
/// # Errors
/// As [`AffineAbstraction::new`].
pub fn scots_abstraction() -> Result<AffineAbstraction<2>, AbstractionError> {
    let growth = Growth::GrowthBound;
    AffineAbstraction::new(scots_shape(), &inputs(), PERIOD_S, growth, [0.0; 2])
}

/// A of both positions of the switch.
pub fn modes() -> [[[Interval; 2]; 2]; 2] {
    let p = Interval::point;
    let load = p(R_O) + p(R_C);
    let leak = -(p(1.0) / (p(X_C) * load));
    let off = [[-(p(R_L) / p(X_L)), Interval::ZERO], [Interval::ZERO, leak]];
    let parallel = p(R_O) * p(R_C) / load;
    let on = [
        [
            -((p(R_L) + parallel) / p(X_L)),
            -(p(R_O) / (load * p(X_L) * p(SCALE))),
        ],
        [p(SCALE) * p(R_O) / (p(X_C) * load), leak],
    ];
    [off, on]
}

/// Both positions of the switch as inputs of the engine.
pub fn inputs() -> Vec<AffineInput<2>> {
    let source = Interval::point(V_S) / Interval::point(X_L);
    modes()
        .into_iter()
        .map(|a| AffineInput {
            a,
            b: [source, Interval::ZERO],
            drive: Interval::ONE,
        })
        .collect()
}

/// The abstraction with so many cells an axis.
///
/// # Errors
/// As [`AffineAbstraction::new`].
pub fn abstraction(cells: u32) -> Result<AffineAbstraction<2>, AbstractionError> {
    let growth = Growth::ExactLinear;
    AffineAbstraction::new(shape(cells), &inputs(), PERIOD_S, growth, [0.0; 2])
}
