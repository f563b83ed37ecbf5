//! Which reflectors of the map other than the target may have returned an echo: the foot on another wall,
//! a concave corner or the end of a wall, each with its own probability (`docs/model.md`, "Other
//! reflectors"). They explain an echo and do not correct the estimate: a corner or the end of a wall near
//! an unmapped object would take the object's echoes as its own.
//!
//! # Non-finite policy
//! State and walls are finite.

use heapless::Vec;

use crate::association::echo::{Others, density};
use crate::association::history::History;
use crate::association::reflector::{Beam, Reflector, Reflectors};
use crate::config::{Config, RangerParameters};
use crate::filter::ekf::Ekf;
use crate::geometry::elementary::sqrt;
use crate::geometry::pose::Point;
use crate::geometry::units::{Metres, Radians, SquareMetres};
use crate::geometry::vector::Vector;
use crate::map::Map;
use crate::sensor::range::{ExpectedRange, SonarPosition};

/// A reflector beyond the measured range by more than so many deviations is no hypothesis.
const MATCH: f32 = 3.0;
/// A reflector whose direction has at least this cosine to that of the target, and its distance, is the
/// target.
const SAME_DIRECTION: f32 = 0.999;
/// The same for distances, metres.
const SAME_DISTANCE: f32 = 0.02;

/// Share of the pings without an echo of the target that return one over a second wall: between an ideal sonar and one that
/// hears each (assumed).
const HEARD_OVER_TWO_WALLS: f32 = 0.3;
/// Standard deviation of its range beside the noise: of two reflections and two walls, metres (assumed).
const OVER_TWO_WALLS: f32 = 0.005;
/// Least length by which it is longer than the range of the target, metres.
const BEHIND: f32 = 0.1;

/// The target of a ping.
pub(crate) struct Target<'a> {
    pub expected: &'a ExpectedRange,
    /// Variance of its innovation.
    pub variance: SquareMetres,
    /// Probability that it answers.
    pub answers: f32,
}

/// The robot in its map.
pub(crate) struct Scene<'a, 'm> {
    pub config: &'a Config,
    pub sonar: &'a RangerParameters,
    pub map: Map<'m>,
    pub ekf: &'a Ekf,
    pub history: &'a History,
}

impl Scene<'_, '_> {
    // ===== Eq. (25): the other reflectors, nearest first =====
    /// The reflectors other than the target that may have returned the echo.
    pub fn others(&self, target: &Target, bearing: Radians, range: Metres) -> Others {
        if cfg!(feature = "reflectors") {
            self.reflectors(target, bearing, range)
        } else {
            Others::NONE
        }
    }

    #[inline(never)]
    fn reflectors(&self, target: &Target, bearing: Radians, range: Metres) -> Others {
        let (sonar, echo) = (self.sonar, &self.config.echo);
        let position = SonarPosition::new(sonar.mount, &self.ekf.state());
        let axis = Vector::of_angle(self.ekf.heading().turned(bearing).radians().0);
        let beam = Beam { from: position.point.into(), axis, range: Some(range.0) };
        let reflectors = Reflectors::new(self.map, sonar);
        let margin = MATCH * sqrt(target.variance.0);
        let mut found = Vec::new();
        reflectors.collect(&beam, range.0 + margin, margin, &mut found);
        let toward = Vector::of_angle(target.expected.direction.radians().0);
        let distance = target.expected.by_range_scale;
        let is_target = |reflector: &Reflector| {
            (reflector.distance - distance).abs() < SAME_DISTANCE
                && reflector.toward.dot(toward) > SAME_DIRECTION
        };
        let mut sum = Sum::new(target);
        for reflector in found.iter().filter(|reflector| !is_target(reflector)) {
            let Some(heard) = reflectors.heard(&beam, reflector) else { continue };
            let at = Metres(reflector.distance);
            let visible = 1.0 - self.history.clutter.prior_occlusion(echo, at);
            let answers = visible * heard.probability(echo.heard(at));
            let repetition = self.history.repetition(reflector.wall);
            let noise = echo.map_variance(reflector.accuracy) * repetition;
            let point = (reflector.toward, reflector.distance);
            let density = self.density_of(point, noise, &position, range);
            sum.add(answers, density, reflector.distance > distance);
        }
        self.add_over_two_walls(target, &position, range, &mut sum);
        sum.others
    }

