//! One wall, and its line.
//!
//! # Non-finite policy
//! [`Wall::new`] refuses NaN, infinity and a length that overflows. For a point that is not finite the
//! functions return NaN or infinity. [`Wall::with_accuracy`] takes any number.

use crate::geometry::numeric::between;
use crate::geometry::pose::{Heading, Point};
use crate::geometry::trig::atan2;
use crate::geometry::units::{Metres, Radians};

/// Reason for which a wall is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WallError {
    /// A coordinate is NaN or infinite, or the length overflows.
    NotFinite,
    /// The wall is degenerate: its ends are the same point, or nearer than [`Wall::SHORTEST`].
    ZeroLength,
}

impl core::fmt::Display for WallError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a coordinate of the wall is NaN or infinite",
            Self::ZeroLength => "the wall has no length",
        })
    }
}

impl core::error::Error for WallError {}

/// Number of a wall in its map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WallId(pub u32);

/// A wall segment, with its line in the paper's form a x + b y + c = 0, a² + b² = 1 (eq. 1).
///
/// The line is stored as a point and a unit tangent, not as c: far from the origin, the range would lose
/// digits to c.
///
/// ```
/// use sonarfix::map::Wall;
/// use sonarfix::geometry::pose::Point;
/// let wall = Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?;
/// // Left of the direction from one end to the other, the distance is positive.
/// assert_eq!(wall.signed_distance(Point::new(1.0, 2.0)).0, 2.0);
/// assert_eq!(wall.along(Point::new(1.0, 2.0)).0, 1.0);
/// # Ok::<(), sonarfix::map::WallError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wall {
    from: Point,
    tangent_x: f32,
    tangent_y: f32,
    length: f32,
    /// Millimetres, 0 for none.
    accuracy: u8,
}

impl Wall {
    /// Length of the shortest wall. The direction of a shorter one is not significant.
    pub const SHORTEST: Metres = Metres(1e-4);

    /// Worst accuracy that a wall can state.
    pub const WORST_ACCURACY: Metres = Metres(0.255);

    /// A wall between two points of the map, without an accuracy of its own.
    ///
    /// # Errors
    /// [`WallError`], by what is wrong with the points.
    pub fn new(from: Point, to: Point) -> Result<Self, WallError> {
        let (dx, dy) = ((to.x - from.x).0, (to.y - from.y).0);
        let length = libm::hypotf(dx, dy);
        if !from.is_finite() || !to.is_finite() || !length.is_finite() {
            return Err(WallError::NotFinite);
        }
        if length < Self::SHORTEST.0 {
            return Err(WallError::ZeroLength);
        }
        let (tangent_x, tangent_y) = (dx / length, dy / length);
        Ok(Self { from, tangent_x, tangent_y, length, accuracy: 0 })
    }

    /// The same wall with an accuracy of its own: the standard deviation of its place, rounded to whole millimetres, at least
    /// 1 mm and at most [`Self::WORST_ACCURACY`]. It replaces [`map_accuracy`](crate::sensor::echo::EchoParameters::map_accuracy).
    /// Without one if it is negative or NaN.
    #[must_use]
    pub fn with_accuracy(self, accuracy: Metres) -> Self {
        let millimetres = between(1e3 * accuracy.0 + 0.5, 1.0, 255.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the integer part, which is a byte"
        )]
        let millimetres = millimetres as u8;
        Self { accuracy: if accuracy.0 >= 0.0 { millimetres } else { 0 }, ..self }
    }

    /// The standard deviation of its place, if it has one of its own.
    #[must_use]
    pub fn accuracy(&self) -> Option<Metres> {
        (self.accuracy > 0).then(|| Metres(1e-3 * f32::from(self.accuracy)))
    }

    /// The accuracy in a [baked map](super::image): millimetres, 0 for none.
    #[must_use]
    pub fn stored_accuracy(&self) -> u8 {
        self.accuracy
    }

    /// A wall from its stored form: coordinates of its start, unit tangent, length; accuracy.
    pub(super) fn from_stored(
        [x, y, tangent_x, tangent_y, length]: [f32; 5],
        accuracy: u8,
    ) -> Self {
        Self { from: Point::new(x, y), tangent_x, tangent_y, length, accuracy }
    }

    /// The stored form in a [baked map](super::image): coordinates of its start, unit tangent, length.
    #[must_use]
    pub fn stored(&self) -> [f32; 5] {
        [self.from.x.0, self.from.y.0, self.tangent_x, self.tangent_y, self.length]
    }

    /// Whether [`Self::new`] can return this wall: finite, long enough, and its tangent a unit vector to
    /// the rounding of `f32`.
    pub(super) fn is_valid(&self) -> bool {
        let norm = self.tangent_x * self.tangent_x + self.tangent_y * self.tangent_y;
        // Two quotients and a hypotenuse, each rounded: at most 3e-7.
        let is_unit = (norm - 1.0).abs() < 1e-6;
        let is_long_enough = self.length >= Self::SHORTEST.0;
        is_unit && is_long_enough && self.from.is_finite() && self.to().is_finite()
    }

    /// The first end.
    #[must_use]
    pub fn from(&self) -> Point {
        self.from
    }

    /// The second end.
    #[must_use]
    pub fn to(&self) -> Point {
        Point::new(
            self.from.x.0 + self.tangent_x * self.length,
            self.from.y.0 + self.tangent_y * self.length,
        )
    }

    /// a of eq. (1): x component of the unit normal, which points to the left of the direction from the
    /// first end to the second.
    #[must_use]
    pub fn a(&self) -> f32 {
        -self.tangent_y
    }

    /// b of eq. (1): y component of the unit normal.
    #[must_use]
    pub fn b(&self) -> f32 {
        self.tangent_x
    }

    /// Length of the segment.
    #[must_use]
    pub fn length(&self) -> Metres {
        Metres(self.length)
    }

    // ===== Eq. (1): d =====
    /// d of eq. (1): the distance of `point` from the line of the wall, negative on its right side.
    #[must_use]
    pub fn signed_distance(&self, point: Point) -> Metres {
        let (dx, dy) = ((point.x - self.from.x).0, (point.y - self.from.y).0);
        Metres(self.a() * dx + self.b() * dy)
    }

    /// Distance of the foot of the perpendicular from `point` along the wall, from its start. The foot is
    /// on the segment if the distance is between zero and the length.
    #[must_use]
    pub fn along(&self, point: Point) -> Metres {
        let (dx, dy) = ((point.x - self.from.x).0, (point.y - self.from.y).0);
        Metres(self.tangent_x * dx + self.tangent_y * dy)
    }

    /// Direction of the perpendicular to the wall from a point at the given signed distance.
    #[must_use]
    pub fn direction_from(&self, signed_distance: Metres) -> Heading {
        let side = if signed_distance.0 < 0.0 { -1.0 } else { 1.0 };
        Heading::new(Radians(atan2(-side * self.b(), -side * self.a())))
    }
}
