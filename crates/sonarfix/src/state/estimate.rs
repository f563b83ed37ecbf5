//! The state estimate in the coordinates of the filter.
//!
//! The filter holds the scale errors of the two wheels as their mean and their difference (see
//! [`covariance`](crate::filter::covariance) for the reason). [`StateEstimate`] is the public form.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf`](crate::filter::ekf::Ekf) accepts only finite states.

use crate::geometry::pose::{Heading, Pose};
use crate::geometry::units::{Metres, Radians};
use crate::state::StateEstimate;

/// The state estimate X̂, with the scale errors as mean and difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterEstimate {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
    /// Mean of the scale errors, the part common to both wheels.
    pub(crate) scale_common: f32,
    /// Scale error of the right wheel less that of the left wheel.
    pub(crate) scale_difference: f32,
    pub(crate) track_width_error: f32,
    pub(crate) range_scale: f32,
    compensation: KahanCompensation,
}

/// Rounding errors of x, y and heading that are added back with the next increment (Kahan).
///
/// At 40 m from the origin the spacing of `f32` is 4 µm, and a leg of a path is a thousand
/// additions: uncompensated rounding would move the estimate by a fiftieth of its own standard
/// deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct KahanCompensation {
    x: f32,
    y: f32,
    heading: f32,
}

impl FilterEstimate {
    /// The estimate in filter coordinates.
    #[must_use]
    pub fn new(state: &StateEstimate) -> Self {
        Self {
            x: state.x.0,
            y: state.y.0,
            heading: wrapped(state.heading.0),
            scale_common: 0.5 * (state.scale_right + state.scale_left),
            scale_difference: state.scale_right - state.scale_left,
            track_width_error: state.track_width_error.0,
            range_scale: state.range_scale,
            compensation: KahanCompensation::default(),
        }
    }

    /// The estimate wheel by wheel.
    #[must_use]
    pub fn state(&self) -> StateEstimate {
        let (scale_right, scale_left) = wheels(self.scale_common, self.scale_difference);
        StateEstimate {
            x: Metres(self.x),
            y: Metres(self.y),
            heading: Radians(self.heading),
            scale_right,
            scale_left,
            track_width_error: Metres(self.track_width_error),
            range_scale: self.range_scale,
        }
    }

    /// Replaces the pose.
    pub(crate) fn set_pose(&mut self, pose: Pose) {
        self.x = pose.x.0;
        self.y = pose.y.0;
        self.heading = wrapped(pose.heading.radians().0);
        self.compensation = KahanCompensation::default();
    }

    /// Displacement and turn from another estimate to this one.
    pub(crate) fn pose_since(&self, before: &Self) -> (f32, f32, f32) {
        (self.x - before.x, self.y - before.y, wrapped(self.heading - before.heading))
    }

    /// Adds increments to the pose and wraps the heading.
    #[inline]
    pub(crate) fn add_to_pose(&mut self, x: f32, y: f32, heading: f32) {
        let compensation = &mut self.compensation;
        add(&mut self.x, &mut compensation.x, x);
        add(&mut self.y, &mut compensation.y, y);
        add(&mut self.heading, &mut compensation.heading, heading);
        self.heading = wrapped(self.heading);
    }
}

/// Adds an increment to a sum with Kahan compensation.
fn add(sum: &mut f32, compensation: &mut f32, increment: f32) {
    let increment = increment + *compensation;
    let before = *sum;
    *sum = before + increment;
    *compensation = increment - (*sum - before);
}

#[inline]
fn wrapped(heading: f32) -> f32 {
    Heading::new(Radians(heading)).radians().0
}

/// The values of the right and the left wheel from the mean and the difference of both.
pub(crate) fn wheels(common: f32, difference: f32) -> (f32, f32) {
    (common + 0.5 * difference, common - 0.5 * difference)
}
