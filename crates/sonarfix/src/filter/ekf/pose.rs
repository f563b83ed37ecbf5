//! Uncertainty of the pose, as other modules read and change it.

use crate::geometry::numeric::at_most_max_variance;
use crate::geometry::units::{Metres, Radians};

/// Covariance of the position, m², and variance of the heading, rad².
pub(crate) struct PoseCovariance {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub hh: f32,
}

/// Variances of x and y, m², and of the heading, rad².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseVariances {
    pub(super) xx: f32,
    pub(super) yy: f32,
    pub(super) hh: f32,
}

impl PoseVariances {
    /// With independent errors of these standard deviations, m and rad; at most the largest variance of a filter.
    pub fn plus(self, position: f32, heading: f32) -> Self {
        let sum = |variance: f32, sigma: f32| at_most_max_variance(variance + sigma * sigma);
        Self { xx: sum(self.xx, position), yy: sum(self.yy, position), hh: sum(self.hh, heading) }
    }
}

/// Uncertainty of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseUncertainty {
    /// Standard deviation of the position in the direction in which it is largest.
    pub position: Metres,
    /// Standard deviation of the heading.
    pub heading: Radians,
}
