//! The line of one side of a wall.

use nalgebra::Vector2;
use sonarfix_batch::odometry::wrap;

/// The line of a wall as seen from one side: the points p with n · p = offset, where the unit normal n points away from the
/// robot. The other side of the wall is another line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Direction of the normal, radians.
    pub angle: f64,
    /// Distance of the line from the origin along the normal, metres.
    pub offset: f64,
}

impl Line {
    /// The unit normal, away from the robot.
    #[must_use]
    pub fn normal(&self) -> Vector2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        Vector2::new(cos, sin)
    }

    /// The unit tangent, the normal turned to the left.
    #[must_use]
    pub fn tangent(&self) -> Vector2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        Vector2::new(-sin, cos)
    }

    /// Distance of a sonar before the line, metres; negative behind it.
    #[must_use]
    pub fn distance(&self, sonar: &Vector2<f64>) -> f64 {
        self.offset - self.normal().dot(sonar)
    }

    /// Position along the line, metres.
    #[must_use]
    pub fn along(&self, point: &Vector2<f64>) -> f64 {
        self.tangent().dot(point)
    }

    /// The point of the line at a position along it.
    #[must_use]
    pub fn point(&self, along: f64) -> Vector2<f64> {
        self.normal() * self.offset + self.tangent() * along
    }

    /// Angle of a direction off the normal, radians.
    #[must_use]
    pub fn off_axis(&self, direction: f64) -> f64 {
        wrap(direction - self.angle)
    }
}

/// An interval along a line, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Its lower end.
    pub from: f64,
    /// Its upper end.
    pub to: f64,
}

impl Span {
    /// Whether a position is inside, or at most `beyond` outside.
    #[must_use]
    pub fn has(&self, along: f64, beyond: f64) -> bool {
        along >= self.from - beyond && along <= self.to + beyond
    }

    /// Its length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.to - self.from
    }
}
