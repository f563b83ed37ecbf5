//! The localizer, step by step.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use self_cell::self_cell;
use sonarfix::aim as core;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{self as of_core, Start};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix::sensor::gyro::MeasuredTurn;

use crate::floor::{Map, Walls};
use crate::robot::Robot;
use crate::{errors, values};

/// A ping: ranger, wall and bearing, with the reasons of the choice.
#[pyclass(frozen, module = "sonarfix")]
#[derive(Clone, Copy)]
pub struct Aim(pub core::Aim);

#[pymethods]
impl Aim {
    /// The number of the wall in the map, from 0.
    #[getter]
    fn wall(&self) -> u32 {
        self.0.wall.0
    }

    /// The ranger, from 0.
    #[getter]
    fn ranger(&self) -> u8 {
        self.0.ranger.0
    }

    /// The bearing of the servo, radians counter-clockwise from the robot's heading.
    #[getter]
    fn bearing(&self) -> f64 {
        self.0.bearing.0.into()
    }

    /// The expected range, metres.
    #[getter]
    fn range(&self) -> f64 {
        self.0.range.0.into()
    }

    /// The expected decrease of the weighted variance, m².
    #[getter]
    fn gain(&self) -> f64 {
        self.0.why.gain.0.into()
    }

    /// The probability that the ping succeeds.
    #[getter]
    fn success(&self) -> f64 {
        self.0.why.success.into()
    }

    /// The duration of the ping, seconds.
    #[getter]
    fn seconds(&self) -> f64 {
        sonarfix_sim::time::seconds(self.0.why.time.to_micros())
    }

    /// How many walls can be measured, before the test for occlusion.
    #[getter]
    fn candidates(&self) -> u16 {
        self.0.why.candidates
    }

    fn __repr__(&self) -> String {
        let (wall, bearing, range) = (self.wall(), self.bearing(), self.range());
        format!("<sonarfix.Aim: wall {wall}, bearing {bearing:.3} rad, range {range:.3} m>")
    }
}

/// What became of a measurement.
#[pyclass(frozen, module = "sonarfix")]
pub struct Fix {
    outcome: &'static str,
    reason: String,
    innovation: Option<[f32; 2]>,
    nis: Option<f32>,
    association: f32,
}

impl Fix {
    pub fn of(fix: &of_core::Fix, association: f32) -> Self {
        use of_core::Fix::{Accepted, Downweighted, Gated, Refused};
        let (outcome, innovation, reason) = match fix {
            Accepted(innovation) => ("accepted", Some(innovation), String::new()),
            Downweighted(innovation) => ("downweighted", Some(innovation), String::new()),
            Gated(innovation) => ("gated", Some(innovation), String::new()),
            Refused(refusal) => ("refused", None, refusal.to_string()),
            other => ("refused", None, format!("{other:?}")),
        };
        Self {
            outcome,
            reason,
            innovation: innovation.map(|of| [of.value.0, of.variance.0]),
            nis: innovation.map(sonarfix::filter::ekf::Innovation::nis),
            association,
        }
    }

    pub fn of_absolute(fix: &of_core::AbsoluteFix) -> Self {
        use of_core::AbsoluteFix::{Accepted, Downweighted, Gated, Refused};
        let (outcome, agreement, reason) = match fix {
            Accepted(agreement) => ("accepted", Some(agreement), String::new()),
            Downweighted(agreement) => ("downweighted", Some(agreement), String::new()),
            Gated(agreement) => ("gated", Some(agreement), String::new()),
            Refused(refusal) => ("refused", None, refusal.to_string()),
            other => ("refused", None, format!("{other:?}")),
        };
        let nis = agreement.map(|of| of.nis);
        Self { outcome, reason, innovation: None, nis, association: 0.0 }
    }
}

#[pymethods]
impl Fix {
    /// ``"accepted"``, ``"downweighted"``, ``"gated"`` or ``"refused"``.
    #[getter]
    fn outcome(&self) -> &'static str {
        self.outcome
    }

    /// Why it was refused; empty otherwise.
    #[getter]
    fn reason(&self) -> &str {
        &self.reason
    }

    /// Measured minus expected range, metres; None where none was computed.
    #[getter]
    fn innovation(&self) -> Option<f64> {
        self.innovation.map(|[value, _]| value.into())
    }

    /// The variance of the innovation, m².
    #[getter]
    fn innovation_variance(&self) -> Option<f64> {
        self.innovation.map(|[_, variance]| variance.into())
    }

    /// Normalized innovation squared.
    #[getter]
    fn nis(&self) -> Option<f64> {
        self.nis.map(f64::from)
    }

    /// The probability that the echo was the wall's; 0 without an echo.
    #[getter]
    fn association(&self) -> f64 {
        self.association.into()
    }

    /// Whether it has corrected the estimate.
    #[getter]
    fn is_used(&self) -> bool {
        matches!(self.outcome, "accepted" | "downweighted")
    }

    fn __repr__(&self) -> String {
        let reason =
            if self.reason.is_empty() { String::new() } else { format!(": {}", self.reason) };
        format!("<sonarfix.Fix: {}{reason}>", self.outcome)
    }
}

