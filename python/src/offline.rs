//! Forecast, replay, calibration, survey, and the search in a recording. `sonarfix.offline` wraps the results.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use numpy::PyArray2;
use pyo3::prelude::*;
use sonarfix::map::Wall;
use sonarfix_batch::calibrate as of_batch;
use sonarfix_batch::recording::StartPose;
use sonarfix_batch::{log, robot_edit, wall};
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Floor, robot_file};
use sonarfix_plan::Forecast;
use sonarfix_plan::starts::Starts;
use sonarfix_replay::fault::Complaint;
use sonarfix_replay::find::Find;
use sonarfix_replay::{Replay, Summary};
use sonarfix_sim::trace::Trace;
use sonarfix_survey::map_text::map_text;
use sonarfix_survey::problem::Robot as Surveyor;
use sonarfix_survey::survey as of_survey;

use crate::floor::Map;
use crate::robot::Robot;
use crate::run::Run;
use crate::scenario::Scenario;
use crate::table::Table;
use crate::{columns, errors, values, work};

/// Longest time in which a robot without a pose drives on, seconds.
const SEARCHED_FOR: f64 = 120.0;

fn open(path: &Path) -> anyhow::Result<BufReader<File>> {
    File::open(path).map(BufReader::new).with_context(|| path.display().to_string())
}

/// The bound on the standard deviation of each state over a run, the posterior Cramér–Rao bound of its measurements: a table
/// with ``time_s`` and a column per state (m, rad, 1).
#[pyfunction]
#[pyo3(signature = (scenario, seed=None))]
pub fn bound(py: Python<'_>, scenario: &Scenario, seed: Option<u64>) -> PyResult<Table> {
    let simulation = Arc::clone(&scenario.simulation);
    let seed = seed.unwrap_or(simulation.scenario.run.seed);
    let run = work::done(py, Some(1), None, move |_| Run::of(&simulation, seed))?;
    let trace = run.map_err(|error| errors::simulation(&error))?.trace;
    let known: Vec<(f64, [f64; 7])> =
        trace.ticks.iter().filter_map(|tick| Some((tick.time, tick.bound?))).collect();
    let mut columns = vec![("time_s", known.iter().map(|(time, _)| *time).collect())];
    let names =
        ["x_m", "y_m", "heading_rad", "scale_right", "scale_left", "track_width_m", "range_scale"];
    for (state, name) in names.into_iter().enumerate() {
        let of = known.iter().filter_map(|(_, bound)| bound.get(state).copied());
        columns.push((name, of.collect()));
    }
    columns::of_reals(columns)
}

/// Wrapped by sonarfix.plan: the forecast as a dict, its samples as a table.
#[pyfunction]
#[pyo3(signature = (scenario, runs=10, starts=None, *, workers=None, progress=None))]
pub fn plan<'py>(
    py: Python<'py>,
    scenario: &Scenario,
    runs: u32,
    starts: Option<u32>,
    workers: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Table, Option<Bound<'py, PyAny>>)> {
    if runs == 0 || starts == Some(0) {
        return Err(errors::input("runs and starts must be at least 1"));
    }
    let scenario = scenario.simulation.scenario.clone();
    let found = work::done(py, workers, progress, move |counter| -> anyhow::Result<_> {
        let forecast = Forecast::new(&scenario, runs, counter)?.context("interrupted")?;
        let starts = starts.map(|starts| Starts::new(&scenario, starts, SEARCHED_FOR, counter));
        Ok((forecast, starts.transpose()?.flatten()))
    })?;
    let (forecast, starts) = found.map_err(|error| errors::any(&error))?;
    let real = |of: &dyn Fn(&sonarfix_plan::Sample) -> f64| {
        forecast.samples.iter().map(of).collect::<Vec<f64>>()
    };
    let samples = columns::of_reals(vec![
        ("time_s", real(&|of| of.time)),
        ("at_x_m", real(&|of| of.at[0])),
        ("at_y_m", real(&|of| of.at[1])),
        ("sigma_x_m", real(&|of| of.x)),
        ("sigma_y_m", real(&|of| of.y)),
        ("sigma_heading_rad", real(&|of| of.heading)),
        ("blind", real(&|of| f64::from(u8::from(of.blind)))),
    ])?;
    let starts = starts.map(|starts| values::of_json(py, &starts)).transpose()?;
    Ok((values::of_json(py, &forecast)?, samples, starts))
}

