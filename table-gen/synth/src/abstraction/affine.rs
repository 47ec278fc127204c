//! Abstraction of a switched affine system `x' = A_m x + b v(t)`, where an input chooses the mode m
//! and the interval in which the drive v may vary.
//!
//! The successor of a cell is a box whose centre is affine in the cell's index and whose radius
//! depends on the input alone. So a box needs one sum of table entries on each axis, in fixed point
//! with 40 fractional bits of a cell:
//!
//! ```text
//! low_d  = floor(Σ_j T_dj[c_j] + offset_d(u))          high_d = floor(Σ_j T_dj[c_j] + offset_d(u)
//! + span_d(u))
//! ```
//!
//! **Rounding.** Φ, Γ and the absolute integrals are intervals that contain the exact values. Each
//! table entry is the middle of an interval, rounded to fixed point; the entry's largest error over
//! the axis (half the interval plus half a unit) is added to the radius, and the offset and span
//! are rounded outward. Sums of i64 are exact. So the box contains the real successors, whatever
//! the cell.
//!
//! **Errors of the estimate.** The cell that the controller sees may differ from the real state by
//! e on each axis. The real state before the step lies in the cell widened by e; the estimate after
//! it in the successor widened by e again.

mod block_tables;
mod blocks;

use self::block_tables::BlockTables;
use super::{Abstraction, BlockCore, BlockExtents, CellBox, Extents};
use model::flow::{Flow, Matrix, Vector, absolute_integral, metzler};
use model::grid_shape::GridShape;
use model::interval::Interval;

/// Fractional bits of a cell.
const FRACTION_BITS: u32 = 40;
/// One cell in fixed point.
const ONE: f64 = (1u64 << FRACTION_BITS) as f64;
/// Largest index, in cells, that a sum may reach: leaves two bits of headroom in i64.
const INDEX_MAX: f64 = (1u64 << (61 - FRACTION_BITS)) as f64;

/// How the radius of a cell grows over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Growth {
    /// `exp(L τ)` with the Metzler matrix L of A, as SCOTS computes it.
    GrowthBound,
    /// `|exp(A τ)|`, exact for a linear system.
    ExactLinear,
}

/// One input of a switched affine system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AffineInput<const D: usize> {
    /// A of the mode that the input chooses.
    pub a: Matrix<D>,
    /// Direction of the drive.
    pub b: Vector<D>,
    /// Interval in which the drive may vary within the step.
    pub drive: Interval,
}

/// What an input adds to the state over a step \[plant units\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift<const D: usize> {
    /// Enclosure of the centre.
    pub centre: Vector<D>,
    /// Largest distance from it on each axis.
    pub radius: [f64; D],
}

/// Errors of what the controller knows \[plant units\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors<const D: usize> {
    /// Widens the cell before the step.
    pub before: [f64; D],
    /// Widens its successor.
    pub after: [f64; D],
}

/// Why an abstraction cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AbstractionError {
    /// No input, or more than the masks hold.
    #[error("{found} inputs; the engine's masks hold 1 to 32")]
    Inputs {
        /// Inputs found.
        found: usize,
    },
    /// A cell of zero, negative or non-finite width.
    #[error("cell width {width} on axis {axis}; it must be finite and above zero")]
    Width {
        /// The axis.
        axis: usize,
        /// Width found.
        width: f64,
    },
    /// A successor that the fixed point cannot hold: the plant is too unstable for the step.
    #[error(
        "a successor lies {cells:.3e} cells away on axis {axis}, more than {INDEX_MAX:.0}: the plant grows too fast for this period; shorten the period or widen the cells"
    )]
    Overflow {
        /// The axis.
        axis: usize,
        /// Distance in cells.
        cells: f64,
    },
    /// A negative or non-finite step.
    #[error("period {period_s} s; it must be finite and above zero")]
    Period {
        /// Period found \[s\].
        period_s: f64,
    },
}

