//! The cells that a tree has to answer for, each with the set of leaves that would be right.

use firmware::grid::Cell;
use rayon::prelude::*;

use model::grid_shape::GridShape;
use model::plant::STATES;

/// A cell and its right leaves: bit v of `labels` for the leaf value v.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LabelledCell {
    /// Index of the cell on each axis.
    pub cell: [u16; STATES],
    /// Leaf values that are right here; not zero.
    pub labels: u64,
}

impl LabelledCell {
    /// The cell as the firmware knows it.
    pub fn cell(&self) -> Cell {
        Cell(self.cell)
    }
}

/// The cells of a grid that have labels, in the dense order. `labels` is asked for every dense
/// index.
pub fn labelled_cells(
    shape: &GridShape<STATES>,
    labels: impl Fn(usize, [u16; STATES]) -> u64 + Sync,
) -> Vec<LabelledCell> {
    let row = shape.count[0] as usize;
    (0..shape.cells() / row)
        .into_par_iter()
        .flat_map_iter(|at| {
            let first = shape.cell(at * row).map(|i| i as u16);
            let labels = &labels;
            (0..row).filter_map(move |f| {
                let mut cell = first;
                cell[0] = f as u16;
                let labels = labels(at * row + f, cell);
                (labels != 0).then_some(LabelledCell { cell, labels })
            })
        })
        .collect()
}

/// Lowest and highest cell on each axis.
pub(super) fn bounds(cells: &[LabelledCell]) -> ([u16; STATES], [u16; STATES]) {
    let (mut low, mut high) = ([u16::MAX; STATES], [0u16; STATES]);
    for cell in cells {
        for d in 0..STATES {
            low[d] = low[d].min(cell.cell[d]);
            high[d] = high[d].max(cell.cell[d]);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_in_the_dense_order_and_those_without_a_label_do_not() {
        let shape = GridShape {
            lower: [0.0; STATES],
            width: [1.0; STATES],
            count: [3, 2, 1, 2],
        };
        let found = labelled_cells(&shape, |index, cell| {
            assert_eq!(shape.index(cell.map(u32::from)), index);
            u64::from(cell[0] != 1) << cell[3]
        });
        let expected = [
            ([0, 0, 0, 0], 1),
            ([2, 0, 0, 0], 1),
            ([0, 1, 0, 0], 1),
            ([2, 1, 0, 0], 1),
            ([0, 0, 0, 1], 2),
            ([2, 0, 0, 1], 2),
            ([0, 1, 0, 1], 2),
            ([2, 1, 0, 1], 2),
        ];
        let expected = expected.map(|(cell, labels)| LabelledCell { cell, labels });
        assert_eq!(found, expected);
    }
}
