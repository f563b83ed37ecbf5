//! Families of rooms: a seed gives the same walls and path on every machine.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::polygon::{Point, Side, distance, sides};
use super::watch::Unobservable;

/// Clear width of an inner door, metres.
const DOOR: f64 = 0.9;
/// Distance between a pillar and the path, metres.
const BESIDE_PATH: f64 = 0.35;

/// A family of rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// An L of 4 m to 6 m.
    Corner,
    /// A field of 1.5 m to 2.5 m for games and races.
    Arena,
    /// A closed corridor, 1.6 m to 2.2 m wide and 8 m to 12 m long.
    Corridor,
    /// The middle of a corridor whose ends are out of range.
    OpenCorridor,
    /// A hall of 8 m to 12 m, whose opposite walls are out of range.
    Hall,
    /// A hall of which one long wall is in range.
    LongWall,
    /// A room with four walls of which no two are parallel or square.
    Slanted,
    /// Six rooms with doors between them.
    Home,
    /// A room with four to eight mapped pillars.
    Pillars,
    /// A square, which looks the same from four places.
    Symmetric,
    /// A square with a niche.
    NearlySymmetric,
}

/// The walls of a room and a path in it, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    /// The corners of its outer walls, counter-clockwise.
    pub outline: Vec<Point>,
    /// Its further walls.
    pub inner: Vec<Side>,
    /// The corners of the path, of which every lap ends at the first.
    pub path: Vec<Point>,
    /// The direction that no wall in range measures.
    pub unobservable: Unobservable,
}

impl Room {
    /// A room without further walls, of which every direction is observable.
    fn of((outline, path): (Vec<Point>, Vec<Point>)) -> Self {
        Self { outline, inner: Vec::new(), path, unobservable: Unobservable::None }
    }

    /// All walls, the outer ones first.
    pub fn walls(&self) -> Vec<Side> {
        sides(&self.outline).chain(self.inner.iter().copied()).collect()
    }

    /// The least distance between a line and the path, metres.
    pub fn beside_path(&self, side: Side) -> f64 {
        sides(&self.path).map(|leg| distance(leg, side)).fold(f64::INFINITY, f64::min)
    }
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Corner,
        Self::Arena,
        Self::Corridor,
        Self::OpenCorridor,
        Self::Hall,
        Self::LongWall,
        Self::Slanted,
        Self::Home,
        Self::Pillars,
        Self::Symmetric,
        Self::NearlySymmetric,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Corner => "L-room",
            Self::Arena => "arena",
            Self::Corridor => "corridor",
            Self::OpenCorridor => "open corridor",
            Self::Hall => "hall",
            Self::LongWall => "one long wall",
            Self::Slanted => "slanted walls",
            Self::Home => "six rooms",
            Self::Pillars => "pillars",
            Self::Symmetric => "square",
            Self::NearlySymmetric => "square with niche",
        }
    }

    /// A room of the family.
    pub(super) fn room(self, rng: &mut ChaCha8Rng) -> Room {
        let mut between = |least: f64, most: f64| rng.random_range(least..most);
        match self {
            Self::Corner => Room::of(corner(&mut between)),
            Self::Arena => Room::of(rectangle(between(1.5, 2.5), between(1.5, 2.5), 0.4)),
            Self::Corridor => Room::of(rectangle(between(8.0, 12.0), between(1.6, 2.2), 0.5)),
            Self::OpenCorridor => open_corridor(between(1.6, 2.2)),
            Self::Hall => {
                Room::of(rectangle(between(8.0, 12.0), between(8.0, 12.0), between(1.0, 2.0)))
            }
            Self::LongWall => long_wall(between(0.8, 1.5)),
            Self::Slanted => Room::of(slanted(&mut between)),
            Self::Home => home([(); 6].map(|()| between(3.0, 4.5))),
            Self::Pillars => pillars(rng),
            Self::Symmetric => {
                let side = between(3.5, 6.0);
                Room::of(rectangle(side, side, 0.25 * side))
            }
            Self::NearlySymmetric => Room::of(niche(&mut between)),
        }
    }
}

/// A room and a path at a distance from its walls.
fn rectangle(w: f64, h: f64, inside: f64) -> (Vec<Point>, Vec<Point>) {
    let corners = |d: f64| vec![[d, d], [w - d, d], [w - d, h - d], [d, h - d]];
    (corners(0.0), corners(inside))
}

fn corner(between: &mut impl FnMut(f64, f64) -> f64) -> (Vec<Point>, Vec<Point>) {
    let (w, h) = (between(4.0, 6.0), between(4.0, 6.0));
    let (x, y) = (between(0.4, 0.6) * w, between(0.4, 0.6) * h);
    let room = vec![[0.0, 0.0], [w, 0.0], [w, y], [x, y], [x, h], [0.0, h]];
    let (u, v) = (0.5 * x, 0.5 * y);
    (room, vec![[u, v], [w - u, v], [u, v], [u, h - v]])
}

