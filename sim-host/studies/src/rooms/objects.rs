//! What stands or moves in a room and is not in its map.

use std::f64::consts::PI;

use rand::RngExt;
use rand::seq::{IndexedRandom, IteratorRandom};
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Obstacle, Oscillation, Outline};

use super::family::Room;
use super::polygon::{
    Point, Side, along, area, contains, directions, distance, from_to, length, narrowest, point_on,
    sides,
};

/// Clearance between an object and the path, metres: that of the robot.
const CLEARANCE: f64 = 0.2;
/// Farthest place of an object from the path, metres: what is farther away no sonar hears.
const REACH: f64 = 3.0;
/// Farthest wall from the path that gets a door, metres.
const NEAR: f64 = 2.0;
/// Attempts to place one object.
const ATTEMPTS: usize = 60;
/// Width of a room for objects of full size, metres; in narrower ones they are smaller in proportion.
const FULL_SIZE: f64 = 3.0;
/// A board's distance from its wall, metres.
const BEFORE_WALL: f64 = 0.3;
/// Objects do not touch the walls, metres.
const GAP: f64 = 1e-3;

/// The kind of objects that are not in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Objects {
    /// None.
    Nothing,
    /// Pieces of furniture, large and round ones.
    Furniture,
    /// Many small round things.
    Clutter,
    /// A flat board 30 cm before a wall.
    Board,
    /// A door that is open while the map says closed, or the converse, or that is opened during the run.
    Door,
    /// One to three people who walk to and fro.
    People,
    /// A box that is moved during the run.
    MovedBox,
}

impl Objects {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Nothing,
        Self::Furniture,
        Self::Clutter,
        Self::Board,
        Self::Door,
        Self::People,
        Self::MovedBox,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "empty",
            Self::Furniture => "furniture",
            Self::Clutter => "clutter",
            Self::Board => "board",
            Self::Door => "door",
            Self::People => "people",
            Self::MovedBox => "moved box",
        }
    }
}

/// A room, what is in it, and what the map says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The true walls.
    pub walls: Vec<Side>,
    /// The walls of the map. Walls of the same number are on the same line.
    pub map: Vec<Side>,
    /// What is not in the map, at the start.
    pub obstacles: Vec<Obstacle>,
    /// What is not in the map from a time on, seconds, if that changes.
    pub later: Option<(f64, Vec<Obstacle>)>,
}

impl Scene {
    /// A room with objects.
    pub fn new(room: &Room, objects: Objects, rng: &mut ChaCha8Rng) -> Self {
        let walls = room.walls();
        let scene = Self { map: walls.clone(), walls, obstacles: Vec::new(), later: None };
        let mut floor = Floor::new(room, rng);
        match objects {
            Objects::Nothing => scene,
            Objects::Furniture => Self { obstacles: floor.furniture(), ..scene },
            Objects::Clutter => Self { obstacles: floor.clutter(), ..scene },
            Objects::Board => Self { obstacles: floor.board(), ..scene },
            Objects::Door => floor.door(scene),
            Objects::People => Self { obstacles: floor.people(), ..scene },
            Objects::MovedBox => floor.moved_box(scene),
        }
    }
}

/// The floor under an object.
type Corners = [Point; 4];

/// A room that is filled with objects.
struct Floor<'a> {
    room: &'a Room,
    walls: Vec<Side>,
    /// Scale of the objects.
    size: f64,
    rng: &'a mut ChaCha8Rng,
}

impl<'a> Floor<'a> {
    fn new(room: &'a Room, rng: &'a mut ChaCha8Rng) -> Self {
        let size = (narrowest(&room.outline) / FULL_SIZE).min(1.0);
        Self { room, walls: room.walls(), size, rng }
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        self.rng.random_range(least..most)
    }

    /// A random number of objects for the floor: one on so many square metres, between two limits.
    fn count(&self, square_metres: f64, least: u32, most: u32) -> u32 {
        let wanted = area(&self.room.outline) / square_metres;
        (least..=most).rev().find(|count| f64::from(*count) <= wanted).unwrap_or(least)
    }

    /// A random place within reach of the path.
    fn place(&mut self) -> Point {
        let leg = sides(&self.room.path).choose(self.rng).unwrap_or_default();
        let share = self.between(0.0, 1.0);
        let (sin, cos) = self.between(-PI, PI).sin_cos();
        let away = self.between(CLEARANCE, REACH);
        along(point_on(leg, share), [cos, sin], away)
    }

    /// Whether a polygon is inside the room, crosses no wall, and is clear of the path.
    fn is_free(&self, corners: Corners) -> bool {
        corners.iter().all(|corner| contains(&self.room.outline, *corner))
            && sides(&corners).all(|side| {
                self.room.beside_path(side) > CLEARANCE
                    && self.walls.iter().all(|wall| distance(*wall, side) > 0.5 * GAP)
            })
    }

