//! Abstraction of any plant with a growth bound, as in SCOTS: the successor of a cell lies around
//! the successor of its centre, within a radius that the plant bounds.
//!
//! The plant is responsible for soundness: [`GrowthBound::centre`] and [`GrowthBound::radius`]
//! together must enclose every successor of the cell under every disturbance, rounding included.

use super::{Abstraction, CellBox};
use model::grid_shape::GridShape;

/// A sampled plant with a growth bound.
pub trait GrowthBound<const D: usize>: Sync {
    /// Number of inputs, 1..=32.
    fn inputs(&self) -> usize;

    /// Successor of a point after one period.
    fn centre(&self, x: [f64; D], input: usize) -> [f64; D];

    /// Bound on the distance of any successor of the box `x ± r` from [`GrowthBound::centre`] of x.
    fn radius(&self, x: [f64; D], r: [f64; D], input: usize) -> [f64; D];
}

/// The abstraction of a plant with a growth bound. It prepares nothing, so it is slow; it serves
/// non-linear plants.
#[derive(Debug, Clone)]
pub struct GrowthAbstraction<P, const D: usize> {
    shape: GridShape<D>,
    plant: P,
}

impl<P: GrowthBound<D>, const D: usize> GrowthAbstraction<P, D> {
    /// The abstraction of a plant on a grid.
    pub fn new(shape: GridShape<D>, plant: P) -> Self {
        Self { shape, plant }
    }
}

impl<P: GrowthBound<D>, const D: usize> Abstraction<D> for GrowthAbstraction<P, D> {
    type Anchor = [f64; D];
    type Inputs = u32;

    fn shape(&self) -> &GridShape<D> {
        &self.shape
    }

    fn inputs(&self) -> usize {
        self.plant.inputs()
    }

    fn anchor(&self, cell: [u32; D]) -> [f64; D] {
        std::array::from_fn(|d| {
            self.shape.lower[d] + self.shape.width[d] * (f64::from(cell[d]) + 0.5)
        })
    }

    fn successor(&self, anchor: &[f64; D], input: usize) -> Option<CellBox<D>> {
        let half = self.shape.width.map(|w| (0.5 * w).next_up());
        let centre = self.plant.centre(*anchor, input);
        let radius = self.plant.radius(*anchor, half, input);
        let (mut low, mut high) = ([0u32; D], [0u32; D]);
        for d in 0..D {
            // Four roundings separate the ends from the exact index; four steps outward cover them.
            let scale = |end: f64| (end - self.shape.lower[d]) / self.shape.width[d];
            let slack =
                4.0 * f64::EPSILON * (centre[d].abs() + radius[d] + self.shape.lower[d].abs())
                    / self.shape.width[d];
            let first = (scale(centre[d] - radius[d]) - slack).floor();
            let last = (scale(centre[d] + radius[d]) + slack).floor();
            // Written so that a NaN leaves the grid.
            if !(first >= 0.0 && last < f64::from(self.shape.count[d])) {
                return None;
            }
            low[d] = first as u32;
            high[d] = last as u32;
        }
        Some(CellBox { low, high })
    }
}