    // ===== Eq. (52): the echo over the target and a wall behind the robot =====
    /// Adds the path from the target perpendicularly onto another wall and back over the target, which is heard where the target itself
    /// is not: the other wall is seen from the mirror image of the sonar in the target.
    fn add_over_two_walls(
        &self,
        target: &Target,
        position: &SonarPosition,
        range: Metres,
        sum: &mut Sum,
    ) {
        let toward = Vector::of_angle(target.expected.direction.radians().0);
        let twice = 2.0 * target.expected.by_range_scale;
        let image = position.point;
        let image = Point::new(image.x.0 + twice * toward.x, image.y.0 + twice * toward.y);
        let shortest = target.expected.range.0 + BEHIND;
        let margin = MATCH * sqrt(target.variance.0) + OVER_TWO_WALLS;
        let is_near = |path: f32| {
            let expected = position.stretch * path;
            expected > shortest && (range.0 - expected).abs() < margin
        };
        for (_, wall) in self.map.near(position.point, self.sonar.max_range) {
            let (path, along) = (wall.signed_distance(image).0.abs(), wall.along(image).0);
            if !is_near(path) || along < 0.0 || along > wall.length().0 {
                continue;
            }
            let noise = OVER_TWO_WALLS * OVER_TWO_WALLS;
            let density = self.density_of((toward, path), noise, position, range);
            sum.add(HEARD_OVER_TWO_WALLS, density, true);
        }
    }

    /// Density of an echo at `range` from a distance along a unit vector, with this variance beside the noise, m².
    #[inline(never)]
    fn density_of(
        &self,
        (toward, distance): (Vector, f32),
        variance: f32,
        position: &SonarPosition,
        range: Metres,
    ) -> f32 {
        let expected = ExpectedRange::from_point(toward, distance, position);
        let noise = SquareMetres(self.sonar.noise.variance(expected.range).0 + variance);
        density(self.ekf.innovation(range, &expected, noise))
    }
}

/// Eq. (25), reflector by reflector, nearest first.
struct Sum {
    others: Others,
    /// Probability that no other reflector so far answers, and that the target does not.
    silent: f32,
    target_silent: f32,
}

impl Sum {
    fn new(target: &Target) -> Self {
        Self { others: Others::NONE, silent: 1.0, target_silent: 1.0 - target.answers }
    }

    /// Adds a reflector that answers with a probability, and the density of its echo.
    fn add(&mut self, answers: f32, density: f32, is_behind: bool) {
        let reached = if is_behind { self.silent * self.target_silent } else { self.silent };
        self.others.density += answers * reached * density;
        self.silent *= 1.0 - answers;
        if !is_behind {
            self.others.silent_before = self.silent;
        }
    }
}