fn slanted(between: &mut impl FnMut(f64, f64) -> f64) -> (Vec<Point>, Vec<Point>) {
    let (w, h) = (between(3.5, 6.0), between(3.5, 6.0));
    let mut bent = || between(0.03, 0.2);
    let (a, b, c, d) = (bent() * h, bent() * w, bent() * h, bent() * w);
    let room = vec![[0.0, 0.0], [w, -a], [w - b, h + c], [d, h]];
    let path =
        vec![[0.3 * w, 0.25 * h], [0.7 * w, 0.25 * h], [0.7 * w, 0.75 * h], [0.3 * w, 0.75 * h]];
    (room, path)
}

/// There and back in the middle of 24 m.
fn open_corridor(width: f64) -> Room {
    let (outline, _) = rectangle(24.0, width, 0.0);
    let path = vec![[9.0, 0.5 * width], [15.0, 0.5 * width]];
    Room { unobservable: Unobservable::X, ..Room::of((outline, path)) }
}

/// There and back in the middle of 24 m, at a distance from the wall; the opposite one is 14 m away.
fn long_wall(away: f64) -> Room {
    let (outline, _) = rectangle(24.0, 14.0, 0.0);
    let path = vec![[8.0, away], [16.0, away]];
    Room { unobservable: Unobservable::X, ..Room::of((outline, path)) }
}

/// A square with a niche in its eastern wall.
fn niche(between: &mut impl FnMut(f64, f64) -> f64) -> (Vec<Point>, Vec<Point>) {
    let side = between(3.5, 6.0);
    let (wide, deep) = (between(0.8, 1.2), between(0.3, 0.5));
    let from = between(0.3, side - wide - 0.3);
    let (mut outline, path) = rectangle(side, side, 0.25 * side);
    let corners =
        [[side, from], [side + deep, from], [side + deep, from + wide], [side, from + wide]];
    outline.splice(2..2, corners);
    (outline, path)
}

/// Three columns and two rows of rooms. The path leads through six doors in a circle.
fn home([a, b, c, d, e, shift]: [f64; 6]) -> Room {
    let (x1, x2, w) = (a, a + b, a + b + c);
    let (y1, h) = (d, d + e);
    let (outline, _) = rectangle(w, h, 0.0);
    // The legs pass the rooms off their middle.
    let (west, east) = (0.12 * shift * a, x2 + (1.0 - 0.12 * shift) * c);
    let (south, north) = (0.12 * shift * d, y1 + (1.0 - 0.12 * shift) * e);
    let path = vec![[west, south], [east, south], [east, north], [west, north]];
    let half = 0.5 * DOOR;
    let upright = |x: f64| {
        let ends = [0.0, south - half, south + half, north - half, north + half, h];
        ends.map(|y| [x, y])
    };
    let level = [0.0, west - half, west + half, east - half, east + half, w].map(|x| [x, y1]);
    let pairs = [upright(x1), upright(x2), level].into_iter();
    let inner = pairs.flat_map(|[a, b, c, d, e, f]| [[a, b], [c, d], [e, f]]).collect();
    Room { inner, ..Room::of((outline, path)) }
}

fn pillars(rng: &mut ChaCha8Rng) -> Room {
    let (w, h) = (rng.random_range(5.0..7.0), rng.random_range(5.0..7.0));
    let mut room = Room::of(rectangle(w, h, 1.2));
    for _ in 0..rng.random_range(4..=8) {
        let side: f64 = rng.random_range(0.2..0.4);
        let (x, y) = (rng.random_range(0.3..w - 0.7), rng.random_range(0.3..h - 0.7));
        let corners = [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
        let is_free = sides(&corners).all(|face| {
            let nearest = room.inner.iter().map(|other| distance(face, *other));
            room.beside_path(face) > BESIDE_PATH && nearest.fold(f64::INFINITY, f64::min) > 0.2
        });
        if is_free {
            room.inner.extend(sides(&corners));
        }
    }
    room
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::super::polygon::contains;
    use super::*;

    #[test]
    fn every_path_is_inside_its_room_and_clear_of_its_walls() {
        for family in Family::ALL {
            for seed in 0..50 {
                let room = family.room(&mut ChaCha8Rng::seed_from_u64(seed));
                let name = format!("{} {seed}", family.name());
                assert!(room.path.iter().all(|at| contains(&room.outline, *at)), "{name}");
                assert!(room.walls().iter().all(|wall| room.beside_path(*wall) > 0.2), "{name}");
            }
        }
    }
}
