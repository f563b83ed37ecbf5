//! The world as a sonar meets it.
//!
//! A ping meets many things: feet of perpendiculars on walls, corners, edges, obstacles that no
//! map knows, ways over two walls. The earliest that is heard wins. Responsibilities, one file
//! each:
//! - [`segment`], [`vertex`], [`obstacle`], [`air`]: what there is;
//! - [`reflector`]: what of it could answer a ping (geometry, no chance);
//! - [`sensor`]: what a sonar can hear and how wrong it is (parameters, no chance);
//! - `hearing`: what is heard this time (chance).

pub mod air;
mod hearing;
pub mod obstacle;
pub mod reflector;
pub mod segment;
pub mod sensor;
pub mod vertex;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use sonarfix_map::Floor;

use crate::angle;
use obstacle::Obstacle;
use reflector::{Reflector, Search, Source};
use segment::{Point, Segment, direction, distance};
use sensor::SensorModel;
use vertex::Vertex;

/// Air of a room, °C, where a scenario does not say.
const ROOM: f64 = 20.0;

/// What a ping brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// What it came from.
    pub source: Source,
    /// Half the way of the sound, metres: what a perfect sonar would report.
    pub distance: f64,
    /// What this sonar reports, metres, if it knows the speed of sound.
    pub range: f64,
}

/// Where a ping is sent from; metres, seconds and radians, map frame.
pub struct Ping<'a> {
    /// Seconds since the run began.
    pub time: f64,
    /// Where the sonar is so many seconds after the ping: the robot moves while the sound flies.
    pub sonar_after: &'a dyn Fn(f64) -> Point,
    /// Direction of the beam's axis.
    pub direction: f64,
}

/// What is really there.
#[derive(Debug, Clone)]
pub struct World {
    walls: Vec<Segment>,
    vertices: Vec<Vertex>,
    obstacles: Vec<Obstacle>,
    /// m/s.
    speed_of_sound: f64,
}

impl World {
    /// A world of a floor's walls, in the same order, and nothing else.
    #[must_use]
    pub fn new(floor: &Floor) -> Self {
        Self::of(floor.named_walls().iter().map(|w| Segment::new(w.from(), w.to())).collect())
    }

    /// A world of walls and nothing else.
    #[must_use]
    pub fn of(walls: Vec<Segment>) -> Self {
        let vertices = vertex::all(&walls);
        Self { walls, vertices, obstacles: Vec::new(), speed_of_sound: air::speed_of_sound(ROOM) }
    }

    /// The same world with things that no map knows.
    #[must_use]
    pub fn with_obstacles(self, obstacles: Vec<Obstacle>) -> Self {
        Self { obstacles, ..self }
    }

    /// The same world in air of so many degrees Celsius.
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

    /// What a ping brings, if anything is heard. `noise` is drawn from once, whether or not an
    /// echo comes, so that runs stay comparable ping by ping; `luck` decides all the rest.
    pub fn echo(
        &self,
        ping: &Ping,
        sensor: &SensorModel,
        noise: &mut impl Rng,
        luck: &mut impl Rng,
    ) -> Option<Echo> {
        let normal = noise.sample(StandardNormal);
        let found = Search::new(self, sensor, ping).run();
        let first = hearing::first(&found, luck);
        let scattered = self.scattered(ping, sensor, luck);
        // Roughness answers later than the foot, but may be all that is heard.
        let earliest = match (first, scattered) {
            (Some(first), Some(rough)) if rough.distance < first.distance => rough,
            (Some(first), _) => first,
            (None, rough) => rough?,
        };
        let heard = hearing::distorted(earliest, sensor, luck);
        let range = hearing::reported(heard.distance, sensor, normal);
        Some(Echo { source: heard.source, distance: earliest.distance, range })
    }

    /// What the roughness of the wall on the axis sends back, from somewhere near the axis.
    fn scattered(
        &self,
        ping: &Ping,
        sensor: &SensorModel,
        luck: &mut impl Rng,
    ) -> Option<Reflector> {
        let from = (ping.sonar_after)(0.0);
        let (wall, hit) = self.on_axis(from, ping.direction)?;
        let along_axis = distance(from, hit);
        let segment = self.walls.get(wall)?;
        let towards_normal = segment.normal_towards(from);
        let off = angle::wrap(ping.direction - towards_normal);
        if !hearing::happens(sensor.scatter.at(along_axis, off), luck) {
            return None;
        }
        let aside = hearing::scatter_angle(off, sensor, luck);
        let met = segment.hit(from, towards_normal + aside)?;
        let mut obstacles = self.obstacles.iter();
        if obstacles.any(|obstacle| obstacle.outline_at(ping.time).blocks(from, met)) {
            return None;
        }
        let (distance, off_axis) =
            (distance(from, met), angle::wrap(direction(from, met) - ping.direction));
        let (nearest, farthest) = sensor.reach;
        let in_reach = distance >= nearest && distance <= farthest;
        in_reach.then_some(Reflector {
            source: Source::Wall(wall),
            distance,
            off_axis,
            audible: 1.0,
        })
    }

    /// The wall that the beam's axis meets first, and where.
    #[must_use]
    pub fn on_axis(&self, from: Point, axis: f64) -> Option<(usize, Point)> {
        let hits = self.walls.iter().enumerate();
        let hits = hits.filter_map(|(wall, segment)| Some((wall, segment.hit(from, axis)?)));
        hits.min_by(|(_, one), (_, other)| distance(from, *one).total_cmp(&distance(from, *other)))
    }
}

#[cfg(test)]
mod tests;