    /// The first free polygon of some attempts.
    fn find(&mut self, draw: impl Fn(&mut Self) -> Corners) -> Option<Corners> {
        (0..ATTEMPTS).find_map(|_| {
            let corners = draw(self);
            self.is_free(corners).then_some(corners)
        })
    }

    fn furniture(&mut self) -> Vec<Obstacle> {
        let mut pieces = Vec::new();
        for _ in 0..self.count(5.0, 3, 20) {
            if self.rng.random_bool(0.3) {
                pieces.extend(self.round(0.02, 0.2));
            } else {
                let is_along_wall = self.rng.random_bool(0.6);
                let piece = self.find(|floor| floor.piece(is_along_wall));
                pieces.extend(piece.into_iter().flat_map(faces));
            }
        }
        pieces
    }

    fn clutter(&mut self) -> Vec<Obstacle> {
        (0..self.count(1.5, 6, 40)).filter_map(|_| self.round(0.02, 0.08)).collect()
    }

    /// A round thing with a radius between two limits, metres.
    fn round(&mut self, least: f64, most: f64) -> Option<Obstacle> {
        let radius = self.size * self.between(least, most);
        let [corner, _, opposite, _] = self.find(|floor| square(floor.place(), 2.0 * radius))?;
        let centre = point_on([corner, opposite], 0.5);
        Some(standing(Outline::Circle { centre, radius }))
    }

    /// A cupboard, a table, a sofa: along a wall or anywhere.
    fn piece(&mut self, is_along_wall: bool) -> Corners {
        let (long, deep) =
            (self.size * self.between(0.5, 1.6), self.size * self.between(0.35, 0.7));
        if is_along_wall {
            return self.before_wall(long, GAP, deep);
        }
        let corner = self.place();
        let turned = if self.rng.random_bool(0.8) { 0.0 } else { self.between(0.0, PI) };
        let (sin, cos) = turned.sin_cos();
        let next = along(corner, [cos, sin], long);
        let across = [-sin, cos];
        [corner, next, along(next, across, deep), along(corner, across, deep)]
    }

    /// A rectangle along a random wall, from a distance from it on; not always inside the room.
    fn before_wall(&mut self, long: f64, from: f64, deep: f64) -> Corners {
        let wall = self.walls.choose(self.rng).copied().unwrap_or_default();
        let (ahead, left) = directions(wall);
        let start = self.between(0.0, 1.0) * (length(wall) - long).max(0.0);
        let begin = along(wall[0], ahead, start);
        // Walls of the outline have the room on their left.
        let side =
            |share: f64| [along(begin, left, share), along(along(begin, ahead, long), left, share)];
        let ([a, b], [d, c]) = (side(from), side(from + deep));
        [a, b, c, d]
    }

    /// A board without thickness; nearer to its wall where the path is.
    fn board(&mut self) -> Vec<Obstacle> {
        let mut before = BEFORE_WALL;
        while before > 0.05 {
            let long = self.size * self.between(0.6, 1.5);
            let found = self.find(|floor| floor.before_wall(long, before, GAP));
            if let Some([from, to, ..]) = found {
                return vec![standing(Outline::Face { from, to })];
            }
            before *= 0.8;
        }
        Vec::new()
    }

    fn people(&mut self) -> Vec<Obstacle> {
        (0..self.rng.random_range(1..=3)).filter_map(|_| self.person()).collect()
    }

    /// Somebody who walks along a line, clear of the path.
    fn person(&mut self) -> Option<Obstacle> {
        let radius = self.size * self.between(0.1, 0.2);
        let [a, b, c, d] = self.find(|floor| {
            let (from, to) = (floor.place(), floor.place());
            let (_, left) = directions([from, to]);
            let corners = [(from, 1.0), (to, 1.0), (to, -1.0), (from, -1.0)];
            corners.map(|(at, side)| along(at, left, side * radius))
        })?;
        let (from, to) = (point_on([a, d], 0.5), point_on([b, c], 0.5));
        let takes = length([from, to]) / self.between(0.4, 1.2);
        let walk = Some(Oscillation { by: from_to(from, to), takes: takes.max(0.1) });
        Some(Obstacle { outline: Outline::Circle { centre: from, radius }, walk })
    }

    fn moved_box(&mut self, scene: Scene) -> Scene {
        let is_along_wall = self.rng.random_bool(0.5);
        let size = self.size * self.between(0.3, 0.6);
        let draw = |floor: &mut Self| {
            if is_along_wall {
                floor.before_wall(size, GAP, size)
            } else {
                square(floor.place(), size)
            }
        };
        let mut put = || self.find(draw).map_or_else(Vec::new, faces);
        let (before, after) = (put(), put());
        let at = self.between(150.0, 450.0);
        Scene { obstacles: before, later: Some((at, after)), ..scene }
    }

