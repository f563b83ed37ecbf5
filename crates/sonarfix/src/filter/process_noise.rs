//! The process noise Q of one odometry increment (`docs/model.md`, eq. 9).
//!
//! All of it grows with the distance travelled, never with time: a parked robot adds none.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf`](crate::filter::ekf::Ekf) checks the densities once and the resulting
//! covariance in every prediction.

use crate::filter::motion::{Drive, LinearizedMotion, WheelTravel};
use crate::geometry::elementary::sqrt;
use crate::geometry::numeric::is_valid_variance;

/// The mean NIS above which the variance of the wheels increases with each range, and the shares of the way to its limit above and
/// below. Chosen on rooms with the seeds 40000 to 40019.
const INCREASE_ABOVE: f32 = 1.5;
const INCREASE: f32 = 1.0 / 32.0;
const DECREASE: f32 = 1.0 / 2048.0;
/// The largest variance as a multiple of that of the drive: four times its deviation.
const MOST: f32 = 16.0;

/// Variance of the advance that a drive states, m²/m: `σ_w²`/4.
fn advance(drive: &Drive) -> f32 {
    0.25 * drive.wheel_noise.0.0 * drive.wheel_noise.0.0
}

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
            advance: advance(drive),
            scale_difference: square(drive.scale_walk.0),
            track_width_error: 0.5 * square(drive.track_width_walk.0.0),
        }
    }

    // ===== Eq. (58): adaptation of the noise of the wheels =====
    /// Increases the noise of the wheels while the mean NIS is too large for it, and decreases it again, never below that of the drive.
    #[inline]
    pub(crate) fn adapt(&mut self, drive: &Drive, mean_nis: f32) {
        let stated = advance(drive);
        if mean_nis > INCREASE_ABOVE {
            self.advance += INCREASE * (MOST * stated - self.advance);
        } else {
            self.advance += DECREASE * (stated - self.advance);
        }
    }

    /// The noise of the wheels as a multiple of the drive's, as deviations.
    #[must_use]
    pub(crate) fn wheel_factor(&self, drive: &Drive) -> f32 {
        sqrt(self.advance / advance(drive))
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::units::{Metres, PerRootMetre};

    const DRIVE: Drive = Drive {
        track_width: Metres(0.16),
        wheel_noise: PerRootMetre(Metres(0.001)),
        scale_walk: PerRootMetre(1e-5),
        track_width_walk: PerRootMetre(Metres(1e-5)),
    };

    proptest! {
        /// Whatever the mean NIS was, the noise is one to four times that of the drive, and follows (58) in f64.
        #[test]
        fn the_noise_is_adapted_within_its_limits(means in prop::collection::vec(0.0_f32..4.0, 1..400)) {
            let mut densities = NoiseDensities::new(&DRIVE);
            let mut variance = 1.0_f64;
            for mean in means {
                densities.adapt(&DRIVE, mean);
                variance += if mean > 1.5 { (16.0 - variance) / 32.0 } else { (1.0 - variance) / 2048.0 };
                let factor = f64::from(densities.wheel_factor(&DRIVE));
                prop_assert!((factor - variance.sqrt()).abs() < 1e-3 * factor);
                prop_assert!((0.999..4.001).contains(&factor));
            }
        }
    }

    /// A wrong file has twice its noise within eight ranges and 3.9 times within 100; a right one is used again within twenty thousand.
    #[test]
    fn the_noise_returns_to_that_of_the_drive() {
        let mut adapted = NoiseDensities::new(&DRIVE);
        (0..8).for_each(|_| adapted.adapt(&DRIVE, 1.51));
        assert!(adapted.wheel_factor(&DRIVE) > 2.0);
        (0..92).for_each(|_| adapted.adapt(&DRIVE, 1.51));
        assert!(adapted.wheel_factor(&DRIVE) > 3.9);
        (0..20_000).for_each(|_| adapted.adapt(&DRIVE, 1.5));
        assert!(adapted.wheel_factor(&DRIVE) < 1.001);
    }
}
