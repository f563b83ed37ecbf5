//! The range of a time-of-flight ranger: light returns along a bundle of rays, and the ranger reports the mean of the
//! nearest surfaces that return enough of it.
//!
//! Nothing of it is sound: there is no foot of a perpendicular, no mirror, no echo over two walls and no influence of the
//! air. A matt surface returns light as the cosine of the incidence and the inverse square of the distance (Lambert).

use rand::Rng;

use super::Echo;
use super::detection::{self, happens};
use super::obstacle::Outline;
use super::reflector::{Reflector, Source};
use super::scene::{Ping, World};
use super::segment::{Point, distance};
use super::sensor::{LightModel, SensorModel};
use crate::{angle, random};

/// Rays to either side of the axis.
const RAYS: i32 = 4;
/// Surfaces within this distance of the nearest one are one target: the length of a pulse of light, metres. Chosen.
const PULSE: f64 = 0.3;
/// Share of all light from which a target is reported. Chosen.
const LEAST_SHARE: f64 = 0.15;
/// How far behind a pane of glass, metres: no further than that the light on both sides is that of one ray.
const BEHIND: f64 = 1e-3;

/// The return of one ray.
#[derive(Debug, Clone, Copy)]
struct Return {
    distance: f64,
    cosine: f64,
    /// Light, relative to that of a ray on the axis that meets a wall squarely at a metre.
    light: f64,
    source: Source,
}

impl World {
    /// The range of a time-of-flight ranger; `normal` is a standard normal draw for its noise.
    pub(super) fn lit(
        &self,
        ping: &Ping,
        sensor: &SensorModel,
        light: &LightModel,
        normal: f64,
        rng: &mut impl Rng,
    ) -> Option<Echo> {
        let from = (ping.sonar_after)(0.0);
        let axis = angle::wrap(ping.direction + light.pointing * random::normal(rng));
        let target = self.target(from, axis, light, ping.time)?;
        if happens(light.absorbed, rng) {
            return None;
        }
        let target = if happens(light.through, rng) {
            let (sin, cos) = libm::sincos(axis);
            let along = target.distance + BEHIND;
            let behind = [from[0] + along * cos, from[1] + along * sin];
            let next = self.target(behind, axis, light, ping.time)?;
            Return { distance: along + next.distance, ..next }
        } else {
            target
        };
        let (nearest, farthest) = sensor.reach;
        if target.distance < nearest || target.distance > farthest {
            return None;
        }
        // A wall at an angle is as bright as a white one farther away.
        let as_far_as = target.distance / libm::sqrt(target.cosine.max(0.01));
        if !happens(sensor.mirror.share.at(as_far_as), rng) {
            return None;
        }
        let Return { source, distance, .. } = target;
        let reflector = Reflector { source, distance, off_axis: 0.0, audible: 1.0 };
        let detected = detection::distorted(reflector, sensor, rng);
        let range = detection::reported(detected.distance, sensor, normal);
        Some(Echo { source: detected.source, distance, range })
    }

    /// What the ranger reports without noise: the mean of the nearest surfaces with enough light.
    fn target(&self, from: Point, axis: f64, light: &LightModel, time: f64) -> Option<Return> {
        let outlines: Vec<Outline> =
            self.obstacles_at(time).iter().map(|obstacle| obstacle.outline_at(time)).collect();
        if light.half_view <= 0.0 {
            return self.met(from, axis, 1.0, &outlines);
        }
        let view = light.half_view;
        let mut returns: Vec<Return> = rays(view)
            .filter_map(|(off, profile)| self.met(from, axis + off, profile, &outlines))
            .collect();
        returns.sort_by(|one, other| one.distance.total_cmp(&other.distance));
        let all: f64 = returns.iter().map(|ray| ray.light).sum();
        let mut rest = returns.as_slice();
        while let Some(first) = rest.first() {
            let count = rest.partition_point(|ray| ray.distance <= first.distance + PULSE);
            let (group, beyond) = rest.split_at(count);
            let light: f64 = group.iter().map(|ray| ray.light).sum();
            if light >= LEAST_SHARE * all {
                return merged(group, light).map(|it| it.calibrated(view));
            }
            rest = beyond;
        }
        None
    }

    /// What a ray meets first.
    fn met(&self, from: Point, axis: f64, profile: f64, outlines: &[Outline]) -> Option<Return> {
        let wall = self.on_axis(from, axis).and_then(|(wall, at)| {
            let segment = self.walls.get(wall)?;
            let incidence = angle::wrap(axis - segment.normal_towards(from));
            Some((Source::Wall(wall), distance(from, at), libm::cos(incidence)))
        });
        let obstacles = outlines.iter().filter_map(|outline| {
            let (at, cosine) = outline.met(from, axis)?;
            Some((Source::Obstacle, at, cosine))
        });
        let nearest =
            wall.into_iter().chain(obstacles).min_by(|one, other| one.1.total_cmp(&other.1));
        let (source, distance, cosine) = nearest?;
        let cosine = cosine.abs();
        let light = profile * cosine / (distance * distance).max(1e-6);
        Some(Return { distance, cosine, light, source })
    }
}

/// The rays of a field of view of which this is the half: angle off the axis, and light relative to that of the axis.
fn rays(half_view: f64) -> impl Iterator<Item = (f64, f64)> {
    (-RAYS..=RAYS).map(move |number| {
        let share = f64::from(number) / f64::from(RAYS);
        // The edge of the field of view is at two deviations.
        (share * half_view, libm::exp(-2.0 * share * share))
    })
}

impl Return {
    /// As its maker has calibrated the sensor: the mean over a square wall is its distance.
    fn calibrated(self, half_view: f64) -> Self {
        let (mut sum, mut light) = (0.0, 0.0);
        for (off, profile) in rays(half_view) {
            let cosine = libm::cos(off);
            let returned = profile * cosine * cosine * cosine;
            sum += returned / cosine;
            light += returned;
        }
        Self { distance: self.distance * light / sum, ..self }
    }
}

/// The mean of returns, by their light; its source is that of the brightest.
fn merged(group: &[Return], light: f64) -> Option<Return> {
    let brightest = group.iter().max_by(|one, other| one.light.total_cmp(&other.light))?;
    let mean =
        |of: fn(&Return) -> f64| group.iter().map(|ray| ray.light * of(ray)).sum::<f64>() / light;
    Some(Return {
        distance: mean(|ray| ray.distance),
        cosine: mean(|ray| ray.cosine),
        light,
        ..*brightest
    })
}

#[cfg(test)]
mod tests;
