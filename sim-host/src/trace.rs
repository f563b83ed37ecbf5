//! The record of one run: what was true, what the filter believed, what every fix brought.
//!
//! A trace is what the simulator and the replay both produce, and what the report, the CSV file
//! and the tests read. Everything here is `f64` in SI units (metres, radians, seconds); the map
//! frame is that of the scenario.

use serde::Serialize;
use sonarfix::localizer::Localizer;
use sonarfix::units::Radians;
use sonarfix_hal::robot::Report;
use sonarfix_map::{Floor, NamedWall};

use crate::world::reflector::Source;

/// A pose in the map frame: metres, metres, radians in (−π, π].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Pose {
    /// Metres along the map's x axis.
    pub x: f64,
    /// Metres along the map's y axis.
    pub y: f64,
    /// Heading, radians counter-clockwise from the map's x axis.
    pub heading: f64,
}

/// The systematic errors of a robot, true or estimated.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Calibration {
    /// Scale error of the right wheel, dimensionless.
    pub scale_right: f64,
    /// Scale error of the left wheel, dimensionless.
    pub scale_left: f64,
    /// Track width, metres (the whole width, not its error).
    pub track_width: f64,
    /// Scale error of the ranger, dimensionless.
    pub range_scale: f64,
}

/// What the filter says at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Estimate {
    /// Estimated pose.
    pub pose: Pose,
    /// Estimated systematic errors.
    pub calibration: Calibration,
    /// One standard deviation of each state, in the order of [`crate::STATES`].
    pub deviation: [f64; 7],
    /// Covariance of x and y, m².
    pub covariance_xy: f64,
}

/// What was true at one instant; a replayed recording may know only the pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Truth {
    /// True pose.
    pub pose: Pose,
    /// True systematic errors, where they are known.
    pub calibration: Option<Calibration>,
}

/// One encoder tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tick {
    /// Seconds since the run began.
    pub time: f64,
    /// The truth, where it is known.
    pub truth: Option<Truth>,
    /// The filter's estimate after everything that happened up to `time`.
    pub estimate: Estimate,
    /// The bound on each state's standard deviation, in a simulation.
    pub bound: Option<[f64; 7]>,
    /// The pose by the encoders alone, with the nominal robot.
    pub odometry: Pose,
}

/// What became of one turn of the sonar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The range corrected the filter.
    Accepted,
    /// The range lay beyond the gate and changed nothing.
    Gated,
    /// There was no range to use, or no wall to look at.
    Refused,
}

/// Why a wall was chosen: what the choice reckoned with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Why {
    /// By how much the variance of the position (and of what else has a weight) was to drop, m².
    pub gain: f64,
    /// How likely the look was to succeed.
    pub success: f64,
    /// How long it was to take, seconds.
    pub seconds: f64,
    /// How many walls could be measured, before asking what hides them.
    pub candidates: u16,
}

/// One turn of the sonar: where it looked, what it heard, what the filter made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FixRecord {
    /// Seconds since the run began.
    pub time: f64,
    /// Index of the wall aimed at, if there was one.
    pub wall: Option<usize>,
    /// Where the sonar truly was (or, in a replay, was estimated to be), metres.
    pub sonar: [f64; 2],
    /// Where the beam pointed, radians in the map frame.
    pub direction: f64,
    /// Where it pointed relative to the robot's heading, radians.
    pub bearing: f64,
    /// The range heard, metres; `None` if no echo came.
    pub range: Option<f64>,
    /// What the sound met; `None` where nothing was heard, or nobody knows.
    pub met: Option<Source>,
    /// Why this wall was looked at, if one was.
    pub why: Option<Why>,
    /// What became of it.
    pub outcome: Outcome,
    /// Why it was refused, in words; empty unless refused.
    pub reason: String,
    /// Innovation, metres, where one was computed.
    pub innovation: Option<f64>,
    /// Innovation variance, m², where one was computed.
    pub innovation_variance: Option<f64>,
}

/// A wall as a picture needs it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wall {
    /// Its name in the map file.
    pub name: String,
    /// One end, metres.
    pub from: [f64; 2],
    /// The other end, metres.
    pub to: [f64; 2],
}

/// One run, whole.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Trace {
    /// The map.
    pub walls: Vec<Wall>,
    /// Half of the sonar's cone, radians.
    pub cone: f64,
    /// Every encoder tick, in order of time.
    pub ticks: Vec<Tick>,
    /// Every turn of the sonar, in order of time.
    pub fixes: Vec<FixRecord>,
}

impl Trace {
    /// A trace on a floor, with nothing in it yet.
    #[must_use]
    pub fn of(floor: &Floor, cone: Radians) -> Self {
        let wall = |w: &NamedWall| Wall { name: w.name().to_owned(), from: w.from(), to: w.to() };
        let walls = floor.named_walls().iter().map(wall).collect();
        Self { walls, cone: cone.0.into(), ..Self::default() }
    }
}

/// Whatever wants to see a run as it happens. What is recorded is made only if it is wanted.
pub trait Recorder {
    /// An encoder tick is over.
    fn tick(&mut self, make: impl FnOnce() -> Tick);
    /// The sonar has had its turn.
    fn fix(&mut self, make: impl FnOnce() -> FixRecord);
    /// A robot's localizer has begun, at the fidelity of pins.
    fn began(&mut self, _localizer: &Localizer) {}
    /// The robot's loop was polled, at the fidelity of pins.
    fn polled(&mut self, _report: &Report, _localizer: &Localizer) {}
}

/// Records nothing.
impl Recorder for () {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}
    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}
}

/// Records everything.
impl Recorder for Trace {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        self.ticks.push(make());
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        self.fixes.push(make());
    }
}
