//! The path of a simulated robot: straight legs, with turns in place between them.
//!
//! Every pose is computed from the corners of the plan and not from an earlier pose, so that rounding does not
//! accumulate: after any number of laps the robot is exactly at the corner.

use std::fmt;

use crate::geometry::{self, TOUCH, distance, wrap};

/// The largest angle between two legs that is due to rounding.
const NO_TURN: f64 = 1e-12;

/// The largest number of laps. The legs of all laps are stored.
const MOST_LAPS: u32 = 10_000;

/// A pose in the map frame: metres, metres, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPose {
    /// Metres along map x.
    pub x: f64,
    /// Metres along map y.
    pub y: f64,
    /// Radians counter-clockwise from map x, in (−π, π].
    pub heading: f64,
}

/// The definition of a path, in metres, seconds and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPlan {
    /// Start; the robot faces the first corner.
    pub start: [f64; 2],
    /// The corners, connected by straight lines.
    pub corners: Vec<[f64; 2]>,
    /// Number of laps; more than one only if the last corner is the start.
    pub laps: u32,
    /// Speed on the straight legs, m/s.
    pub speed: f64,
    /// Turn rate at the corners, rad/s.
    pub turn_rate: f64,
}

/// Why a plan is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PathError {
    /// The start is not finite, or too far from the origin.
    Start,
    /// There is no corner.
    NoCorner,
    /// The corner with this index is not finite, or too far from the origin.
    Corner(usize),
    /// The corner with this index equals the point before it.
    SameCorner(usize),
    /// There are too few or too many laps.
    Laps,
    /// There are several laps, but the path is not closed.
    OpenLaps,
    /// The speed is not a positive number.
    Speed,
    /// The turn rate is not a positive number.
    TurnRate,
}

impl PathError {
    /// The invalid field of the plan.
    #[must_use]
    pub fn field(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::NoCorner | Self::Corner(_) | Self::SameCorner(_) => "corners",
            Self::Laps | Self::OpenLaps => "laps",
            Self::Speed => "speed",
            Self::TurnRate => "turn_rate",
        }
    }

    /// The index of the invalid corner, if any.
    #[must_use]
    pub fn corner(self) -> Option<usize> {
        match self {
            Self::Corner(index) | Self::SameCorner(index) => Some(index),
            _ => None,
        }
    }
}

impl fmt::Display for PathError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start | Self::Corner(_) => write!(f, "must be {}", geometry::TOO_FAR),
            Self::NoCorner => f.write_str("must hold at least one corner to drive to"),
            Self::SameCorner(_) => {
                f.write_str("must differ from the point before it; the robot is already there")
            }
            Self::Laps => write!(f, "must be from 1 to {MOST_LAPS}"),
            Self::OpenLaps => f.write_str(
                "must be 1, because the last corner is not the start; end the corners there",
            ),
            Self::Speed | Self::TurnRate => f.write_str("must be positive and finite"),
        }
    }
}

impl std::error::Error for PathError {}

/// The movement on a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Movement {
    /// Drives ahead by this many metres.
    Straight(f64),
    /// Turns in place by this angle, counter-clockwise, in (−π, π]: the shorter direction, left if both are equal.
    Turn(f64),
}

/// One leg of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Start time, seconds from the start of the path.
    pub start_time: f64,
    /// Duration, seconds.
    pub duration: f64,
    /// Start pose.
    pub from: PathPose,
    /// End pose.
    pub to: PathPose,
    /// The movement.
    pub movement: Movement,
}

impl Leg {
    /// End time, seconds from the start of the path.
    #[must_use]
    pub fn end_time(&self) -> f64 {
        self.start_time + self.duration
    }

    /// The completed fraction of the leg at a time, from 0 to 1.
    fn done(&self, time: f64) -> f64 {
        if time >= self.end_time() {
            return 1.0;
        }
        ((time - self.start_time) / self.duration).max(0.0)
    }

    fn pose_at(&self, time: f64) -> PathPose {
        let done = self.done(time);
        if done >= 1.0 {
            return self.to;
        }
        let (from, to) = (self.from, self.to);
        match self.movement {
            Movement::Straight(_) => PathPose {
                x: from.x + done * (to.x - from.x),
                y: from.y + done * (to.y - from.y),
                heading: from.heading,
            },
            Movement::Turn(by) => PathPose { heading: wrap(from.heading + done * by), ..from },
        }
    }

    fn motion_between(&self, from: f64, to: f64) -> Motion {
        let share = self.done(to) - self.done(from);
        match self.movement {
            Movement::Straight(length) => Motion { advance: share * length, turn: 0.0 },
            Movement::Turn(by) => Motion { advance: 0.0, turn: share * by },
        }
    }
}

/// A movement without its time: straight ahead or in place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Metres ahead.
    pub advance: f64,
    /// Radians counter-clockwise.
    pub turn: f64,
}

/// A valid path, with the pose at every time.
///
/// ```
/// use sonarfix_map::{Path, PathPlan};
/// let path = Path::new(PathPlan {
///     start: [0.0, 0.0],
///     corners: vec![[2.0, 0.0], [2.0, 2.0]],
///     laps: 1,
///     speed: 0.5,
///     turn_rate: 1.0,
/// })?;
/// assert_eq!(path.pose_at(2.0).x, 1.0);
/// assert_eq!(path.pose_at(path.duration()).y, 2.0);
/// # Ok::<(), sonarfix_map::PathError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    plan: PathPlan,
    start: PathPose,
    legs: Vec<Leg>,
}

