//! A route by pure pursuit, from estimates of the pose.
//!
//! The robot steers along an arc to a point of the route that is the look-ahead distance L ahead of it (Coulter,
//! *Implementation of the Pure Pursuit Path Tracking Algorithm*, 1992). With the point at the distance d and the bearing α, the
//! curvature of that arc is
//!
//! ```text
//! κ = 2 sin α / d
//! ```
//!
//! Where α is large, the robot first turns on the spot. A corner of the route is passed within L, on the inside; the end is
//! reached within the tolerance. The speed declines towards the end, and where the arc would need a faster turn than
//! the limit.
//!
//! ```text
//!                 the verdict is Lost, the pose is uncertain,
//!                 an object is ahead
//!   Driving ─────────────────────────────────────────────────▶ Stopped(reason)
//!      │    ◀─────────────────────────────────────────────────
//!      ▼          none of them any more
//!   Arrived, which stays
//! ```
//!
//! At the end the pose must be more certain than on the route: until it is, the robot stands and its ranges correct the pose.
//!
//! It avoids nothing: the route has a clearance of L and half of the robot from every wall. It is an example of a controller,
//! to be replaced by a planner where a robot needs one.
//!
//! # Non-finite policy
//! [`Pursuit::new`] refuses NaN and infinity. [`Pursuit::drive`] stops the robot at a pose or a deviation that is not finite.

use sonarfix::geometry::elementary::sqrt;
use sonarfix::geometry::numeric::{at_least, at_most};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::trig::atan2;
use sonarfix::geometry::units::{
    Duration, Metres, MetresPerSecond, Radians, RadiansPerSecond, seconds,
};
use sonarfix::geometry::vector::Vector;
use sonarfix::health::Verdict;
use sonarfix_link::Motion;

use crate::clamped;

/// How a robot drives along a route, and when it stops.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// The speed on a straight line.
    pub speed: MetresPerSecond,
    /// The fastest turn.
    pub turn: RadiansPerSecond,
    /// The look-ahead distance L: longer than the tolerance, and than the travel in some periods of the estimate.
    pub look_ahead: Metres,
    /// The distance from the end at which the robot has arrived.
    pub tolerance: Metres,
    /// The time constant with which the robot approaches the end, and with which it turns on the spot.
    pub approach: Duration,
    /// The bearing of the point ahead beyond which the robot turns on the spot.
    pub turn_first: Radians,
    /// The largest deviation of the position with which the robot drives.
    pub max_deviation: Metres,
    /// The largest deviation of the position with which it has arrived: with a larger one it stands at the end until ranges have
    /// reduced it, and drives on if the end is then elsewhere.
    pub end_deviation: Metres,
    /// The robot does not drive ahead while an object is nearer than this ([`Situation::ahead`]).
    pub clearance: Metres,
}

impl Limits {
    /// For a robot 20 cm wide: 0.2 m/s, 60°/s, L = 15 cm, tolerance 2 cm.
    pub const SMALL: Self = Self {
        speed: MetresPerSecond(0.2),
        turn: RadiansPerSecond(1.05),
        look_ahead: Metres(0.15),
        tolerance: Metres(0.02),
        approach: Duration::from_ticks(500_000),
        turn_first: Radians(0.5),
        max_deviation: Metres(0.1),
        end_deviation: Metres(0.02),
        clearance: Metres(0.3),
    };
}

/// Why a route or its limits were refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RouteError {
    /// The route has no point.
    Empty,
    /// A point of the route is not finite.
    Point,
    /// A limit is not positive and finite.
    Limit,
    /// The look-ahead distance is not longer than the tolerance.
    LookAhead,
}

impl core::fmt::Display for RouteError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Empty => "the route has no point",
            Self::Point => "a point of the route is not finite",
            Self::Limit => "a limit is not positive and finite",
            Self::LookAhead => "the look-ahead distance must be longer than the tolerance",
        })
    }
}

impl core::error::Error for RouteError {}

