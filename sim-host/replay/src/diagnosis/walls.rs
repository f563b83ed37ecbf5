//! Changes of single walls: shifted, removed, added.

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::Wall;

/// With more walls in the map, single walls are not tried: it takes too long, and one of many fits by chance.
const MOST: usize = 24;
/// Shifts to the left of a wall, seen from its first end, metres.
const SHIFTS: [f64; 8] = [-0.8, -0.5, -0.3, -0.15, 0.15, 0.3, 0.5, 0.8];
/// Half the distance of two shifts, metres.
const HALF_STEP: f64 = 0.08;
/// A wall ends at another one that is as near, metres.
const JOINED: f64 = 0.05;

/// What is tried with one wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WallChange {
    /// The wall of this index is so many metres farther to its left.
    Shifted(usize, f64),
    /// The wall of this index is not there.
    Removed(usize),
    /// There is another one, between these ends.
    Added(Point, Point),
}

impl WallChange {
    /// The walls with the change.
    pub fn of(self, mut walls: Vec<Wall>) -> Vec<Wall> {
        match self {
            Self::Shifted(index, by) => {
                if let Some(wall) = walls.get_mut(index) {
                    *wall = shifted(wall, by);
                }
            }
            Self::Removed(index) if index < walls.len() => _ = walls.remove(index),
            Self::Removed(_) => {}
            Self::Added(from, to) => walls.extend(Wall::new(from, to)),
        }
        walls
    }
}

/// All changes of single walls that are tried.
pub fn changes(walls: &[Wall]) -> Vec<WallChange> {
    if walls.len() > MOST {
        return Vec::new();
    }
    let shifted = |index| SHIFTS.map(move |by| WallChange::Shifted(index, by));
    let indices = 0..walls.len();
    let moved = indices.clone().flat_map(shifted).chain(indices.map(WallChange::Removed));
    let added = closing(walls).into_iter().map(|wall| WallChange::Added(wall.from(), wall.to()));
    moved.chain(added).collect()
}

/// Shifts between one of a wall and its neighbours. `fineness` halves the step.
pub fn finer(coarse: WallChange, fineness: i32) -> Vec<WallChange> {
    let WallChange::Shifted(index, by) = coarse else { return Vec::new() };
    let step = HALF_STEP * 0.5_f64.powi(fineness);
    [by - step, by + step].map(|by| WallChange::Shifted(index, by)).into()
}

fn shifted(wall: &Wall, by: f64) -> Wall {
    let [from, to] = [wall.from(), wall.to()].map(|end| [end.x, end.y].map(|it| f64::from(it.0)));
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    let [x, y] = [-along[1] * by / length, along[0] * by / length];
    let moved = |end: [f64; 2]| point(end[0] + x, end[1] + y);
    let shifted = Wall::new(moved(from), moved(to)).unwrap_or(*wall);
    wall.accuracy().map_or(shifted, |accuracy| shifted.with_accuracy(accuracy))
}

/// Walls between two ends that no other wall joins.
fn closing(walls: &[Wall]) -> Vec<Wall> {
    let is_joined = |index: usize, end: Point| {
        let mut others = walls.iter().enumerate().filter(|(other, _)| *other != index);
        others.any(|(_, wall)| is_at(wall, end))
    };
    let ends = walls.iter().enumerate().flat_map(|(index, wall)| {
        [wall.from(), wall.to()].into_iter().filter(move |end| !is_joined(index, *end))
    });
    let ends: Vec<_> = ends.take(MOST / 2).collect();
    let pairs = ends.iter().enumerate().flat_map(|(index, from)| {
        ends.iter().skip(index + 1).filter_map(|to| Wall::new(*from, *to).ok())
    });
    pairs
        .filter(|wall| {
            !walls.iter().any(|other| is_at(other, wall.from()) && is_at(other, wall.to()))
        })
        .collect()
}

/// Whether a point is on a wall.
fn is_at(wall: &Wall, point: Point) -> bool {
    let along = f64::from(wall.along(point).0);
    let length = f64::from(wall.length().0);
    let is_beside = f64::from(wall.signed_distance(point).0).abs() <= JOINED;
    is_beside && (-JOINED..=length + JOINED).contains(&along)
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn point(x: f64, y: f64) -> Point {
    Point { x: Metres(x as f32), y: Metres(y as f32) }
}
