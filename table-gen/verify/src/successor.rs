//! Where a whole cell goes in one period, recomputed from the plant: nothing is shared with the
//! games.

use firmware::grid::Grid;

use super::closed_loop::Model;
use super::estimate_error::PeriodEffect;
use model::interval::Interval;
use model::plant::STATES;

/// A box of cells, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cells {
    pub(super) low: [u16; STATES],
    pub(super) high: [u16; STATES],
}

/// The cells in which the next decision's state may lie a period after this one's was in a box,
/// which holds the errors before the way ([`super::estimate_error`]); `None` if some lie outside
/// the grid.
pub(super) fn successor(
    grid: &Grid,
    model: &Model,
    from: &[Interval; STATES],
    drift: &PeriodEffect,
) -> Option<Cells> {
    let mut cells = Cells {
        low: [0; STATES],
        high: [0; STATES],
    };
    for d in 0..STATES {
        let mut sum = drift.centre[d];
        for (phi, axis) in model.period.flow.phi[d].iter().zip(from) {
            sum = sum + *phi * *axis;
        }
        let low = (sum.low - drift.radius[d]).next_down();
        let high = (sum.high + drift.radius[d]).next_up();
        cells.low[d] = index(grid, d, low)?;
        cells.high[d] = index(grid, d, high)?;
    }
    Some(cells)
}

/// Index of the half-open cell that holds a number, exactly; `None` outside the grid.
pub(super) fn index(grid: &Grid, axis: usize, value: f64) -> Option<u16> {
    let lower = f64::from(grid.lower_edge()[axis]);
    let width = f64::from(grid.width()[axis]);
    let guess = ((value - lower) / width).floor();
    // The guess may be off by one where the quotient rounds to a whole number; edges are whole
    // numbers below 2^32, so the comparisons are exact.
    let edge = |i: f64| lower + i * width;
    let exact = if edge(guess) > value {
        guess - 1.0
    } else if edge(guess + 1.0) <= value {
        guess + 1.0
    } else {
        guess
    };
    // Written so that a NaN lies outside.
    let inside = exact >= 0.0 && exact < f64::from(grid.count()[axis]);
    inside.then_some(exact as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_belongs_to_the_cell_above() {
        let grid = Grid::new([-10, 0, 0, 0], [3, 1, 1, 1], [4, 1, 1, 1]).unwrap();
        assert_eq!(index(&grid, 0, -10.0), Some(0));
        assert_eq!(index(&grid, 0, (-7f64).next_down()), Some(0));
        assert_eq!(index(&grid, 0, -7.0), Some(1));
        assert_eq!(index(&grid, 0, (2f64).next_down()), Some(3));
        assert_eq!(index(&grid, 0, 2.0), None);
        assert_eq!(index(&grid, 0, (-10f64).next_down()), None);
        assert_eq!(index(&grid, 0, f64::NAN), None);
    }
}