/// Robot, map and log of a recording: given, or beside the log.
struct Recording {
    log: PathBuf,
    robot: RobotConfig,
    floor: Option<Floor>,
}

impl Recording {
    fn new(log: PathBuf, robot: Option<&Robot>, map: Option<&Map>) -> PyResult<Self> {
        let beside = |name: &str| log.with_file_name(name);
        let robot = match robot {
            Some(robot) => robot.config,
            None => Robot::read(&beside("robot.toml"))?.config,
        };
        let usual = beside("map.toml");
        let floor = match map {
            Some(map) => Some(map.floor.clone()),
            None if usual.exists() => {
                Some(Floor::read(&usual).map_err(|error| errors::file(&error))?)
            }
            None => None,
        };
        Ok(Self { log, robot, floor })
    }

    fn walls(&self) -> PyResult<Vec<Wall>> {
        let missing = || errors::input("give a map: there is no map.toml beside the log");
        Ok(self.floor.as_ref().ok_or_else(missing)?.walls())
    }
}

/// Wrapped by sonarfix.replay: the run, the summary as a dict, and the skipped lines.
#[pyfunction]
#[pyo3(signature = (log, robot=None, map=None, reference=None, *, strict=false))]
pub fn replay<'py>(
    py: Python<'py>,
    log: PathBuf,
    robot: Option<&Robot>,
    map: Option<&Map>,
    reference: Option<PathBuf>,
    strict: bool,
) -> PyResult<(Run, Bound<'py, PyAny>, Vec<String>)> {
    let recording = Recording::new(log, robot, map)?;
    let walls = recording.walls()?;
    let usual = recording.log.with_file_name("reference.csv");
    let reference = reference.or_else(|| usual.exists().then_some(usual));
    let replayed = work::done(py, Some(1), None, move |_| -> anyhow::Result<_> {
        let Recording { log, robot, floor } = recording;
        let cone = robot.localizer.rangers.first.cone;
        let mut trace = floor.map_or_else(Trace::default, |floor| Trace::of(&floor, cone));
        let mut skipped = Vec::new();
        let with = Replay { robot: &robot, walls: &walls, strict, pings_per_scan: 1 };
        let reference = reference.as_deref().map(open).transpose()?;
        let mut report = |complaint: &Complaint| skipped.push(complaint.to_string());
        let summary = with.run(open(&log)?, reference, &mut trace, &mut report);
        let summary: Summary = summary.with_context(|| log.display().to_string())?;
        let scenario = log.display().to_string();
        let run = Run { scenario, seed: 0, trace, rows: Vec::new(), poses: Vec::new() };
        Ok((run, summary, skipped))
    })?;
    let (run, summary, skipped) = replayed.map_err(|error| errors::any(&error))?;
    Ok((run, values::of_json(py, &summary)?, skipped))
}

/// Wrapped by sonarfix.find.
#[pyfunction]
#[pyo3(signature = (log, robot=None, map=None))]
pub fn find<'py>(
    py: Python<'py>,
    log: PathBuf,
    robot: Option<&Robot>,
    map: Option<&Map>,
) -> PyResult<Bound<'py, PyAny>> {
    let recording = Recording::new(log, robot, map)?;
    let walls = recording.walls()?;
    let found = work::done(py, Some(1), None, move |_| -> anyhow::Result<_> {
        let Recording { log, robot, .. } = recording;
        let found = Find { robot: &robot, walls: &walls }.run(open(&log)?);
        found.with_context(|| log.display().to_string())
    })?;
    values::of_json(py, &found.map_err(|error| errors::any(&error))?)
}

/// A calibration for Python: name, value, deviation, scatter of the halves, how it is determined.
type Estimates = Vec<(&'static str, f64, f64, f64, &'static str)>;

fn estimates(found: &of_batch::Calibration) -> Estimates {
    let row = |estimate: &of_batch::Estimate| {
        let determined = match estimate.determined {
            of_batch::Determined::Yes => "yes",
            of_batch::Determined::Jointly => "jointly",
            of_batch::Determined::No => "no",
        };
        let of_batch::Estimate { name, value, deviation, scatter, .. } = *estimate;
        (name.label(), value, deviation, scatter, determined)
    };
    found.estimates.iter().map(row).collect()
}

