//! The grid as the engine sees it: real edges, widths and counts on up to six axes, first axis
//! fastest.
//!
//! For the charger's plant it is read off [`firmware::grid::Grid`], whose integers are the truth;
//! other plants give it directly.

/// A uniform grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridShape<const D: usize> {
    /// Lower edge of the first cell on each axis, in the plant's units.
    pub lower: [f64; D],
    /// Cell width on each axis, in the plant's units.
    pub width: [f64; D],
    /// Cells on each axis.
    pub count: [u32; D],
}

impl<const D: usize> GridShape<D> {
    /// Cells in all.
    pub fn cells(&self) -> usize {
        self.count.iter().map(|n| *n as usize).product()
    }

    /// Distance in the dense order between neighbours on each axis.
    pub fn strides(&self) -> [usize; D] {
        let mut strides = [1; D];
        for d in 1..D {
            strides[d] = strides[d - 1] * self.count[d - 1] as usize;
        }
        strides
    }

    /// Position of a cell in the dense order.
    pub fn index(&self, cell: [u32; D]) -> usize {
        let mut index = 0;
        for d in (0..D).rev() {
            index = index * self.count[d] as usize + cell[d] as usize;
        }
        index
    }

    /// The cell at a position of the dense order.
    pub fn cell(&self, mut index: usize) -> [u32; D] {
        let mut cell = [0; D];
        for d in 0..D {
            cell[d] = (index % self.count[d] as usize) as u32;
            index /= self.count[d] as usize;
        }
        cell
    }

    /// Positions of the cells of a box, both ends included, in the dense order.
    pub fn indices(&self, low: [u32; D], high: [u32; D]) -> impl Iterator<Item = usize> + '_ {
        let mut next = Some(low);
        std::iter::from_fn(move || {
            let cell = next?;
            let mut after = cell;
            next = None;
            for d in 0..D {
                if after[d] < high[d] {
                    after[d] += 1;
                    next = Some(after);
                    break;
                }
                after[d] = low[d];
            }
            Some(self.index(cell))
        })
    }

    /// Interval `[low, high]` of a cell on an axis.
    pub fn interval(&self, axis: usize, index: u32) -> (f64, f64) {
        let low = self.lower[axis] + self.width[axis] * f64::from(index);
        (low, low + self.width[axis])
    }
}
