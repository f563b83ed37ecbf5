//! Which reflectors of the map other than the target may have returned an echo: the foot on another wall,
//! a concave corner or the end of a wall, each with its own probability (`docs/model.md`, "Other
//! reflectors"). They explain an echo and do not correct the estimate: a corner or the end of a wall near
//! an unmapped object would take the object's echoes as its own.
//!
//! # Non-finite policy
//! State and walls are finite.

use crate::aim::History;
use crate::config::Config;
use crate::echo::{Others, density};
use crate::ekf::Ekf;
use crate::elementary::sqrt;
use crate::map::Map;
use crate::range::{ExpectedRange, SonarPosition};
use crate::reflector::{Beam, Reflector, Reflectors};
use crate::units::{Metres, Radians, SquareMetres};
use crate::vector::Vector;

/// A reflector beyond the measured range by more than so many deviations is no hypothesis.
const MATCH: f32 = 3.0;
/// A reflector whose direction has at least this cosine to that of the target, and its distance, is the
/// target.
const SAME_DIRECTION: f32 = 0.999;
/// The same for distances, metres.
const SAME_DISTANCE: f32 = 0.02;

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
    pub map: Map<'m>,
    pub ekf: &'a Ekf,
    pub history: &'a History,
}

impl Scene<'_, '_> {
    // ===== Eq. (25): the other reflectors, nearest first =====
    /// The reflectors other than the target that may have returned the echo.
    #[inline(never)]
    pub fn others(&self, target: &Target, bearing: Radians, range: Metres) -> Others {
        let Config { sonar, echo, .. } = self.config;
        let position = SonarPosition::new(sonar.mount, &self.ekf.state());
        let axis = Vector::of_angle(self.ekf.heading().turned(bearing).radians().0);
        let beam = Beam { from: position.point.into(), axis, range: Some(range.0) };
        let reflectors = Reflectors::new(self.map, sonar);
        let margin = MATCH * sqrt(target.variance.0);
        let (found, _) = reflectors.in_beam(&beam, range.0 + margin, margin);
        let toward = Vector::of_angle(target.expected.direction.radians().0);
        let distance = target.expected.by_range_scale;
        let is_target = |reflector: &Reflector| {
            (reflector.distance - distance).abs() < SAME_DISTANCE
                && reflector.toward.dot(toward) > SAME_DIRECTION
        };
        let mut others = Others::NONE;
        let mut silent = 1.0;
        for reflector in found.iter().filter(|reflector| !is_target(reflector)) {
            let Some(heard) = reflectors.heard(&beam, reflector) else { continue };
            let is_behind = reflector.distance > distance;
            let visible = 1.0 - echo.prior_occlusion(Metres(reflector.distance));
            let answers = visible * heard.probability(echo.heard());
            let expected =
                ExpectedRange::from_point(reflector.toward, reflector.distance, &position);
            let travelled = self.history.travelled_since(reflector.wall);
            let noise = sonar.noise.variance(expected.range).0 + echo.map_variance(travelled);
            let noise = SquareMetres(noise);
            let innovation = self.ekf.innovation(range, &expected, noise);
            let reached = if is_behind { silent * (1.0 - target.answers) } else { silent };
            others.density += answers * reached * density(innovation);
            silent *= 1.0 - answers;
            if !is_behind {
                others.silent_before = silent;
            }
        }
        others
    }
}
