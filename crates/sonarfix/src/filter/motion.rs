//! The motion model: how two wheel travels move the pose, and the derivatives of that movement
//! (`docs/model.md`, eqs. 3, 4, 7 and 8).
//!
//! The paper's eq. (3) moves along the heading at the start of the step. This model moves along the
//! heading in the middle of the turn, eq. (7). Both agree on a straight line and in a turn on the
//! spot; on a curve the error of a step falls from Δs Δψ/2 sideways to Δs Δψ²/24 along the path.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf::predict`](crate::filter::ekf::Ekf::predict) checks the turn and the
//! resulting covariance.

use crate::geometry::units::{Metres, PerRootMetre};
use crate::state::estimate::{FilterEstimate, wheels};

/// Travel of each wheel since the last step, from its encoder and nominal diameter. Negative is
/// backwards.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelTravel {
    /// ΔR of the paper.
    pub right: Metres,
    /// ΔL of the paper.
    pub left: Metres,
}

impl WheelTravel {
    /// A travel from metres.
    #[must_use]
    pub const fn new(right: f32, left: f32) -> Self {
        Self { right: Metres(right), left: Metres(left) }
    }

    /// Mean distance of both wheels, forwards or backwards.
    #[must_use]
    pub fn distance(self) -> Metres {
        Metres(0.5 * (self.right.0.abs() + self.left.0.abs()))
    }

    /// Whether both travels are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.right.is_finite() && self.left.is_finite()
    }
}

/// Parameters of the differential drive: track width, and the noise of eq. (9).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    /// Nominal distance between the wheels' contact points (D).
    pub track_width: Metres,
    /// White noise of the travel of each wheel, independent of the other wheel.
    pub wheel_noise: PerRootMetre<Metres>,
    /// Random walk of each scale error.
    pub scale_walk: PerRootMetre<f32>,
    /// Random walk of the track width.
    pub track_width_walk: PerRootMetre<Metres>,
}

impl Drive {
    /// Whether every parameter is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.track_width.is_finite()
            && self.wheel_noise.0.is_finite()
            && self.scale_walk.0.is_finite()
            && self.track_width_walk.0.is_finite()
    }
}

/// One odometry increment: the displacement of the pose, and its derivatives at the estimate before
/// it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearizedMotion {
    /// Sine and cosine of the mid-heading ψ + Δψ/2.
    pub(crate) sin: f32,
    pub(crate) cos: f32,
    /// Displacement of the midpoint between the wheels along map x and y, metres: Δs cos m, Δs sin m.
    pub(crate) dx: f32,
    pub(crate) dy: f32,
    /// Turn Δψ, radians.
    pub(crate) turn: f32,
    /// Derivatives of Δs with respect to the mean and the difference of the scale errors; Δs does
    /// not depend on the track width.
    pub(crate) advance_by_c: f32,
    pub(crate) advance_by_d: f32,
    /// Derivatives of Δψ with respect to the mean, the difference, and the track-width error.
    pub(crate) turn_by_c: f32,
    pub(crate) turn_by_d: f32,
    pub(crate) turn_by_w: f32,
    /// True travel per measured travel of each wheel, 1 + S.
    pub(crate) factor_right: f32,
    pub(crate) factor_left: f32,
    /// 1/W, 1/m.
    pub(crate) per_width: f32,
}

impl LinearizedMotion {
    // ===== Eqs. (7) and (8): Δs, Δψ and their derivatives =====
    /// Linearizes the motion of these travels at an estimate.
    ///
    /// `sin_cos` is called with the mid-heading.
    #[inline]
    pub fn new(
        track_width: f32,
        at: &FilterEstimate,
        travel: WheelTravel,
        sin_cos: impl FnOnce(f32) -> (f32, f32),
    ) -> Self {
        let (right, left) = (travel.right.0, travel.left.0);
        let (factor_right, factor_left) = wheels(1.0 + at.scale_common, at.scale_difference);
        let (true_right, true_left) = (right * factor_right, left * factor_left);
        let per_width = 1.0 / (track_width + at.track_width_error);
        let turn = (true_right - true_left) * per_width;
        let (sin, cos) = sin_cos(at.heading + 0.5 * turn);
        let advance = 0.5 * (true_right + true_left);
        let (mean, difference) = (0.5 * (right + left), right - left);
        Self {
            sin,
            cos,
            dx: advance * cos,
            dy: advance * sin,
            turn,
            advance_by_c: mean,
            advance_by_d: 0.25 * difference,
            turn_by_c: difference * per_width,
            turn_by_d: mean * per_width,
            turn_by_w: -turn * per_width,
            factor_right,
            factor_left,
            per_width,
        }
    }

    // ===== Eq. (4): X̂ ← f(X̂, U), with f of eq. (7) =====
    /// Moves the estimate along the displacement.
    #[inline]
    pub fn advance(&self, estimate: &mut FilterEstimate) {
        estimate.add_to_pose(self.dx, self.dy, self.turn);
    }
}
