//! Scenarios, and their runs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sonarfix_map::{CLASSROOM, Fidelity, PAPER, Scenario as Read};
use sonarfix_monitor::simulated;
use sonarfix_plan::bare;
use sonarfix_plan::edit::{self, Edit};
use sonarfix_plan::overrides::Overrides;
use sonarfix_rows::{Plan, Shard};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::row::Row;
use sonarfix_sim::simulate::Simulation;

use crate::floor::Map;
use crate::guest::{self, Invited};
use crate::robot::Robot;
use crate::run::Run;
use crate::table::Table;
use crate::{columns, errors, values, work};

/// Where a scenario comes from: what another process needs to read it again.
#[derive(Debug, Clone)]
struct Source {
    text: String,
    file: PathBuf,
    keys: Vec<(String, toml::Value)>,
    options: Vec<String>,
}

impl Source {
    fn read(&self) -> PyResult<Read> {
        let base = self.file.parent().unwrap_or(Path::new(""));
        let mut scenario = if self.keys.is_empty() {
            let name = self.file.display().to_string();
            Read::parse(&self.text, &name, base).map_err(|error| errors::file(&error))?
        } else {
            let keys = self.keys.iter().map(|(key, value)| (key.clone(), edit_of(value)));
            let keys: Vec<_> = keys.collect();
            edit::scenario(&self.file, &self.text, &keys, "").map_err(|e| errors::any(&e))?
        };
        let overrides = Overrides::parse(self.options.iter().cloned());
        let overrides = overrides.map_err(|error| errors::input(first_of(&error)))?;
        overrides.apply(&mut scenario).map_err(|error| errors::any(&error))?;
        Ok(scenario)
    }
}

/// The error of the command's options, without its hint at `--help`.
fn first_of(error: &clap::Error) -> String {
    let text = error.to_string();
    let text = text.split("\n\nUsage").next().unwrap_or_default();
    let text = text.split("\n\nFor more information").next().unwrap_or_default();
    text.trim_start_matches("error: ").trim_end().to_owned()
}

/// A text may stand for a number or a truth value, as in `run --sweep`.
fn edit_of(value: &toml::Value) -> Edit {
    match value {
        toml::Value::String(text) => Edit::Text(text.clone()),
        other => Edit::Value(other.clone()),
    }
}

/// The options of the command for these keywords.
fn options_of(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let mut options = Vec::new();
    for (name, value) in keywords.into_iter().flat_map(PyDictMethods::iter) {
        let name = format!("--{}", name.extract::<String>()?.replace('_', "-"));
        if value.is_none() {
            continue;
        }
        match value.extract::<bool>() {
            Ok(true) => options.push(name),
            Ok(false) => {}
            Err(_) => options.push(format!("{name}={}", value.str()?)),
        }
    }
    Ok(options)
}

/// A scenario: a place, a robot as it believes itself to be, its path, and what it truly is.
///
/// ``source`` is the name of a shipped scenario (``"paper"``, ``"classroom"``), the path of a scenario file, or a dict with the
/// keys of one (docs/formats.md). ``keys`` sets single keys of the scenario or of its robot, as ``run --sweep`` does:
/// ``{"sonar.noise": "5 mm", "truth.scale_right": 0.02}``. Keywords are the options of ``sonarfix run`` that change a
/// scenario: ``policy="nearest"``, ``fidelity="ideal"``, ``gyro="mpu6050"``, ``fix_period=0.5``, ``sensor="vl53l1x"``,
/// ``servo="sg90"``, ``light=True``, ``range_error=0.01``, ``absolute="pose"``, ``heading_slips=60``, ``start="unknown"``.
///
/// Raises FileError with file, line and key of each mistake, and InputError for a keyword or a key that does not fit.
#[pyclass(frozen, module = "sonarfix")]
pub struct Scenario {
    source: Source,
    pub simulation: Arc<Simulation>,
}

impl Scenario {
    fn of(source: Source) -> PyResult<Self> {
        let simulation = Arc::new(Simulation::new(source.read()?));
        Ok(Self { source, simulation })
    }

    fn scenario(&self) -> &Read {
        &self.simulation.scenario
    }

    fn seed_or(&self, seed: Option<u64>) -> u64 {
        seed.unwrap_or(self.scenario().run.seed)
    }

