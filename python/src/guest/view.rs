//! What an estimator gets at its start, and a policy before each ping.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use sonarfix::localizer::Localizer;
use sonarfix_map::NamedWall;
use sonarfix_sim::observe;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::time::seconds;

use crate::localizer::Aim;
use crate::robot::Robot;
use crate::{floor, values};

/// The state of a localizer, and its walls.
struct Known {
    state: [f64; 7],
    covariance: [[f64; 7]; 7],
    walls: Vec<[[f64; 2]; 2]>,
}

impl Known {
    fn of(localizer: &Localizer, simulation: &Simulation) -> Self {
        let p = observe::covariance(localizer.filter());
        let ends = |wall: &NamedWall| [wall.from(), wall.to()];
        Self {
            state: observe::state(localizer.filter()).into(),
            covariance: std::array::from_fn(|row| std::array::from_fn(|at| p[(row, at)])),
            walls: simulation.scenario.floor.named_walls().iter().map(ends).collect(),
        }
    }

    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let [x, y, heading, ..] = self.state;
        PyArray1::from_slice(py, &[x, y, heading])
    }
}

/// What another estimator gets at the start of a run.
#[pyclass(frozen, module = "sonarfix")]
pub struct Setup {
    known: Known,
    robot: Robot,
}

impl Setup {
    pub fn of(localizer: &Localizer, simulation: &Simulation) -> Self {
        let known = Known::of(localizer, simulation);
        Self { known, robot: Robot { config: simulation.robot() } }
    }
}

#[pymethods]
impl Setup {
    /// The estimated start pose: x, y (metres), heading (radians) in the map frame; an array of shape (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.known.pose(py)
    }

    /// The covariance at the start, an array of shape (7, 7): x, y (m), heading (rad), scale errors of the right and the left
    /// wheel, error of the track width (m), scale error of the ranges.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        values::matrix(py, self.known.covariance)
    }

    /// The ends of the walls, an array of shape (n, 2, 2), metres in the map frame.
    #[getter]
    fn walls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        floor::ends(py, self.known.walls.iter().copied())
    }

    /// The robot, as its software is configured.
    #[getter]
    fn robot(&self) -> Robot {
        Robot { config: self.robot.config }
    }
}

/// What a policy gets before each ping: the localizer's estimate, and the localizer's own choice.
#[pyclass(frozen, module = "sonarfix")]
pub struct View {
    known: Known,
    time: f64,
    choice: Option<sonarfix::aim::Aim>,
}

impl View {
    pub fn of(localizer: &Localizer, simulation: &Simulation) -> Self {
        Self {
            known: Known::of(localizer, simulation),
            time: seconds(localizer.time().ticks()),
            choice: localizer.aim().ok(),
        }
    }
}

#[pymethods]
impl View {
    /// Seconds since the run began.
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// The estimated pose: x, y (metres), heading (radians) in the map frame; an array of shape (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.known.pose(py)
    }

    /// The covariance, an array of shape (7, 7), in the order of Setup.covariance.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        values::matrix(py, self.known.covariance)
    }

    /// The ends of the walls, an array of shape (n, 2, 2), metres in the map frame.
    #[getter]
    fn walls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        floor::ends(py, self.known.walls.iter().copied())
    }

    /// The ping that the localizer would choose; None if it can measure no wall.
    #[getter]
    fn choice(&self) -> Option<Aim> {
        self.choice.map(Aim)
    }
}
