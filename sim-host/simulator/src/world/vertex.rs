//! The points where walls meet or end. Corners reflect a sound back to its source, edges scatter it.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use super::index::Index;
use super::segment::{Point, Segment, direction, distance};

/// Walls closer than this meet: a tenth of a millimetre, the resolution of a map file.
const TOUCH: f64 = 1e-4;
/// Two walls at a right angle, to within this, reflect a sound back to its source (a dihedral
/// reflector). At other angles only the edge is a reflector. Chosen: half of an HC-SR04's cone.
const RIGHT_WITHIN: f64 = 0.26;

/// How a vertex reflects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Two walls that enclose the sonar at a right angle: a strong reflector.
    Corner,
    /// An edge that juts out, or a wall's free end: a weak one.
    Edge,
}

/// A place where walls meet, or where one ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertex {
    /// Position, metres.
    pub at: Point,
    /// The walls that touch it.
    pub walls: Vec<usize>,
    /// Directions of the walls that leave it, ascending.
    arms: Vec<f64>,
}

/// All vertices of some walls, each once.
#[must_use]
pub fn all(walls: &[Segment], index: &Index) -> Vec<Vertex> {
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut by_cell: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    for at in walls.iter().flat_map(Segment::ends) {
        let near = cells_around(at).into_iter().filter_map(|cell| by_cell.get(&cell)).flatten();
        let mut near = near.filter_map(|&vertex| vertices.get(vertex));
        if near.all(|vertex| distance(vertex.at, at) > TOUCH) {
            by_cell.entry(cell(at)).or_default().push(vertices.len());
            vertices.push(Vertex::new(at, walls, index));
        }
    }
    vertices
}

/// Width of the cells by which points that touch are found, metres.
const CELL: f64 = 10.0 * TOUCH;

#[expect(clippy::cast_possible_truncation, reason = "a float-to-int cast saturates")]
fn cell(at: Point) -> [i64; 2] {
    at.map(|coordinate| (coordinate / CELL).floor() as i64)
}

/// The cells of all points that touch a point, each once.
fn cells_around([x, y]: Point) -> Vec<[i64; 2]> {
    // Twice the distance, for rounding.
    let shifts = [-2.0 * TOUCH, 2.0 * TOUCH];
    let corners = shifts.iter().flat_map(|dx| shifts.iter().map(move |dy| [x + dx, y + dy]));
    let mut cells: Vec<_> = corners.map(cell).collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

impl Vertex {
    fn new(at: Point, all: &[Segment], index: &Index) -> Self {
        let touches = |&wall: &usize| {
            all.get(wall).is_some_and(|wall| distance(wall.nearest(at), at) <= TOUCH)
        };
        let walls: Vec<usize> = index.near(at, TOUCH).into_iter().filter(touches).collect();
        let ends = walls.iter().filter_map(|&wall| all.get(wall)).flat_map(Segment::ends);
        let mut arms: Vec<f64> =
            ends.filter(|&end| distance(end, at) > TOUCH).map(|end| direction(at, end)).collect();
        arms.sort_by(f64::total_cmp);
        Self { at, walls, arms }
    }

    /// How it reflects towards a point: by the angle between the two walls to the left and right.
    #[must_use]
    pub fn shape_from(&self, sonar: Point) -> Option<Shape> {
        let towards = direction(self.at, sonar);
        let turn_to = |arm: &f64| (arm - towards).rem_euclid(TAU);
        let left = self.arms.iter().map(turn_to).min_by(f64::total_cmp)?;
        let right = self.arms.iter().map(|arm| TAU - turn_to(arm)).min_by(f64::total_cmp)?;
        let opening = left + right;
        if (opening - FRAC_PI_2).abs() <= RIGHT_WITHIN {
            Some(Shape::Corner)
        } else if (opening - 2.0 * FRAC_PI_2).abs() <= RIGHT_WITHIN {
            // Collinear walls: no edge.
            None
        } else {
            Some(Shape::Edge)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertices(ends: &[(Point, Point)]) -> Vec<Vertex> {
        let walls: Vec<_> = ends.iter().map(|&(from, to)| Segment::new(from, to)).collect();
        all(&walls, &Index::new(ends))
    }

    #[test]
    fn a_right_angle_is_a_corner_from_inside_and_an_edge_from_outside() {
        let vertices = vertices(&[([0.0, 0.0], [3.0, 0.0]), ([0.0, 2.0], [0.0, 0.0])]);
        assert_eq!(vertices.len(), 3);
        let vertex = vertices.iter().find(|vertex| vertex.walls.len() == 2).unwrap();
        assert_eq!(vertex.shape_from([1.0, 1.0]), Some(Shape::Corner));
        for outside in [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
            assert_eq!(vertex.shape_from(outside), Some(Shape::Edge), "{outside:?}");
        }
    }

    #[test]
    fn a_wall_that_ends_on_another_makes_two_corners_and_no_edge() {
        let vertices = vertices(&[([-3.0, 0.0], [3.0, 0.0]), ([0.0, 0.0], [0.0, 2.0])]);
        let vertex =
            vertices.iter().find(|vertex| distance(vertex.at, [0.0, 0.0]) < TOUCH).unwrap();
        assert_eq!(vertex.shape_from([1.0, 1.0]), Some(Shape::Corner));
        assert_eq!(vertex.shape_from([-1.0, 1.0]), Some(Shape::Corner));
        assert_eq!(vertex.shape_from([0.5, -1.0]), None);
    }

    #[test]
    fn free_ends_are_edges_joints_of_one_line_are_nothing_and_blunt_angles_no_corners() {
        let vertices = vertices(&[
            ([0.0, 0.0], [1.0, 0.0]),
            ([1.0, 0.0], [2.0, 0.0]),
            ([2.0, 0.0], [3.0, 1.0]),
        ]);
        let at = |point: Point| {
            let vertex = vertices.iter().find(|vertex| distance(vertex.at, point) < TOUCH).unwrap();
            vertex.shape_from([1.5, 3.0])
        };
        assert_eq!(at([0.0, 0.0]), Some(Shape::Edge));
        assert_eq!(at([1.0, 0.0]), None);
        assert_eq!(at([2.0, 0.0]), Some(Shape::Edge));
    }
}
