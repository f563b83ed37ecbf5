//! What of the robot file is probably wrong, by name.
//!
//! The verdict is about the pose; a mismatch is about the robot file, and what its owner should change. It is computed when it is asked
//! for: a program that does not ask does not link it.
//!
//! # Non-finite policy
//! Health and estimate of the filter are finite. A deviation of zero, of what is not estimated, adds nothing.

use super::{DEGRADED_NIS, Health, Verdict};
use crate::config::CalibrationPrior;
use crate::geometry::units::Metres;
use crate::state::StateEstimate;

/// What of the robot file is probably wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Mismatch {
    /// The innovations are larger than the noise of the file explains: the localizer uses more than twice the noise of the wheels, or that is
    /// not enough. In the latter case the verdict is not `Tracking`, since the deviations of the pose are too small as well.
    NoiseTooSmall,
    /// Diameters of the wheels or track width are farther from the file than its deviations permit. They are estimated
    /// nevertheless, and the verdict is not changed.
    WheelsOutsidePrior,
    /// The same of the place of the first ranger in the robot.
    MountSuspect,
}

/// The noise of the wheels beyond which the file's is too small, as a multiple of it.
const MOST_NOISE: f32 = 2.0;
/// The 99 % quantiles of χ² with three degrees of freedom and with two.
const MOST_OF_THREE: f32 = 11.34;
const MOST_OF_TWO: f32 = 9.21;

impl Mismatch {
    // ===== Eq. (57) =====
    /// The mismatch by health, [noise factor](crate::localizer::Localizer::noise_factor) and calibration of a localizer whose
    /// configuration has this prior, but for the mount. The calibration is judged while the verdict is `Tracking`: one that follows
    /// wrong ranges says nothing about the wheels.
    #[must_use]
    pub fn of(
        health: &Health,
        noise_factor: f32,
        state: &StateEstimate,
        prior: &CalibrationPrior,
    ) -> Option<Self> {
        if health.nis > DEGRADED_NIS || noise_factor > MOST_NOISE {
            return Some(Self::NoiseTooSmall);
        }
        let is_tracking = health.verdict == Verdict::Tracking;
        let is_outside = is_tracking && wheels_distance(state, prior) > MOST_OF_THREE;
        is_outside.then_some(Self::WheelsOutsidePrior)
    }

    /// The mismatch by the square of the distance, m², from the mount of the file to the estimated one; `deviation` is that of each
    /// coordinate of the file's.
    pub(crate) fn of_mount(health: &Health, square: f32, deviation: Metres) -> Option<Self> {
        let distance = over(square, deviation.0 * deviation.0);
        let is_outside = health.verdict == Verdict::Tracking && distance > MOST_OF_TWO;
        is_outside.then_some(Self::MountSuspect)
    }
}

impl core::fmt::Display for Mismatch {
    /// The name, what it means, and what to do.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoiseTooSmall => {
                "NoiseTooSmall: ranges are off by more than the noise explains; increase that of the wheels, or of the ranger"
            }
            Self::WheelsOutsidePrior => {
                "WheelsOutsidePrior: diameters or track width are wrong by more than their deviations; measure them, or calibrate"
            }
            Self::MountSuspect => {
                "MountSuspect: the ranger is not where the robot file has it; measure its place, or calibrate"
            }
        })
    }
}

/// x̂ᵀ P₀⁻¹ x̂ of both scale errors and of the track width. The filter moves an estimate no farther from the prior than the ranges
/// require, cov x̂ = P₀ − P: it is at most χ² distributed if the prior is right, however uncertain the estimate is.
fn wheels_distance(state: &StateEstimate, prior: &CalibrationPrior) -> f32 {
    let (right, left) = (prior.scale_right, prior.scale_left);
    let (r, l) = (state.scale_right, state.scale_left);
    let (product, apart) = (right * left, right - left);
    let difference = prior.difference_of(right, left);
    let difference = difference.map_or(right * right + left * left, |it| it * it);
    // The product less the covariance of both scale errors, without cancellation.
    let margin = 0.5 * (difference - apart * apart);
    let across = left * r - right * l;
    let scales = over(across * across + 2.0 * margin * r * l, margin * (2.0 * product - margin));
    let width = state.track_width_error.0;
    scales + over(width * width, prior.track_width.0 * prior.track_width.0)
}

fn over(square: f32, variance: f32) -> f32 {
    if variance > 0.0 { square / variance } else { 0.0 }
}

#[cfg(test)]
mod tests;
