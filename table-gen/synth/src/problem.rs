//! Everything that the games and the compression derive from a spec, computed once.
//!
//! It stands in this package and not beside the spec: the verifier derives the same things by
//! itself, and must not reach this.

use firmware::grid::{Grid, GridError};
use model::flow::{Matrix, Vector};
use model::grid_shape::GridShape;
use model::plant::{Plant, STATES};
use model::spec::Spec;

use crate::abstraction::affine::AffineInput;
use crate::changeover::Changeover;
use crate::delay::{Delay, DelayError};
use crate::drives::{MICRO, measurement_micro, net_power};

/// A spec and what follows from it.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The spec.
    pub spec: Spec,
    /// The device's grid.
    pub grid: Grid,
    /// The engine's view of it, in micro-units.
    pub shape: GridShape<STATES>,
    /// A of `x' = A x + b v`.
    pub a: Matrix<STATES>,
    /// b of `x' = A x + b v`.
    pub b: Vector<STATES>,
    /// The inputs as drives of the plant, by level.
    pub inputs: Vec<AffineInput<STATES>>,
    /// The period \[s\], a whole number of milliseconds.
    pub period_s: f64,
    /// Bound of the estimate's error \[micro-units\].
    pub measurement: [f64; STATES],
    /// The delay of the commands, if there is one: the least of a range.
    pub delay: Option<Delay>,
    /// How every period begins where the delay is a range.
    pub changeover: Option<Changeover>,
    /// Bound of the error of what the games know \[micro-units\]: the estimate's, or, with a delay,
    /// the prediction's.
    pub known_within: [f64; STATES],
    /// I1 \[µHz\].
    pub outer: [f64; 2],
    /// I2 \[µHz\].
    pub inner: [f64; 2],
    /// Lowest allowed frequency \[µHz\].
    pub containment: Option<f64>,
}

/// Why a spec is no problem that can be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A delay that the device cannot predict over.
    #[error(transparent)]
    Delay(#[from] DelayError),
    /// The spec's grid is not one for the device.
    #[error("the grid does not fit the device: {0:?}")]
    Grid(GridError),
}

impl Problem {
    /// Derives everything.
    ///
    /// # Errors
    /// A grid that does not fit the device, or a delay that it cannot predict over.
    pub fn new(spec: &Spec) -> Result<Self, ProblemError> {
        Self::on_grid(spec, device_grid(spec)?)
    }

    /// The same on another grid than the spec's, for measurements of the engine.
    ///
    /// # Errors
    /// A delay that the device cannot predict over.
    pub fn on_grid(spec: &Spec, grid: Grid) -> Result<Self, ProblemError> {
        let (a, b) = Plant::new(spec).matrices();
        let inputs: Vec<_> = (0..spec.input.levels())
            .map(|level| AffineInput {
                a,
                b,
                drive: net_power(spec, level),
            })
            .collect();
        let delay = Delay::of(spec)?;
        let changeover = Changeover::of(spec, inputs.iter().map(|input| input.drive));
        let measurement = measurement_micro(spec);
        let requirements = &spec.requirements;
        Ok(Self {
            spec: spec.clone(),
            shape: grid_shape(&grid),
            grid,
            a,
            b,
            inputs,
            period_s: f64::from(spec.sampling.period_ms()) / 1000.0,
            measurement,
            known_within: delay.as_ref().map_or(measurement, |delay| delay.effective),
            delay,
            changeover,
            outer: requirements.outer_micro().map(f64::from),
            inner: requirements.inner_micro().map(f64::from),
            containment: requirements.containment_hz.map(containment_micro),
        })
    }
}

/// The device's grid of a spec; all that a response needs.
///
/// # Errors
/// A grid that does not fit the device.
pub fn device_grid(spec: &Spec) -> Result<Grid, ProblemError> {
    // Counts above 65535 were refused by the spec.
    let count = spec.grid.cell_counts().map(|n| n as u16);
    let (lower, width) = (spec.grid.lower_edges_micro(), spec.grid.widths_micro());
    Grid::new(lower, width, count).map_err(ProblemError::Grid)
}

/// The engine's view of a device's grid, in micro-units.
fn grid_shape(grid: &Grid) -> GridShape<STATES> {
    GridShape {
        lower: grid.lower_edge().map(f64::from),
        width: grid.width().map(f64::from),
        count: grid.count().map(u32::from),
    }
}

/// Containment \[µHz\], rounded up if it is no whole number of them.
fn containment_micro(hz: f64) -> f64 {
    let micro = hz * MICRO;
    // The product of a decimal and 1e6 may miss a whole number by a rounding; a thousandth of a µHz
    // decides.
    if (micro - micro.round()).abs() < 1e-3 {
        micro.round()
    } else {
        micro.ceil()
    }
}
