//! The seven states: their estimate and their standard deviations.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf`](crate::filter::ekf::Ekf) accepts only finite values.

pub(crate) mod estimate;

use crate::geometry::pose::{Heading, Pose};
use crate::geometry::units::{Metres, Radians};

/// Number of states.
pub const STATES: usize = 7;

/// The estimate X̂ of the seven states, in the order of the state vector and of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StateEstimate {
    /// Position along map x.
    pub x: Metres,
    /// Position along map y.
    pub y: Metres,
    /// Heading ψ, in (−π, π] when it comes from the filter.
    pub heading: Radians,
    /// Scale error of the right wheel, `S_R`: true travel is (1 + `S_R`) times the measured one.
    pub scale_right: f32,
    /// Scale error of the left wheel, `S_L`.
    pub scale_left: f32,
    /// Error of the track width, δD: the true track width is D + δD.
    pub track_width_error: Metres,
    /// Scale error of the ranger, κ: a measured range is (1 + κ) times the true one.
    pub range_scale: f32,
}

impl StateEstimate {
    /// An estimate of this pose, with all systematic errors zero.
    #[must_use]
    pub fn at_pose(pose: Pose) -> Self {
        Self { x: pose.x, y: pose.y, heading: pose.heading.radians(), ..Self::default() }
    }

    /// Position and heading.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose { x: self.x, y: self.y, heading: Heading::new(self.heading) }
    }

    /// The numbers in the order of the fields: metres, radians, dimensionless.
    #[must_use]
    pub fn to_array(self) -> [f32; STATES] {
        [
            self.x.0,
            self.y.0,
            self.heading.0,
            self.scale_right,
            self.scale_left,
            self.track_width_error.0,
            self.range_scale,
        ]
    }

    /// The estimate of these numbers, in the order and units of [`Self::to_array`].
    #[must_use]
    pub fn from_array(numbers: [f32; STATES]) -> Self {
        let [x, y, heading, scale_right, scale_left, track_width_error, range_scale] = numbers;
        Self {
            x: Metres(x),
            y: Metres(y),
            heading: Radians(heading),
            scale_right,
            scale_left,
            track_width_error: Metres(track_width_error),
            range_scale,
        }
    }
}

/// One standard deviation of each state's error, in the unit of the state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StandardDeviations {
    /// Of the position along map x.
    pub x: Metres,
    /// Of the position along map y.
    pub y: Metres,
    /// Of the heading.
    pub heading: Radians,
    /// Of the right wheel's scale error, dimensionless.
    pub scale_right: f32,
    /// Of the left wheel's scale error, dimensionless.
    pub scale_left: f32,
    /// Of the track-width error.
    pub track_width_error: Metres,
    /// Of the ranger's scale error, dimensionless.
    pub range_scale: f32,
}

impl StandardDeviations {
    /// The numbers in the order of the fields: metres, radians, dimensionless.
    #[must_use]
    pub fn to_array(self) -> [f32; STATES] {
        [
            self.x.0,
            self.y.0,
            self.heading.0,
            self.scale_right,
            self.scale_left,
            self.track_width_error.0,
            self.range_scale,
        ]
    }

    /// The deviations of these numbers, in the order and units of [`Self::to_array`].
    #[must_use]
    pub fn from_array(numbers: [f32; STATES]) -> Self {
        let [x, y, heading, scale_right, scale_left, track_width_error, range_scale] = numbers;
        Self {
            x: Metres(x),
            y: Metres(y),
            heading: Radians(heading),
            scale_right,
            scale_left,
            track_width_error: Metres(track_width_error),
            range_scale,
        }
    }
}
