//! Checks the clearance of a path from the walls.

use std::fmt;

use crate::floor::{Floor, NamedWall};
use crate::geometry::{Segment, TOUCH};
use crate::path::PathPlan;

/// A leg of a path that is too close to a wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// Index of the corner at the end of the leg.
    pub corner: usize,
    /// Start of the leg, metres.
    pub from: [f64; 2],
    /// End of the leg, metres.
    pub to: [f64; 2],
    /// The wall's name.
    pub wall: String,
    /// Distance of the leg from the wall, metres; zero if it crosses it.
    pub distance: f64,
    /// Required clearance, metres.
    pub clearance: f64,
}

impl fmt::Display for Collision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from: [x0, y0], to: [x1, y1], wall, distance, clearance, .. } = self;
        write!(f, "the leg from ({x0}, {y0}) to ({x1}, {y1}) m ")?;
        if *distance < TOUCH {
            return write!(f, "goes through the wall \"{wall}\"");
        }
        write!(
            f,
            "comes within {distance:.3} m of the wall \"{wall}\", nearer than the clearance of \
             {clearance:.3} m"
        )
    }
}

impl Collision {
    /// The first leg of a path that is closer to a wall than `clearance`, metres. Every lap has the same legs.
    #[must_use]
    pub fn first(plan: &PathPlan, floor: &Floor, clearance: f64) -> Option<Self> {
        let starts = std::iter::once(&plan.start).chain(&plan.corners);
        starts.zip(&plan.corners).enumerate().find_map(|(corner, (&from, &to))| {
            let leg = Segment { from, to };
            floor.named_walls().iter().find_map(|wall| {
                let distance = leg.distance(segment(wall));
                let is_near = distance < TOUCH || distance < clearance - TOUCH;
                let wall = wall.name().to_owned();
                is_near.then_some(Self { corner, from, to, wall, distance, clearance })
            })
        })
    }
}

fn segment(wall: &NamedWall) -> Segment {
    Segment { from: wall.from(), to: wall.to() }
}
