//! Everything that could answer a ping, whether it is heard or not.

use serde::Serialize;

use super::obstacle::Outline;
use super::segment::{Point, direction, distance};
use super::sensor::SensorModel;
use super::vertex::Shape;
use super::{Ping, World};
use crate::angle;

/// What an echo came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A wall, by its index in the floor.
    Wall(usize),
    /// A corner of two walls.
    Corner,
    /// An edge, or a free end of a wall.
    Edge,
    /// Something that no map knows.
    Obstacle,
    /// Two walls, one after the other.
    DoubleBounce,
    /// Nothing that is there.
    Outlier,
}

/// Something that could answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflector {
    /// What it is.
    pub source: Source,
    /// Half the way of the sound, metres.
    pub distance: f64,
    /// Direction in which the sound leaves, off the beam's axis, radians.
    pub off_axis: f64,
    /// Probability that it is heard.
    pub audible: f64,
}

/// Two rounds find the time of flight to a tenth of a microsecond: a robot at 0.4 m/s moves
/// 1/860 of what sound does, and each round gains that factor.
const FLIGHT_ROUNDS: usize = 2;

/// What one ping of one sensor could hear.
pub(super) struct Search<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    ping: &'a Ping<'a>,
    obstacles: Vec<Outline>,
    from: Point,
}

impl<'a> Search<'a> {
    pub fn new(world: &'a World, sensor: &'a SensorModel, ping: &'a Ping<'a>) -> Self {
        let obstacles = world.obstacles.iter().map(|o| o.outline_at(ping.time)).collect();
        let from = (ping.sonar_after)(0.0);
        Self { world, sensor, ping, obstacles, from }
    }

    /// Everything that could be heard, the earliest first; of equals the first in the map.
    pub fn run(&self) -> Vec<Reflector> {
        let mut found: Vec<Reflector> = self.walls().chain(self.obstacles()).collect();
        if self.sensor.corner > 0.0 || self.sensor.edge > 0.0 {
            found.extend(self.vertices());
        }
        if self.sensor.double_bounce > 0.0 {
            found.extend(self.double_bounces());
        }
        found.sort_by(|one, other| one.distance.total_cmp(&other.distance));
        found
    }

    fn walls(&self) -> impl Iterator<Item = Reflector> {
        self.world.walls.iter().enumerate().filter_map(|(wall, segment)| {
            let (foot, _) = segment.foot(self.from)?;
            let half_way = |to| segment.half_way_over(self.from, to);
            self.heard(Source::Wall(wall), foot, 1.0, half_way, &[wall])
        })
    }

    fn vertices(&self) -> impl Iterator<Item = Reflector> {
        self.world.vertices.iter().filter_map(|vertex| {
            let (source, strength) = match vertex.shape_from(self.from)? {
                Shape::Corner => (Source::Corner, self.sensor.corner),
                Shape::Edge => (Source::Edge, self.sensor.edge),
            };
            let half_way = |to| half_way_by(self.from, vertex.at, to);
            self.heard(source, vertex.at, strength, half_way, &vertex.walls)
        })
    }

    fn obstacles(&self) -> impl Iterator<Item = Reflector> {
        self.obstacles.iter().filter_map(|outline| {
            let near = outline.nearest(self.from);
            let strength = if outline.faces(self.from) { 1.0 } else { self.sensor.edge };
            // A hair before its surface, where it does not stand in its own way.
            let before = towards(self.from, near, 1.0 - 1e-6);
            let half_way = |to| half_way_by(self.from, near, to);
            self.heard(Source::Obstacle, before, strength, half_way, &[])
        })
    }

    fn double_bounces(&self) -> impl Iterator<Item = Reflector> {
        let walls = 0..self.world.walls.len();
        let pairs =
            walls.clone().flat_map(move |first| walls.clone().map(move |next| (first, next)));
        pairs.filter_map(|(first, next)| self.double_bounce(first, next))
    }

    /// Over one wall, squarely onto another, and back over the first: the second is seen from
    /// where the first mirrors the sonar to.
    fn double_bounce(&self, first: usize, next: usize) -> Option<Reflector> {
        let (mirror, target) = (self.world.walls.get(first)?, self.world.walls.get(next)?);
        let image = mirror.mirror(self.from);
        let (foot, _) = target.foot(image).filter(|_| first != next)?;
        let turning = mirror.crossing(image, foot)?;
        if self.is_hidden(turning, foot, &[first, next]) {
            return None;
        }
        let half_way = |to| target.half_way_over(image, mirror.mirror(to));
        let strength = self.sensor.double_bounce;
        self.heard(Source::DoubleBounce, turning, strength, half_way, &[first])
    }

    /// What answers from `turning`, at which the sound first meets something, if it is within
    /// reach, in the cone and not hidden by other walls than `own`.
    fn heard(
        &self,
        source: Source,
        turning: Point,
        strength: f64,
        half_way: impl Fn(Point) -> f64,
        own: &[usize],
    ) -> Option<Reflector> {
        let off_axis = angle::wrap(direction(self.from, turning) - self.ping.direction);
        if off_axis.abs() > self.sensor.cone {
            return None;
        }
        let distance = self.flown(half_way);
        let (nearest, farthest) = self.sensor.reach;
        let in_reach = distance >= nearest && distance <= farthest;
        let audible = strength * self.sensor.mirror.at(distance, off_axis);
        let is_heard = in_reach && audible > 0.0 && !self.is_hidden(self.from, turning, own);
        is_heard.then_some(Reflector { source, distance, off_axis, audible })
    }

    /// Half the way of a sound that comes back to where the sonar then is.
    fn flown(&self, half_way: impl Fn(Point) -> f64) -> f64 {
        let mut distance = half_way(self.from);
        for _ in 0..FLIGHT_ROUNDS {
            let flight = 2.0 * distance / self.world.speed_of_sound;
            distance = half_way((self.ping.sonar_after)(flight));
        }
        distance
    }

    fn is_hidden(&self, from: Point, to: Point, own: &[usize]) -> bool {
        let mut walls = self.world.walls.iter().enumerate();
        walls.any(|(wall, segment)| !own.contains(&wall) && segment.crossing(from, to).is_some())
            || self.obstacles.iter().any(|outline| outline.blocks(from, to))
    }
}

fn towards(from: Point, to: Point, share: f64) -> Point {
    [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
}

fn half_way_by(from: Point, by: Point, to: Point) -> f64 {
    0.5 * (distance(from, by) + distance(by, to))
}
