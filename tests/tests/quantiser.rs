//! The quantiser at every cell boundary and one step to either side.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::grid::{Cell, Grid};
use firmware::units::State;
use model::spec::Spec;
use synth::problem::Problem;

/// Walks every edge of every axis of a grid, the other axes held at a point inside.
fn edges(grid: &Grid) {
    let inside: [i32; 4] =
        std::array::from_fn(|d| grid.lower_edge()[d] + grid.width()[d] as i32 / 2);
    for axis in 0..4 {
        let (low, width) = (
            i64::from(grid.lower_edge()[axis]),
            i64::from(grid.width()[axis]),
        );
        let count = i64::from(grid.count()[axis]);
        for edge in 0..=count {
            for step in [-1i64, 0, 1] {
                let mut state = inside;
                state[axis] = (low + edge * width + step) as i32;
                // By the definition, in wide integers and without division: the cell k with
                // low + k width <= x < low + (k + 1) width.
                let x = i64::from(state[axis]);
                let expected =
                    (0..count).find(|k| low + k * width <= x && x < low + (k + 1) * width);
                let found = grid.quantise(State(state));
                assert_eq!(
                    found.map(|cell| i64::from(cell.0[axis])),
                    expected,
                    "axis {axis} edge {edge} step {step}"
                );
                if let Some(cell) = found {
                    let (from, to) = grid.bounds(cell).unwrap()[axis];
                    assert!(i64::from(from) <= x && x < i64::from(to));
                }
            }
        }
    }
}

#[test]
fn every_boundary_of_the_shipped_grids() {
    for name in Spec::shipped_names() {
        let spec = Spec::load(name, &[]).unwrap();
        edges(&Problem::new(&spec).unwrap().grid);
    }
}

#[test]
fn extreme_states_and_grids() {
    let grid = Grid::new([i32::MIN; 4], [u32::MAX / 2; 4], [1, 1, 1, 2]).unwrap();
    assert_eq!(grid.quantise(State([i32::MIN; 4])), Some(Cell([0; 4])));
    assert_eq!(
        grid.quantise(State([i32::MIN, i32::MIN, i32::MIN, i32::MAX])),
        None
    );
    assert!(Grid::new([0; 4], [u32::MAX; 4], [1; 4]).is_err());
    assert!(Grid::new([0; 4], [1, 1, 0, 1], [1; 4]).is_err());
    assert!(Grid::new([0; 4], [1; 4], [u16::MAX; 4]).is_err());
    edges(&Grid::new([i32::MIN, -7, 0, 3], [1, 2, 3, 1000], [40, 30, 20, 10]).unwrap());
}

#[test]
fn the_dense_order_is_a_bijection() {
    let grid = Grid::new([0; 4], [1; 4], [3, 4, 5, 6]).unwrap();
    let mut seen = vec![false; grid.cells() as usize];
    for p in 0..6 {
        for l in 0..5 {
            for g in 0..4 {
                for f in 0..3 {
                    let index = grid.index(Cell([f, g, l, p])).unwrap() as usize;
                    assert!(!std::mem::replace(&mut seen[index], true));
                }
            }
        }
    }
    assert!(seen.into_iter().all(|s| s));
    assert_eq!(grid.index(Cell([3, 0, 0, 0])), None);
    assert_eq!(grid.bounds(Cell([0, 4, 0, 0])), None);
}
