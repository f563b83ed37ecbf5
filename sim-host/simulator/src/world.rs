//! The acoustic model of the world and of the sonar.
//!
//! A ping can be reflected by walls (at the foot of the perpendicular), corners, edges, unmapped
//! obstacles, and over two walls. The earliest echo that is detected is reported.
//! - [`segment`], [`vertex`], [`obstacle`], [`air`], `scene`: the geometry of the world;
//! - `index`, `grid`, `wedge`: the walls near the sonar, along a line, and in the cone;
//! - [`reflector`], `sector`: the reflectors that can answer a ping (deterministic);
//! - [`sensor`]: the parameters of a sonar (deterministic);
//! - `light`: the range of a time-of-flight ranger (random);
//! - `detection`: which reflector is detected, and with what error (random).

pub mod air;
mod detection;
mod grid;
mod index;
mod light;
pub mod obstacle;
pub mod reflector;
mod scene;
mod sector;
pub mod segment;
pub mod sensor;
pub mod vertex;
mod wedge;

use rand::Rng;

use crate::angle;
use crate::random;
use reflector::{Reflector, Search, Source};
use segment::{Point, direction, distance};
use sensor::SensorModel;

pub use scene::{Ping, World};

/// A detected echo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// The reflector.
    pub source: Source,
    /// Half the path of the sound, metres: the range of a perfect sonar.
    pub distance: f64,
    /// The range that this sonar reports, metres, given the true speed of sound.
    pub range: f64,
}

impl World {
    /// All that can answer a ping of a sonar, the earliest first, whether it is detected or not.
    #[must_use]
    pub fn reflectors(&self, ping: &Ping, sensor: &SensorModel) -> Vec<Reflector> {
        Search::new(self, sensor, ping, (ping.sonar_after)(0.0)).run()
    }

    /// The echo of a ping, if one is detected. `noise` gives exactly one draw per ping, with or
    /// without an echo, so that runs stay comparable ping by ping; `rng` gives all other draws.
    pub fn echo(
        &self,
        ping: &Ping,
        sensor: &SensorModel,
        noise: &mut impl Rng,
        rng: &mut impl Rng,
    ) -> Option<Echo> {
        let normal = random::normal(noise);
        if let Some(light) = &sensor.light {
            return self.lit(ping, sensor, light, normal, rng);
        }
        let from = (ping.sonar_after)(0.0);
        let found = Search::new(self, sensor, ping, from).run();
        let first = detection::first(&found, rng);
        let scattered = self.scattered(ping, sensor, from, rng);
        // The echo of a rough surface is later than that of the foot, but may be the only one.
        let earliest = match (first, scattered) {
            (Some(first), Some(rough)) if rough.distance < first.distance => rough,
            (Some(first), _) => first,
            (None, rough) => rough?,
        };
        let detected = detection::distorted(earliest, sensor, rng);
        let range = detection::reported(detected.distance, sensor, normal);
        Some(Echo { source: detected.source, distance: earliest.distance, range })
    }

    /// The diffuse echo of the wall on the beam's axis from a sonar, from a point near the axis.
    fn scattered(
        &self,
        ping: &Ping,
        sensor: &SensorModel,
        from: Point,
        rng: &mut impl Rng,
    ) -> Option<Reflector> {
        if sensor.scatter.is_deaf() {
            return None;
        }
        let (wall, hit) = self.on_axis(from, ping.direction)?;
        let along_axis = distance(from, hit);
        let segment = self.walls.get(wall)?;
        let towards_normal = segment.normal_towards(from);
        let off = angle::wrap(ping.direction - towards_normal);
        if !detection::happens(sensor.scatter.at(along_axis, off), rng) {
            return None;
        }
        let aside = detection::scatter_angle(off, sensor, rng);
        let met = segment.hit(from, towards_normal + aside)?;
        let mut obstacles = self.obstacles_at(ping.time).iter();
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
}

#[cfg(test)]
mod exhaustive;
#[cfg(test)]
mod tests;
