//! Pose and calibration after an interruption: a `Stop`, or a power cycle.
//!
//! | state | deviation after it |
//! |---|---|
//! | scale errors, track width | twice the one before, and a tenth of the prior (independent); at most the prior |
//! | range scale | the prior: the temperature may have changed |
//! | position, if the robot was parked | the one before, and 10 cm; at most 1 km |
//! | heading, if the robot was parked | the one before, and 5°; at most 180° |
//!
//! *Twice*, because a record holds deviations and no correlations: no covariance of four errors
//! exceeds four times its diagonal, so the restored covariance is never too small. The tenth is
//! for tyres that are cleaned, warmed or pressed flat while the robot stands; the 10 cm and 5° for a robot that
//! is pushed while it is switched. A robot that is carried farther needs a new pose; without one, the
//! health verdict detects the error.
//!
//! **Any number of interruptions without driving equals one**: the deviations *before* the interruption are stored,
//! and the rule above is applied when the loop starts. A loop in which no wheel has rolled leaves them unchanged.
//!
//! The pose of a record that was written while the robot might drive is not used. A calibration belongs to the
//! configuration that it corrects: with another one, the prior is used.

use sonarfix::config::Config;
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::{Start, UNKNOWN_HEADING, UNKNOWN_POSITION};

use super::Saved;

/// Standard deviations of the displacement of a robot that is switched by hand, metres and radians.
const PUSHED: f32 = 0.10;
const TURNED: f32 = 5.0 * core::f32::consts::PI / 180.0;
/// The share of the prior by which the wheels may have changed.
const AGED: f32 = 0.1;
/// The square root of the number of correlated calibration errors.
const DECORRELATED: f32 = 2.0;
/// The largest deviation of a position, metres.
pub const MAX_POSITION_DEVIATION: f32 = UNKNOWN_POSITION.0;
/// The largest deviation of a heading, radians.
pub const MAX_HEADING_DEVIATION: f32 = UNKNOWN_HEADING.0;

/// The start state of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
pub struct Resumed {
    /// Pose and calibration; the pose is zero if it is not known.
    pub state: StateEstimate,
    /// Their standard deviations before the interruption, if there was one.
    pub deviation: StandardDeviations,
    /// Whether the pose is known.
    pub has_pose: bool,
    /// Whether the calibration is a learned one.
    pub has_calibration: bool,
    /// Whether the pose was interrupted since it was known with its deviations.
    pub is_pose_interrupted: bool,
    /// Whether the calibration was.
    pub is_calibration_interrupted: bool,
    /// Whether the pose is that of a record of an earlier run.
    pub is_pose_stored: bool,
}

impl Resumed {
    /// The start state from the configuration alone.
    #[must_use]
    pub fn afresh(config: &Config) -> Self {
        let prior = &config.prior;
        let deviation = StandardDeviations {
            scale_right: prior.scale_right,
            scale_left: prior.scale_left,
            track_width_error: prior.track_width,
            range_scale: prior.range_scale,
            ..StandardDeviations::default()
        };
        Self {
            state: StateEstimate::default(),
            deviation,
            has_pose: false,
            has_calibration: false,
            is_pose_interrupted: false,
            is_calibration_interrupted: false,
            is_pose_stored: false,
        }
    }

    /// The valid part of a record, for a robot of this configuration with this checksum.
    #[must_use]
    pub fn from(saved: &Saved, config: &Config, configuration: u32) -> Self {
        let afresh = Self::afresh(config);
        if !is_sound(saved) {
            return afresh;
        }
        let whole = Self::interrupted(saved.state, saved.deviation);
        let has_calibration = saved.configuration == configuration;
        let resumed = if has_calibration { whole } else { whole.calibrated_as(&afresh) };
        let resumed = Self { is_pose_stored: true, ..resumed };
        if saved.is_parked { resumed } else { resumed.without_pose() }
    }