/// Estimates, smoothed poses, robot, and the echoes that fit and that were expected.
type Calibrated<'py> = (Estimates, Bound<'py, PyArray2<f64>>, Robot, (usize, usize));

/// Wrapped by sonarfix.calibrate: estimates, the smoothed poses (time, x, y, heading), the calibrated robot, echoes that fit
/// and that were expected.
#[pyfunction]
#[pyo3(signature = (log, robot=None, map=None, reference=None, start=None))]
pub fn calibrate<'py>(
    py: Python<'py>,
    log: PathBuf,
    robot: Option<&Robot>,
    map: Option<&Map>,
    reference: Option<PathBuf>,
    start: Option<(f64, f64, f64)>,
) -> PyResult<Calibrated<'py>> {
    let recording = Recording::new(log, robot, map)?;
    let found = work::done(py, Some(1), None, move |_| -> anyhow::Result<_> {
        let Recording { log: path, robot, floor } = recording;
        let named = || path.display().to_string();
        let mut read = log::read(open(&path)?, &robot).with_context(named)?;
        if let Some(reference) = reference {
            read.recording.references = log::read_reference(open(&reference)?)
                .with_context(|| reference.display().to_string())?;
        }
        if let Some((x, y, heading)) = start {
            let time = read.recording.readings.first().map_or(0.0, |reading| reading.time);
            let pose = nalgebra::Vector3::new(x, y, heading);
            read.recording.start = Some(StartPose { time, pose, position: 0.05, heading: 0.05 });
        }
        let walls = floor.as_ref().map_or(&[][..], Floor::named_walls).iter();
        let walls: Vec<_> = walls.filter_map(|one| wall::Wall::new(one.from(), one.to())).collect();
        let nominal = log::nominal(&robot, !read.has_scans);
        let found = of_batch::calibrate(&read.recording, &walls, &nominal).with_context(named)?;
        let text = robot_edit::calibrated(&robot_file::text(&robot), &robot, &found)?;
        Ok((found, robot_file::parse(&text, "robot.toml")?))
    })?;
    let (found, config) = found.map_err(|error| errors::recorded(&error))?;
    let poses = found.trajectory.iter().map(|(time, pose, _)| [*time, pose.x, pose.y, pose.z]);
    let robot = Robot { config };
    let fits = (found.inliers, found.expected);
    Ok((estimates(&found), values::matrix(py, poses)?, robot, fits))
}

/// A survey for Python: the map, whether it is sure and why not, accuracy (m) and echoes of each wall, path (time, x, y,
/// heading), metres driven.
type Surveyed<'py> = (Map, Vec<String>, Vec<(f64, usize, bool)>, Bound<'py, PyArray2<f64>>, f64);

/// Wrapped by sonarfix.survey.
#[pyfunction]
#[pyo3(signature = (log, robot=None))]
pub fn survey<'py>(
    py: Python<'py>,
    log: PathBuf,
    robot: Option<&Robot>,
) -> PyResult<Surveyed<'py>> {
    let robot = match robot {
        Some(robot) => robot.config,
        None => Robot::read(&log.with_file_name("robot.toml"))?.config,
    };
    let found = work::done(py, None, None, move |_| -> anyhow::Result<_> {
        let named = || log.display().to_string();
        let read = log::read(open(&log)?, &robot).with_context(named)?;
        let nominal = log::nominal(&robot, !read.has_scans);
        of_survey::survey(&read.recording, Surveyor::of(&nominal)).with_context(named)
    })?;
    let found = found.map_err(|error| errors::recorded(&error))?;
    let floor = Floor::parse(&map_text(&found), "the survey").map_err(|e| errors::file(&e))?;
    let reasons = found.reasons.iter().map(ToString::to_string).collect();
    let walls = found.walls.iter().map(|wall| (wall.accuracy, wall.echoes, wall.is_confirmed));
    let path = found.path.iter().map(|(time, pose)| [*time, pose.x, pose.y, pose.z]);
    let path = values::matrix(py, path)?;
    Ok((Map::of(floor), reasons, walls.collect(), path, found.distance))
}
