//! The scene: walls, obstacles, air, and a ping in it.

use sonarfix_map::Floor;

use super::air;
use super::obstacle::Obstacle;
use super::segment::{Point, Segment, distance};
use super::vertex::{self, Vertex};

/// Default air temperature, °C.
const ROOM: f64 = 20.0;

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
    pub(super) obstacles: Vec<Obstacle>,
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
        let vertices = vertex::all(&walls);
        Self { walls, vertices, obstacles: Vec::new(), speed_of_sound: air::speed_of_sound(ROOM) }
    }

    /// The same world with unmapped obstacles.
    #[must_use]
    pub fn with_obstacles(self, obstacles: Vec<Obstacle>) -> Self {
        Self { obstacles, ..self }
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

    /// Speed of sound, m/s.
    #[must_use]
    pub fn speed_of_sound(&self) -> f64 {
        self.speed_of_sound
    }

    /// The first wall on the beam's axis, and the point of intersection.
    #[must_use]
    pub fn on_axis(&self, from: Point, axis: f64) -> Option<(usize, Point)> {
        let hits = self.walls.iter().enumerate();
        let hits = hits.filter_map(|(wall, segment)| Some((wall, segment.hit(from, axis)?)));
        hits.min_by(|(_, one), (_, other)| distance(from, *one).total_cmp(&distance(from, *other)))
    }
}
