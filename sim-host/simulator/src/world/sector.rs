//! A sonar that reports the nearest point inside a sector around its axis, however oblique the surface is there.
//!
//! Beside a wall whose normal is outside of the sector, that is the point on the sector's edge: d / cos(α − β) for the
//! perpendicular distance d, an angle α between axis and normal, and a half-angle β.

use super::obstacle::Outline;
use super::segment::{Point, Segment, direction, distance};
use crate::angle;

/// A sector around the axis of a ping.
#[derive(Debug, Clone, Copy)]
pub struct Sector {
    pub from: Point,
    /// Direction of the axis, and half of the angle, radians.
    pub axis: f64,
    pub half: f64,
}

impl Sector {
    /// The nearest point of an outline in the sector, and the angle between the axis and the normal there, radians.
    pub fn nearest(&self, outline: &Outline) -> Option<(Point, f64)> {
        match outline {
            Outline::Face(face) => self.nearest_of(face),
            Outline::Circle { .. } => {
                let near = outline.nearest(self.from);
                let at = if self.contains(near) { Some(near) } else { self.on_edge(outline) };
                // A round object has a normal in every direction.
                at.map(|at| (at, 0.0))
            }
        }
    }

    /// The nearest point of a wall in the sector, and the angle between the axis and its normal, radians.
    pub fn nearest_of(&self, wall: &Segment) -> Option<(Point, f64)> {
        let near = wall.nearest(self.from);
        let at = if self.contains(near) {
            Some(near)
        } else {
            let edges = self.edges().into_iter().filter_map(|edge| wall.hit(self.from, edge));
            let ends = wall.ends().into_iter().filter(|end| self.contains(*end));
            self.nearest_among(edges.chain(ends))
        };
        let off = angle::wrap(self.axis - wall.normal_towards(self.from));
        at.map(|at| (at, off))
    }

    fn edges(&self) -> [f64; 2] {
        [self.axis - self.half, self.axis + self.half]
    }

    fn contains(&self, point: Point) -> bool {
        angle::wrap(direction(self.from, point) - self.axis).abs() <= self.half
    }

    fn on_edge(&self, outline: &Outline) -> Option<Point> {
        let [x, y] = self.from;
        let points = self.edges().into_iter().filter_map(|edge| {
            let (along, _) = outline.met(self.from, edge)?;
            let (sin, cos) = libm::sincos(edge);
            Some([x + along * cos, y + along * sin])
        });
        self.nearest_among(points)
    }

    fn nearest_among(&self, points: impl Iterator<Item = Point>) -> Option<Point> {
        points
            .min_by(|one, other| distance(self.from, *one).total_cmp(&distance(self.from, *other)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oblique_wall_answers_from_the_edge_of_the_sector() {
        let wall = Segment::new([1.0, -50.0], [1.0, 50.0]);
        for (degrees, expected) in
            [(0.0, 0.0), (10.0, 0.0), (15.0, 0.0), (25.0, 10.0), (45.0, 30.0)]
        {
            let axis = f64::to_radians(degrees);
            let sector = Sector { from: [0.0, 0.0], axis, half: f64::to_radians(15.0) };
            let (at, off) = sector.nearest_of(&wall).unwrap();
            let range = 1.0 / f64::to_radians(expected).cos();
            assert!((distance([0.0, 0.0], at) - range).abs() < 1e-9, "{degrees}");
            assert!((off - axis).abs() < 1e-12);
        }
    }

    #[test]
    fn a_wall_beside_the_sector_does_not_answer() {
        let sector = Sector { from: [0.0, 0.0], axis: 0.0, half: 0.2 };
        assert!(sector.nearest_of(&Segment::new([-1.0, 1.0], [1.0, 1.0])).is_none());
        let (end, _) = sector.nearest_of(&Segment::new([2.0, 0.1], [2.0, 3.0])).unwrap();
        assert!(distance(end, [2.0, 0.1]) < 1e-12);
        let post = Outline::Circle { centre: [2.0, 0.5], radius: 0.2 };
        let (met, _) = sector.nearest(&post).unwrap();
        assert!((distance(met, [2.0, 0.5]) - 0.2).abs() < 1e-9 && met[1] < 0.5);
    }
}