/// Tables of one mode: `tables[d][j][i]` is what cell index i on axis j adds to the successor's
/// lower end on axis d.
#[derive(Debug, Clone)]
struct Mode<const D: usize> {
    a: Matrix<D>,
    b: Vector<D>,
    tables: Vec<[Vec<i64>; D]>,
    /// Error of the table sums \[cells\].
    error: [f64; D],
    /// Radius that the cell itself contributes \[plant units\].
    radius: [f64; D],
    flow: Flow<D>,
    absolute: [f64; D],
    /// Lowest (not above zero) and highest (not below zero) change of the sums within a block.
    travel: [(i64, i64); D],
}

#[derive(Debug, Clone, Copy)]
struct InputStep<const D: usize> {
    mode: usize,
    offset: [i64; D],
    span: [i64; D],
}

/// The abstraction.
#[derive(Debug, Clone)]
pub struct AffineAbstraction<const D: usize> {
    shape: GridShape<D>,
    modes: Vec<Mode<D>>,
    steps: Vec<InputStep<D>>,
    extents: Extents<D>,
    blocks: BlockTables<D>,
}

impl<const D: usize> AffineAbstraction<D> {
    /// Builds the abstraction for a period \[s\] and an error of the estimate on each axis \[plant
    /// units\].
    ///
    /// # Errors
    /// Bad widths, inputs or period, or a plant that leaves the fixed point's range in one step.
    pub fn new(
        shape: GridShape<D>,
        inputs: &[AffineInput<D>],
        period_s: f64,
        growth: Growth,
        measurement: [f64; D],
    ) -> Result<Self, AbstractionError> {
        let errors = Errors {
            before: measurement,
            after: measurement,
        };
        Self::with_drifts(shape, inputs, period_s, growth, errors, None)
    }

    /// The same with errors of its own before and after the step, and with what each input adds
    /// over the step where that is not the response to the input's own drive (commands that act
    /// late).
    ///
    /// # Errors
    /// As [`AffineAbstraction::new`].
    pub fn with_drifts(
        shape: GridShape<D>,
        inputs: &[AffineInput<D>],
        period_s: f64,
        growth: Growth,
        errors: Errors<D>,
        drifts: Option<&[Drift<D>]>,
    ) -> Result<Self, AbstractionError> {
        if inputs.is_empty() || inputs.len() > 32 {
            return Err(AbstractionError::Inputs {
                found: inputs.len(),
            });
        }
        if !(period_s.is_finite() && period_s > 0.0) {
            return Err(AbstractionError::Period { period_s });
        }
        for (axis, width) in shape.width.into_iter().enumerate() {
            if !(width.is_finite() && width > 0.0) {
                return Err(AbstractionError::Width { axis, width });
            }
        }
        let mut modes: Vec<Mode<D>> = Vec::new();
        let mut steps = Vec::with_capacity(inputs.len());
        for (index, input) in inputs.iter().enumerate() {
            let known = modes
                .iter()
                .position(|mode| mode.a == input.a && mode.b == input.b);
            let mode = match known {
                Some(mode) => mode,
                None => {
                    modes.push(Mode::new(&shape, input, period_s, growth, errors.before)?);
                    modes.len() - 1
                }
            };
            let drift = match drifts.and_then(|drifts| drifts.get(index)) {
                Some(drift) => *drift,
                None => modes[mode].drift(input.drive),
            };
            let (offset, span) = modes[mode].step(&shape, &drift, errors.after)?;
            steps.push(InputStep { mode, offset, span });
        }
        let mut extents = Extents {
            min: [u32::MAX; D],
            max: [0; D],
        };
        for step in &steps {
            for d in 0..D {
                let whole = (step.span[d] >> FRACTION_BITS) as u32;
                extents.min[d] = extents.min[d].min(whole + 1);
                extents.max[d] = extents.max[d].max(whole + 2);
            }
        }
        let mut abstraction = Self {
            shape,
            modes,
            steps,
            extents,
            blocks: BlockTables::single(),
        };
        abstraction.choose_blocks();
        Ok(abstraction)
    }

