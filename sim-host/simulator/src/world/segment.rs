//! Geometry of a straight wall.

/// A point or a vector, metres.
pub type Point = [f64; 2];

/// A wall: its start, unit tangent and length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    from: Point,
    tangent: [f64; 2],
    length: f64,
}

/// Distance between two points, metres.
#[must_use]
pub fn distance(from: Point, to: Point) -> f64 {
    libm::hypot(to[0] - from[0], to[1] - from[1])
}

/// Direction from one point to another, radians in the map frame.
#[must_use]
pub fn direction(from: Point, to: Point) -> f64 {
    libm::atan2(to[1] - from[1], to[0] - from[0])
}

impl Segment {
    /// The wall between two points.
    #[must_use]
    pub fn new(from: Point, to: Point) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = libm::hypot(dx, dy);
        Self { from, tangent: [dx / length, dy / length], length }
    }

    /// The point at a distance along the wall's line, metres.
    fn at(&self, along: f64) -> Point {
        let [tx, ty] = self.tangent;
        [self.from[0] + along * tx, self.from[1] + along * ty]
    }

    /// Both ends.
    #[must_use]
    pub fn ends(&self) -> [Point; 2] {
        [self.from, self.at(self.length)]
    }

    /// The wall moved by a vector.
    #[must_use]
    pub fn moved(&self, by: [f64; 2]) -> Self {
        Self { from: [self.from[0] + by[0], self.from[1] + by[1]], ..*self }
    }

    /// Distance along the wall from its start, and signed distance from its line (left is positive).
    fn place(&self, point: Point) -> (f64, f64) {
        let (dx, dy) = (point[0] - self.from[0], point[1] - self.from[1]);
        let [tx, ty] = self.tangent;
        (tx * dx + ty * dy, tx * dy - ty * dx)
    }

    /// Foot of the perpendicular from a point and its distance, if the foot lies on the wall.
    #[must_use]
    pub fn foot(&self, point: Point) -> Option<(Point, f64)> {
        let (along, off) = self.place(point);
        let on_wall = (0.0..=self.length).contains(&along);
        on_wall.then(|| (self.at(along), off.abs()))
    }

    /// Direction of the wall's normal from a point towards the wall's line.
    #[must_use]
    pub fn normal_towards(&self, point: Point) -> f64 {
        let (along, _) = self.place(point);
        direction(point, self.at(along))
    }

    /// The nearest point of the wall.
    #[must_use]
    pub fn nearest(&self, point: Point) -> Point {
        let (along, _) = self.place(point);
        self.at(along.clamp(0.0, self.length))
    }

    /// Half the path of a sound from one point over the wall, as a mirror, to another point.
    #[must_use]
    pub fn half_way_over(&self, from: Point, to: Point) -> f64 {
        let ((along_a, off_a), (along_b, off_b)) = (self.place(from), self.place(to));
        0.5 * libm::hypot(off_a.abs() + off_b.abs(), along_b - along_a)
    }

    /// The mirror image of a point in the wall's line.
    #[must_use]
    pub fn mirror(&self, point: Point) -> Point {
        let (_, off) = self.place(point);
        let [tx, ty] = self.tangent;
        [point[0] + 2.0 * off * ty, point[1] - 2.0 * off * tx]
    }

    /// The intersection of the wall with the line between two points, if there is one.
    #[must_use]
    pub fn crossing(&self, from: Point, to: Point) -> Option<Point> {
        let ((along_a, off_a), (along_b, off_b)) = (self.place(from), self.place(to));
        if (off_a > 0.0) == (off_b > 0.0) {
            return None;
        }
        let along = along_a + (along_b - along_a) * off_a / (off_a - off_b);
        (0.0..=self.length).contains(&along).then(|| self.at(along))
    }

    /// The intersection of the wall with a ray, if there is one.
    #[must_use]
    pub fn hit(&self, from: Point, direction: f64) -> Option<Point> {
        let (_, off) = self.place(from);
        let (sin, cos) = libm::sincos(direction);
        let approach = self.tangent[1] * cos - self.tangent[0] * sin;
        let along_ray = off / approach;
        let end = [from[0] + along_ray * cos, from[1] + along_ray * sin];
        let (along, _) = self.place(end);
        (along_ray > 0.0 && along_ray.is_finite() && (0.0..=self.length).contains(&along))
            .then_some(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinate() -> impl Strategy<Value = f64> {
        -10.0..10.0
    }

    fn point() -> impl Strategy<Value = Point> {
        [coordinate(), coordinate()]
    }

    proptest! {
        /// The path over a wall equals that to the mirror image, and without motion the
        /// perpendicular, to the bit: the ideal sonar's ranges depend on it.
        #[test]
        fn the_path_of_a_reflection_ends_at_the_image(
            ends in [point(), point()], from in point(), to in point(),
        ) {
            prop_assume!(distance(ends[0], ends[1]) > 0.1);
            let wall = Segment::new(ends[0], ends[1]);
            let (_, side_from) = wall.place(from);
            let (_, side_to) = wall.place(to);
            let to = if side_from * side_to < 0.0 { wall.mirror(to) } else { to };
            let image = 0.5 * distance(wall.mirror(from), to);
            prop_assert!((wall.half_way_over(from, to) - image).abs() < 1e-9);
            prop_assert_eq!(wall.half_way_over(from, from).to_bits(), side_from.abs().to_bits());
        }

        /// A ray towards a point of the wall meets the wall there, and its extension crosses it.
        #[test]
        fn a_ray_hits_its_target(
            ends in [point(), point()], from in point(), share in 0.05..0.95,
        ) {
            prop_assume!(distance(ends[0], ends[1]) > 0.1);
            let wall = Segment::new(ends[0], ends[1]);
            prop_assume!(wall.place(from).1.abs() > 0.1);
            let target = wall.at(share * wall.length);
            let hit = wall.hit(from, direction(from, target)).unwrap();
            prop_assert!(distance(hit, target) < 1e-6, "{:?} {:?}", hit, target);
            let beyond = [2.0 * target[0] - from[0], 2.0 * target[1] - from[1]];
            let crossing = wall.crossing(from, beyond).unwrap();
            prop_assert!(distance(crossing, target) < 1e-9);
            let back = direction(target, from);
            prop_assert_eq!(wall.hit(from, back), None);
        }
    }
}
