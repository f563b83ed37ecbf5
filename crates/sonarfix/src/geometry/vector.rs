//! Plane vectors: metres, or unit vectors.

use crate::geometry::pose::Point;
use crate::geometry::trig::sin_cos;
use crate::geometry::units::Radians;

/// A vector in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Vector {
    /// Along x.
    pub x: f32,
    /// Along y.
    pub y: f32,
}

impl Vector {
    /// The vector of these components.
    #[must_use]
    pub const fn new(x: f32, y: f32) -> Self {
        Self { x, y }
    }

    /// Cosine and sine of an angle, radians.
    #[inline(never)]
    #[must_use]
    pub fn of_angle(angle: f32) -> Self {
        let (sin, cos) = sin_cos(Radians(angle));
        Self { x: cos, y: sin }
    }

    /// The scalar product.
    #[must_use]
    pub fn dot(self, other: Self) -> f32 {
        self.x * other.x + self.y * other.y
    }

    /// The sum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }

    /// The difference.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }

    /// The vector times a number.
    #[must_use]
    pub fn times(self, factor: f32) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }

    /// The vector turned by 90° to the left.
    #[must_use]
    pub fn left(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// The vector turned by the angle of which `by` holds cosine and sine.
    #[must_use]
    pub fn turned(self, by: Self) -> Self {
        Self::new(by.x * self.x - by.y * self.y, by.y * self.x + by.x * self.y)
    }

    /// The square of the length.
    #[must_use]
    pub fn length_squared(self) -> f32 {
        self.dot(self)
    }
}

impl From<Point> for Vector {
    fn from(point: Point) -> Self {
        Self::new(point.x.0, point.y.0)
    }
}

impl From<Vector> for Point {
    fn from(vector: Vector) -> Self {
        Self::new(vector.x, vector.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_is_turned_counter_clockwise() {
        // cos and sin of the angle whose tangent is 4/3.
        let turned = Vector::new(2.0, 1.0).turned(Vector::new(0.6, 0.8));
        assert!((turned.x - 0.4).abs() < 1e-6 && (turned.y - 2.2).abs() < 1e-6, "{turned:?}");
    }

    #[test]
    fn a_point_is_converted_both_ways() {
        let point = Point::new(1.5, -2.5);
        assert_eq!(Point::from(Vector::from(point)), point);
    }
}