/// What is known about the robot now.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Situation {
    /// The estimated pose.
    pub pose: Pose,
    /// The deviation of its position: the larger one of x and y.
    pub deviation: Metres,
    /// The reliability of the estimate.
    pub verdict: Verdict,
    /// The distance of the nearest object ahead that is not on the map, from the midpoint between the wheels
    /// ([`Obstacles::ahead`](crate::obstacles::Obstacles::ahead)). `None`: none is known.
    pub ahead: Option<Metres>,
}

/// Why a robot stands on its route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reason {
    /// The verdict is [`Verdict::Lost`], or the pose is not finite.
    Lost,
    /// The deviation of the position is larger than [`Limits::max_deviation`], or at the end than [`Limits::end_deviation`].
    Uncertain,
    /// An object is nearer than [`Limits::clearance`].
    Obstructed,
}

impl core::fmt::Display for Reason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Lost => "the robot is lost",
            Self::Uncertain => "the pose is too uncertain",
            Self::Obstructed => "an object that is not on the map is ahead",
        })
    }
}

/// What the robot does on its route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// It drives.
    Driving,
    /// It has reached the end, and stands from now on.
    Arrived,
    /// It stands, and drives on when the reason no longer holds.
    Stopped(Reason),
}

/// A robot on a route.
///
/// ```
/// use sonarfix::geometry::pose::{Point, Pose};
/// use sonarfix::geometry::units::{Metres, Radians};
/// use sonarfix::health::Verdict;
/// use sonarfix_drive::pursuit::{Limits, Progress, Pursuit, Situation};
/// // To one point: a route of one leg.
/// let route = [Point::new(2.0, 0.0)];
/// let mut pursuit = Pursuit::new(&route, Limits::SMALL)?;
/// let situation = Situation {
///     pose: Pose::new(0.0, 0.0, Radians(0.1)),
///     deviation: Metres(0.01),
///     verdict: Verdict::Tracking,
///     ahead: None,
/// };
/// let (progress, motion) = pursuit.drive(&situation);
/// assert_eq!(progress, Progress::Driving);
/// assert!(motion.speed.0 > 0.0 && motion.turn.0 < 0.0);
/// # Ok::<(), sonarfix_drive::pursuit::RouteError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Pursuit<'r> {
    route: &'r [Point],
    limits: Limits,
    /// The start of the present leg, from the first estimate on.
    from: Option<Point>,
    /// The index of the point at the end of the present leg.
    next: usize,
    is_turning: bool,
    has_arrived: bool,
}

impl<'r> Pursuit<'r> {
    /// A robot that is to drive from where it is along these points.
    ///
    /// # Errors
    /// [`RouteError`].
    pub fn new(route: &'r [Point], limits: Limits) -> Result<Self, RouteError> {
        if route.is_empty() {
            return Err(RouteError::Empty);
        }
        if !route.iter().all(|point| point.is_finite()) {
            return Err(RouteError::Point);
        }
        check(&limits)?;
        let (from, next) = (None, 0);
        Ok(Self { route, limits, from, next, is_turning: false, has_arrived: false })
    }

    /// The motion at a new estimate, and what the robot does. The motion holds until the next estimate.
    pub fn drive(&mut self, situation: &Situation) -> (Progress, Motion) {
        let stand = Motion::default();
        if self.has_arrived {
            return (Progress::Arrived, stand);
        }
        if let Some(reason) = self.reason_to_stand(situation) {
            return (Progress::Stopped(reason), stand);
        }
        let Some(target) = self.target(situation.pose.position()) else {
            if situation.deviation > self.limits.end_deviation {
                return (Progress::Stopped(Reason::Uncertain), stand);
            }
            self.has_arrived = true;
            return (Progress::Arrived, stand);
        };
        let motion = self.motion(situation.pose, target);
        // A turn on the spot may turn the robot away from the object.
        let is_near = situation.ahead.is_some_and(|ahead| ahead < self.limits.clearance);
        if is_near && motion.speed.0 > 0.0 {
            return (Progress::Stopped(Reason::Obstructed), stand);
        }
        (Progress::Driving, motion)
    }

