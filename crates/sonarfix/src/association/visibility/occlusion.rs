//! Whether a wall of the map occludes the echo of another: it crosses the beam, or returns an earlier
//! echo inside the cone.
//!
//! The frame is that of the beam from the sonar to the foot: *ahead* along it, *aside* to its left.
//! An error of the position moves all walls in that frame together, so each condition is tested for
//! the worst position within the uncertainty.
//!
//! # Non-finite policy
//! State and walls are finite, and so are the numbers computed from them here.

use super::viewpoint::Viewpoint;
use crate::geometry::elementary::sqrt;
use crate::geometry::pose::Point;
use crate::geometry::trig::sin_cos;
use crate::geometry::units::{Metres, Radians};
use crate::map::Wall;
use crate::sensor::range::ExpectedRange;

/// Widest cone, wider than that of any sonar: beyond it the tangent diverges.
const MAX_CONE: Radians = Radians(75.0 * core::f32::consts::PI / 180.0);

/// A beam from the sonar to the foot on its target.
pub(crate) struct Beam {
    origin: Point,
    /// Unit vector along the beam.
    axis: (f32, f32),
    /// Distance to the foot on the target.
    distance: f32,
    tangent_of_cone: f32,
    /// Uncertainty of the position along the beam and across it.
    uncertainty_ahead: f32,
    uncertainty_aside: f32,
}

/// A point in the frame of the beam.
#[derive(Clone, Copy)]
struct BeamPoint {
    ahead: f32,
    aside: f32,
}

impl Beam {
    pub fn new(view: &Viewpoint, expected: &ExpectedRange) -> Self {
        let (sin, cos) = sin_cos(expected.direction.radians());
        let wide = view.wide_cone();
        let cone = if wide < MAX_CONE { wide } else { MAX_CONE };
        let (cone_sin, cone_cos) = sin_cos(cone);
        Self {
            origin: view.position(),
            axis: (cos, sin),
            distance: expected.by_range_scale,
            tangent_of_cone: cone_sin / cone_cos,
            uncertainty_ahead: sqrt(view.uncertainty_squared(cos, sin)),
            uncertainty_aside: sqrt(view.uncertainty_squared(-sin, cos)),
        }
    }

    /// Largest distance at which a wall can occlude the target.
    pub fn reach(&self) -> Metres {
        Metres(self.distance + self.uncertainty_ahead + self.uncertainty_aside)
    }

    /// Whether `wall`, which is not the target, occludes the target.
    pub fn is_occluded_by(&self, wall: &Wall) -> bool {
        let (from, to) = (self.place(wall.from()), self.place(wall.to()));
        // Most walls have both ends behind the sonar, beyond the target or beside the cone.
        if self.is_beside(from, to) {
            return false;
        }
        self.is_crossed(from, to)
            || self.answers_first(from)
            || self.answers_first(to)
            || self.has_nearer_foot(wall)
    }

    fn place(&self, point: Point) -> BeamPoint {
        let (dx, dy) = ((point.x - self.origin.x).0, (point.y - self.origin.y).0);
        let (cos, sin) = self.axis;
        BeamPoint { ahead: cos * dx + sin * dy, aside: cos * dy - sin * dx }
    }

    /// Worst-case distances of a point from the right and the left edge of the cone, positive
    /// inside.
    fn margins(&self, place: BeamPoint) -> (f32, f32) {
        let half_width =
            self.tangent_of_cone * (place.ahead + self.uncertainty_ahead) + self.uncertainty_aside;
        (half_width + place.aside, half_width - place.aside)
    }

    /// Whether both ends of a wall are on the outer side of one boundary of the occluding region.
    fn is_beside(&self, from: BeamPoint, to: BeamPoint) -> bool {
        if (from.ahead >= self.distance && to.ahead >= self.distance)
            || (from.ahead + self.uncertainty_ahead <= 0.0
                && to.ahead + self.uncertainty_ahead <= 0.0)
        {
            return true;
        }
        let ((right_a, left_a), (right_b, left_b)) = (self.margins(from), self.margins(to));
        (right_a < 0.0 && right_b < 0.0) || (left_a < 0.0 && left_b < 0.0)
    }

    /// Whether the wall between two points crosses the beam, displaced by at most the uncertainty
    /// aside, before the target.
    fn is_crossed(&self, from: BeamPoint, to: BeamPoint) -> bool {
        let (right, left) = if from.aside < to.aside { (from, to) } else { (to, from) };
        let band = self.uncertainty_aside;
        if right.aside > band || left.aside < -band {
            return false;
        }
        let width = left.aside - right.aside;
        let ahead_at =
            |aside: f32| right.ahead + (left.ahead - right.ahead) * ((aside - right.aside) / width);
        let one = if right.aside < -band { ahead_at(-band) } else { right.ahead };
        let other = if left.aside > band { ahead_at(band) } else { left.ahead };
        let (near, far) = if one < other { (one, other) } else { (other, one) };
        near < self.distance && far + self.uncertainty_ahead > 0.0
    }

    /// Whether a reflector at this point may be inside the cone and nearer than the target.
    fn answers_first(&self, place: BeamPoint) -> bool {
        let (right, left) = self.margins(place);
        let nearer_by = self.distance - place.ahead;
        let is_candidate = right >= 0.0
            && left >= 0.0
            && place.ahead + self.uncertainty_ahead > 0.0
            && nearer_by > 0.0;
        // The distances are √(ahead² + aside²) and `distance`; an error ahead shifts both.
        let aside = place.aside.abs() - self.uncertainty_aside;
        let aside = if aside > 0.0 { aside } else { 0.0 };
        let sum = self.distance + place.ahead + 2.0 * self.uncertainty_ahead;
        is_candidate && aside * aside < nearer_by * sum
    }

    /// Whether the foot of the perpendicular on `wall` may answer before the target.
    fn has_nearer_foot(&self, wall: &Wall) -> bool {
        let along = wall.along(self.origin).0;
        if !(along >= 0.0 && along <= wall.length().0) {
            return false;
        }
        let signed = wall.signed_distance(self.origin).0;
        let foot =
            Point::new(self.origin.x.0 - signed * wall.a(), self.origin.y.0 - signed * wall.b());
        self.answers_first(self.place(foot))
    }
}

#[cfg(test)]
mod tests;
