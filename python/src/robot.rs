//! Robots as their software is configured.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::robot_file;

use crate::{errors, values};

/// A robot as its software is configured: the content of a robot file (docs/formats.md).
///
/// ``source`` is the path of a robot file, or a dict with its keys. Raises FileError.
#[pyclass(frozen, module = "sonarfix")]
pub struct Robot {
    pub config: RobotConfig,
}

impl Robot {
    /// Reads a robot file.
    pub fn read(path: &Path) -> PyResult<Self> {
        let config = robot_file::read(path).map_err(|error| errors::file(&error))?;
        Ok(Self { config })
    }
}

#[pymethods]
impl Robot {
    #[new]
    fn new(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        match source.cast::<PyDict>() {
            Ok(table) => Self::parse(&values::toml_text(table)?),
            Err(_) => Self::read(&source.extract::<PathBuf>()?),
        }
    }

    /// Reads the text of a robot file.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        let config = robot_file::parse(text, "robot.toml").map_err(|error| errors::file(&error))?;
        Ok(Self { config })
    }

    /// The text of the robot file.
    fn to_toml(&self) -> String {
        robot_file::text(&self.config)
    }

    /// Distance between the wheels' contact points, metres.
    #[getter]
    fn track_width(&self) -> f64 {
        self.config.localizer.drive.track_width.0.into()
    }

    /// The numbers of the filter's model: a dict with ``track_width`` (m), ``wheel_noise`` (m/√m), ``scale_walk`` (1/√m),
    /// ``track_width_walk`` (m/√m), ``mount`` (m ahead, m left), ``range_noise`` (m), ``range_noise_per_metre``,
    /// ``min_range``, ``max_range`` (m), ``cone`` (half of it, rad), ``servo`` (rightmost and leftmost bearing, rad).
    #[getter]
    fn model<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (drive, sonar) = (&self.config.localizer.drive, &self.config.localizer.rangers.first);
        let of = PyDict::new(py);
        let numbers = [
            ("track_width", drive.track_width.0),
            ("wheel_noise", drive.wheel_noise.0.0),
            ("scale_walk", drive.scale_walk.0),
            ("track_width_walk", drive.track_width_walk.0.0),
            ("range_noise", sonar.noise.floor.0),
            ("range_noise_per_metre", sonar.noise.per_metre),
            ("min_range", sonar.min_range.0),
            ("max_range", sonar.max_range.0),
            ("cone", sonar.cone.0),
        ];
        for (name, value) in numbers {
            of.set_item(name, f64::from(value))?;
        }
        of.set_item("mount", (f64::from(sonar.mount.x.0), f64::from(sonar.mount.y.0)))?;
        of.set_item("servo", (f64::from(sonar.servo.0.0), f64::from(sonar.servo.1.0)))?;
        Ok(of)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let parse = slf.get_type().getattr("parse")?;
        let arguments = PyTuple::new(slf.py(), [slf.get().to_toml()])?;
        PyTuple::new(slf.py(), [parse, arguments.into_any()])
    }

    fn __repr__(&self) -> String {
        format!("<sonarfix.Robot: track width {:.3} m>", self.track_width())
    }
}
