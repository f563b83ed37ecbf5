//! The record of one run: the truth, the estimate, and the outcome of every measurement cycle.
//!
//! Simulator and replay produce a trace; report, CSV file and tests read it. All values are `f64` in
//! SI units (metres, radians, seconds), in the map frame of the scenario.

use serde::Serialize;
use sonarfix::geometry::units::Radians;
use sonarfix::health::{Mismatch, Verdict};
use sonarfix::localizer::Localizer;
use sonarfix_hal::robot::Report;
use sonarfix_map::{Floor, NamedWall};

use crate::world::obstacle::Obstacle;
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

/// The estimate of a gyro at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct GyroEstimate {
    /// Estimated bias, rad/s.
    pub bias: f64,
    /// Its standard deviation, rad/s.
    pub deviation: f64,
    /// Slips of the wheels since the start.
    pub slips: u32,
}

/// The filter's estimate at one instant.
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
    /// The gyro of a robot that has one.
    pub gyro: Option<GyroEstimate>,
    /// The health verdict.
    #[serde(skip)]
    pub verdict: Verdict,
    /// What of the robot file is probably wrong.
    #[serde(skip)]
    pub mismatch: Option<Mismatch>,
    /// How often the covariance was inflated since the robot was last not lost.
    pub inflations: u16,
}

/// The truth at one instant; the reference of a recording may have only the pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Truth {
    /// True pose.
    pub pose: Pose,
    /// True systematic errors, where they are known.
    pub calibration: Option<Calibration>,
    /// True bias of the gyro, rad/s, where it is known.
    pub gyro_bias: Option<f64>,
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
    /// The pose by dead reckoning with the nominal robot.
    pub odometry: Pose,
}

/// The outcome of one measurement cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The range corrected the filter: it is probably the wall's.
    Accepted,
    /// The range corrected the filter with a lower weight: it may be the wall's or clutter.
    Downweighted,
    /// The range lay beyond the gate and changed nothing.
    Gated,
    /// There was no usable range, or no measurable wall.
    Refused,
}

impl Outcome {
    /// Whether the range corrected the filter.
    #[must_use]
    pub fn is_used(self) -> bool {
        matches!(self, Self::Accepted | Self::Downweighted)
    }
}

/// Why a wall was chosen: the predictions behind the choice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Why {
    /// Expected reduction of the weighted variance (position and every other weighted state), m².
    pub gain: f64,
    /// Predicted probability that the measurement succeeds.
    pub success: f64,
    /// Predicted duration, seconds.
    pub seconds: f64,
    /// How many walls could be measured, before occlusion is checked.
    pub candidates: u16,
}

/// One measurement cycle: the bearing, the range, and the outcome.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FixRecord {
    /// Seconds since the run began.
    pub time: f64,
    /// Index of the wall aimed at, if there was one.
    pub wall: Option<usize>,
    /// The ranger, counted from 0 as in the robot file; 0 if no wall was chosen.
    pub ranger: u8,
    /// The true position of the sonar (in a replay, the estimated one), metres.
    pub sonar: [f64; 2],
    /// Direction of the beam, radians in the map frame.
    pub direction: f64,
    /// Direction of the beam relative to the robot's heading, radians.
    pub bearing: f64,
    /// The measured range, metres; `None` without an echo.
    pub range: Option<f64>,
    /// The source of the echo; `None` without an echo, or where it is unknown.
    pub source: Option<Source>,
    /// Why this wall was chosen, if one was.
    pub why: Option<Why>,
    /// The outcome.
    pub outcome: Outcome,
    /// β, the probability that the echo was the wall's; `None` without an echo.
    pub association: Option<f64>,
    /// Why it was refused; empty otherwise.
    pub reason: String,
    /// Innovation, metres, where one was computed.
    pub innovation: Option<f64>,
    /// Innovation variance, m², where one was computed.
    pub innovation_variance: Option<f64>,
}