    /// Radius of the successor box of every cell under an input, before rounding to cells \[plant
    /// units\].
    pub fn radius(&self, input: usize) -> [f64; D] {
        let step = &self.steps[input];
        let mut radius = [0.0; D];
        for d in 0..D {
            radius[d] = step.span[d] as f64 / ONE / 2.0 * self.shape.width[d];
        }
        radius
    }

    /// Table sums of an anchored cell in a mode.
    #[inline]
    fn sums_of(&self, anchor: &AffineAnchor<D>, mode: usize) -> [i64; D] {
        if mode == 0 {
            anchor.sums
        } else {
            self.sums(mode, anchor.cell)
        }
    }

    fn sums(&self, mode: usize, cell: [u32; D]) -> [i64; D] {
        let mut sums = [0i64; D];
        for (d, sum) in sums.iter_mut().enumerate() {
            for j in 0..D {
                *sum += self.modes[mode].tables[d][j][cell[j] as usize];
            }
        }
        sums
    }
}

impl<const D: usize> Mode<D> {
    fn new(
        shape: &GridShape<D>,
        input: &AffineInput<D>,
        period_s: f64,
        growth: Growth,
        measurement: [f64; D],
    ) -> Result<Self, AbstractionError> {
        let flow = Flow::over(&input.a, &input.b, period_s);
        let (bound, absolute) = match growth {
            Growth::ExactLinear => {
                let absolute = absolute_integral(&input.a, &input.b, period_s);
                (flow.phi, absolute)
            }
            Growth::GrowthBound => {
                let l = metzler(&input.a);
                let b = input.b.map(Interval::abs);
                // exp(L s)|b| is not negative, so its integral is that of its magnitude.
                let grown = Flow::over(&l, &b, period_s);
                (grown.phi, grown.gamma.map(Interval::magnitude))
            }
        };
        let mut mode = Self {
            a: input.a,
            b: input.b,
            tables: Vec::with_capacity(D),
            error: [0.0; D],
            radius: [0.0; D],
            flow,
            absolute,
            travel: [(0, 0); D],
        };
        for d in 0..D {
            let mut row: [Vec<i64>; D] = std::array::from_fn(|_| Vec::new());
            let width = Interval::point(shape.width[d]);
            for j in 0..D {
                let scale = flow.phi[d][j] * Interval::point(shape.width[j]) / width;
                let mut error = 0.0f64;
                for i in 0..shape.count[j] {
                    let exact = scale * Interval::point(f64::from(i));
                    let entry = fixed(exact.mid(), d)?;
                    // |real - entry| <= the interval's radius + its middle's distance to the entry.
                    let distance = (exact.mid() - entry as f64 / ONE).abs();
                    error = error.max((exact.radius() + distance).next_up());
                    row[j].push(entry);
                }
                mode.error[d] = (mode.error[d] + error).next_up();
                let reach = (0.5 * shape.width[j] + measurement[j]).next_up();
                let grown = (bound[d][j].magnitude() * reach).next_up();
                mode.radius[d] = (mode.radius[d] + grown).next_up();
            }
            mode.tables.push(row);
        }
        Ok(mode)
    }

    /// What a drive that varies in an interval adds over the step.
    fn drift(&self, drive: Interval) -> Drift<D> {
        let radius = drive.radius();
        Drift {
            centre: self
                .flow
                .gamma
                .map(|gamma| gamma * Interval::point(drive.mid())),
            radius: self.absolute.map(|absolute| (absolute * radius).next_up()),
        }
    }

