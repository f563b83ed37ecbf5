//! What of the map answers a ping: the foot of the perpendicular on a wall, or a concave corner of two walls, which reflects
//! a sound back to its source (Kuc and Siegel 1987; Leonard and Durrant-Whyte 1992).

use nalgebra::Vector2;

use crate::odometry::wrap;
use crate::wall::Wall;

/// Walls closer than this meet, metres.
const TOUCH: f64 = 0.005;
/// Cosine of the angle between two walls up to which they make a corner: 75°, as in the localizer.
const SQUARE: f64 = 0.26;
/// Distance beyond the end of a wall, or behind the walls of a corner, up to which they still answer, metres: a pose may be
/// wrong by as much.
const BEYOND: f64 = 0.05;

/// A wall, or a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reflector {
    /// A wall, which answers at the foot of the perpendicular.
    Wall(Wall),
    /// A corner, which answers to all sides between its walls.
    Corner(Corner),
}

/// A right angle of two walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    at: Vector2<f64>,
    /// Directions of the walls from there.
    arms: [Vector2<f64>; 2],
}

/// A reflector as the sonar sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Distance of the sonar, metres.
    pub distance: f64,
    /// Derivatives of the distance by the position of the sonar: the unit vector from the reflector to the sonar.
    pub away: Vector2<f64>,
    /// Angle of the beam's axis off the direction to the reflector, radians.
    pub off_axis: f64,
    /// Derivatives of that angle by the position of the sonar.
    pub turned: Vector2<f64>,
    /// Whether the reflector answers towards the sonar, to 5 cm.
    pub answers: bool,
}

/// What a ping can be associated with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Largest difference between range and distance, metres.
    pub range: f64,
    /// Largest angle off the axis, radians.
    pub cone: f64,
}

impl Reflector {
    /// The walls in their order, then their corners.
    #[must_use]
    pub fn of_walls(walls: &[Wall]) -> Vec<Self> {
        let mut reflectors: Vec<Self> = walls.iter().copied().map(Self::Wall).collect();
        for (i, one) in walls.iter().enumerate() {
            for (j, other) in walls.iter().enumerate() {
                // Two walls that share an end are one corner, not two.
                if i != j && !(j < i && one.shares_end(other)) {
                    reflectors.extend(corners(one, other).map(Self::Corner));
                }
            }
        }
        reflectors
    }

    /// Whether it is a wall.
    #[must_use]
    pub fn is_wall(&self) -> bool {
        self.wall().is_some()
    }

    /// Its wall, if it is one.
    #[must_use]
    pub fn wall(&self) -> Option<&Wall> {
        match self {
            Self::Wall(wall) => Some(wall),
            Self::Corner(_) => None,
        }
    }

    /// The reflector from a sonar whose axis has this direction.
    #[must_use]
    pub fn view(&self, sonar: Vector2<f64>, direction: f64) -> View {
        match self {
            Self::Wall(wall) => {
                let foot = wall.foot(sonar, direction);
                View {
                    distance: foot.signed.abs(),
                    away: foot.normal * foot.signed.signum(),
                    off_axis: foot.off_axis,
                    turned: Vector2::zeros(),
                    answers: foot.along >= -BEYOND && foot.along <= wall.length() + BEYOND,
                }
            }
            Self::Corner(corner) => corner.view(sonar, direction),
        }
    }
}

impl Corner {
    fn view(&self, sonar: Vector2<f64>, direction: f64) -> View {
        let from = sonar - self.at;
        let distance = from.norm().max(1e-6);
        View {
            distance,
            away: from / distance,
            off_axis: wrap(direction - (-from.y).atan2(-from.x)),
            turned: Vector2::new(from.y, -from.x) / distance.powi(2),
            answers: self.arms.iter().all(|arm| arm.dot(&from) >= -BEYOND),
        }
    }
}