    /// The start state of a robot that was stopped with this estimate.
    #[must_use]
    pub fn interrupted(state: StateEstimate, deviation: StandardDeviations) -> Self {
        Self {
            state,
            deviation,
            has_pose: true,
            has_calibration: true,
            is_pose_interrupted: true,
            is_calibration_interrupted: true,
            is_pose_stored: false,
        }
    }

    /// The same after another interruption.
    #[must_use]
    pub fn interrupted_again(self) -> Self {
        Self { is_pose_interrupted: true, is_calibration_interrupted: true, ..self }
    }

    /// The deviations with which a robot of this configuration starts.
    #[must_use]
    pub fn deviation_at_start(&self, config: &Config) -> StandardDeviations {
        let prior = Self::afresh(config).deviation;
        let mut start = self.deviation;
        if self.is_calibration_interrupted {
            let wheel = |known: f32, prior: f32| both(DECORRELATED * known, AGED * prior);
            start.scale_right = wheel(start.scale_right, prior.scale_right);
            start.scale_left = wheel(start.scale_left, prior.scale_left);
            start.track_width_error =
                Metres(wheel(start.track_width_error.0, prior.track_width_error.0));
            start.range_scale = prior.range_scale;
        }
        start.scale_right = least(start.scale_right, prior.scale_right);
        start.scale_left = least(start.scale_left, prior.scale_left);
        let track_width = least(start.track_width_error.0, prior.track_width_error.0);
        start.track_width_error = Metres(track_width);
        start.range_scale = least(start.range_scale, prior.range_scale);
        if !self.has_pose {
            (start.x, start.y) = (UNKNOWN_POSITION, UNKNOWN_POSITION);
            start.heading = UNKNOWN_HEADING;
        } else if self.is_pose_interrupted {
            let pushed =
                |known: Metres| Metres(least(both(known.0, PUSHED), MAX_POSITION_DEVIATION));
            (start.x, start.y) = (pushed(start.x), pushed(start.y));
            let turned = both(start.heading.0, TURNED);
            start.heading = Radians(least(turned, MAX_HEADING_DEVIATION));
        }
        start
    }

    /// The same calibration of a robot whose pose is not known.
    #[must_use]
    pub fn without_pose(self) -> Self {
        let none = StateEstimate::default();
        let unknown = StandardDeviations::default();
        Self {
            state: StateEstimate { x: none.x, y: none.y, heading: none.heading, ..self.state },
            deviation: StandardDeviations {
                x: unknown.x,
                y: unknown.y,
                heading: unknown.heading,
                ..self.deviation
            },
            has_pose: false,
            is_pose_stored: false,
            ..self
        }
    }

    /// The same calibration at another pose.
    #[must_use]
    pub fn at(self, start: &Start) -> Self {
        let mut known = self;
        let Start { pose, position_deviation, heading_deviation } = *start;
        (known.state.x, known.state.y) = (pose.x, pose.y);
        known.state.heading = pose.heading.radians();
        (known.deviation.x, known.deviation.y) = (position_deviation, position_deviation);
        known.deviation.heading = heading_deviation;
        Self { has_pose: true, is_pose_interrupted: false, is_pose_stored: false, ..known }
    }

    /// The same pose with another's calibration.
    #[must_use]
    pub fn calibrated_as(self, other: &Self) -> Self {
        let StateEstimate { x, y, heading, .. } = self.state;
        let state = StateEstimate { x, y, heading, ..other.state };
        let StandardDeviations { x, y, heading, .. } = self.deviation;
        let deviation = StandardDeviations { x, y, heading, ..other.deviation };
        Self {
            state,
            deviation,
            has_calibration: other.has_calibration,
            is_calibration_interrupted: other.is_calibration_interrupted,
            ..self
        }
    }
}

fn least(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// The deviation of two independent errors together.
fn both(one: f32, other: f32) -> f32 {
    libm::sqrtf(one * one + other * other)
}

fn is_sound(saved: &Saved) -> bool {
    let values = saved.state.to_array().into_iter().all(f32::is_finite);
    values && saved.deviation.to_array().into_iter().all(|d| d >= 0.0 && d.is_finite())
}
