//! A wall of the map, and the sonar beside it.

use nalgebra::{Vector2, Vector3};

use crate::constants::{Constants, Name};
use crate::odometry::wrap;

/// A wall from one end to the other, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    from: Vector2<f64>,
    along: Vector2<f64>,
    length: f64,
}

/// The foot of the perpendicular from the sonar to a wall's line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Signed distance of the sonar from the line, positive to the left of the wall.
    pub signed: f64,
    /// The line's normal, to the left.
    pub normal: Vector2<f64>,
    /// Position of the foot along the wall, metres from its first end.
    pub along: f64,
    /// Angle of the beam's axis off the direction to the foot, radians.
    pub off_axis: f64,
}

impl Wall {
    /// A wall; `None` if it is shorter than a millimetre or not finite.
    #[must_use]
    pub fn new(from: [f64; 2], to: [f64; 2]) -> Option<Self> {
        let (from, to) = (Vector2::from(from), Vector2::from(to));
        let length = (to - from).norm();
        (length.is_finite() && length > 1e-3).then(|| Self {
            from,
            along: (to - from) / length,
            length,
        })
    }

    /// Its ends, metres.
    #[must_use]
    pub fn ends(&self) -> [[f64; 2]; 2] {
        [self.from.into(), (self.from + self.along * self.length).into()]
    }

    /// Its length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The foot of the perpendicular from a sonar whose axis has this direction.
    #[must_use]
    pub fn foot(&self, sonar: Vector2<f64>, direction: f64) -> Foot {
        let normal = Vector2::new(-self.along.y, self.along.x);
        let relative = sonar - self.from;
        let signed = normal.dot(&relative);
        let towards = if signed >= 0.0 { -normal } else { normal };
        let off_axis = wrap(direction - towards.y.atan2(towards.x));
        Foot { signed, normal, along: self.along.dot(&relative), off_axis }
    }

    /// Distance at which a ray in this direction meets the wall, metres; `None` if it does not.
    #[must_use]
    pub fn met(&self, from: Vector2<f64>, direction: f64) -> Option<f64> {
        let foot = self.foot(from, direction);
        let cosine = foot.off_axis.cos();
        if cosine < 1e-6 {
            return None;
        }
        let distance = foot.signed.abs() / cosine;
        let ray = Vector2::new(direction.cos(), direction.sin());
        let along = foot.along + distance * self.along.dot(&ray);
        (0.0..=self.length).contains(&along).then_some(distance)
    }
}

/// Position and direction of the sonar of a robot at a pose, with a commanded bearing.
#[must_use]
pub fn sonar(pose: &Vector3<f64>, bearing: f64, constants: &Constants) -> (Vector2<f64>, f64) {
    let (sin, cos) = pose.z.sin_cos();
    let (ahead, left) = (constants.get(Name::MountAhead), constants.get(Name::MountLeft));
    let at = Vector2::new(pose.x + cos * ahead - sin * left, pose.y + sin * ahead + cos * left);
    (at, pose.z + constants.bearing(bearing))
}
