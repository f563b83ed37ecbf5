//! Whether something of the map keeps the echo of a wall from being the first: by standing before
//! its foot, or by answering from nearer inside the cone (`docs/model.md`, "Which walls count").
//!
//! The frame is that of the beam from the sonar to the foot: *ahead* along it, *aside* to its left.
//! When the position is wrong, everything moves in that frame together; so what matters is asked
//! for the worst position within the uncertainty.
//!
//! # Non-finite policy
//! The filter's state and the walls are finite, and so is what is computed from them here.

use super::viewpoint::Viewpoint;
use crate::map::Wall;
use crate::pose::Point;
use crate::range::ExpectedRange;
use crate::trig::sin_cos;
use crate::units::{Metres, Radians};

/// Beyond this the tangent of a cone runs away; no sonar's is that wide.
const WIDEST: Radians = Radians(75.0 * core::f32::consts::PI / 180.0);

/// The sonar's view along one direction.
pub(super) struct Beam {
    origin: Point,
    /// Unit vector along the beam.
    axis: (f32, f32),
    /// To the target's foot.
    distance: f32,
    tangent_of_cone: f32,
    /// By how much the position may be wrong, along the beam and across it.
    doubt_ahead: f32,
    doubt_aside: f32,
}

/// A place in the frame of the beam.
#[derive(Clone, Copy)]
struct Place {
    ahead: f32,
    aside: f32,
}

impl Beam {
    pub fn new(view: &Viewpoint, expected: &ExpectedRange) -> Self {
        let (sin, cos) = sin_cos(expected.direction.radians());
        let cone = if view.wide_cone < WIDEST { view.wide_cone } else { WIDEST };
        let (cone_sin, cone_cos) = sin_cos(cone);
        Self {
            origin: view.position,
            axis: (cos, sin),
            distance: expected.by_range_scale,
            tangent_of_cone: cone_sin / cone_cos,
            doubt_ahead: libm::sqrtf(view.doubt_squared(cos, sin)),
            doubt_aside: libm::sqrtf(view.doubt_squared(-sin, cos)),
        }
    }

    /// How far away something may be and still disturb.
    pub fn reach(&self) -> Metres {
        Metres(self.distance + self.doubt_ahead + self.doubt_aside)
    }

    /// Whether `wall`, which is not the target, disturbs the echo.
    pub fn is_disturbed_by(&self, wall: &Wall) -> bool {
        let (from, to) = (self.place(wall.from()), self.place(wall.to()));
        // Most walls are behind the sonar, beyond the target or beside the cone with both ends.
        if self.is_beside(from, to) {
            return false;
        }
        self.is_crossed(from, to)
            || self.answers_first(from)
            || self.answers_first(to)
            || self.has_nearer_foot(wall)
    }

    fn place(&self, point: Point) -> Place {
        let (dx, dy) = ((point.x - self.origin.x).0, (point.y - self.origin.y).0);
        let (cos, sin) = self.axis;
        Place { ahead: cos * dx + sin * dy, aside: cos * dy - sin * dx }
    }

    /// How far to the left of the cone's right edge a place is, at worst, and of that mirrored: to
    /// the right of the left edge. Negative: outside.
    fn inside_by(&self, place: Place) -> (f32, f32) {
        let half_width = self.tangent_of_cone * (place.ahead + self.doubt_ahead) + self.doubt_aside;
        (half_width + place.aside, half_width - place.aside)
    }

    /// Whether a whole wall lies on the far side of one of the lines that bound what can disturb.
    fn is_beside(&self, from: Place, to: Place) -> bool {
        let ((right_a, left_a), (right_b, left_b)) = (self.inside_by(from), self.inside_by(to));
        (from.ahead >= self.distance && to.ahead >= self.distance)
            || (right_a < 0.0 && right_b < 0.0)
            || (left_a < 0.0 && left_b < 0.0)
            || (from.ahead + self.doubt_ahead <= 0.0 && to.ahead + self.doubt_ahead <= 0.0)
    }

    /// Whether the wall between two places cuts a beam that starts within the doubt aside of this
    /// one, before it reaches its target.
    fn is_crossed(&self, from: Place, to: Place) -> bool {
        let (right, left) = if from.aside < to.aside { (from, to) } else { (to, from) };
        let band = self.doubt_aside;
        if right.aside > band || left.aside < -band {
            return false;
        }
        let width = left.aside - right.aside;
        let ahead_at =
            |aside: f32| right.ahead + (left.ahead - right.ahead) * ((aside - right.aside) / width);
        let one = if right.aside < -band { ahead_at(-band) } else { right.ahead };
        let other = if left.aside > band { ahead_at(band) } else { left.ahead };
        let (near, far) = if one < other { (one, other) } else { (other, one) };
        near < self.distance && far + self.doubt_ahead > 0.0
    }

    /// Whether something at this place may be inside the cone and nearer than the target.
    fn answers_first(&self, place: Place) -> bool {
        let (right, left) = self.inside_by(place);
        let nearer_by = self.distance - place.ahead;
        let is_candidate =
            right >= 0.0 && left >= 0.0 && place.ahead + self.doubt_ahead > 0.0 && nearer_by > 0.0;
        // The distances are √(ahead² + aside²) and `distance`; an error ahead shifts both.
        let aside = place.aside.abs() - self.doubt_aside;
        let aside = if aside > 0.0 { aside } else { 0.0 };
        let sum = self.distance + place.ahead + 2.0 * self.doubt_ahead;
        is_candidate && aside * aside < nearer_by * sum
    }

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