    /// Why the robot must not move at all.
    fn reason_to_stand(&self, situation: &Situation) -> Option<Reason> {
        if situation.verdict == Verdict::Lost || !situation.pose.is_finite() {
            return Some(Reason::Lost);
        }
        // A comparison with NaN does not hold.
        let is_certain = situation.deviation <= self.limits.max_deviation;
        (!is_certain).then_some(Reason::Uncertain)
    }

    /// The point to steer to; `None` at the end of the route.
    fn target(&mut self, at: Point) -> Option<Target> {
        let at = Vector::from(at);
        let look_ahead = self.limits.look_ahead.0;
        loop {
            let end = Vector::from(*self.route.get(self.next)?);
            let from = Vector::from(*self.from.get_or_insert(at.into()));
            let leg = end.minus(from);
            let (length, left) = (length(leg), length(end.minus(at)));
            let is_last = self.next + 1 >= self.route.len();
            if is_last && left <= self.limits.tolerance.0 {
                return None;
            }
            let along = if length > 0.0 { at.minus(from).dot(leg) / length } else { length };
            let ahead = at_least(along, 0.0) + look_ahead;
            if ahead < length {
                let to = from.plus(leg.times(ahead / length));
                return Some(Target { to, left: is_last.then_some(left) });
            }
            if is_last {
                return Some(Target { to: end, left: Some(left) });
            }
            self.from = Some(end.into());
            self.next += 1;
        }
    }

    /// The arc to the target, or a turn on the spot towards it.
    fn motion(&mut self, pose: Pose, target: Target) -> Motion {
        let Limits { speed, turn, approach, turn_first, .. } = self.limits;
        let offset = target.to.minus(pose.position().into());
        let ahead = Vector::of_angle(pose.heading.radians().0);
        let (along, aside) = (ahead.dot(offset), ahead.left().dot(offset));
        let bearing = atan2(aside, along);
        let threshold = if self.is_turning { 0.25 * turn_first.0 } else { turn_first.0 };
        self.is_turning = bearing.abs() > threshold;
        let per_second = 1.0 / seconds(approach);
        if self.is_turning {
            let rate = clamped(bearing * per_second, turn.0);
            return Motion { turn: RadiansPerSecond(rate), ..Motion::default() };
        }
        let speed = target.left.map_or(speed.0, |left| at_most(left * per_second, speed.0));
        let curvature = 2.0 * aside / offset.length_squared();
        let rate = curvature * speed;
        // The same arc, slower.
        let slower = if rate.abs() > turn.0 { turn.0 / rate.abs() } else { 1.0 };
        let (speed, rate) = (speed * slower, rate * slower);
        Motion { speed: MetresPerSecond(speed), turn: RadiansPerSecond(rate) }
    }
}

/// A point to steer to.
#[derive(Debug, Clone, Copy)]
struct Target {
    to: Vector,
    /// The distance of the end, on the last leg.
    left: Option<f32>,
}

/// The length of a vector; exactly zero for a zero vector.
fn length(vector: Vector) -> f32 {
    let square = vector.length_squared();
    if square > f32::MIN_POSITIVE { sqrt(square) } else { 0.0 }
}

fn check(limits: &Limits) -> Result<(), RouteError> {
    let Limits {
        speed,
        turn,
        look_ahead,
        tolerance,
        approach,
        turn_first,
        max_deviation,
        end_deviation,
        clearance,
    } = *limits;
    let numbers = [
        speed.0,
        turn.0,
        look_ahead.0,
        tolerance.0,
        turn_first.0,
        max_deviation.0,
        end_deviation.0,
        clearance.0,
        seconds(approach),
    ];
    if !numbers.iter().all(|number| *number > 0.0 && number.is_finite()) {
        return Err(RouteError::Limit);
    }
    if look_ahead <= tolerance { Err(RouteError::LookAhead) } else { Ok(()) }
}
