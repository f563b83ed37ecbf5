//! Neighbouring rooms, and the doors between them.

use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::rooms::{Room, Span};
use super::site::Point;

/// Clear widths of doors, centimetres.
const WIDTH: (i32, i32) = (80, 110);
/// Minimum wall beside a door, centimetres.
const BESIDE: i32 = 15;
/// Probability of a door that is not needed to reach every room.
const SPARE: f64 = 0.25;

/// A door between two rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Door {
    /// The rooms, by their index: the one at smaller coordinates first.
    pub rooms: [usize; 2],
    /// Whether the wall runs along y, so that the passage is along x.
    pub wall_along_y: bool,
    /// The coordinate of the wall's centre on the axis of the passage.
    pub at: i32,
    /// The opening, along the wall.
    pub gap: Span,
}

impl Door {
    /// The point at a distance in front of the door's centre, on the side of the first room
    /// (negative) or the second (positive).
    pub fn front(&self, distance: i32) -> Point {
        let middle = i32::midpoint(self.gap.from, self.gap.to);
        let before = self.at + distance;
        if self.wall_along_y { [before, middle] } else { [middle, before] }
    }

    /// The room on the other side of the door.
    pub fn beyond(&self, room: usize) -> Option<usize> {
        match self.rooms {
            [one, other] if one == room => Some(other),
            [one, other] if other == room => Some(one),
            _ => None,
        }
    }
}

/// Doors so that every room can be reached, and some more.
///
/// They exist: the first two rooms on both sides of a cut share the length of the smaller one, and
/// no room is too short for a door.
pub(super) fn between(rooms: &[Room], thickness: i32, rng: &mut ChaCha8Rng) -> Vec<Door> {
    let mut possible = possible(rooms, thickness);
    possible.shuffle(rng);
    let opens_on_corridor = |door: &Door| {
        door.rooms.iter().any(|&room| rooms.get(room).is_some_and(|room| room.is_corridor))
    };
    possible.sort_by_key(|door| !opens_on_corridor(door));
    let mut group: Vec<usize> = (0..rooms.len()).collect();
    let mut doors = Vec::new();
    for mut door in possible {
        let [one, other] = door.rooms.map(|room| group.get(room).copied());
        let is_needed = one != other;
        if is_needed {
            for member in &mut group {
                if Some(*member) == other {
                    *member = one.unwrap_or(*member);
                }
            }
        }
        if is_needed || rng.random_bool(SPARE) {
            door.gap = opening(door.gap, rng);
            doors.push(door);
        }
    }
    doors
}

/// The widest possible door of each pair of neighbours.
fn possible(rooms: &[Room], thickness: i32) -> Vec<Door> {
    let mut doors = Vec::new();
    for (one, a) in rooms.iter().enumerate() {
        for (other, b) in rooms.iter().enumerate() {
            for (wall_along_y, at, touches, shared) in [
                (true, b.x.from, a.x.to == b.x.from, a.y.shared(b.y)),
                (false, b.y.from, a.y.to == b.y.from, a.x.shared(b.x)),
            ] {
                let gap = shared.inset(thickness / 2 + BESIDE);
                if touches && gap.length() >= WIDTH.0 {
                    doors.push(Door { rooms: [one, other], wall_along_y, at, gap });
                }
            }
        }
    }
    doors
}

/// An opening of a door's width at a random position in an interval.
fn opening(within: Span, rng: &mut ChaCha8Rng) -> Span {
    let width = rng.random_range(WIDTH.0..=WIDTH.1).min(within.length());
    let from = rng.random_range(within.from..=within.to - width);
    Span { from, to: from + width }
}
