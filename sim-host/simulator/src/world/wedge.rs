//! The cone of a ping as two half-planes: which points are certainly outside of it.

use std::f64::consts::FRAC_PI_2;

use super::segment::Point;

/// Distance from the edge of the cone up to which a point is not certainly outside, metres: far above rounding.
const MARGIN: f64 = 1e-6;

/// A sector around a direction.
pub struct Wedge {
    from: Point,
    /// Unit normals of the edges, inwards; none of a cone of a half-plane or more.
    inwards: Option<[Point; 2]>,
}

impl Wedge {
    /// The sector up to `half_angle` to either side of a direction, radians.
    pub fn new(from: Point, direction: f64, half_angle: f64) -> Self {
        let normal = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            [cos, sin]
        };
        let (left, right) = (direction + half_angle, direction - half_angle);
        let inwards =
            (half_angle < FRAC_PI_2).then(|| [normal(left - FRAC_PI_2), normal(right + FRAC_PI_2)]);
        Self { from, inwards }
    }

    /// Whether these points are all on the outer side of the same edge, and so is any line between them.
    pub fn is_beside(&self, points: &[Point]) -> bool {
        let Some(edges) = self.inwards else {
            return false;
        };
        edges.iter().any(|normal| points.iter().all(|&point| self.inside(normal, point) < -MARGIN))
    }

    /// Distance of a point from an edge, positive inside.
    fn inside(&self, normal: &Point, point: Point) -> f64 {
        normal[0] * (point[0] - self.from[0]) + normal[1] * (point[1] - self.from[1])
    }
}
