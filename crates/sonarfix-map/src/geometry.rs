//! Points, angles and distances in f64.

use std::f64::consts::{PI, TAU};

/// The largest coordinate, metres: up to 8,192 m, neighbouring numbers in `f32` are less than half a millimetre apart.
const FARTHEST: f64 = 8_000.0;

/// The distance at which two objects touch: a nanometre, a thousand times the rounding of a coordinate.
pub(crate) const TOUCH: f64 = 1e-9;

/// Why a point was refused.
pub(crate) const TOO_FAR: &str = "finite and within 8 km of the origin: subtract the same offset from all coordinates of the map";

pub(crate) type Point = [f64; 2];

pub(crate) fn is_near_enough(point: Point) -> bool {
    point.iter().all(|coordinate| coordinate.abs() <= FARTHEST)
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(b[0] - a[0], b[1] - a[1])
}

/// An angle in (−π, π].
pub(crate) fn wrap(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let wrapped = angle - TAU * (angle / TAU).round();
    if wrapped <= -PI { PI } else { wrapped }
}

/// A straight line from one point to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    pub from: Point,
    pub to: Point,
}

impl Segment {
    pub fn length(self) -> f64 {
        distance(self.from, self.to)
    }

    /// The unit vector from one end to the other.
    pub fn tangent(self) -> Point {
        let length = self.length();
        [(self.to[0] - self.from[0]) / length, (self.to[1] - self.from[1]) / length]
    }

    /// The point at this distance from the start.
    pub fn at(self, along: f64) -> Point {
        let [x, y] = self.tangent();
        [self.from[0] + along * x, self.from[1] + along * y]
    }

    /// Coordinates of a point: along the segment from its start, and to the left of it.
    pub fn place(self, point: Point) -> Point {
        let [x, y] = self.tangent();
        let (dx, dy) = (point[0] - self.from[0], point[1] - self.from[1]);
        [x * dx + y * dy, x * dy - y * dx]
    }

    /// The least distance between two segments; zero if they cross.
    pub fn distance(self, other: Self) -> f64 {
        if self.separates(other) && other.separates(self) {
            return 0.0;
        }
        let from_ends = [other.from, other.to].map(|end| self.distance_to(end));
        let to_ends = [self.from, self.to].map(|end| other.distance_to(end));
        let least = f64::min;
        from_ends.into_iter().chain(to_ends).fold(f64::INFINITY, least)
    }

    /// Whether the ends of `other` lie on different sides of this segment's line.
    fn separates(self, other: Self) -> bool {
        self.side(other.from) * self.side(other.to) < 0.0
    }

    fn side(self, point: Point) -> f64 {
        let (ax, ay) = (self.to[0] - self.from[0], self.to[1] - self.from[1]);
        let (bx, by) = (point[0] - self.from[0], point[1] - self.from[1]);
        (ax * by - ay * bx).signum()
    }

    /// The least distance of a point from the segment.
    pub fn distance_to(self, point: Point) -> f64 {
        let (ax, ay) = (self.to[0] - self.from[0], self.to[1] - self.from[1]);
        let (bx, by) = (point[0] - self.from[0], point[1] - self.from[1]);
        let foot = ((ax * bx + ay * by) / (ax * ax + ay * ay)).clamp(0.0, 1.0);
        libm::hypot(bx - foot * ax, by - foot * ay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_between_segments() {
        let segment = |from, to| Segment { from, to };
        let wall = segment([0.0, 0.0], [4.0, 0.0]);
        let cases = [
            ("crosses", segment([1.0, -1.0], [1.0, 1.0]), 0.0),
            ("touches with an end", segment([1.0, 0.0], [1.0, 1.0]), 0.0),
            ("touches an end", segment([4.0, -1.0], [4.0, 1.0]), 0.0),
            ("lies on it", segment([1.0, 0.0], [2.0, 0.0]), 0.0),
            ("beside it", segment([1.0, 2.0], [2.0, 3.0]), 2.0),
            ("beyond it", segment([7.0, 4.0], [8.0, 4.0]), 5.0),
            ("over it, not through", segment([-1.0, 3.0], [5.0, 3.0]), 3.0),
            ("its line crosses", segment([4.5, -1.0], [4.5, 1.0]), 0.5),
        ];
        for (what, other, expected) in cases {
            assert!((wall.distance(other) - expected).abs() < 1e-12, "{what}");
            assert!((other.distance(wall) - expected).abs() < 1e-12, "{what}");
        }
    }

    #[test]
    fn angles_are_wrapped_into_half_open_range() {
        for (angle, wrapped) in [(PI, PI), (-PI, PI), (1.5 * PI, -0.5 * PI), (7.0 * PI, PI)] {
            assert!((wrap(angle) - wrapped).abs() < 1e-12, "{angle}");
        }
    }
}
