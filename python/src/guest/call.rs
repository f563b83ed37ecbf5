//! The calls of a guest, and what its poses are worth.

use nalgebra::Matrix2;
use pyo3::prelude::*;
use pyo3::types::PyString;
use sonarfix::aim::{Aim, Reason};
use sonarfix::config::RangerId;
use sonarfix::geometry::units::{Duration, Metres, Radians, SquareMetres};
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;
use sonarfix::map::WallId;
use sonarfix_map::Fidelity;
use sonarfix_sim::angle;
use sonarfix_sim::dense::{Matrix, Vector};
use sonarfix_sim::integrity::Integrity;
use sonarfix_sim::observe;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::statistics::{FixCounts, PathSum, RunResult};
use sonarfix_sim::trace::Tick;

use super::view::{Setup, View};
use crate::{errors, values};

/// A covariance so large that every error is inside its ellipse, m².
const ANYWHERE: f64 = 1e12;

/// The methods of an estimator.
struct Estimator<'py> {
    odometry: Bound<'py, PyAny>,
    fix: Bound<'py, PyAny>,
    pose: Bound<'py, PyAny>,
    aim: Option<Bound<'py, PyAny>>,
    covariance: Option<Bound<'py, PyAny>>,
}

/// The guests of a run, and their first error.
pub struct Guest<'py> {
    py: Python<'py>,
    simulation: &'py Simulation,
    factory: Option<Bound<'py, PyAny>>,
    policy: Option<Bound<'py, PyAny>>,
    estimator: Option<Estimator<'py>>,
    pub error: Option<PyErr>,
    pub score: Score,
}

/// What the poses of an estimator are worth.
#[derive(Default)]
pub struct Score {
    pub poses: Vec<[f64; 3]>,
    error: Vector,
    path: PathSum,
    integrity: Integrity,
    fixes: FixCounts,
    last_tick: f64,
}

impl<'py> Guest<'py> {
    pub fn new(
        py: Python<'py>,
        simulation: &'py Simulation,
        estimator: Option<&Py<PyAny>>,
        policy: Option<&Py<PyAny>>,
    ) -> PyResult<Self> {
        let is_pins = simulation.scenario.fidelity == Fidelity::Pins;
        if policy.is_some() && is_pins {
            let text =
                "a policy of your own needs fidelity=\"ideal\": the robot's loop has its own";
            return Err(errors::input(text));
        }
        let bound = |of: Option<&Py<PyAny>>| of.map(|of| of.bind(py).clone());
        Ok(Self {
            py,
            simulation,
            factory: bound(estimator),
            policy: bound(policy),
            estimator: None,
            error: None,
            score: Score::default(),
        })
    }

    /// The name of the estimator, if there is one.
    pub fn name(&self) -> Option<String> {
        let factory = self.factory.as_ref()?;
        let name = factory.getattr("__name__").and_then(|name| name.extract());
        Some(name.unwrap_or_else(|_| "estimator".to_owned()))
    }

    /// Keeps the first error, with which the run ends.
    pub fn kept<T>(&mut self, result: PyResult<T>) -> Result<T, SimulationError> {
        let failed = || SimulationError::Computer("the estimator failed".to_owned());
        if self.error.is_some() {
            return Err(failed());
        }
        result.map_err(|error| {
            self.error = Some(error);
            failed()
        })
    }

    /// Creates the estimator for a localizer that has just started.
    pub fn begin(&mut self, localizer: &Localizer) -> Result<(), SimulationError> {
        let Some(factory) = &self.factory else { return Ok(()) };
        let made = factory.call1((Setup::of(localizer, self.simulation),));
        let estimator = made.and_then(|made| {
            let optional = |name: &str| made.getattr_opt(name);
            Ok(Estimator {
                odometry: made.getattr("odometry")?,
                fix: made.getattr("fix")?,
                pose: made.getattr("pose")?,
                aim: optional("aim")?,
                covariance: optional("covariance")?,
            })
        });
        self.estimator = Some(self.kept(estimator)?);
        Ok(())
    }