/// A heading, position or pose from outside.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AbsoluteRecord {
    /// When it was measured, seconds since the run began.
    pub time: f64,
    /// The measured position, metres; `None` for a heading.
    pub position: Option<[f64; 2]>,
    /// The measured heading, radians; `None` for a position.
    pub heading: Option<f64>,
    /// The outcome.
    pub outcome: Outcome,
    /// Why it was refused; empty otherwise.
    pub reason: String,
    /// Normalized innovation squared over its number of dimensions, where an innovation was computed.
    pub nis: Option<f64>,
}

/// A hypothesis of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hypothesis {
    /// The robot's pose.
    pub pose: Pose,
    /// Its likelihood over that of the best one.
    pub weight: f64,
}

/// The state of the search at one instant, while the robot has no confirmed pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SearchRecord {
    /// Seconds since the run began.
    pub time: f64,
    /// Whether a pose has been handed over and is not confirmed yet.
    pub is_provisional: bool,
    /// The hypotheses, best first.
    pub hypotheses: Vec<Hypothesis>,
    /// The pings of the window as the best hypothesis places them: sonar, and echo if there was one.
    pub pings: Vec<([f64; 2], Option<[f64; 2]>)>,
    /// The lines among them.
    pub lines: Vec<[[f64; 2]; 2]>,
}

/// A wall with its name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wall {
    /// Its name in the map file.
    pub name: String,
    /// One end, metres.
    pub from: [f64; 2],
    /// The other end, metres.
    pub to: [f64; 2],
}

/// The trace of one run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Trace {
    /// The map.
    pub walls: Vec<Wall>,
    /// The unmapped obstacles, where they are known.
    #[serde(skip)]
    pub obstacles: Vec<Obstacle>,
    /// Half of the sonar's cone, radians.
    pub cone: f64,
    /// The state of the localizer before its first input.
    pub start: Option<Tick>,
    /// Every encoder tick, in order of time.
    pub ticks: Vec<Tick>,
    /// Every measurement cycle, in order of time.
    pub fixes: Vec<FixRecord>,
    /// Every heading, position and pose from outside, in the order in which the localizer took them.
    pub absolutes: Vec<AbsoluteRecord>,
    /// The search, in order of time.
    pub searches: Vec<SearchRecord>,
}

impl Trace {
    /// An empty trace on a floor.
    #[must_use]
    pub fn of(floor: &Floor, cone: Radians) -> Self {
        let wall = |w: &NamedWall| Wall { name: w.name().to_owned(), from: w.from(), to: w.to() };
        let walls = floor.named_walls().iter().map(wall).collect();
        Self { walls, cone: cone.0.into(), ..Self::default() }
    }
}

/// Receives the records of a run as it proceeds. A record is only built if the recorder calls `make`.
pub trait Recorder {
    /// The localizer has its start estimate, and no input yet. A restart after a power loss is another start.
    fn started(&mut self, _make: impl FnOnce() -> Tick) {}
    /// An encoder tick is over.
    fn tick(&mut self, make: impl FnOnce() -> Tick);
    /// A measurement cycle is over.
    fn fix(&mut self, make: impl FnOnce() -> FixRecord);
    /// The localizer has taken or refused a heading, position or pose from outside.
    fn absolute(&mut self, _make: impl FnOnce() -> AbsoluteRecord) {}
    /// The robot has no confirmed pose, twice a second.
    fn search(&mut self, _make: impl FnOnce() -> SearchRecord) {}
    /// The robot's localizer has started, at the fidelity of pins.
    fn began(&mut self, _localizer: &Localizer) {}
    /// What the robot's loop has done, at the fidelity of pins: after each step of the simulated hardware, empty while the loop
    /// sleeps.
    fn polled(&mut self, _report: &Report, _localizer: &Localizer) {}
}

/// Records nothing.
impl Recorder for () {
    fn tick(&mut self, _: impl FnOnce() -> Tick) {}
    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}
}

/// Records everything.
impl Recorder for Trace {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        self.start.get_or_insert_with(make);
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        self.ticks.push(make());
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        self.fixes.push(make());
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        self.absolutes.push(make());
    }

    fn search(&mut self, make: impl FnOnce() -> SearchRecord) {
        self.searches.push(make());
    }
}
