//! Plane vectors: metres, or unit vectors.

use crate::pose::Point;
use crate::trig::sin_cos;
use crate::units::Radians;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Vector {
    pub x: f32,
    pub y: f32,
}

impl Vector {
    pub const fn new(x: f32, y: f32) -> Self {
        Self { x, y }
    }

    /// Cosine and sine of an angle, radians.
    #[inline(never)]
    pub fn of_angle(angle: f32) -> Self {
        let (sin, cos) = sin_cos(Radians(angle));
        Self { x: cos, y: sin }
    }

    pub fn dot(self, other: Self) -> f32 {
        self.x * other.x + self.y * other.y
    }

    pub fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }

    pub fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }

    pub fn times(self, factor: f32) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }

    /// The vector turned by 90° to the left.
    pub fn left(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// The vector turned by the angle of which `by` holds cosine and sine.
    pub fn turned(self, by: Self) -> Self {
        Self::new(by.x * self.x - by.y * self.y, by.y * self.x + by.x * self.y)
    }

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
    fn a_point_is_converted_both_ways() {
        let point = Point::new(1.5, -2.5);
        assert_eq!(Point::from(Vector::from(point)), point);
    }
}
