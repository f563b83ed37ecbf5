//! One wall, and its line.
//!
//! # Non-finite policy
//! [`Wall::new`] refuses NaN, infinity and what is too long to measure. Asked for a point that is not
//! finite, a wall answers with NaN or infinity.

use crate::pose::{Heading, Point};
use crate::units::{Metres, Radians};

/// Why a wall was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WallError {
    /// A coordinate is NaN or infinite, or the wall is too long to measure.
    NotFinite,
    /// Both ends are the same point, or nearer than [`Wall::SHORTEST`].
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

/// A wall segment, with its line in the paper's form a x + b y + c = 0, a² + b² = 1 (eq. 1).
///
/// The line is kept as a point and a unit tangent, not as c: far from the origin, c would cost
/// the digits that a range is measured with.
///
/// ```
/// use sonarfix::map::Wall;
/// use sonarfix::pose::Point;
/// let wall = Wall::new(Point::new(0.0, 0.0), Point::new(4.0, 0.0))?;
/// // On the left of the way from one end to the other, the distance is positive.
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
}

impl Wall {
    /// The shortest wall: a tenth of a millimetre has no direction that a sonar could tell.
    pub const SHORTEST: Metres = Metres(1e-4);

    /// A wall between two points of the map.
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
        Ok(Self { from, tangent_x: dx / length, tangent_y: dy / length, length })
    }

    /// A wall from what it is stored as: the coordinates of its start, its unit tangent, its length.
    pub(super) fn from_stored([x, y, tangent_x, tangent_y, length]: [f32; 5]) -> Self {
        Self { from: Point::new(x, y), tangent_x, tangent_y, length }
    }

    /// What the wall is stored as in a [baked map](super::image): the coordinates of its start, its
    /// unit tangent, its length.
    #[must_use]
    pub fn stored(&self) -> [f32; 5] {
        [self.from.x.0, self.from.y.0, self.tangent_x, self.tangent_y, self.length]
    }

    /// Whether this could have come from [`Self::new`]: finite, long enough, and its tangent a
    /// unit vector to the rounding of `f32`.
    pub(super) fn is_sound(&self) -> bool {
        let norm = self.tangent_x * self.tangent_x + self.tangent_y * self.tangent_y;
        // Two quotients and a hypotenuse, each rounded: 3e-7 at most.
        let is_unit = (norm - 1.0).abs() < 1e-6;
        let is_long_enough = self.length >= Self::SHORTEST.0;
        is_unit && is_long_enough && self.from.is_finite() && self.to().is_finite()
    }

    /// The end the wall was drawn from.
    #[must_use]
    pub fn from(&self) -> Point {
        self.from
    }

    /// The end the wall was drawn to.
    #[must_use]
    pub fn to(&self) -> Point {
        Point::new(
            self.from.x.0 + self.tangent_x * self.length,
            self.from.y.0 + self.tangent_y * self.length,
        )
    }

    /// a of eq. (1): x component of the unit normal, which points to the left of the way from one
    /// end to the other.
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

    /// d of eq. (1): the distance of `point` from the wall's line, negative on its right side.
    #[must_use]
    pub fn signed_distance(&self, point: Point) -> Metres {
        let (dx, dy) = ((point.x - self.from.x).0, (point.y - self.from.y).0);
        Metres(self.a() * dx + self.b() * dy)
    }

    /// Where along the wall the foot of the perpendicular from `point` lies, from the wall's
    /// start; on the segment if between zero and its length.
    #[must_use]
    pub fn along(&self, point: Point) -> Metres {
        let (dx, dy) = ((point.x - self.from.x).0, (point.y - self.from.y).0);
        Metres(self.tangent_x * dx + self.tangent_y * dy)
    }

    /// The direction in which a point at the given signed distance sees the wall squarely.
    #[must_use]
    pub fn direction_from(&self, signed_distance: Metres) -> Heading {
        let normal = Heading::new(Radians(libm::atan2f(self.b(), self.a())));
        if signed_distance.0 < 0.0 { normal } else { normal.turned(Radians(core::f32::consts::PI)) }
    }
}
