//! The native half of the Python package `holdfast`.
//!
//! Values go over as texts and bytes: JSON for what people read, little-endian arrays for what
//! numpy reads. The Python half (`holdfast/__init__.py`) gives them names and shapes. Long work
//! runs with the interpreter released.

mod results;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use firmware::table::TableView;
use lab::simulation::baseline;
use lab::simulation::closed_loop::{self, Estimator};
use lab::simulation::scenario::Scenario;
use lab::simulation::trajectory::Run;
use model::spec as spec_room;
use synth::game::unwatched;
use synth::pipeline::{self, Encoding};
use synth::synthesis::{self, SolvedLaw};

/// Bad input: a `ValueError` with the error's own words.
fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The answer is "no": a `RuntimeError`.
fn no(error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// A specification.
#[pyclass(frozen, name = "Spec")]
struct Spec {
    inner: spec_room::Spec,
}

#[pymethods]
impl Spec {
    /// A shipped spec by name, or a file by path; overrides as `KEY=VALUE`.
    #[staticmethod]
    fn load(spec: &str, overrides: Vec<String>) -> PyResult<Self> {
        let inner = spec_room::Spec::load(spec, &overrides).map_err(value_error)?;
        Ok(Self { inner })
    }

    fn name(&self) -> &str {
        &self.inner.name
    }

    fn toml(&self) -> PyResult<String> {
        toml::to_string_pretty(&self.inner).map_err(value_error)
    }

    fn json(&self) -> PyResult<String> {
        serde_json::to_string(&self.inner).map_err(value_error)
    }

    fn hash(&self) -> String {
        self.inner
            .hash()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// The table's bytes, with or without games.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| pipeline::table_bytes(&self.inner, None, &unwatched));
        Ok(PyBytes::new(py, &bytes.map_err(no)?))
    }

    fn synth(&self, py: Python<'_>) -> PyResult<Synthesis> {
        let solved = py.detach(|| synthesis::synthesise(&self.inner, &unwatched));
        Ok(Synthesis {
            inner: solved.map_err(no)?,
        })
    }
}

/// The solved games of a spec.
#[pyclass(frozen, name = "Synthesis")]
struct Synthesis {
    inner: synthesis::Synthesis,
}

impl Synthesis {
    fn law(&self, name: &str) -> PyResult<&SolvedLaw> {
        let found = match name {
            "C1" => Some(&self.inner.c1),
            "C2" => self.inner.c2.as_ref(),
            "Hold" => self.inner.hold.as_ref(),
            other => return Err(value_error(format!("{other:?}; allowed: C1, C2, Hold"))),
        };
        found.ok_or_else(|| value_error(format!("the spec has no law {name}")))
    }
}

#[pymethods]
impl Synthesis {
    /// Lowest edge, width and number of cells, by axis.
    fn grid(&self) -> ([f64; 4], [f64; 4], [usize; 4]) {
        let grid = &self.inner.problem.grid;
        let unit = |micro: f64| micro / f64::from(firmware::units::MICRO);
        (
            grid.lower_edge().map(|edge| unit(edge.into())),
            grid.width().map(|width| unit(width.into())),
            grid.count().map(usize::from),
        )
    }

    /// The games in order, as JSON.
    fn problems(&self) -> PyResult<String> {
        results::problems(&self.inner).map_err(value_error)
    }

    /// Worst-case steps to the target of each cell, as 16-bit words, f fastest.
    fn ranks<'py>(&self, py: Python<'py>, law: &str) -> PyResult<Bound<'py, PyBytes>> {
        let ranks = &self.law(law)?.solution.ranks;
        let bytes: Vec<u8> = ranks.iter().flat_map(|rank| rank.to_le_bytes()).collect();
        Ok(PyBytes::new(py, &bytes))
    }

    /// Allowed inputs of each cell, as 32-bit words with a bit for each level, f fastest.
    fn masks<'py>(&self, py: Python<'py>, law: &str) -> PyResult<Bound<'py, PyBytes>> {
        let masks = &self.law(law)?.solution.masks;
        let bytes: Vec<u8> = masks.iter().flat_map(|mask| mask.to_le_bytes()).collect();
        Ok(PyBytes::new(py, &bytes))
    }

    /// The table's bytes.
    fn table<'py>(&self, py: Python<'py>, dense: bool) -> PyResult<Bound<'py, PyBytes>> {
        let encoding = if dense {
            Encoding::Dense
        } else {
            Encoding::default()
        };
        let emitted = py.detach(|| pipeline::emit(&self.inner, encoding, &unwatched));
        Ok(PyBytes::new(py, &emitted.map_err(no)?.bytes))
    }
}

