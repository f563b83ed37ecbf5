//! A straight line of a drawing.

/// A line between two points, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The name of its layer or element.
    pub name: String,
    /// One end.
    pub from: [f64; 2],
    /// The other end.
    pub to: [f64; 2],
    /// How thick it is, metres: the stroke of a line in an image, or the distance of a double line; 0 if that is not known.
    pub thickness: f64,
}

impl Piece {
    /// Its length, metres.
    pub(super) fn length(&self) -> f64 {
        (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1])
    }

    /// The unit vector along it.
    pub(super) fn tangent(&self) -> [f64; 2] {
        let length = self.length();
        [(self.to[0] - self.from[0]) / length, (self.to[1] - self.from[1]) / length]
    }

    /// Where a point is: along the line from its start, and to the left of it, metres.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [tx, ty] = self.tangent();
        let (x, y) = (x - self.from[0], y - self.from[1]);
        [x * tx + y * ty, y * tx - x * ty]
    }

    /// The point so far along the line and to its left, metres.
    pub(super) fn at(&self, along: f64, left: f64) -> [f64; 2] {
        let [tx, ty] = self.tangent();
        [self.from[0] + along * tx - left * ty, self.from[1] + along * ty + left * tx]
    }

    /// The sine of the angle between the directions of two lines, from 0 to 1.
    pub(super) fn angle(&self, other: &Self) -> f64 {
        let ([ax, ay], [bx, by]) = (self.tangent(), other.tangent());
        (ax * by - ay * bx).abs()
    }

    /// Where another line begins and ends along this one, the smaller first, and how far it is to the left in its middle.
    pub(super) fn shadow(&self, other: &Self) -> ([f64; 2], f64) {
        let ([a, left], [b, right]) = (self.place(other.from), self.place(other.to));
        ([a.min(b), a.max(b)], f64::midpoint(left, right))
    }

    /// The distance of a point from the line between its ends.
    pub(super) fn distance_to(&self, point: [f64; 2]) -> f64 {
        let [along, left] = self.place(point);
        let beyond = (-along).max(along - self.length()).max(0.0);
        beyond.hypot(left)
    }

    /// The smallest distance of two lines; 0 if they cross.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let crosses = self.crossing(other).is_some_and(|[along, across]| {
            (0.0..=self.length()).contains(&along) && (0.0..=other.length()).contains(&across)
        });
        if crosses {
            return 0.0;
        }
        let ends = [
            self.distance_to(other.from),
            self.distance_to(other.to),
            other.distance_to(self.from),
            other.distance_to(self.to),
        ];
        ends.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// How far along this line and along the other one the two would cross if they were long enough; `None` if they are almost
    /// parallel.
    pub(super) fn crossing(&self, other: &Self) -> Option<[f64; 2]> {
        /// The sine of 20°.
        const STEEP: f64 = 0.342;
        if self.angle(other) < STEEP {
            return None;
        }
        let ([a, left], [b, right]) = (self.place(other.from), self.place(other.to));
        let part = left / (left - right);
        Some([a + part * (b - a), part * other.length()])
    }
}