impl Path {
    /// Creates the path of a plan.
    ///
    /// # Errors
    /// [`PathError`], by the cause.
    pub fn new(plan: PathPlan) -> Result<Self, PathError> {
        check(&plan)?;
        let first = *plan.corners.first().ok_or(PathError::NoCorner)?;
        let start =
            PathPose { x: plan.start[0], y: plan.start[1], heading: direction(plan.start, first) };
        let legs = Driver::new(&plan, start).drive();
        Ok(Self { plan, start, legs })
    }

    /// The definition of the path.
    #[must_use]
    pub fn plan(&self) -> &PathPlan {
        &self.plan
    }

    /// The legs of all laps in order.
    #[must_use]
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Whether the path ends in the pose it starts from.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        is_closed(&self.plan)
    }

    /// Duration, seconds.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.legs.last().map_or(0.0, Leg::end_time)
    }

    /// Length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        let length = |leg: &Leg| match leg.movement {
            Movement::Straight(length) => length,
            Movement::Turn(_) => 0.0,
        };
        self.legs.iter().map(length).sum()
    }

    /// The pose at a time, seconds from the start. Before the start it is the start, after the end it is the end.
    #[must_use]
    pub fn pose_at(&self, time: f64) -> PathPose {
        let begun = self.legs.partition_point(|leg| leg.start_time <= time);
        let current = self.legs.get(..begun).and_then(<[Leg]>::last);
        current.map_or(self.start, |leg| leg.pose_at(time))
    }

    /// The exact motion from one time to a later one: one piece per leg in between, in order. None if `to` is not later.
    pub fn motion_between(&self, from: f64, to: f64) -> impl Iterator<Item = Motion> + '_ {
        let to = to.max(from);
        let ended = self.legs.partition_point(|leg| leg.end_time() <= from);
        let begun = self.legs.partition_point(|leg| leg.start_time < to);
        let legs = self.legs.get(ended..begun).unwrap_or_default();
        legs.iter().map(move |leg| leg.motion_between(from, to))
    }
}

fn direction(from: [f64; 2], to: [f64; 2]) -> f64 {
    wrap(libm::atan2(to[1] - from[1], to[0] - from[0]))
}

fn is_closed(plan: &PathPlan) -> bool {
    let last = plan.corners.last();
    last.is_some_and(|&last| distance(last, plan.start) < TOUCH)
}

fn check(plan: &PathPlan) -> Result<(), PathError> {
    if !geometry::is_near_enough(plan.start) {
        return Err(PathError::Start);
    }
    let mut here = plan.start;
    for (index, &corner) in plan.corners.iter().enumerate() {
        if !geometry::is_near_enough(corner) {
            return Err(PathError::Corner(index));
        }
        if distance(here, corner) < TOUCH {
            return Err(PathError::SameCorner(index));
        }
        here = corner;
    }
    let positive = |value: f64| value > 0.0 && value.is_finite();
    if plan.corners.is_empty() {
        Err(PathError::NoCorner)
    } else if !(1..=MOST_LAPS).contains(&plan.laps) {
        Err(PathError::Laps)
    } else if plan.laps > 1 && !is_closed(plan) {
        Err(PathError::OpenLaps)
    } else if !positive(plan.speed) {
        Err(PathError::Speed)
    } else if !positive(plan.turn_rate) {
        Err(PathError::TurnRate)
    } else {
        Ok(())
    }
}

/// Generates the legs of a plan.
struct Driver<'a> {
    plan: &'a PathPlan,
    start: PathPose,
    here: PathPose,
    time: f64,
    legs: Vec<Leg>,
}

impl<'a> Driver<'a> {
    fn new(plan: &'a PathPlan, start: PathPose) -> Self {
        Self { plan, start, here: start, time: 0.0, legs: Vec::new() }
    }

    fn drive(mut self) -> Vec<Leg> {
        for _ in 0..self.plan.laps {
            for &corner in &self.plan.corners {
                self.drive_to(corner);
            }
        }
        if is_closed(self.plan) {
            self.turn_to(self.start.heading);
        }
        self.legs
    }

    fn drive_to(&mut self, corner: [f64; 2]) {
        let here = [self.here.x, self.here.y];
        let heading = direction(here, corner);
        self.turn_to(heading);
        let length = distance(here, corner);
        let to = PathPose { x: corner[0], y: corner[1], heading };
        self.add(to, length / self.plan.speed, Movement::Straight(length));
    }

    fn turn_to(&mut self, heading: f64) {
        let mut by = wrap(heading - self.here.heading);
        if by.abs() < NO_TURN {
            return;
        }
        // A half turn is +π or −π by rounding; it is always made to the left.
        if by < NO_TURN - std::f64::consts::PI {
            by += std::f64::consts::TAU;
        }
        let to = PathPose { heading, ..self.here };
        self.add(to, by.abs() / self.plan.turn_rate, Movement::Turn(by));
    }

    fn add(&mut self, to: PathPose, duration: f64, movement: Movement) {
        self.legs.push(Leg { start_time: self.time, duration, from: self.here, to, movement });
        self.here = to;
        self.time += duration;
    }
}