/// The start of a localizer from arguments.
pub fn start(pose: [f64; 3], position: f64, heading: f64) -> PyResult<Start> {
    let [x, y, angle] = pose;
    let at = |value, name| values::single(value, name);
    Ok(Start {
        pose: Pose::new(at(x, "x")?, at(y, "y")?, Radians(at(angle, "the heading")?)),
        position_deviation: Metres(at(position, "position_deviation")?),
        heading_deviation: Radians(at(heading, "heading_deviation")?),
    })
}

/// Three numbers of Python: x, y, heading.
pub fn pose_of(pose: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let (numbers, _) = values::reals(pose, "the pose")?;
    let pose = <[f64; 3]>::try_from(numbers);
    pose.map_err(|_| errors::input("the pose must be x, y (metres) and heading (radians)"))
}

/// Wheel travel, and the turn by a gyro over the same time.
pub fn travel(
    right: f64,
    left: f64,
    turn: Option<(f64, f64)>,
) -> PyResult<(WheelTravel, Option<MeasuredTurn>)> {
    let travel = WheelTravel::new(values::single(right, "right")?, values::single(left, "left")?);
    let turn = turn.map(|(angle, seconds)| {
        let angle = Radians(values::single(angle, "the turn")?);
        if !(0.0..=1e10).contains(&seconds) {
            return Err(errors::input("the duration of a turn must be from 0 to 1e10 s"));
        }
        let duration = Duration::from_ticks(sonarfix_sim::time::micros(seconds));
        Ok(MeasuredTurn { angle, duration })
    });
    Ok((travel, turn.transpose()?))
}

/// A measured range; NaN and infinity are refused by the localizer.
#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
pub fn range(range: Option<f64>) -> Option<Metres> {
    range.map(|range| Metres(range as f32))
}

/// A heading, position or pose from outside.
pub fn absolute(
    heading: Option<f64>,
    position: Option<(f64, f64)>,
    position_deviation: f64,
    heading_deviation: f64,
) -> PyResult<AbsoluteMeasurement> {
    let (x, y) = position.unwrap_or_default();
    let start = start([x, y, heading.unwrap_or(0.0)], position_deviation, heading_deviation)?;
    let Start { pose, position_deviation, heading_deviation } = start;
    match (heading, position) {
        (Some(_), None) => {
            let angle = pose.heading.radians();
            Ok(AbsoluteMeasurement::Heading { angle, deviation: heading_deviation })
        }
        (None, Some(_)) => {
            let noise = PositionNoise::circular(position_deviation);
            Ok(AbsoluteMeasurement::Position { point: pose.position(), noise })
        }
        (Some(_), Some(_)) => {
            let noise = PoseNoise::independent(position_deviation, heading_deviation);
            Ok(AbsoluteMeasurement::Pose { pose, noise })
        }
        (None, None) => Err(errors::input("give a heading, a position or both")),
    }
}

pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Tracking => "tracking",
        Verdict::Degraded => "degraded",
        Verdict::Lost => "lost",
    }
}

/// The estimated pose of a localizer as an array.
pub fn pose<'py>(py: Python<'py>, localizer: &of_core::Localizer) -> Bound<'py, PyArray1<f32>> {
    let pose = localizer.pose();
    PyArray1::from_slice(py, &[pose.x.0, pose.y.0, pose.heading.radians().0])
}

pub fn state<'py>(py: Python<'py>, of: &of_core::Localizer) -> Bound<'py, PyArray1<f32>> {
    PyArray1::from_slice(py, &of.filter().state().to_array())
}

pub fn covariance<'py>(
    py: Python<'py>,
    of: &of_core::Localizer,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    use numpy::PyArrayMethods;
    let p = of.filter().covariance();
    // Symmetric: columns are rows.
    PyArray1::from_slice(py, p.as_slice()).reshape([7, 7])
}

type Localized<'m> = of_core::Localizer<'m>;

self_cell!(
    /// A localizer with the walls that it borrows.
    struct Owned {
        owner: Walls,
        #[covariant]
        dependent: Localized,
    }
);

/// The localizer: it gets wheel travels and ranges with their times, and returns the pose and the bearing of the next ping.
///
/// ``robot`` is a Robot, ``map`` a Map; ``pose`` is the start: x, y (metres), heading (radians) in the map frame, with its
/// standard deviations (metres, radians); ``time`` is its time, seconds. Raises InputError.
#[pyclass(module = "sonarfix")]
pub struct Localizer(Owned);

impl Localizer {
    fn get(&self) -> &Localized<'_> {
        self.0.borrow_dependent()
    }
}

