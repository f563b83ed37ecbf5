//! The reflectors that can answer a ping, detected or not.

use serde::Serialize;

use super::obstacle::Outline;
use super::scene::{Ping, World};
use super::sector::Sector;
use super::segment::{Point, Segment, direction, distance};
use super::sensor::SensorModel;
use super::vertex::Shape;
use super::wedge::Wedge;
use crate::angle;

/// The source of an echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A wall, by its index in the floor.
    Wall(usize),
    /// A corner of two walls.
    Corner,
    /// An edge, or a free end of a wall.
    Edge,
    /// An unmapped obstacle.
    Obstacle,
    /// Two walls in turn.
    DoubleBounce,
    /// No reflector: an outlier.
    Outlier,
}

/// A reflector of one ping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflector {
    /// Its kind.
    pub source: Source,
    /// Half the path of the sound, metres.
    pub distance: f64,
    /// Angle between the beam's axis and the leaving sound, radians.
    pub off_axis: f64,
    /// Probability of detection.
    pub audible: f64,
}

/// Fixed-point iterations for the time of flight. Two give a tenth of a microsecond: a robot moves
/// at 0.4 m/s, 1/860 of the speed of sound, and each iteration gains that factor.
const FLIGHT_ROUNDS: usize = 2;

/// A reflector within reach at the end of the flight is at most this many times as far away at the ping, as long as the
/// robot is slower than a quarter of the speed of sound.
const MOTION: f64 = 1.5;

/// Share of the way to an obstacle up to which it does not occlude itself.
const BEFORE: f64 = 1.0 - 1e-6;

/// The search for the reflectors of one ping.
pub(super) struct Search<'a> {
    world: &'a World,
    sensor: &'a SensorModel,
    ping: &'a Ping<'a>,
    obstacles: Vec<Outline>,
    from: Point,
    /// Farthest place of a reflector within reach, metres.
    radius: f64,
    /// Walls within that distance, and others, in the order of the map.
    near: Vec<usize>,
    cone: Wedge,
}

impl<'a> Search<'a> {
    /// The search for a ping from this place.
    pub fn new(world: &'a World, sensor: &'a SensorModel, ping: &'a Ping<'a>, from: Point) -> Self {
        let obstacles = world.obstacles_at(ping.time).iter();
        let obstacles = obstacles.map(|obstacle| obstacle.outline_at(ping.time)).collect();
        let radius = MOTION * sensor.reach.1;
        let near = world.walls_index.near(from, radius);
        let cone = Wedge::new(from, ping.direction, sensor.cone);
        Self { world, sensor, ping, obstacles, from, radius, near, cone }
    }

    /// All reflectors, the earliest first; ties in the order of the map.
    pub fn run(&self) -> Vec<Reflector> {
        let mut found: Vec<Reflector> = match self.sensor.sector {
            Some(half) => self.in_sector(half),
            None => self.walls().chain(self.obstacles()).collect(),
        };
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
        self.near_walls().filter_map(|(wall, segment)| {
            let (foot, _) = segment.foot(self.from)?;
            let half_way = |to| segment.half_way_over(self.from, to);
            self.reflector_at(Source::Wall(wall), foot, 1.0, half_way, &[wall])
        })
    }

    /// The nearest points of walls and obstacles in the sector of a sonar that hears them at any angle.
    fn in_sector(&self, half: f64) -> Vec<Reflector> {
        let sector = Sector { from: self.from, axis: self.ping.direction, half };
        let walls = self.near_walls().filter_map(|(wall, segment)| {
            self.answer(Source::Wall(wall), sector.nearest_of(segment)?, &[wall])
        });
        let obstacles = self
            .obstacles
            .iter()
            .filter_map(|outline| self.answer(Source::Obstacle, sector.nearest(outline)?, &[]));
        walls.chain(obstacles).collect()
    }

    /// The echo of a point at an angle between axis and normal, if it is within reach and not occluded.
    fn answer(&self, source: Source, (at, off): (Point, f64), own: &[usize]) -> Option<Reflector> {
        let distance = self.flown(|to| half_way_by(self.from, at, to));
        let (nearest, farthest) = self.sensor.reach;
        let audible = self.sensor.mirror.at(distance, off);
        let is_in_reach = distance >= nearest && distance <= farthest;
        let before = towards(self.from, at, BEFORE);
        let off_axis = angle::wrap(direction(self.from, at) - self.ping.direction);
        (is_in_reach && audible > 0.0 && !self.is_hidden(self.from, before, own))
            .then_some(Reflector { source, distance, off_axis, audible })
    }

    fn near_walls(&self) -> impl Iterator<Item = (usize, &'a Segment)> {
        self.near.iter().filter_map(|&wall| Some((wall, self.world.walls.get(wall)?)))
    }

