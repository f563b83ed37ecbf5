//! The process noise Q of one odometry increment (`docs/model.md`, eq. 9).
//!
//! All of it grows with the distance travelled, never with time: a parked robot adds none.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf`](crate::filter::ekf::Ekf) checks the densities once and the resulting
//! covariance in every prediction.

use crate::filter::motion::{Drive, LinearizedMotion, WheelTravel};
use crate::geometry::numeric::is_valid_variance;

/// Noise of a drive, as variances per metre of the distance of both wheels together, |ΔR| + |ΔL|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseDensities {
    /// Of the advance Δs: `σ_w²`/4, m²/m.
    advance: f32,
    /// Of the difference of the scale errors: `σ_S²`, 1/m. The difference of two independent random walks has twice the variance of
    /// one, their mean half of it.
    scale_difference: f32,
    /// Of the track-width error: `σ_D²`/2, m²/m.
    track_width_error: f32,
}

impl NoiseDensities {
    /// The densities of a drive.
    #[must_use]
    pub fn new(drive: &Drive) -> Self {
        let square = |sigma: f32| sigma * sigma;
        Self {
            advance: 0.25 * square(drive.wheel_noise.0.0),
            scale_difference: square(drive.scale_walk.0),
            track_width_error: 0.5 * square(drive.track_width_walk.0.0),
        }
    }

    /// Whether every density is within the limits of a variance.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let densities = [self.advance, self.scale_difference, self.track_width_error];
        densities.into_iter().all(is_valid_variance)
    }
}

/// Random-walk process noise of the calibration, accumulated since the last update.
///
/// It is added to P with a correction and not with every prediction: the noise of one step is less
/// than the rounding of the variance that it would be added to, so it would be lost or doubled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccumulatedRandomWalk {
    pub(crate) scale_common: f32,
    pub(crate) scale_difference: f32,
    pub(crate) track_width_error: f32,
}

impl AccumulatedRandomWalk {
    /// The random walk over a distance of both wheels together, metres.
    #[inline]
    #[must_use]
    pub fn new(densities: &NoiseDensities, distance: f32) -> Self {
        let scale_difference = distance * densities.scale_difference;
        Self {
            scale_common: 0.25 * scale_difference,
            scale_difference,
            track_width_error: distance * densities.track_width_error,
        }
    }
}

/// Noise of the wheels in one increment: variances and covariance of the pair (Δs, Δψ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProcessNoise {
    pub(crate) advance: f32,
    pub(crate) turn: f32,
    pub(crate) advance_turn: f32,
}

impl ProcessNoise {
    // ===== Eq. (9): Q of the wheels, in the variables of eq. (10) =====
    /// The noise of these travels.
    #[inline]
    #[must_use]
    pub fn new(densities: &NoiseDensities, motion: &LinearizedMotion, travel: WheelTravel) -> Self {
        let LinearizedMotion { factor_right, factor_left, per_width, .. } = *motion;
        // |Δ| (1 + S)² of each wheel.
        let right = (travel.right.0 * factor_right * factor_right).abs();
        let left = (travel.left.0 * factor_left * factor_left).abs();
        let advance = densities.advance * (right + left);
        let per_half_width = per_width + per_width;
        Self {
            advance,
            turn: advance * per_half_width * per_half_width,
            advance_turn: densities.advance * (right - left) * per_half_width,
        }
    }
}