#[pymethods]
impl Localizer {
    #[new]
    #[pyo3(signature = (robot, map, pose, *, position_deviation=0.05, heading_deviation=0.02, time=0.0))]
    fn new(
        robot: &Robot,
        map: &Map,
        pose: &Bound<'_, PyAny>,
        position_deviation: f64,
        heading_deviation: f64,
        time: f64,
    ) -> PyResult<Self> {
        let start = start(pose_of(pose)?, position_deviation, heading_deviation)?;
        let now = values::instant(time)?;
        let owned = Owned::try_new(Walls::of(&map.floor), |walls| {
            Localized::new(robot.config.localizer, walls.map(), start, now)
        });
        owned.map(Self).map_err(|error| errors::input(error.to_string()))
    }

    /// Predicts over the travel of both wheels (metres) up to a time (seconds, never before the last one). ``turn`` is the
    /// angle that a gyro measured (radians) and its duration (seconds). Raises InputError; then nothing has changed.
    #[pyo3(signature = (time, right, left, turn=None))]
    fn odometry(
        &mut self,
        time: f64,
        right: f64,
        left: f64,
        turn: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let now = values::instant(time)?;
        let (travel, turn) = travel(right, left, turn)?;
        let taken = self.0.with_dependent_mut(|_, of| of.odometry_with_turn(now, travel, turn));
        taken.map_err(|error| errors::input(error.to_string()))
    }

    /// The ping that the policy chooses; None if no wall can be measured.
    fn aim(&self) -> Option<Aim> {
        self.get().aim().ok().map(Aim)
    }

    /// The wall to which a beam at a bearing (radians from the heading) is square; None if it is square to no wall.
    fn aim_at(&self, bearing: f64) -> PyResult<Option<Aim>> {
        let bearing = Radians(values::single(bearing, "the bearing")?);
        Ok(self.get().aim_at(bearing).ok().map(Aim))
    }

    /// Corrects the estimate by the range (metres; None without an echo) measured along an aim.
    #[pyo3(signature = (aim, range))]
    fn fix(&mut self, aim: &Aim, range: Option<f64>) -> Fix {
        let range = self::range(range);
        self.0.with_dependent_mut(|_, of| {
            let fix = of.fix(&aim.0, range);
            Fix::of(&fix, of.association())
        })
    }

    /// Records that no wall could be measured when a ping was due.
    fn skip(&mut self) {
        self.0.with_dependent_mut(|_, of| of.skip());
    }

    /// Passes a heading (radians), a position (x, y in metres) or both from outside, measured at ``time``: after the
    /// second last and not after the last odometry.
    #[pyo3(signature = (time, *, heading=None, position=None, position_deviation=0.05, heading_deviation=0.05))]
    fn absolute(
        &mut self,
        time: f64,
        heading: Option<f64>,
        position: Option<(f64, f64)>,
        position_deviation: f64,
        heading_deviation: f64,
    ) -> PyResult<Fix> {
        let at = values::instant(time)?;
        let measured = absolute(heading, position, position_deviation, heading_deviation)?;
        Ok(Fix::of_absolute(&self.0.with_dependent_mut(|_, of| of.absolute(at, &measured))))
    }

    /// Replaces the pose by one that was measured independently.
    #[pyo3(signature = (pose, *, position_deviation=0.05, heading_deviation=0.02))]
    fn set_pose(
        &mut self,
        pose: &Bound<'_, PyAny>,
        position_deviation: f64,
        heading_deviation: f64,
    ) -> PyResult<()> {
        let start = start(pose_of(pose)?, position_deviation, heading_deviation)?;
        let set = self.0.with_dependent_mut(|_, of| of.set_pose(&start));
        set.map_err(|error| errors::input(error.to_string()))
    }

    /// Declares the pose unknown: the verdict becomes "lost".
    fn declare_lost(&mut self) {
        self.0.with_dependent_mut(|_, of| of.declare_lost());
    }

    /// The time of the last odometry, seconds.
    #[getter]
    fn time(&self) -> f64 {
        sonarfix_sim::time::seconds(self.get().time().ticks())
    }

    /// The estimated pose: x, y (metres), heading (radians in (−π, π]) in the map frame; a float32 array of shape (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        pose(py, self.get())
    }

    /// The state, a float32 array of shape (7,): x, y (m), heading (rad), scale errors of the right and the left wheel, error of
    /// the track width (m), scale error of the ranges.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        state(py, self.get())
    }

    /// The covariance of the state, a float32 array of shape (7, 7).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        covariance(py, self.get())
    }

    /// The verdict on the estimate: ``"tracking"``, ``"degraded"`` or ``"lost"``.
    #[getter]
    fn verdict(&self) -> &'static str {
        verdict(self.get().health().verdict)
    }

    /// What of the robot file is probably wrong: ``"NoiseTooSmall"``, ``"WheelsOutsidePrior"`` or ``"MountSuspect"``, else None.
    #[getter]
    fn mismatch(&self) -> Option<String> {
        self.get().mismatch().map(|mismatch| format!("{mismatch:?}"))
    }

    fn __repr__(&self) -> String {
        let pose = self.get().pose();
        let (x, y, heading) = (pose.x.0, pose.y.0, pose.heading.radians().0);
        format!("<sonarfix.Localizer: ({x:.3} m, {y:.3} m, {heading:.3} rad), {}>", self.verdict())
    }
}
