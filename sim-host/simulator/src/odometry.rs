//! Dead reckoning by the encoders: eq. (2), with the nominal robot.

use crate::angle;
use crate::trace::Pose;

/// Dead reckoning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadReckoning {
    pose: Pose,
    track_width: f64,
}

impl DeadReckoning {
    /// Starts at a pose.
    #[must_use]
    pub fn new(pose: Pose, track_width: f64) -> Self {
        Self { pose, track_width }
    }

    /// Adds the travel of the right and the left wheel, metres.
    pub fn moved(&mut self, [right, left]: [f64; 2]) {
        let turn = (right - left) / self.track_width;
        let advance = f64::midpoint(right, left);
        let (sin, cos) = libm::sincos(self.pose.heading + turn / 2.0);
        self.pose.x += advance * cos;
        self.pose.y += advance * sin;
        self.pose.heading = angle::wrap(self.pose.heading + turn);
    }

    /// The current pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }
}
