//! A path through rooms and doors with clearance from every wall.
//!
//! Every corner lies [`MARGIN`] inside a room, and the path passes a door perpendicularly through its
//! centre. A room is convex, so a leg between two corners has the same clearance.

use std::collections::VecDeque;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::doors::Door;
use super::rooms::{Room, Span};
use super::site::Point;

/// Distance of a corner from the faces around it, centimetres.
const MARGIN: i32 = 40;
/// Minimum distance of corners within a room, centimetres.
const SHORTEST: f64 = 30.0;
/// Lengths of paths, centimetres.
const LENGTH: (f64, f64) = (2_500.0, 5_000.0);
/// Probability that a leg runs along a wall.
const SQUARE: f64 = 0.6;
/// Attempts to find the next corner: a room of 2.4 m has others.
const TRIES: usize = 1_000;

pub(super) fn through(
    rooms: &[Room],
    doors: &[Door],
    thickness: i32,
    rng: &mut ChaCha8Rng,
) -> Vec<Point> {
    let start = rng.random_range(0..rooms.len());
    let mut walker = Walker { rooms, doors, inset: thickness / 2 + MARGIN, path: Vec::new() };
    let least = rng.random_range(LENGTH.0..LENGTH.1);
    let mut here = start;
    walker.wander(here, rng);
    for _ in 0..TRIES {
        if walker.length() >= least {
            break;
        }
        let target = rng.random_range(0..rooms.len());
        walker.go(here, target);
        here = target;
        walker.wander(here, rng);
    }
    walker.path
}

struct Walker<'a> {
    rooms: &'a [Room],
    doors: &'a [Door],
    /// From the centre of a wall to the nearest corner of the path.
    inset: i32,
    path: Vec<Point>,
}

impl<'a> Walker<'a> {
    fn length(&self) -> f64 {
        self.path.iter().zip(self.path.iter().skip(1)).map(|(a, b)| distance(*a, *b)).sum()
    }

    /// Adds a leg within a room, along a wall or across.
    fn wander(&mut self, room: usize, rng: &mut ChaCha8Rng) {
        let Some(room) = self.rooms.get(room) else {
            return;
        };
        let mut along = |span: Span| {
            let free = span.inset(self.inset);
            rng.random_range(free.from..=free.to)
        };
        let mut corner = [along(room.x), along(room.y)];
        if let Some(&[x, y]) = self.path.last()
            && rng.random_bool(SQUARE)
        {
            corner = if rng.random_bool(0.5) { [x, corner[1]] } else { [corner[0], y] };
        }
        let is_far = |last: &Point| distance(*last, corner) >= SHORTEST;
        if self.path.last().is_none_or(is_far) {
            self.path.push(corner);
        }
    }

    /// Adds the legs from room to room, through the fewest doors.
    fn go(&mut self, from: usize, to: usize) {
        let mut here = from;
        for door in self.shortest(from, to) {
            let first_side = door.rooms.first() == Some(&here);
            let side = if first_side { -self.inset } else { self.inset };
            for corner in [door.front(side), door.front(-side)] {
                if self.path.last() != Some(&corner) {
                    self.path.push(corner);
                }
            }
            here = door.beyond(here).unwrap_or(here);
        }
    }

    /// The doors on the shortest route between two rooms, in order.
    fn shortest(&self, from: usize, to: usize) -> Vec<&'a Door> {
        // Breadth-first search from the end: the exit of each room towards it.
        let mut exits: Vec<Option<&'a Door>> = vec![None; self.rooms.len()];
        let mut queue = VecDeque::from([to]);
        while let Some(room) = queue.pop_front() {
            for door in self.doors {
                let Some(before) = door.beyond(room).filter(|&before| before != to) else {
                    continue;
                };
                if let Some(exit @ None) = exits.get_mut(before) {
                    *exit = Some(door);
                    queue.push_back(before);
                }
            }
        }
        let mut here = from;
        std::iter::from_fn(|| {
            let door = exits.get(here).copied().flatten()?;
            here = door.beyond(here)?;
            Some(door)
        })
        .collect()
    }
}

fn distance(a: Point, b: Point) -> f64 {
    f64::from(b[0] - a[0]).hypot(f64::from(b[1] - a[1]))
}