/// The right angles that an end of the first wall makes with the second.
fn corners(one: &Wall, other: &Wall) -> impl Iterator<Item = Corner> {
    let ends = |wall: &Wall| wall.ends().map(Vector2::from);
    let [from, to] = ends(one);
    let other = *other;
    [(from, to), (to, from)].into_iter().flat_map(move |(at, away)| {
        let arms = ends(&other).into_iter().filter(move |end| (end - at).norm() > TOUCH);
        let arms = arms.map(move |end| [(away - at).normalize(), (end - at).normalize()]);
        arms.filter(move |[one, next]| other.is_at(at, TOUCH) && one.dot(next).abs() < SQUARE)
            .map(move |arms| Corner { at, arms })
    })
}

impl Wall {
    /// Whether a point is on the wall, to a distance in metres.
    fn is_at(&self, point: Vector2<f64>, within: f64) -> bool {
        let foot = self.foot(point, 0.0);
        foot.signed.abs() <= within && foot.along >= -within && foot.along <= self.length() + within
    }

    fn shares_end(&self, other: &Self) -> bool {
        let is_near =
            |a: [f64; 2], b: [f64; 2]| (Vector2::from(a) - Vector2::from(b)).norm() <= TOUCH;
        self.ends().iter().any(|one| other.ends().iter().any(|next| is_near(*one, *next)))
    }
}

/// The reflector whose expected range is nearest to the measured one, within the gate.
#[must_use]
pub fn associate(
    reflectors: &[Reflector],
    at: Vector2<f64>,
    direction: f64,
    range: f64,
    scale: f64,
    gate: Gate,
) -> Option<usize> {
    let mut best: Option<(usize, f64)> = None;
    for (index, reflector) in reflectors.iter().enumerate() {
        let view = reflector.view(at, direction);
        let error = (view.distance * scale - range).abs();
        let fits = view.answers && view.off_axis.abs() <= gate.cone && error <= gate.range;
        if fits && best.is_none_or(|(_, least)| error < least) {
            best = Some((index, error));
        }
    }
    best.map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(from: [f64; 2], to: [f64; 2]) -> Wall {
        Wall::new(from, to).unwrap()
    }

    fn corners_of(walls: &[Wall]) -> Vec<Corner> {
        let corner = |reflector: Reflector| match reflector {
            Reflector::Corner(corner) => Some(corner),
            Reflector::Wall(_) => None,
        };
        Reflector::of_walls(walls).into_iter().filter_map(corner).collect()
    }

    #[test]
    fn a_shared_end_is_one_corner_a_junction_two_and_a_blunt_angle_none() {
        let floor = wall([0.0, 0.0], [4.0, 0.0]);
        let found = corners_of(&[floor, wall([4.0, 0.0], [4.0, 3.0])]);
        assert_eq!(found.len(), 1);
        let answers = |from: [f64; 2]| found[0].view(from.into(), 0.0).answers;
        assert!(answers([1.0, 1.0]) && !answers([5.0, 1.0]) && !answers([1.0, -1.0]));
        assert_eq!(corners_of(&[floor, wall([2.0, 0.0], [2.0, 3.0])]).len(), 2);
        assert_eq!(corners_of(&[wall([2.0, 3.0], [2.0, 0.0]), floor]).len(), 2);
        assert!(corners_of(&[floor, wall([4.0, 0.0], [6.0, 1.0])]).is_empty());
        assert!(corners_of(&[floor, wall([4.0, 0.1], [4.0, 3.0])]).is_empty());
    }

    #[test]
    fn an_echo_belongs_to_the_reflector_with_the_nearest_range_in_the_cone() {
        let reflectors =
            Reflector::of_walls(&[wall([0.0, 0.0], [4.0, 0.0]), wall([4.0, 0.0], [4.0, 3.0])]);
        let nearest = |direction: f64, range: f64| {
            let gate = Gate { range: 0.2, cone: 0.4 };
            associate(&reflectors, Vector2::new(3.0, 1.0), direction, range, 1.0, gate)
        };
        let to_corner = -std::f64::consts::FRAC_PI_4;
        assert_eq!(nearest(0.0, 1.05), Some(1));
        assert_eq!(nearest(2.0 * to_corner, 1.05), Some(0));
        assert_eq!(nearest(to_corner, 1.38), Some(2));
        assert_eq!(nearest(to_corner, 1.1), None);
    }
}
