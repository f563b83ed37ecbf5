//! The room of the campaign with exact geometry: where the robot is, and what its rangers measure.

use std::f64::consts::{PI, TAU};

use anyhow::Context;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::Radians;
use sonarfix::map::Wall;

/// Corners of the room in metres, counter-clockwise. A corner is cut off, so that the room is not itself after half a turn.
const CORNERS: [[f64; 2]; 6] =
    [[0.0, 0.0], [4.0, 0.0], [4.0, 2.2], [2.8, 2.2], [2.8, 3.0], [0.0, 3.0]];
/// Half of a sonar's cone, radians.
const CONE: f64 = 0.25;

fn walls() -> impl Iterator<Item = [[f64; 2]; 2]> {
    CORNERS.into_iter().zip(CORNERS.into_iter().cycle().skip(1)).map(|(from, to)| [from, to])
}

/// The map.
///
/// # Errors
/// Never: the walls are valid.
#[expect(clippy::cast_possible_truncation, reason = "a few metres")]
pub fn map() -> anyhow::Result<Vec<u8>> {
    let point = |[x, y]: [f64; 2]| Point::new(x as f32, y as f32);
    let walls: Option<Vec<Wall>> =
        walls().map(|[from, to]| Wall::new(point(from), point(to)).ok()).collect();
    Ok(sonarfix_map::bake(&walls.context("a wall without length")?)?)
}

/// Where something is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub x: f64,
    pub y: f64,
    pub heading: f64,
}

impl Place {
    /// Where the robot starts.
    pub const START: Self = Self { x: 1.0, y: 1.5, heading: 0.5 };

    /// Moves ahead along an arc.
    pub fn roll(&mut self, advance: f64, turn: f64) {
        let middle = self.heading + 0.5 * turn;
        self.x += advance * middle.cos();
        self.y += advance * middle.sin();
        self.heading += turn;
    }

    /// The place of a ranger that is mounted so far ahead of the axle, at this bearing.
    pub fn of_ranger(&self, ahead: f64, bearing: f64) -> Self {
        let (sin, cos) = self.heading.sin_cos();
        Self { x: self.x + ahead * cos, y: self.y + ahead * sin, heading: self.heading + bearing }
    }

    /// As a pose.
    #[expect(clippy::cast_possible_truncation, reason = "a few metres")]
    pub fn pose(&self) -> Pose {
        Pose::new(self.x as f32, self.y as f32, Radians(self.heading as f32))
    }

    /// The distance of the nearest wall whose perpendicular is in the cone of a sonar here.
    pub fn by_sound(&self) -> Option<f64> {
        let heard = walls().filter_map(|[from, to]| {
            let (along, length, distance) = self.beside(from, to);
            let normal = (to[0] - from[0]).atan2(from[1] - to[1]) + PI;
            let off = (self.heading - normal + PI).rem_euclid(TAU) - PI;
            let is_heard = (0.0..=length).contains(&along) && distance > 0.0 && off.abs() <= CONE;
            is_heard.then_some(distance)
        });
        heard.reduce(f64::min)
    }

    /// The distance of the wall that a beam from here meets first.
    pub fn by_light(&self) -> Option<f64> {
        let met = walls().filter_map(|[from, to]| {
            let (along, length, distance) = self.beside(from, to);
            let wall = (to[1] - from[1]).atan2(to[0] - from[0]);
            let (sin, cos) = (self.heading - wall).sin_cos();
            // The inside is at the left of a wall: a beam to its right meets it.
            let range = -distance / sin;
            let is_met = sin < -1e-3 && (0.0..=length).contains(&(along + range * cos));
            is_met.then_some(range)
        });
        met.filter(|range| *range > 0.0).reduce(f64::min)
    }

    /// Along a wall and its length, and the distance to its left.
    fn beside(&self, from: [f64; 2], to: [f64; 2]) -> (f64, f64, f64) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        let (x, y) = (self.x - from[0], self.y - from[1]);
        ((x * dx + y * dy) / length, length, (y * dx - x * dy) / length)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn the_room_is_exact() {
        let at = |heading| Place { x: 1.0, y: 1.0, heading };
        for (heading, range) in [(0.0, 3.0), (FRAC_PI_2, 2.0), (PI, 1.0), (-FRAC_PI_2, 1.0)] {
            let sound = at(heading + 0.1).by_sound().unwrap();
            let light = at(heading).by_light().unwrap();
            assert!((sound - range).abs() < 1e-9 && (light - range).abs() < 1e-9, "{heading}");
        }
        assert_eq!(at(0.25 * PI).by_sound(), None);
        assert!((at(0.25 * PI).by_light().unwrap() - 1.2 * 2.0_f64.sqrt()).abs() < 0.9);
    }
}
