//! What a look is worth, computed from P alone, without trying the correction (`docs/model.md`,
//! eq. 16).
//!
//! # Non-finite policy
//! None of its own: what comes of a covariance that is sound is finite, and the choice is written so
//! that NaN would be worth nothing.

use crate::config::Weights;
use crate::ekf::Prospect;
use crate::units::SquareMetres;

/// By how much the weighted sum of variances would drop.
pub(super) fn gain(prospect: &Prospect, weights: Weights) -> SquareMetres {
    let m = &prospect.with_pose;
    let (c, d) = prospect.with_wheels;
    let (lever, way) = (weights.heading.0, weights.wheels.0);
    let position = m.x * m.x + m.y * m.y;
    let heading = lever * lever * m.h * m.h;
    // The mean over both wheels: c is the common part of their scale errors, d the difference.
    let wheels = way * way * (c * c + 0.25 * d * d);
    SquareMetres((position + heading + wheels) / prospect.variance)
}
