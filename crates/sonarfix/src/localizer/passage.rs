//! Whether the estimated path leads through a wall of the map. A robot cannot, so that the pose is wrong then.
//!
//! # Non-finite policy
//! The path consists of accepted steps. A comparison with NaN is false: no wall is passed.

use crate::filter::ekf::{Ekf, PoseCovariance};
use crate::geometry::units::Metres;
use crate::geometry::vector::Vector;
use crate::map::{Map, Wall};

/// Parts of the path that are known. A program that does not explain echoes by other walls than the one in view knows none.
const PARTS: u8 = if cfg!(feature = "reflectors") { 4 } else { 0 };
/// So many deviations of the position have to be between both ends and a wall that was passed; a part is as long. The centre of a robot
/// stays away from a wall by half its width, in addition. Chosen on the recordings `seattle`, `freiburg-079` and `ex3_guy`, and on rooms with the seeds
/// 200000 to 200011.
const DEVIATIONS: f32 = 2.5;
/// The least distance between an end and the wall, and the least length of a part, metres.
const LEAST: f32 = 0.05;

/// The latest path, as the filter predicted it: displacements in the map frame, the latest first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Path {
    parts: [Vector; PARTS as usize],
}

impl Path {
    // ===== Eq. (59): passage through a wall =====
    /// Adds a step that has led to the estimate of a filter. Returns whether the path has led through a wall of the map.
    #[inline]
    pub fn extend(&mut self, step: Vector, ekf: &Ekf, map: &Map<'_>) -> bool {
        let Some(latest) = self.parts.first_mut() else { return false };
        *latest = latest.plus(step);
        let length_squared = latest.length_squared();
        self.test(length_squared, ekf, map)
    }

    /// Tests the path, and begins another part if the square of the length of the latest one is `latest`, and that is enough.
    #[inline(never)]
    fn test(&mut self, latest: f32, ekf: &Ekf, map: &Map<'_>) -> bool {
        let (estimate, p) = (ekf.estimate(), ekf.pose_covariance());
        let at = Vector::new(estimate.x, estimate.y);
        let length_squared = limit(p.xx + p.yy);
        let length = libm::sqrtf(length_squared);
        let is_passed = map
            .near(at.into(), Metres(f32::from(PARTS) * length))
            .any(|(_, wall)| self.leads_through(&wall, at, length, &p));
        if latest >= length_squared {
            let mut before = Vector::default();
            for part in &mut self.parts {
                before = core::mem::replace(part, before);
            }
        }
        is_passed
    }

    /// Whether its ends are beside the wall, on both sides, and the place where it crosses lies on it, by `along` from the ends.
    fn leads_through(&self, wall: &Wall, end: Vector, along: f32, p: &PoseCovariance) -> bool {
        let of_end = wall.signed_distance(end.into()).0;
        let (mut point, mut distance, mut place) = (end, of_end, 0.0);
        for &part in &self.parts {
            let (later, of_later) = (point, distance);
            point = later.minus(part);
            distance = wall.signed_distance(point.into()).0;
            if distance * of_later < 0.0 {
                let share = distance / (distance - of_later);
                place = wall.along(point.plus(part.times(share)).into()).0;
            }
        }
        let (a, b) = (wall.a(), wall.b());
        let variance = a * a * p.xx + 2.0 * a * b * p.xy + b * b * p.yy;
        let across = limit(variance);
        distance * of_end < 0.0
            && distance * distance > across
            && of_end * of_end > across
            && (along..wall.length().0 - along).contains(&place)
    }
}

/// The square of a length: [`DEVIATIONS`] of this variance, and at least [`LEAST`].
fn limit(variance: f32) -> f32 {
    DEVIATIONS * DEVIATIONS * variance + LEAST * LEAST
}
