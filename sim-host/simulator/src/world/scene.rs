//! The scene: walls, obstacles, air, and a ping in it.

use sonarfix_map::Floor;

use super::air;
use super::index::Index;
use super::obstacle::Obstacle;
use super::segment::{Point, Segment, distance};
use super::vertex::{self, Vertex};

/// Default air temperature, °C.
const ROOM: f64 = 20.0;

/// Length of the beam in which the first wall on its axis is looked for at first, metres; then four times as far, up to the last.
const FIRST_REACH: f64 = 4.0;
const LAST_REACH: f64 = 1e6;

/// A ping; metres, seconds and radians, map frame.
pub struct Ping<'a> {
    /// Seconds since the run began.
    pub time: f64,
    /// Position of the sonar a number of seconds after the ping: the robot moves during the flight.
    pub sonar_after: &'a dyn Fn(f64) -> Point,
    /// Direction of the beam's axis.
    pub direction: f64,
}

/// The true world.
#[derive(Debug, Clone)]
pub struct World {
    pub(super) walls: Vec<Segment>,
    pub(super) vertices: Vec<Vertex>,
    pub(super) walls_index: Index,
    pub(super) vertices_index: Index,
    pub(super) obstacles: Vec<Obstacle>,
    /// The obstacles from a time on, seconds since the run began, if they change.
    rearranged: Option<(f64, Vec<Obstacle>)>,
    /// m/s.
    pub(super) speed_of_sound: f64,
}

impl World {
    /// A world with the walls of a floor, in the same order.
    #[must_use]
    pub fn new(floor: &Floor) -> Self {
        Self::of(floor.named_walls().iter().map(|w| Segment::new(w.from(), w.to())).collect())
    }

    /// A world with these walls.
    #[must_use]
    pub fn of(walls: Vec<Segment>) -> Self {
        let ends: Vec<_> = walls.iter().map(Segment::ends).map(|[from, to]| (from, to)).collect();
        let walls_index = Index::new(&ends);
        let vertices = vertex::all(&walls, &walls_index);
        let places: Vec<_> = vertices.iter().map(|vertex| (vertex.at, vertex.at)).collect();
        let vertices_index = Index::new(&places);
        let speed_of_sound = air::speed_of_sound(ROOM);
        Self {
            walls,
            vertices,
            walls_index,
            vertices_index,
            obstacles: Vec::new(),
            rearranged: None,
            speed_of_sound,
        }
    }

    /// The same world with unmapped obstacles.
    #[must_use]
    pub fn with_obstacles(self, obstacles: Vec<Obstacle>) -> Self {
        Self { obstacles, ..self }
    }

    /// The same world with other obstacles from a time on, seconds since the run began: a box that somebody has moved, a door
    /// that somebody has opened.
    #[must_use]
    pub fn rearranged(self, from: f64, obstacles: Vec<Obstacle>) -> Self {
        Self { rearranged: Some((from, obstacles)), ..self }
    }

    /// The same world at another air temperature.
    #[must_use]
    pub fn at_temperature(self, celsius: f64) -> Self {
        Self { speed_of_sound: air::speed_of_sound(celsius), ..self }
    }

    /// The walls, in their order.
    #[must_use]
    pub fn walls(&self) -> &[Segment] {
        &self.walls
    }

    /// The points where walls meet or end.
    #[must_use]
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// The unmapped obstacles at a time, seconds since the run began.
    #[must_use]
    pub fn obstacles_at(&self, time: f64) -> &[Obstacle] {
        match &self.rearranged {
            Some((from, obstacles)) if time >= *from => obstacles,
            _ => &self.obstacles,
        }
    }

    /// The unmapped obstacles at the start.
    #[must_use]
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// Speed of sound, m/s.
    #[must_use]
    pub fn speed_of_sound(&self) -> f64 {
        self.speed_of_sound
    }

    /// The first wall on the beam's axis, and the point of intersection.
    #[must_use]
    pub fn on_axis(&self, from: Point, axis: f64) -> Option<(usize, Point)> {
        let (sin, cos) = libm::sincos(axis);
        let mut reach = FIRST_REACH;
        loop {
            let end = [from[0] + reach * cos, from[1] + reach * sin];
            let nearest = self.nearest_hit(from, axis, end);
            // A wall that the index did not return is hit beyond `end`.
            let found = nearest.filter(|&(_, hit)| distance(from, hit) < 0.999 * reach);
            if found.is_some() || reach > LAST_REACH || self.walls_index.is_within(from, reach) {
                return nearest;
            }
            reach *= 4.0;
        }
    }

    /// The nearest intersection of the beam's axis with the walls along it up to `end`, and others; of two equally near
    /// ones the first in the map.
    fn nearest_hit(&self, from: Point, axis: f64, end: Point) -> Option<(usize, Point)> {
        let walls = self.walls_index.along(from, end);
        let hits = walls.filter_map(|wall| Some((wall, self.walls.get(wall)?.hit(from, axis)?)));
        hits.min_by(|(wall, one), (other_wall, other)| {
            let nearer = distance(from, *one).total_cmp(&distance(from, *other));
            nearer.then(wall.cmp(other_wall))
        })
    }
}
