//! Points, headings and poses.
//!
//! There are two frames. *Map*: fixed, with the x and y of the map, angles counter-clockwise from x.
//! *Robot*: x ahead along the heading, y to the left, origin midway between the wheels.
//!
//! # Non-finite policy
//! NaN and infinity propagate; a heading from either is NaN. [`Pose::is_finite`] detects them, and
//! every function that passes a pose to the filter checks it.

use core::f32::consts::{PI, TAU};

use crate::geometry::trig::sin_cos;
use crate::geometry::units::{Metres, Radians};

/// A point, in the map frame unless stated otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Point {
    /// Along x.
    pub x: Metres,
    /// Along y.
    pub y: Metres,
}

impl Point {
    /// A point from its coordinates in metres.
    #[must_use]
    pub const fn new(x: f32, y: f32) -> Self {
        Self { x: Metres(x), y: Metres(y) }
    }

    /// Whether both coordinates are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

/// A direction in the map frame: radians, counter-clockwise from map x, kept in (−π, π].
///
/// ```
/// use sonarfix::geometry::pose::Heading;
/// use sonarfix::geometry::units::Radians;
/// let heading = Heading::new(Radians(3.0)).turned(Radians(1.0));
/// assert!((heading.radians().0 - (4.0 - core::f32::consts::TAU)).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "Radians", into = "Radians"))]
pub struct Heading(f32);

impl Heading {
    /// Wraps any finite angle into (−π, π] in constant time; NaN and infinity become NaN.
    #[must_use]
    pub fn new(angle: Radians) -> Self {
        Self(wrap(angle.0))
    }

    /// The heading, in (−π, π].
    #[must_use]
    pub fn radians(self) -> Radians {
        Radians(self.0)
    }

    /// The heading after a turn, counter-clockwise.
    #[must_use]
    pub fn turned(self, by: Radians) -> Self {
        Self(wrap(self.0 + by.0))
    }

    /// The turn, in (−π, π], that leads from `other` to this heading.
    #[must_use]
    pub fn from(self, other: Self) -> Radians {
        Radians(wrap(self.0 - other.0))
    }
}

impl From<Radians> for Heading {
    fn from(angle: Radians) -> Self {
        Self::new(angle)
    }
}

impl From<Heading> for Radians {
    fn from(heading: Heading) -> Self {
        heading.radians()
    }
}

fn wrap(angle: f32) -> f32 {
    if angle.abs() < PI {
        return angle;
    }
    // Subtracting one turn is exact for an angle of up to two.
    let turned = angle - TAU.copysign(angle);
    if turned.abs() < PI { turned } else { wrap_far(angle) }
}

#[cold]
#[inline(never)]
fn wrap_far(angle: f32) -> f32 {
    // Exactly half a turn is the direction of many walls.
    if angle.abs() <= PI {
        return PI;
    }
    // Unlike repeated subtraction, remainderf terminates for any angle.
    let wrapped = libm::remainderf(angle, TAU);
    if wrapped <= -PI { PI } else { wrapped }
}

/// A robot pose in the map frame.
///
/// ```
/// use sonarfix::geometry::pose::{Point, Pose};
/// use sonarfix::geometry::units::Radians;
/// let pose = Pose::new(2.0, 1.0, Radians::from_degrees(90.0));
/// // A sonar 10 cm ahead of the axle of a robot that faces along y:
/// let sonar = pose.to_map(Point::new(0.1, 0.0));
/// assert!((sonar.x.0 - 2.0).abs() < 1e-6 && (sonar.y.0 - 1.1).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Midpoint between the wheels, along map x.
    pub x: Metres,
    /// Midpoint between the wheels, along map y.
    pub y: Metres,
    /// Direction of the robot.
    pub heading: Heading,
}

impl Pose {
    /// A pose from metres and an angle, which is wrapped.
    #[must_use]
    pub fn new(x: f32, y: f32, heading: Radians) -> Self {
        Self { x: Metres(x), y: Metres(y), heading: Heading::new(heading) }
    }

    /// The position without the heading.
    #[must_use]
    pub fn position(self) -> Point {
        Point { x: self.x, y: self.y }
    }

    /// Whether all three numbers are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.position().is_finite() && self.heading.0.is_finite()
    }

    /// A point of the robot frame, in the map frame.
    #[must_use]
    pub fn to_map(self, point: Point) -> Point {
        let (sin, cos) = sin_cos(self.heading.radians());
        Point {
            x: Metres(self.x.0 + cos * point.x.0 - sin * point.y.0),
            y: Metres(self.y.0 + sin * point.x.0 + cos * point.y.0),
        }
    }
}
