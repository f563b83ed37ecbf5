//! One run.

use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sonarfix_sim::row::Row;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::trace::Trace;

use crate::floor;
use crate::table::Table;
use crate::{columns, values};

/// A run of a scenario, or the replay of a recording.
#[pyclass(frozen, module = "sonarfix")]
pub struct Run {
    pub scenario: String,
    pub seed: u64,
    pub trace: Trace,
    /// Whose row, and the row: that of the localizer, then that of the other estimator.
    pub rows: Vec<(String, Row)>,
    /// The poses of the other estimator at the ticks.
    pub poses: Vec<[f64; 3]>,
}

impl Run {
    /// Runs once.
    pub fn of(simulation: &Simulation, seed: u64) -> Result<Self, SimulationError> {
        let mut trace = simulation.empty_trace();
        let result = simulation.run(seed, &mut trace)?;
        let rows = vec![("sonarfix".to_owned(), Row::new(seed, &result))];
        let scenario = simulation.scenario.name.clone();
        Ok(Self { scenario, seed, trace, rows, poses: Vec::new() })
    }
}

#[pymethods]
impl Run {
    /// The name of the scenario.
    #[getter]
    fn scenario(&self) -> &str {
        &self.scenario
    }

    /// The seed.
    #[getter]
    fn seed(&self) -> u64 {
        self.seed
    }

    /// The trace as a table with the rows and the columns of ``sonarfix run --trace``: SI units, map frame.
    #[getter]
    fn trace(&self) -> PyResult<Table> {
        columns::of_trace(&self.trace)
    }

    /// The state at every encoder tick, the start first, as a table: truth, estimate, deviations, bound, dead reckoning.
    #[getter]
    fn ticks(&self) -> PyResult<Table> {
        columns::of_ticks(&self.trace)
    }

    /// The measurement cycles as a table: wall, bearing, range, outcome, innovation.
    #[getter]
    fn fixes(&self) -> PyResult<Table> {
        columns::of_fixes(&self.trace)
    }

    /// The result as a table with the columns of ``monte_carlo``, one row per estimator.
    #[getter]
    fn row(&self) -> PyResult<Table> {
        let (names, rows): (Vec<_>, Vec<_>) = self.rows.iter().cloned().unzip();
        let names = (names.len() > 1).then_some(names);
        columns::of_rows(&rows, names.as_deref())
    }

    /// The poses of the other estimator at the encoder ticks, an array of shape (n, 3): x, y (metres), heading (radians) in
    /// the map frame. Empty without one.
    #[getter]
    fn estimator_poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        values::matrix(py, self.poses.iter().copied())
    }

    /// The ends of the walls, an array of shape (n, 2, 2), metres in the map frame.
    #[getter]
    fn walls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        floor::ends(py, self.trace.walls.iter().map(|wall| [wall.from, wall.to]))
    }

    /// Draws walls, true path, estimate and dead reckoning with matplotlib; returns the axes.
    #[pyo3(signature = (ax=None, **keywords))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plots = slf.py().import("sonarfix.plots")?;
        plots.getattr("plot_run")?.call((slf, ax), keywords)
    }

    /// Draws the errors of position and heading over time, with the deviations and the bound; returns the figure.
    #[pyo3(signature = (**keywords))]
    fn plot_errors<'py>(
        slf: &Bound<'py, Self>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plots = slf.py().import("sonarfix.plots")?;
        plots.getattr("plot_errors")?.call((slf,), keywords)
    }

    /// An animation of the run for a notebook (matplotlib's FuncAnimation); ``speed`` is simulated seconds per second.
    #[pyo3(signature = (**keywords))]
    fn animate<'py>(
        slf: &Bound<'py, Self>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plots = slf.py().import("sonarfix.plots")?;
        plots.getattr("animate_run")?.call((slf,), keywords)
    }

    fn __repr__(&self) -> String {
        let ticks = self.trace.ticks.len();
        format!("<sonarfix.Run {:?}, seed {}: {ticks} ticks>", self.scenario, self.seed)
    }
}