    /// Offset and span of an input.
    fn step(
        &self,
        shape: &GridShape<D>,
        drift: &Drift<D>,
        after: [f64; D],
    ) -> Result<([i64; D], [i64; D]), AbstractionError> {
        let (mut offset, mut span) = ([0i64; D], [0i64; D]);
        for d in 0..D {
            // Centre of the box for cell index 0 on every axis, relative to the grid's lower edge.
            let mut centre = drift.centre[d];
            for j in 0..D {
                let middle = Interval::point(shape.lower[j])
                    + Interval::point(0.5) * Interval::point(shape.width[j]);
                centre = centre + self.flow.phi[d][j] * middle;
            }
            centre = centre - Interval::point(shape.lower[d]);
            let radius = ((self.radius[d] + drift.radius[d]).next_up() + after[d]).next_up();
            let width = Interval::point(shape.width[d]);
            let spread = Interval {
                low: -radius,
                high: radius,
            };
            let ends = (centre + spread) / width;
            let low = (ends.low - self.error[d]).next_down();
            let high = (ends.high + self.error[d]).next_up();
            if low.abs().max(high.abs()) > INDEX_MAX {
                return Err(AbstractionError::Overflow {
                    axis: d,
                    cells: low.abs().max(high.abs()),
                });
            }
            // Scaling by a power of two is exact; floor and ceil round outward.
            offset[d] = (low * ONE).floor() as i64;
            span[d] = (high * ONE).ceil() as i64 - offset[d];
        }
        Ok((offset, span))
    }
}

/// A number of cells in fixed point, rounded to nearest.
fn fixed(cells: f64, axis: usize) -> Result<i64, AbstractionError> {
    if cells.is_nan() || cells.abs() > INDEX_MAX {
        return Err(AbstractionError::Overflow { axis, cells });
    }
    Ok((cells * ONE).round() as i64)
}

/// Cell and table sums of its first mode.
#[derive(Debug, Clone, Copy)]
pub struct AffineAnchor<const D: usize> {
    cell: [u32; D],
    sums: [i64; D],
}

impl<const D: usize> Abstraction<D> for AffineAbstraction<D> {
    type Anchor = AffineAnchor<D>;
    type Inputs = u32;

    fn shape(&self) -> &GridShape<D> {
        &self.shape
    }

    fn inputs(&self) -> usize {
        self.steps.len()
    }

    fn anchor(&self, cell: [u32; D]) -> AffineAnchor<D> {
        let sums = self.sums(0, cell);
        AffineAnchor { cell, sums }
    }

    #[inline]
    fn successor(&self, anchor: &AffineAnchor<D>, input: usize) -> Option<CellBox<D>> {
        let step = &self.steps[input];
        let sums = self.sums_of(anchor, step.mode);
        let (mut low, mut high) = ([0u32; D], [0u32; D]);
        let mut inside = true;
        for d in 0..D {
            let at = sums[d] + step.offset[d];
            let (first, last) = (at >> FRACTION_BITS, (at + step.span[d]) >> FRACTION_BITS);
            inside &= first >= 0 && last < i64::from(self.shape.count[d]);
            low[d] = first as u32;
            high[d] = last as u32;
        }
        inside.then_some(CellBox { low, high })
    }

    fn extents(&self) -> Option<Extents<D>> {
        Some(self.extents)
    }

    fn block(&self) -> [u32; D] {
        self.blocks.block
    }

    fn group(&self) -> [u32; D] {
        self.blocks.group
    }

    fn block_extents(&self) -> Option<BlockExtents<D>> {
        Some(self.blocks.extents)
    }

    #[inline]
    fn group_hull(&self, first: &AffineAnchor<D>) -> Option<CellBox<D>> {
        self.hull_of_all(first, &self.blocks.group_travel, &self.blocks.extents.group)
    }

    #[inline]
    fn block_hull(&self, first: &AffineAnchor<D>, input: Option<usize>) -> Option<CellBox<D>> {
        match input {
            Some(input) => self.hull_of_input(first, input),
            None => self.hull_of_all(
                first,
                &self.modes[0].travel,
                &self.blocks.extents.hull_of_all,
            ),
        }
    }

    #[inline]
    fn block_core(&self, first: &AffineAnchor<D>, input: usize) -> BlockCore<D> {
        self.core_of_input(first, input)
    }
}
