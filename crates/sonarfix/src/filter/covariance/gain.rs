//! The gain of a measurement (`docs/model.md`, eqs. 6 and 18).

use crate::state::estimate::FilterEstimate;

/// The gain K, one number for each state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gain {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) h: f32,
    pub(super) c: f32,
    pub(super) d: f32,
    pub(super) w: f32,
    pub(super) k: f32,
    /// 1/S, 1/m².
    pub(super) per_variance: f32,
}

impl Gain {
    /// The correction of all states that has led from one estimate to another: a gain for an innovation of one.
    pub fn between(before: &FilterEstimate, after: &FilterEstimate) -> Self {
        let (x, y, h) = after.pose_since(before);
        Self {
            x,
            y,
            h,
            c: after.scale_common - before.scale_common,
            d: after.scale_difference - before.scale_difference,
            w: after.track_width_error - before.track_width_error,
            k: after.range_scale - before.range_scale,
            per_variance: 1.0,
        }
    }

    // ===== Eqs. (6) and (18): X̂ ← X̂ + K ν =====
    /// Corrects the estimate by an innovation.
    #[inline]
    pub fn correct(&self, estimate: &mut FilterEstimate, innovation: f32) {
        estimate.add_to_pose(self.x * innovation, self.y * innovation, self.h * innovation);
        estimate.scale_common += self.c * innovation;
        estimate.scale_difference += self.d * innovation;
        estimate.track_width_error += self.w * innovation;
        estimate.range_scale += self.k * innovation;
    }
}