    fn runs_or(&self, runs: Option<u32>) -> PyResult<u32> {
        let runs = runs.unwrap_or(self.scenario().run.runs);
        if runs == 0 { Err(errors::input("runs must be at least 1")) } else { Ok(runs) }
    }
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (source, keys=None, **options))]
    fn new(
        source: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (text, file) = if let Ok(table) = source.cast::<PyDict>() {
            (values::toml_text(table)?, PathBuf::from("scenario.toml"))
        } else {
            let path: PathBuf = source.extract()?;
            match path.to_str() {
                Some("paper") => (PAPER.to_owned(), PathBuf::from("paper.toml")),
                Some("classroom") => (CLASSROOM.to_owned(), PathBuf::from("classroom.toml")),
                _ => (values::text_of(&path)?, path),
            }
        };
        let keys = keys.map(values::toml_keys).transpose()?.unwrap_or_default();
        Self::of(Source { text, file, keys, options: options_of(options)? })
    }

    /// A scenario on a map alone: a robot of the size that drives through doors, at the fidelity "pins", along a path: an array
    /// of shape (n, 2) of points, x and y in metres, the start first. ``keys`` and keywords are those of Scenario.
    #[staticmethod]
    #[pyo3(signature = (map, path, keys=None, **options))]
    fn on_map(
        map: &Map,
        path: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (numbers, shape) = values::reals(path, "the path")?;
        let is_path = matches!(shape.as_slice(), &[points, 2] if points > 1);
        if !is_path || !numbers.iter().all(|number| number.is_finite()) {
            let text = "the path must be finite points of shape (n, 2), the start first";
            return Err(errors::input(text));
        }
        let points: Vec<toml::Value> =
            numbers.chunks_exact(2).map(|point| point.to_vec().into()).collect();
        let (start, corners) = (points.first().cloned(), points.get(1..).map(<[_]>::to_vec));
        let floor: toml::Table = map.floor.to_toml().parse().map_err(values::no_toml)?;
        let mut all = vec![("name".to_owned(), "on a map".into())];
        all.extend(floor.get("map").map(|walls| ("map".to_owned(), walls.clone())));
        all.extend(start.map(|start| ("path.start".to_owned(), start)));
        all.extend(corners.map(|corners| ("path.corners".to_owned(), corners.into())));
        all.extend(keys.map(values::toml_keys).transpose()?.unwrap_or_default());
        let (text, file) = (bare::text(), PathBuf::from("scenario.toml"));
        Self::of(Source { text, file, keys: all, options: options_of(options)? })
    }

    /// The same scenario with other keys and options, on top of those that it has.
    #[pyo3(signature = (keys=None, **options))]
    fn replace(
        &self,
        keys: Option<&Bound<'_, PyDict>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut source = self.source.clone();
        for (key, value) in keys.map(values::toml_keys).transpose()?.unwrap_or_default() {
            source.keys.retain(|(held, _)| *held != key);
            source.keys.push((key, value));
        }
        for option in options_of(options)? {
            let name = option.split('=').next().unwrap_or_default().to_owned();
            source.options.retain(|held| held.split('=').next() != Some(name.as_str()));
            source.options.push(option);
        }
        Self::of(source)
    }

    /// The name in the file.
    #[getter]
    fn name(&self) -> &str {
        &self.scenario().name
    }

    /// What the scenario demonstrates.
    #[getter]
    fn description(&self) -> &str {
        &self.scenario().description
    }

    /// ``"ideal"``: travel and ranges reach the localizer directly and on time; ``"pins"``: through simulated pins, drivers and
    /// the robot's loop.
    #[getter]
    fn fidelity(&self) -> &'static str {
        match self.scenario().fidelity {
            Fidelity::Ideal => "ideal",
            Fidelity::Pins => "pins",
        }
    }

    /// Number of runs that the scenario suggests.
    #[getter]
    fn runs(&self) -> u32 {
        self.scenario().run.runs
    }

    /// Seed of the first run.
    #[getter]
    fn seed(&self) -> u64 {
        self.scenario().run.seed
    }

    /// Duration of a run, seconds.
    #[getter]
    fn duration(&self) -> f64 {
        self.simulation.seconds()
    }

    /// The walls, as the robot knows them.
    #[getter]
    fn map(&self) -> Map {
        Map::of(self.scenario().floor.clone())
    }

    /// The robot, as its software is configured.
    #[getter]
    fn robot(&self) -> Robot {
        Robot { config: self.scenario().robot }
    }

    /// The path as it is planned, a pose a second: an array of shape (n, 3) of x, y (metres) and heading (radians) in the map
    /// frame.
    #[getter]
    fn path<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let path = &self.scenario().path;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some hours")]
        let seconds = path.duration().max(0.0).ceil() as u32;
        let at = |second: u32| {
            let pose = path.pose_at(f64::from(second).min(path.duration()));
            [pose.x, pose.y, pose.heading]
        };
        values::matrix(py, (0..=seconds).map(at))
    }

    /// Runs once. With an ``estimator`` (a class, called with a Setup) another estimator gets the same odometry and the same
    /// pings; a ``policy`` (a function of a View) chooses the wall or the bearing of each ping (docs/python.md).
    #[pyo3(signature = (seed=None, *, estimator=None, policy=None))]
    fn run(
        &self,
        py: Python<'_>,
        seed: Option<u64>,
        estimator: Option<Py<PyAny>>,
        policy: Option<Py<PyAny>>,
    ) -> PyResult<Run> {
        let seed = self.seed_or(seed);
        let simulation = Arc::clone(&self.simulation);
        let invited = Invited { estimator, policy };
        if invited.is_nobody() {
            let run = work::done(py, Some(1), None, move |_| Run::of(&simulation, seed))?;
            return run.map_err(|error| errors::simulation(&error));
        }
        let mut trace = simulation.empty_trace();
        let (rows, poses) = guest::run(py, &simulation, seed, &invited, &mut trace)?;
        Ok(Run { scenario: self.scenario().name.clone(), seed, trace, rows, poses })
    }

    /// Runs the seeds ``seed``, ``seed + 1``, … and returns a table with a row per run: the columns and the bits of
    /// ``sonarfix run --rows`` (docs/formats.md).
    ///
    /// ``workers`` is the number of threads, by default one per core; the rows do not depend on it. ``progress`` is called
    /// with the number of newly finished runs, like ``tqdm(total=runs).update``. Ctrl-C ends it within a second. With an
    /// estimator or a policy, which are Python, the runs are done one after the other (sonarfix.distributed spreads them over
    /// processes); the table then has a column ``estimator``, and two rows per run if there is an estimator.
    #[pyo3(signature = (runs=None, seed=None, *, workers=None, progress=None, estimator=None, policy=None))]
    fn monte_carlo(
        &self,
        py: Python<'_>,
        runs: Option<u32>,
        seed: Option<u64>,
        workers: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
        estimator: Option<Py<PyAny>>,
        policy: Option<Py<PyAny>>,
    ) -> PyResult<Table> {
        let (runs, first) = (self.runs_or(runs)?, self.seed_or(seed));
        let invited = Invited { estimator, policy };
        if !invited.is_nobody() {
            return guest::many(py, &self.simulation, first, runs, &invited, progress);
        }
        let simulation = Arc::clone(&self.simulation);
        let rows = work::done(py, workers, progress, move |counter| {
            monte_carlo::rows(&simulation, first, runs, counter)
        })?;
        let rows: Vec<Row> = rows.map_err(|error| errors::simulation(&error))?;
        columns::of_rows(&rows, None)
    }

    /// Simulates a drive and writes what the robot would have recorded into ``file`` (a log, docs/formats.md), and the true
    /// poses into ``truth``, by default ``reference.csv`` beside it. Also writes ``robot.toml`` and ``map.toml`` beside the
    /// log, unless they exist. Needs the fidelity ``"pins"``.
    #[pyo3(signature = (file, seed=None, *, truth=None, force=false))]
    fn record(
        &self,
        py: Python<'_>,
        file: PathBuf,
        seed: Option<u64>,
        truth: Option<PathBuf>,
        force: bool,
    ) -> PyResult<()> {
        let (simulation, seed) = (Arc::clone(&self.simulation), self.seed_or(seed));
        let recorded = work::done(py, Some(1), None, move |_| {
            simulated::record(&simulation, seed, &file, truth.as_deref(), force)
        })?;
        recorded.map_err(|error| errors::any(&error))
    }

    /// The first line of a file of ``sonarfix run --rows`` with these runs.
    #[pyo3(signature = (runs=None, seed=None))]
    fn rows_plan(&self, runs: Option<u32>, seed: Option<u64>) -> PyResult<String> {
        let (runs, seed) = (self.runs_or(runs)?, self.seed_or(seed));
        Ok(Plan::new(self.scenario(), seed, runs, Shard::ALL).line())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Source { text, file, keys, options }) = (slf.py(), &slf.get().source);
        let keys =
            serde_json::to_string(keys).map_err(|error| errors::internal(error.to_string()))?;
        let file = file.to_string_lossy();
        let arguments = (text.as_str(), file.as_ref(), keys, options.clone()).into_pyobject(py)?;
        let again = slf.get_type().getattr("_again")?;
        PyTuple::new(py, [again, arguments.into_any()])
    }

    #[staticmethod]
    fn _again(text: String, file: PathBuf, keys: &str, options: Vec<String>) -> PyResult<Self> {
        let keys = serde_json::from_str(keys).map_err(|error| errors::input(error.to_string()))?;
        Self::of(Source { text, file, keys, options })
    }

    fn __repr__(&self) -> String {
        let Read { name, .. } = self.scenario();
        format!("<sonarfix.Scenario {name:?}: {:.0} s, {}>", self.duration(), self.fidelity())
    }
}