    fn vertices(&self) -> impl Iterator<Item = Reflector> {
        let near = self.world.vertices_index.near(self.from, self.radius).into_iter();
        let near = near.filter_map(|vertex| self.world.vertices.get(vertex));
        let visible = near.filter(|vertex| !self.cone.is_beside(&[vertex.at]));
        visible.filter_map(|vertex| {
            let (source, strength) = match vertex.shape_from(self.from)? {
                Shape::Corner => (Source::Corner, self.sensor.corner),
                Shape::Edge => (Source::Edge, self.sensor.edge),
            };
            let half_way = |to| half_way_by(self.from, vertex.at, to);
            self.reflector_at(source, vertex.at, strength, half_way, &vertex.walls)
        })
    }

    fn obstacles(&self) -> impl Iterator<Item = Reflector> {
        self.obstacles.iter().filter_map(|outline| {
            let near = outline.nearest(self.from);
            let strength = if outline.faces(self.from) { 1.0 } else { self.sensor.edge };
            let before = towards(self.from, near, BEFORE);
            let half_way = |to| half_way_by(self.from, near, to);
            self.reflector_at(Source::Obstacle, before, strength, half_way, &[])
        })
    }

    /// Over a first wall in the cone onto a second one: the whole path is within reach, so both are near.
    fn double_bounces(&self) -> impl Iterator<Item = Reflector> {
        let firsts = self.near_walls().filter(|(_, mirror)| !self.cone.is_beside(&mirror.ends()));
        firsts.flat_map(move |(first, mirror)| {
            let image = mirror.mirror(self.from);
            let nexts = self.near_walls().filter(move |&(next, _)| next != first);
            nexts.filter_map(move |(next, target)| {
                self.double_bounce((first, mirror), (next, target), image)
            })
        })
    }

    /// The path over one wall, perpendicularly onto another, and back over the first: the second
    /// wall is seen from the mirror image of the sonar in the first.
    fn double_bounce(
        &self,
        (first, mirror): (usize, &Segment),
        (next, target): (usize, &Segment),
        image: Point,
    ) -> Option<Reflector> {
        let (foot, path) = target.foot(image)?;
        if path > self.radius {
            return None;
        }
        let turning = mirror.crossing(image, foot)?;
        if self.cone.is_beside(&[turning]) || self.is_hidden(turning, foot, &[first, next]) {
            return None;
        }
        let half_way = |to| target.half_way_over(image, mirror.mirror(to));
        let strength = self.sensor.double_bounce;
        self.reflector_at(Source::DoubleBounce, turning, strength, half_way, &[first])
    }

    /// The reflector at `turning`, the first point of reflection, if it is within reach, inside the
    /// cone and not occluded by walls other than `own`.
    fn reflector_at(
        &self,
        source: Source,
        turning: Point,
        strength: f64,
        half_way: impl Fn(Point) -> f64,
        own: &[usize],
    ) -> Option<Reflector> {
        if self.cone.is_beside(&[turning]) {
            return None;
        }
        let off_axis = angle::wrap(direction(self.from, turning) - self.ping.direction);
        if off_axis.abs() > self.sensor.cone {
            return None;
        }
        let distance = self.flown(half_way);
        let (nearest, farthest) = self.sensor.reach;
        let is_in_reach = distance >= nearest && distance <= farthest;
        if !is_in_reach {
            return None;
        }
        let audible = strength * self.sensor.mirror.at(distance, off_axis);
        let is_detectable = audible > 0.0 && !self.is_hidden(self.from, turning, own);
        is_detectable.then_some(Reflector { source, distance, off_axis, audible })
    }

    /// Half the path of a sound that returns to the sonar's position at the time of arrival.
    fn flown(&self, half_way: impl Fn(Point) -> f64) -> f64 {
        let mut distance = half_way(self.from);
        for _ in 0..FLIGHT_ROUNDS {
            let flight = 2.0 * distance / self.world.speed_of_sound;
            distance = half_way((self.ping.sonar_after)(flight));
        }
        distance
    }

    fn is_hidden(&self, from: Point, to: Point, own: &[usize]) -> bool {
        let hides = |wall: usize| {
            let segment = self.world.walls.get(wall).filter(|_| !own.contains(&wall));
            segment.is_some_and(|segment| segment.crossing(from, to).is_some())
        };
        self.world.walls_index.along(from, to).any(hides)
            || self.obstacles.iter().any(|outline| outline.blocks(from, to))
    }
}

fn towards(from: Point, to: Point, share: f64) -> Point {
    [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
}

fn half_way_by(from: Point, by: Point, to: Point) -> f64 {
    0.5 * (distance(from, by) + distance(by, to))
}