    /// Passes wheel travel up to a time, seconds.
    pub fn odometry(&mut self, time: f64, right: f32, left: f32) -> Result<(), SimulationError> {
        let Some(of) = &self.estimator else { return Ok(()) };
        let called = of.odometry.call1((time, f64::from(right), f64::from(left)));
        self.kept(called).map(drop)
    }

    /// Passes a range along a bearing.
    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Result<(), SimulationError> {
        let Some(of) = &self.estimator else { return Ok(()) };
        let range = range.map(|range| f64::from(range.0));
        let called = of.fix.call1((f64::from(aim.bearing.0), range));
        let is_used =
            called.and_then(|used| if used.is_none() { Ok(true) } else { used.is_truthy() });
        let is_used = self.kept(is_used)?;
        *match (range, is_used) {
            (None, _) => &mut self.score.fixes.refused,
            (_, true) => &mut self.score.fixes.accepted,
            (_, false) => &mut self.score.fixes.gated,
        } += 1;
        Ok(())
    }

    /// The ping that the policy or the estimator chooses; `None` leaves the choice to the localizer.
    pub fn aim(&mut self, localizer: &Localizer) -> Result<Option<Aim>, SimulationError> {
        let choice = match (&self.policy, &self.estimator) {
            (Some(policy), _) => policy.call1((View::of(localizer, self.simulation),)),
            (None, Some(Estimator { aim: Some(aim), .. })) => aim.call0(),
            _ => return self.kept(Ok(None)),
        };
        let aim = choice.and_then(|choice| self.aimed(&choice, localizer));
        self.kept(aim)
    }

    fn aimed(&self, choice: &Bound<'_, PyAny>, localizer: &Localizer) -> PyResult<Option<Aim>> {
        if choice.is_none() {
            return Ok(None);
        }
        let is_wall = choice.hasattr("__index__")? || choice.is_instance_of::<PyString>();
        let (wall, bearing) = if is_wall {
            let wall = self.wall(choice)?;
            (wall, square_to(wall, localizer)?)
        } else {
            let bearing = Radians(values::single(choice.extract()?, "a bearing")?);
            // A wall that does not exist: the localizer refuses the range, and the estimator gets it.
            let nowhere = WallId(u32::MAX);
            (localizer.aim_at(bearing).map_or(nowhere, |aim| aim.wall), bearing)
        };
        let (rightmost, leftmost) = localizer.config().rangers.first.servo;
        if !(rightmost.0..=leftmost.0).contains(&bearing.0) {
            return Err(errors::input(format!(
                "the bearing {:.3} rad is beyond the servo's reach, {:.3} to {:.3} rad",
                bearing.0, rightmost.0, leftmost.0
            )));
        }
        let chosen = localizer.aim_at(bearing).ok().filter(|aim| aim.wall == wall);
        let time = Duration::from_ticks(0);
        let why = Reason { gain: SquareMetres(0.0), success: 0.0, time, candidates: 0 };
        let range = Metres(0.0);
        let aim = chosen.unwrap_or(Aim { wall, bearing, range, why, ranger: RangerId::FIRST });
        Ok(Some(Aim { bearing, ..aim }))
    }

    /// A wall by its number or its name.
    fn wall(&self, choice: &Bound<'_, PyAny>) -> PyResult<WallId> {
        let walls = self.simulation.scenario.floor.named_walls();
        let place = match choice.extract::<String>() {
            Ok(name) => walls.iter().position(|wall| wall.name() == name),
            Err(_) => Some(choice.extract::<usize>()?).filter(|&wall| wall < walls.len()),
        };
        let wall = place.and_then(|place| u32::try_from(place).ok()).map(WallId);
        wall.ok_or_else(|| errors::input(format!("the map has no wall {choice}")))
    }