mod light;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::association::history::Origin;
    use crate::config::RangerId;
    use crate::filter::ekf::{StandardDeviations, StateEstimate};
    use crate::geometry::pose::Point;
    use crate::geometry::units::Instant;
    use crate::map::{Wall, WallId};

    proptest! {
        /// Eq. (25) in `f64`, for the foot of another wall before the target, the corner of both and the foot of a third
        /// one behind it.
        #[test]
        fn the_density_of_the_others_is_that_of_the_equation(
            (target_at, near, far) in (1.5_f32..2.5, 0.4_f32..0.9, 1.1_f32..1.5), answers in 0.1_f32..0.9,
            off in -0.1_f32..0.1, travelled in 0.05_f32..2.0, which in 0_usize..2, is_used in any::<bool>(),
            accuracy in proptest::option::of(5_u8..80),
        ) {
            // Feet at these angles from x, each on a wall of 4 cm.
            let foot = |distance: f32, degrees: f32| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let end = |along: f32| {
                    Point::new(distance * cos - along * sin, distance * sin + along * cos)
                };
                Wall::new(end(-0.02), end(0.02)).unwrap()
            };
            let distances = [target_at * near, target_at * far];
            let mut walls = [foot(target_at, 0.0), foot(distances[0], 9.0), foot(distances[1], -9.0)];
            if let Some(accuracy) = accuracy {
                walls[1] = walls[1].with_accuracy(Metres(1e-3 * f32::from(accuracy)));
            }
            let mut config = Config::for_track_width(Metres(0.2));
            config.rangers.first.cone = Radians::from_degrees(12.0);
            config.rangers.first.max_range = Metres(6.0);
            config.rangers.first.mount = Point::default();
            config.echo.map_accuracy = Metres(0.03);
            let deviation = StandardDeviations {
                x: Metres(0.08), y: Metres(0.05), heading: Radians(0.01), ..StandardDeviations::default()
            };
            let ekf = Ekf::new(config.drive, StateEstimate::default(), deviation).unwrap();
            let map = Map::new(&walls);
            let mut history = History::default();
            let now = Instant::from_ticks(0);
            let used = WallId(1);
            history.record_distance(Metres(1.7));
            if is_used {
                let entry = history.entry(&config.echo, RangerId::FIRST, used, Metres(0.02), Metres(1.0), now);
                history.record_echo(&entry, 0.1, Origin::Wall, now);
                history.record_distance(Metres(travelled));
            }
            let ratio = 2.0 / f64::from(travelled);
            let repetition = if is_used { (1.0 + ratio * ratio).sqrt() } else { 1.0 };
            prop_assert!((f64::from(history.repetition(used)) / repetition - 1.0).abs() < 1e-5);
            prop_assert_eq!(history.repetition(WallId(2)).to_bits(), 1.0_f32.to_bits());

            let position = SonarPosition::new(config.rangers.first.mount, &ekf.state());
            let expected = ExpectedRange::from_sonar(&walls[0], &position);
            // So wide that every end of a wall is within reach of the measured range.
            let target = Target { expected: &expected, variance: SquareMetres(1.0), answers };
            let range = Metres(distances[which] + off);
            let scene = Scene { config: &config, sonar: &config.rangers.first, map, ekf: &ekf, history: &history };
            let others = scene.others(&target, Radians(0.0), range);

            let wide = f64::from;
            let normal = |nu: f64, s: f64| (-0.5 * nu * nu / s).exp() / (core::f64::consts::TAU * s).sqrt();
            let (mut density, mut silent, mut before) = (0.0, 1.0, 1.0);
            let axis = Vector::of_angle(0.0);
            let beam = Beam { from: Vector::new(0.0, 0.0), axis, range: Some(range.0) };
            let reflectors = Reflectors::new(map, &config.rangers.first);
            let (found, _) = reflectors.in_beam(&beam, 9.0, 3.0);
            let mut compared = 0;
            for it in found.iter().filter(|it| it.wall != WallId(0)) {
                let Some(heard) = reflectors.heard(&beam, it) else { continue };
                let h = wide(it.distance);
                let free = wide(config.echo.free_path.0);
                let a = wide(heard.probability(config.echo.heard(Metres(it.distance)))) * (1.0 - h / (h + free));
                let (x, y) = (wide(it.toward.x), wide(it.toward.y));
                let p = (0.08 * x).powi(2) + (0.05 * y).powi(2);
                let map_error = if it.wall == used { repetition } else { 1.0 };
                let noise = &config.rangers.first.noise;
                let sonar = wide(noise.floor.0).powi(2) + (wide(noise.per_metre) * h).powi(2);
                let own = accuracy.filter(|_| it.wall == WallId(1));
                let map = own.map_or(0.03, |accuracy| 1e-3 * f64::from(accuracy));
                let s = p + sonar + map.powi(2) * map_error;
                let nu = wide(range.0) - h;
                let is_behind = h > wide(target_at);
                let reached = if is_behind { silent * (1.0 - wide(answers)) } else { silent };
                density += a * reached * (0.98 * normal(nu, s) + 0.02 * normal(nu, 9.0 * s));
                silent *= 1.0 - a;
                if !is_behind {
                    before = silent;
                }
                compared += 1;
            }
            prop_assert!(compared >= 2, "{compared}");
            prop_assert!((wide(others.density) - density).abs() < 2e-3 * density + 1e-6, "{others:?} {density}");
            prop_assert!((wide(others.silent_before) - before).abs() < 1e-4, "{others:?} {before}");
        }
    }
}
