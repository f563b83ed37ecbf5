//! The walls around a path: whether they close, what is inside, and for which reason a path leaves them.

use super::rule::short;
use crate::clearance::Collision;
use crate::flaws::TOLERANCE;
use crate::floor::{Floor, NamedWall};
use crate::geometry::{Point, Segment};
use crate::path::PathPlan;

/// The largest gap between two ends that are meant to meet, metres: no door is as narrow.
pub(super) const WIDEST_GAP: f64 = 0.12;
/// Most walls that are compared in pairs.
pub(super) const MOST_WALLS: usize = 2_000;
/// Instants of a path, and directions from a place, that are tested.
pub(super) const SAMPLES: u16 = 200;

/// A change of coordinates that undoes a mistake.
pub(super) struct Change {
    pub why: &'static str,
    pub undo: fn(Point) -> Point,
}

/// Mistakes in the coordinates of a path or an obstacle.
#[rustfmt::skip]
pub(super) static CHANGES: [Change; 9] = [
    Change { why: "x and y are swapped", undo: |[x, y]| [y, x] },
    Change { why: "the sign of y is that of a picture, whose y axis points down", undo: |[x, y]| [x, -y] },
    Change { why: "the sign of x is wrong", undo: |[x, y]| [-x, y] },
    Change { why: "the coordinates are in centimetres, those of the map are not", undo: |[x, y]| [0.01 * x, 0.01 * y] },
    Change { why: "the coordinates are in millimetres, those of the map are not", undo: |[x, y]| [0.001 * x, 0.001 * y] },
    Change { why: "the unit is 100 times too small for the map", undo: |[x, y]| [100.0 * x, 100.0 * y] },
    Change { why: "the unit is 10 times too small for the map", undo: |[x, y]| [10.0 * x, 10.0 * y] },
    Change { why: "the unit is 10 times too large for the map", undo: |[x, y]| [0.1 * x, 0.1 * y] },
    Change { why: "the unit is 1000 times too small for the map", undo: |[x, y]| [1000.0 * x, 1000.0 * y] },
];

/// The probable reason for which a path comes too close to a wall.
pub(crate) fn intention(floor: &Floor, plan: &PathPlan, clearance: f64) -> Option<String> {
    let room = Room::new(floor);
    let is_free = |plan: &PathPlan, clearance: f64| {
        Collision::first(plan, floor, clearance).is_none() && room.has_inside(plan.start)
    };
    if let Some(change) = CHANGES.iter().find(|change| is_free(&changed(plan, change), clearance)) {
        return Some(format!("; is it that {}?", change.why));
    }
    let smaller = [0.1, 0.01, 0.001].map(|factor| factor * clearance);
    let clearance = smaller.into_iter().find(|smaller| is_free(plan, *smaller));
    let clearance = clearance.filter(|clearance| *clearance >= 0.01)?;
    Some(format!("; did you mean a clearance of {} m?", short(clearance)))
}

fn changed(plan: &PathPlan, change: &Change) -> PathPlan {
    let corners = plan.corners.iter().map(|corner| (change.undo)(*corner)).collect();
    PathPlan { start: (change.undo)(plan.start), corners, ..plan.clone() }
}

/// The walls as segments, and their bounding box.
pub(super) struct Room {
    pub walls: Vec<Segment>,
    pub least: Point,
    pub most: Point,
    /// Whether every end of a wall meets another wall, as around a room.
    is_closed: bool,
}

impl Room {
    pub fn new(floor: &Floor) -> Self {
        let walls: Vec<_> = floor.named_walls().iter().map(NamedWall::segment).collect();
        let (least, most) = bounds(walls.iter().copied());
        let is_closed = walls.len() <= MOST_WALLS
            && (0..walls.len())
                .all(|wall| ends(&walls, wall).all(|end| nearest(&walls, wall, end) <= WIDEST_GAP));
        Self { walls, least, most, is_closed }
    }

    pub fn sides(&self) -> Point {
        [self.most[0] - self.least[0], self.most[1] - self.least[1]]
    }

    pub fn size(&self) -> f64 {
        self.sides()[0].max(self.sides()[1])
    }

    /// Whether a point is within a closed room; true if the walls do not close.
    pub fn has_inside(&self, point: Point) -> bool {
        let far = 3.0 * self.size() + 1.0;
        let is_hit = |index: u16| {
            // Off the axes, so that no beam runs along a wall.
            let angle = (f64::from(index) + 0.37) * std::f64::consts::TAU / f64::from(SAMPLES);
            let to = [point[0] + far * angle.cos(), point[1] + far * angle.sin()];
            let beam = Segment { from: point, to };
            self.walls.iter().any(|wall| wall.distance(beam) <= TOLERANCE)
        };
        let hits = (0..SAMPLES).filter(|index| is_hit(*index)).count();
        !self.is_closed || hits * 100 >= usize::from(SAMPLES) * 97
    }

    /// Whether a point is in the bounding box, with a margin.
    pub fn bounds(&self, [x, y]: Point) -> bool {
        let margin = 0.1 * self.size();
        let is_in = |value: f64, axis: usize| {
            let edge = |point: &Point| point.get(axis).copied().unwrap_or_default();
            value >= edge(&self.least) - margin && value <= edge(&self.most) + margin
        };
        is_in(x, 0) && is_in(y, 1)
    }
}

pub(super) fn ends(walls: &[Segment], wall: usize) -> impl Iterator<Item = Point> {
    walls.get(wall).into_iter().flat_map(|wall| [wall.from, wall.to])
}

pub(super) fn bounds(walls: impl Iterator<Item = Segment>) -> (Point, Point) {
    let all = walls.flat_map(|wall| [wall.from, wall.to]);
    all.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(least, most), [x, y]| {
        ([least[0].min(x), least[1].min(y)], [most[0].max(x), most[1].max(y)])
    })
}

/// The distance of a point from the nearest other wall.
pub(super) fn nearest(walls: &[Segment], wall: usize, point: Point) -> f64 {
    let others = walls.iter().enumerate().filter(|(other, _)| *other != wall);
    others.map(|(_, other)| other.distance_to(point)).fold(f64::INFINITY, f64::min)
}
