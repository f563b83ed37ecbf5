//! Whether a path keeps clear of the walls.

use std::fmt;

use crate::floor::{Floor, NamedWall};
use crate::geometry::{Segment, TOUCH};
use crate::path::PathPlan;

/// A leg of a path that a wall is in the way of.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// Which corner the leg leads to, by its index.
    pub corner: usize,
    /// Where the leg begins, metres.
    pub from: [f64; 2],
    /// Where it ends, metres.
    pub to: [f64; 2],
    /// The wall's name.
    pub wall: String,
    /// How near the leg comes to the wall, metres; zero: it goes through it.
    pub distance: f64,
    /// How near it may come, metres.
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
    /// The first leg of a path that comes nearer to a wall than `clearance`, metres. The legs of
    /// the first lap are those of every lap.
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