/// The names of the shipped specs.
#[pyfunction]
fn shipped() -> Vec<&'static str> {
    spec_room::Spec::shipped_names().to_vec()
}

/// The rank of a cell that is not won.
#[pyfunction]
fn not_won() -> u16 {
    synth::game::NOT_WON
}

/// The verdict on a table, as JSON.
#[pyfunction]
fn verify_table(py: Python<'_>, table: &[u8], spec: &Spec) -> PyResult<String> {
    py.detach(|| results::verdict(table, &spec.inner))
        .map_err(value_error)
}

/// A run: summary and phases as JSON, and seven 64-bit numbers a sample: time, f, g, l, p,
/// participation, delivered.
#[pyfunction]
#[pyo3(signature = (spec, controller, table, loss_gw, duration_s, participation_error, seed))]
#[expect(
    clippy::too_many_arguments,
    reason = "the Python half gives them names"
)]
fn simulate<'py>(
    py: Python<'py>,
    spec: &Spec,
    controller: &str,
    table: Option<&[u8]>,
    loss_gw: Option<f64>,
    duration_s: Option<f64>,
    participation_error: f64,
    seed: u64,
) -> PyResult<(String, Bound<'py, PyBytes>)> {
    let spec = &spec.inner;
    let mut scenario = Scenario::of(spec);
    scenario.loss_gw = loss_gw.unwrap_or(scenario.loss_gw);
    scenario.duration_s = duration_s.unwrap_or(scenario.duration_s);
    scenario.participation_error = participation_error;
    scenario.seed = seed;
    scenario.check().map_err(value_error)?;
    let run = match (controller, table) {
        ("none", _) => py.detach(|| baseline::simulate(spec, &scenario, false)),
        ("baseline", _) => py.detach(|| baseline::simulate(spec, &scenario, true)),
        ("symbolic", Some(bytes)) => py.detach(|| symbolic(spec, bytes, &scenario))?,
        ("symbolic", None) => return Err(value_error("controller symbolic needs a table")),
        (other, _) => {
            let allowed = "allowed: none, baseline, symbolic";
            return Err(value_error(format!("controller {other:?}; {allowed}")));
        }
    };
    let (text, rows) = results::run(&run).map_err(value_error)?;
    Ok((text, PyBytes::new(py, &rows)))
}

fn symbolic(spec: &spec_room::Spec, bytes: &[u8], scenario: &Scenario) -> PyResult<Run> {
    let table = TableView::parse_for_spec(bytes, spec.hash());
    let table = table.map_err(|error| value_error(format!("the table is refused: {error:?}")))?;
    closed_loop::simulate(spec, &table, scenario, Estimator::FullState).map_err(value_error)
}

#[pymodule]
fn _holdfast(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Spec>()?;
    module.add_class::<Synthesis>()?;
    module.add_function(wrap_pyfunction!(shipped, module)?)?;
    module.add_function(wrap_pyfunction!(not_won, module)?)?;
    module.add_function(wrap_pyfunction!(verify_table, module)?)?;
    module.add_function(wrap_pyfunction!(simulate, module)?)
}
