//! Expected information gain of a range (`docs/model.md`, eq. 21).
//!
//! # Non-finite policy
//! The result of a valid covariance is finite; the planner never chooses a wall with a NaN.

use crate::config::Weights;
use crate::filter::covariance::PredictedMeasurement;
use crate::geometry::units::SquareMetres;

// ===== Eq. (21): expected decrease of the weighted variances =====
/// The decrease of the weighted sum of variances by a range with noise variance `noise`.
///
/// `wheels`: covariance of the range with the mean and the difference of the scale errors; `None` if only the position has a weight.
pub(super) fn expected_gain(
    prediction: &PredictedMeasurement,
    wheels: Option<(f32, f32)>,
    noise: SquareMetres,
    weights: Weights,
) -> SquareMetres {
    let m = &prediction.cross_covariance;
    let position = m.x * m.x + m.y * m.y;
    let variance = noise.0 + prediction.variance;
    let Some((c, d)) = wheels else {
        // The other terms are zero.
        return SquareMetres(position / variance);
    };
    let (lever, distance) = (weights.heading.0, weights.wheels.0);
    let heading = lever * lever * m.h * m.h;
    // The mean over both wheels: c is the mean of their scale errors, d the difference.
    let wheels = distance * distance * (c * c + 0.25 * d * d);
    SquareMetres((position + heading + wheels) / variance)
}