    /// Takes the estimator's pose at an encoder tick.
    pub fn tick(&mut self, tick: &Tick) {
        let Some(of) = self.estimator.as_ref().filter(|_| self.error.is_none()) else { return };
        match of.pose.call0().and_then(|pose| numbers(&pose)) {
            Ok(state) => self.score.tick(tick, &state),
            Err(error) => self.error = Some(error),
        }
    }

    /// The result of the estimator beside that of the localizer.
    pub fn result(&self, ours: &RunResult) -> PyResult<RunResult> {
        let score = &self.score;
        let covariance = self.estimator.as_ref().and_then(|of| of.covariance.as_ref());
        let p =
            covariance.map(PyAnyMethods::call0).transpose()?.as_ref().map(matrix).transpose()?;
        let nees = p.and_then(|p| observe::nees(&score.error, &p));
        let (nees, estimated_states) = nees.unwrap_or((f64::NAN, 0));
        let mut result = RunResult {
            error: score.error,
            bound_variance: ours.bound_variance,
            nees,
            estimated_states,
            path: score.path,
            fixes: score.fixes,
            integrity: score.integrity,
            ..RunResult::default()
        };
        result.set_lost(Verdict::Tracking);
        self.py.check_signals()?;
        Ok(result)
    }
}

impl Score {
    fn tick(&mut self, tick: &Tick, state: &[f64]) {
        let Some(truth) = tick.truth else { return };
        let of = truth.calibration.unwrap_or_default();
        let pose = truth.pose;
        let truth = [
            pose.x,
            pose.y,
            pose.heading,
            of.scale_right,
            of.scale_left,
            of.track_width,
            of.range_scale,
        ];
        let mut error = [f64::NAN; 7];
        for ((error, estimate), truth) in error.iter_mut().zip(state).zip(truth) {
            *error = estimate - truth;
        }
        error[2] = angle::wrap(error[2]);
        self.error = Vector::from(error);
        self.path.add(&self.error);
        let seconds = tick.time - std::mem::replace(&mut self.last_tick, tick.time);
        let p = Matrix2::identity() * ANYWHERE;
        self.integrity.add(seconds, &self.error, &p, Verdict::Tracking);
        if let [x, y, heading, ..] = *state {
            self.poses.push([x, y, heading]);
        }
    }
}

/// The bearing that is square to a wall from the estimated pose.
fn square_to(wall: WallId, localizer: &Localizer) -> PyResult<Radians> {
    let of = localizer.map().wall(wall);
    let of = of.ok_or_else(|| errors::input(format!("the map has no wall {}", wall.0)))?;
    let (pose, mount) = (localizer.pose(), localizer.config().rangers.first.mount);
    let direction = of.direction_from(of.signed_distance(pose.to_map(mount)));
    Ok(direction.from(pose.heading))
}

/// What `pose()` returns.
fn numbers(pose: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let numbers: Vec<f64> =
        pose.try_iter()?.map(|number| number?.extract()).collect::<PyResult<_>>()?;
    if (3..=7).contains(&numbers.len()) && numbers.iter().all(|number| number.is_finite()) {
        return Ok(numbers);
    }
    Err(errors::input("pose() must return x, y and heading, finite, and at most four more states"))
}

/// What `covariance()` returns.
fn matrix(values: &Bound<'_, PyAny>) -> PyResult<Matrix> {
    let (numbers, shape) = values::reals(values, "covariance()")?;
    let &[rows, columns] = shape.as_slice() else {
        return Err(errors::input("covariance() must return a matrix"));
    };
    if rows != columns || !(3..=7).contains(&rows) {
        return Err(errors::input("covariance() must return a matrix of 3 × 3 to 7 × 7"));
    }
    let mut p = Matrix::zeros();
    for (at, value) in numbers.into_iter().enumerate() {
        p[(at / rows, at % rows)] = value;
    }
    Ok(p)
}
