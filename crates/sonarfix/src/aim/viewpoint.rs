//! Which walls can be measured from where the robot believes to be (`docs/model.md`, "Which walls
//! count"), apart from what stands before them.
//!
//! # Non-finite policy
//! Comparisons are written so that NaN leaves no slack: a wall with one cannot be measured.

use crate::config::{Config, Sonar};
use crate::ekf::{Ekf, PoseCovariance};
use crate::map::Wall;
use crate::pose::{Heading, Point};
use crate::range::ExpectedRange;
use crate::state::State;
use crate::units::Radians;

/// Standard deviations of the heading that must lie inside the cone for a look to be worth it,
/// however much confidence is asked for. 19 looks of 20 are square then, and the gate is there for
/// the other; not to look has no way back. (A first turn of 180° with a track width known to 3 %
/// leaves 5°, and three times that is more than most cones.)
pub(crate) const LEAST_CONFIDENCE: f32 = 2.0;
/// The share of the cone in which a beam counts as square then.
const LEAST_CLEAR: f32 = 0.25;

/// Why a wall cannot be measured, apart from what stands before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unfit {
    FootOffWall,
    OutOfRange,
}

/// The filter's belief, as far as aiming needs it: computed once for all walls.
pub(crate) struct Viewpoint<'a> {
    pub sonar: &'a Sonar,
    state: State,
    /// Where the sonar is, by the estimate.
    pub position: Point,
    pub heading: Heading,
    /// One standard deviation of the heading.
    heading_deviation: Radians,
    /// What of the cone is left when the heading is wrong by its uncertainty; not positive if the
    /// heading is too uncertain to look.
    clear_cone: Radians,
    /// The cone, widened by the heading's uncertainty: what may answer.
    pub wide_cone: Radians,
    confidence_squared: f32,
    covariance: PoseCovariance,
}

impl<'a> Viewpoint<'a> {
    pub fn new(config: &'a Config, ekf: &Ekf) -> Self {
        let sonar = &config.sonar;
        let confidence = config.trust.confidence;
        let state = ekf.state();
        let pose = state.pose();
        let covariance = ekf.pose_covariance();
        let sigma = Radians(libm::sqrtf(covariance.hh));
        let doubt = sigma * confidence;
        let clear = sonar.cone - doubt;
        let is_bearable = sigma * LEAST_CONFIDENCE < sonar.cone;
        let least = sonar.cone * if is_bearable { LEAST_CLEAR } else { 0.0 };
        Self {
            sonar,
            state,
            position: pose.to_map(sonar.mount),
            heading: pose.heading,
            heading_deviation: sigma,
            clear_cone: if clear > least { clear } else { least },
            wide_cone: sonar.cone + doubt,
            confidence_squared: confidence * confidence,
            covariance,
        }
    }

    /// Whether the heading is certain enough for any beam to be square.
    pub fn can_be_square(&self) -> bool {
        self.clear_cone > Radians(0.0)
    }

    /// What of the position's uncertainty a wall must bear along the direction (x, y): squared
    /// metres.
    pub fn doubt_squared(&self, x: f32, y: f32) -> f32 {
        let p = &self.covariance;
        self.confidence_squared * (p.xx * x * x + 2.0 * p.xy * x * y + p.yy * y * y)
    }

    /// The range expected of a wall, if its foot and its range are certain enough.
    pub fn expect(&self, wall: &Wall) -> Result<ExpectedRange, Unfit> {
        let along = wall.along(self.position).0;
        let to_end = smaller(along, wall.length().0 - along);
        if !holds(to_end, self.doubt_squared(wall.b(), -wall.a())) {
            return Err(Unfit::FootOffWall);
        }
        let distance = wall.signed_distance(self.position).0.abs();
        let range = (1.0 + self.state.range_scale) * distance;
        let sonar = self.sonar;
        let to_limit = smaller(range - sonar.min_range.0, sonar.max_range.0 - range);
        if !holds(to_limit, self.doubt_squared(wall.a(), wall.b())) {
            return Err(Unfit::OutOfRange);
        }
        Ok(ExpectedRange::new(wall, sonar.mount, &self.state))
    }

    /// Whether a beam that is `off` the perpendicular meets its wall squarely enough, heading
    /// uncertainty included.
    pub fn is_square(&self, off: Radians) -> bool {
        off.abs() <= self.clear_cone
    }

    /// How likely a beam that is to be `off` the perpendicular is inside the cone, by the
    /// heading's uncertainty. The farther side of the cone is taken to be as near as the nearer.
    pub fn share_inside(&self, off: Radians) -> f32 {
        let slack = (self.sonar.cone - off.abs()).0;
        // A heading known exactly would divide zero by zero at the rim.
        central_share(slack / (self.heading_deviation.0 + 1e-6))
    }
}

/// Whether `slack` metres are left when what is uncertain by the root of `doubt_squared` is wrong
/// by that.
fn holds(slack: f32, doubt_squared: f32) -> bool {
    slack > 0.0 && slack * slack >= doubt_squared
}

/// The share of a normal distribution within `sigmas` standard deviations: erf(x/√2), after
/// Abramowitz and Stegun 7.1.27, off by at most 5e-4; zero for what is not positive.
fn central_share(sigmas: f32) -> f32 {
    if sigmas > 0.0 {
        let x = sigmas * core::f32::consts::FRAC_1_SQRT_2;
        let sum = 1.0 + x * (0.278_393 + x * (0.230_389 + x * (0.000_972 + x * 0.078_108)));
        let square = sum * sum;
        1.0 - 1.0 / (square * square)
    } else {
        0.0
    }
}

/// `f32::min` treats +0 and −0 differently from build to build; a comparison does not.
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_a_normal_distribution_is_that_of_the_tables() {
        let table = [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.682_689), (2.0, 0.954_500), (3.0, 0.997_300)];
        for (sigmas, share) in table {
            assert!((central_share(sigmas) - share).abs() < 5e-4, "{sigmas}");
        }
        assert!((central_share(1e9) - 1.0).abs() < 1e-6);
    }
}