    /// Opens a door in an outer wall, of the truth, of the map, or during the run.
    fn door(&mut self, scene: Scene) -> Scene {
        let outer = self.room.outline.len();
        let wide = self.size * self.between(0.8, 1.0);
        let fits = |wall: Side| length(wall) > 1.2 * wide && self.room.beside_path(wall) < NEAR;
        let outer = self.walls.iter().copied().take(outer).enumerate();
        let Some((number, wall)) = outer.filter(|(_, wall)| fits(*wall)).choose(self.rng) else {
            return scene;
        };
        let at = self.between(0.1 * wide, length(wall) - 1.1 * wide) / length(wall);
        let gap = [at, at + wide / length(wall)].map(|share| point_on(wall, share));
        let open = split(&scene.walls, number, gap);
        let leaf = standing(Outline::Face { from: gap[0], to: gap[1] });
        match self.rng.random_range(0..3) {
            0 => Scene { walls: self.with_room_behind(open, gap), ..scene },
            1 => Scene { map: open, ..scene },
            _ => {
                let opened_at = self.between(100.0, 400.0);
                let later = Some((opened_at, Vec::new()));
                let walls = self.with_room_behind(open, gap);
                Scene { walls, obstacles: vec![leaf], later, ..scene }
            }
        }
    }

    /// Walls behind a door: those of a corridor.
    fn with_room_behind(&mut self, mut walls: Vec<Side>, gap: Side) -> Vec<Side> {
        let (ahead, left) = directions(gap);
        let behind = |at: Point, by: f64, aside: f64| along(along(at, left, -by), ahead, aside);
        let deep = self.between(1.0, 2.5);
        walls.push([behind(gap[0], deep, -1.0), behind(gap[1], deep, 1.0)]);
        walls
    }
}

/// The walls with a gap in one of them. Its first part keeps its number.
fn split(walls: &[Side], number: usize, [from, to]: Side) -> Vec<Side> {
    let mut walls = walls.to_vec();
    if let Some([_, end]) = walls.get_mut(number) {
        let end = std::mem::replace(end, from);
        walls.push([to, end]);
    }
    walls
}

fn square([x, y]: Point, side: f64) -> Corners {
    [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
}

fn faces(corners: Corners) -> Vec<Obstacle> {
    sides(&corners).map(|[from, to]| standing(Outline::Face { from, to })).collect()
}

fn standing(outline: Outline) -> Obstacle {
    Obstacle { outline, walk: None }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::super::family::Family;
    use super::*;

    fn scene(family: Family, objects: Objects, seed: u64) -> (Room, Scene) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let room = family.room(&mut rng);
        let scene = Scene::new(&room, objects, &mut rng);
        (room, scene)
    }

    #[test]
    fn objects_are_in_nearly_every_room_and_clear_of_the_path() {
        for family in Family::ALL {
            for objects in Objects::ALL {
                let mut changed = 0;
                for seed in 0..20 {
                    let (room, scene) = scene(family, objects, seed);
                    let differs = scene.map != scene.walls || scene.later.is_some();
                    changed += u32::from(differs || !scene.obstacles.is_empty());
                    for obstacle in &scene.obstacles {
                        if let Outline::Face { from, to } = obstacle.outline {
                            assert!(room.beside_path([from, to]) > CLEARANCE);
                        }
                    }
                }
                let least = match (family, objects) {
                    (_, Objects::Nothing) => 0,
                    // Arenas and corridors seldom have room for somebody beside the path.
                    (Family::Arena | Family::Corridor, Objects::People) => 1,
                    _ => 15,
                };
                assert!(changed >= least, "{} {}: {changed}", family.name(), objects.name());
                assert!(objects != Objects::Nothing || changed == 0);
            }
        }
    }

    #[test]
    fn a_board_is_30_cm_before_a_wall_where_the_path_leaves_room() {
        let (room, scene) = scene(Family::Corner, Objects::Board, 3);
        let [Obstacle { outline: Outline::Face { from, to }, .. }] = scene.obstacles[..] else {
            panic!("{scene:?}")
        };
        let is_before = |wall| (distance(wall, [from, to]) - BEFORE_WALL).abs() < 1e-9;
        assert!(room.walls().into_iter().any(is_before));
    }

    #[test]
    fn a_split_wall_keeps_its_line_and_number() {
        let walls = [[[0.0, 0.0], [4.0, 0.0]], [[4.0, 0.0], [4.0, 3.0]]];
        let open = split(&walls, 0, [[1.0, 0.0], [2.0, 0.0]]);
        let expected =
            vec![[[0.0, 0.0], [1.0, 0.0]], [[4.0, 0.0], [4.0, 3.0]], [[2.0, 0.0], [4.0, 0.0]]];
        assert_eq!(open, expected);
    }
}
