//! Buildings of any size with constant density, for benchmarks and tests.

use sonarfix::geometry::pose::Point;
use sonarfix::map::Wall;

/// Inner size of a room, metres.
const ROOM: (f32, f32) = (4.0, 5.0);
/// Width of a door, metres.
const DOOR: f32 = 0.9;

/// The first `count` walls of a square of rooms of 4 m × 5 m. Each room has a wall to its left and
/// one below, with a door in the middle of each: four segments on 20 m².
pub fn rooms(count: usize) -> Vec<Wall> {
    let side = rooms_a_side(count);
    let rooms = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
    rooms.flat_map(|(column, row)| room(corner(column, row))).take(count).collect()
}

/// A place in a room in the middle of the building, before a wall on its left and one below.
pub fn inside(count: usize) -> Point {
    let side = rooms_a_side(count);
    let Point { x, y } = corner(side / 2, (side - 1) / 2);
    Point::new(x.0 + 1.0, y.0 + 1.2)
}

fn rooms_a_side(count: usize) -> u16 {
    let side = (1..u16::MAX).find(|&side| 4 * usize::from(side).pow(2) >= count);
    side.unwrap_or(u16::MAX)
}

fn corner(column: u16, row: u16) -> Point {
    Point::new(f32::from(column) * ROOM.0, f32::from(row) * ROOM.1)
}

fn room(corner: Point) -> Vec<Wall> {
    let (wide, high) = ROOM;
    let at = |x: f32, y: f32| Point::new(corner.x.0 + x, corner.y.0 + y);
    let jamb = |length: f32| (0.5 * (length - DOOR), 0.5 * (length + DOOR));
    let (left, right) = jamb(wide);
    let (low, top) = jamb(high);
    let ends = [
        (at(0.0, 0.0), at(left, 0.0)),
        (at(right, 0.0), at(wide, 0.0)),
        (at(0.0, 0.0), at(0.0, low)),
        (at(0.0, top), at(0.0, high)),
    ];
    ends.into_iter().filter_map(|(from, to)| Wall::new(from, to).ok()).collect()
}
