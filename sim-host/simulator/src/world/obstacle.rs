//! Obstacles that no map has, standing or walking.

use sonarfix_map::Oscillation;

use super::segment::{Point, Segment, distance};

/// The outline of an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// A table's leg, a bin, a person: centre and radius, metres.
    Circle {
        /// Centre, metres.
        centre: Point,
        /// Radius, metres.
        radius: f64,
    },
    /// The face of a box or a cupboard.
    Face(Segment),
}

/// An unmapped obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Its outline at time zero.
    pub outline: Outline,
    /// Its motion; `None` if it stands.
    pub walk: Option<Oscillation>,
}

/// The displacement of a walk at a time, metres.
fn shift(walk: Oscillation, time: f64) -> [f64; 2] {
    let lap = (time / walk.takes).rem_euclid(2.0);
    let share = if lap <= 1.0 { lap } else { 2.0 - lap };
    walk.by.map(|component| share * component)
}

impl Obstacle {
    /// Its outline at a time, seconds since the run began.
    #[must_use]
    pub fn outline_at(&self, time: f64) -> Outline {
        let by = self.walk.map_or([0.0, 0.0], |walk| shift(walk, time));
        match self.outline {
            Outline::Circle { centre: [x, y], radius } => {
                Outline::Circle { centre: [x + by[0], y + by[1]], radius }
            }
            Outline::Face(face) => Outline::Face(face.moved(by)),
        }
    }
}

impl Outline {
    /// The nearest point of the outline.
    #[must_use]
    pub fn nearest(&self, point: Point) -> Point {
        match self {
            Self::Circle { centre, radius } => {
                let share = radius / distance(*centre, point);
                let ([cx, cy], [px, py]) = (*centre, point);
                [cx + share * (px - cx), cy + share * (py - cy)]
            }
            Self::Face(face) => face.nearest(point),
        }
    }

    /// Whether it is perpendicular to the line of sight from a point, and so reflects back to it.
    #[must_use]
    pub fn faces(&self, point: Point) -> bool {
        match self {
            Self::Circle { .. } => true,
            Self::Face(face) => face.foot(point).is_some(),
        }
    }

    /// Where a ray meets it first: the distance, and the cosine of the incidence.
    #[must_use]
    pub fn met(&self, from: Point, direction: f64) -> Option<(f64, f64)> {
        match self {
            Self::Circle { centre, radius } => {
                let (sin, cos) = libm::sincos(direction);
                let (dx, dy) = (centre[0] - from[0], centre[1] - from[1]);
                let (ahead, aside) = (cos * dx + sin * dy, cos * dy - sin * dx);
                let half_chord = libm::sqrt(radius * radius - aside * aside);
                // False for a ray beside it, whose chord is NaN, and for one that begins inside or behind.
                let distance = ahead - half_chord;
                (distance > 0.0).then_some((distance, half_chord / radius))
            }
            Self::Face(face) => {
                let hit = face.hit(from, direction)?;
                let incidence = direction - face.normal_towards(from);
                Some((distance(from, hit), libm::cos(incidence)))
            }
        }
    }

    /// Whether it blocks the line between two points.
    #[must_use]
    pub fn blocks(&self, from: Point, to: Point) -> bool {
        match self {
            Self::Circle { centre, radius } => {
                // Most circles are far from the line.
                !is_beside(*centre, radius + MARGIN, from, to)
                    && distance(Segment::new(from, to).nearest(*centre), *centre) < *radius
            }
            Self::Face(face) => face.crossing(from, to).is_some(),
        }
    }
}

/// Far above the rounding of a distance, metres.
const MARGIN: f64 = 1e-6;

/// Whether the square around a centre is above, below, to the left or to the right of both points.
fn is_beside(centre: Point, half_width: f64, from: Point, to: Point) -> bool {
    (0..2).any(|axis| match (centre.get(axis), from.get(axis), to.get(axis)) {
        (Some(centre), Some(from), Some(to)) => {
            centre + half_width < from.min(*to) || centre - half_width > from.max(*to)
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_obstacle_moves_back_and_forth() {
        let outline = Outline::Circle { centre: [1.0, 0.0], radius: 0.2 };
        let walk = Some(Oscillation { by: [0.0, 2.0], takes: 4.0 });
        let obstacle = Obstacle { outline, walk };
        for (time, y) in
            [(0.0, 0.0), (1.0, 0.5), (4.0, 2.0), (5.0, 1.5), (6.0, 1.0), (8.0, 0.0), (9.0, 0.5)]
        {
            let expected = Outline::Circle { centre: [1.0, y], radius: 0.2 };
            assert_eq!(obstacle.outline_at(time), expected, "{time}");
        }
    }

    #[test]
    fn a_post_reflects_from_its_near_side_and_occludes() {
        let post = Outline::Circle { centre: [1.0, 0.0], radius: 0.2 };
        assert!(distance(post.nearest([0.0, 0.0]), [0.8, 0.0]) < 1e-12);
        assert!(post.blocks([0.0, 0.1], [2.0, 0.1]));
        assert!(!post.blocks([0.0, 0.3], [2.0, 0.3]));
        assert!(!post.blocks([0.0, 0.0], [0.7, 0.0]));
    }
}
