//! Which plane cuts a box of cells best: the one after which single leaves fit the most cells.

use super::cells::{LabelledCell, bounds};
use model::plant::STATES;

/// Leaf values that fit in a set of labels.
const LABELS: usize = 64;

/// A plane between cells: those below `threshold` on `axis` go left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plane {
    /// Axis, 0..4.
    pub axis: usize,
    /// Lowest index of the right side.
    pub threshold: u16,
}

/// How many cells of each slice of a box accept each label.
struct Histogram {
    low: [u16; STATES],
    /// For each axis, for each slice: cells, then cells by label.
    slices: [Vec<[u32; LABELS + 1]>; STATES],
}

impl Histogram {
    fn new(cells: &[LabelledCell]) -> Self {
        let (low, high) = bounds(cells);
        let mut slices: [Vec<[u32; LABELS + 1]>; STATES] =
            std::array::from_fn(|d| vec![[0; LABELS + 1]; usize::from(high[d] - low[d]) + 1]);
        for cell in cells {
            for d in 0..STATES {
                let slice = &mut slices[d][usize::from(cell.cell[d] - low[d])];
                slice[LABELS] += 1;
                let mut rest = cell.labels;
                while rest != 0 {
                    slice[rest.trailing_zeros() as usize] += 1;
                    rest &= rest - 1;
                }
            }
        }
        Self { low, slices }
    }
}

/// Bits that an exception costs on top of saying where it is. Larger values ask for purer sides;
/// between 2 and 8 the trees of the shipped specs differ by a few percent.
const EXCEPTION_BITS: f64 = 2.0;

/// Cost in bits of a side of which `fit` of `cells` cells accept the best label: to say which cells
/// are exceptions (the entropy of the choice) and what they get instead.
fn cost(cells: u32, fit: u32) -> f64 {
    let (n, k) = (f64::from(cells), f64::from(fit));
    let m = n - k;
    if m == 0.0 {
        return 0.0;
    }
    m * (n / m).log2() + k * (n / k).log2() + EXCEPTION_BITS * m
}

/// The best plane through cells that no single label fits; `None` if all cells are one. With more
/// `balance` the costlier side counts more: paths get shorter and trees larger.
pub fn best_plane(cells: &[LabelledCell], balance: f64) -> Option<Plane> {
    let histogram = Histogram::new(cells);
    let mut best: Option<(f64, Plane)> = None;
    for axis in 0..STATES {
        let slices = &histogram.slices[axis];
        let mut total = [0u32; LABELS + 1];
        for slice in slices {
            for (sum, n) in total.iter_mut().zip(slice) {
                *sum += n;
            }
        }
        let mut left = [0u32; LABELS + 1];
        for (at, slice) in slices.iter().enumerate().skip(1) {
            for (sum, n) in left.iter_mut().zip(&slices[at - 1]) {
                *sum += n;
            }
            if slice[LABELS] == 0 {
                continue;
            }
            let mut fit_left = 0;
            let mut fit_right = 0;
            for label in 0..LABELS {
                fit_left = fit_left.max(left[label]);
                fit_right = fit_right.max(total[label] - left[label]);
            }
            let below = cost(left[LABELS], fit_left);
            let above = cost(total[LABELS] - left[LABELS], fit_right);
            let score = below + above + balance * below.max(above);
            let plane = Plane {
                axis,
                threshold: histogram.low[axis] + at as u16,
            };
            if best.is_none_or(|(other, _)| score < other) {
                best = Some((score, plane));
            }
        }
    }
    best.map(|(_, plane)| plane)
}

/// The plane that halves the axis on which the cells spread widest; `None` if all cells are one.
pub fn widest_plane(cells: &[LabelledCell]) -> Option<Plane> {
    let (low, high) = bounds(cells);
    let axis = (0..STATES)
        .rev()
        .max_by_key(|d| high[*d].saturating_sub(low[*d]))?;
    let extent = high[axis].checked_sub(low[axis]).filter(|n| *n > 0)?;
    Some(Plane {
        axis,
        threshold: low[axis] + extent / 2 + 1,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(labels: &[u64]) -> Vec<LabelledCell> {
        let labels = labels.iter().zip(0..);
        labels
            .map(|(labels, f)| LabelledCell {
                cell: [f, 0, 0, 0],
                labels: *labels,
            })
            .collect()
    }

    #[test]
    fn an_exception_costs_the_entropy_of_saying_where_it_is() {
        assert_eq!(cost(8, 8), 0.0);
        // One of four: lb 4 bits to pick it, 3 lb (4/3) for the others, and the two of the
        // constant.
        assert!((cost(4, 3) - (2.0 + 3.0 * (4.0f64 / 3.0).log2() + EXCEPTION_BITS)).abs() < 1e-12);
        assert!(cost(8, 6) > cost(8, 7));
    }

    #[test]
    fn the_plane_leaves_the_cheapest_exceptions() {
        // Labels A A B A B B B B. Below f = 4 one of four is an exception: 5.2 bits; from f = 2 on
        // it is one of six: 5.9 bits; any other plane leaves more.
        let plane = best_plane(&cells(&[1, 1, 2, 1, 2, 2, 2, 2]), 0.0);
        let expected = Plane {
            axis: 0,
            threshold: 4,
        };
        assert_eq!(plane, Some(expected));
    }

    #[test]
    fn a_single_cell_cannot_be_cut() {
        assert_eq!(best_plane(&cells(&[1]), 0.0), None);
        assert_eq!(widest_plane(&cells(&[1])), None);
        assert_eq!(widest_plane(&[]), None);
    }

    #[test]
    fn the_widest_axis_is_halved_and_neither_side_is_empty() {
        let corner = |cell| LabelledCell { cell, labels: 1 };
        let plane = widest_plane(&[corner([4, 10, 0, 0]), corner([7, 15, 0, 0])]);
        let expected = Plane {
            axis: 1,
            threshold: 13,
        };
        assert_eq!(plane, Some(expected));
        // Two neighbours: one on each side. Of equal axes the first.
        let plane = widest_plane(&[corner([4, 4, 0, 0]), corner([5, 5, 0, 0])]);
        let expected = Plane {
            axis: 0,
            threshold: 5,
        };
        assert_eq!(plane, Some(expected));
    }
}
