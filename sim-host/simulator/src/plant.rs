//! The true robot.
//!
//! - [`wheels`]: the encoder readings of rolling wheels;
//! - `course`: the motion of the robot: exactly along its path, or as commanded;
//! - [`follower`]: the path follower, which steers by the estimate;
//! - [`gyro`]: a gyro's rates;
//! - [`servo`]: the true bearing of the sonar.

pub mod absolute;
mod course;
pub mod follower;
pub mod gyro;
pub mod servo;
pub mod wheels;

use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Follow, Scenario};

use crate::dense::Vector;
use crate::trace::{Calibration, Pose, Truth};
use course::Course;
use follower::Command;
pub use wheels::Travel;
use wheels::Wheels;

/// The true robot in motion.
#[derive(Debug, Clone)]
pub struct Plant<'a> {
    course: Course<'a>,
    wheels: Wheels,
    nominal_track_width: f64,
    /// True scale error of the ranger, including that of the speed of sound.
    range_scale: f64,
    /// Seconds since the run began.
    time: f64,
}

impl<'a> Plant<'a> {
    /// The robot at the start of its path; `range_scale` includes the error of the speed of sound.
    #[must_use]
    pub fn new(scenario: &'a Scenario, range_scale: f64) -> Self {
        let start = scenario.path.pose_at(0.0);
        let start = Pose { x: start.x, y: start.y, heading: start.heading };
        Self {
            course: match scenario.follow {
                Follow::Truth => Course::OnPath { path: &scenario.path, ahead: 0.0 },
                Follow::Estimate => Course::steered(start),
            },
            wheels: Wheels::new(&scenario.truth, scenario.upsets),
            nominal_track_width: scenario.robot.localizer.drive.track_width.0.into(),
            range_scale,
            time: 0.0,
        }
    }

    /// Sets the command; without effect on a robot that follows its path exactly.
    pub fn steer(&mut self, command: Command) {
        self.course.steer(command, self.nominal_track_width);
    }

    /// Carries the robot along its path by this time of driving, seconds; its wheels do not roll. Without effect on a
    /// robot that steers by its estimate.
    pub fn carry(&mut self, seconds: f64) {
        self.course.carry(seconds);
    }

    /// Begins a slip of the right (0) or left (1) wheel that turns the odometry by this angle, radians.
    pub fn begin_slip(&mut self, wheel: usize, turn: f64) {
        self.wheels.begin_slip(wheel, turn);
    }

    /// Puts the robot down at a pose; its wheels do not roll. Without effect on a robot that follows its path exactly.
    pub fn put_down(&mut self, pose: Pose) {
        self.course.put_down(pose);
    }

    /// Drives on to `time` seconds and reads the encoders.
    pub fn drive_to(&mut self, time: f64, rng: &mut ChaCha8Rng, slips: &mut ChaCha8Rng) -> Travel {
        let rolled = self.course.drive(self.time, time, self.wheels.parameters());
        let seconds = time - self.time;
        self.time = time;
        self.wheels.roll(rolled, seconds, rng, slips)
    }

    /// The pose now.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose_after(0.0)
    }

    /// The pose a number of seconds from now, if the command does not change.
    #[must_use]
    pub fn pose_after(&self, seconds: f64) -> Pose {
        self.course.pose_at(self.time, self.time + seconds, self.wheels.parameters())
    }

    /// The truth now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let p = self.wheels.parameters();
        let calibration = Calibration {
            scale_right: p.scale_right,
            scale_left: p.scale_left,
            track_width: p.track_width,
            range_scale: self.range_scale,
        };
        Truth { pose: self.pose(), calibration: Some(calibration), gyro_bias: None }
    }

    /// The truth now, as the states of the filter.
    #[must_use]
    pub fn state(&self) -> Vector {
        let pose = self.pose();
        let p = self.wheels.parameters();
        Vector::from([
            pose.x,
            pose.y,
            pose.heading,
            p.scale_right,
            p.scale_left,
            p.track_width - self.nominal_track_width,
            self.range_scale,
        ])
    }
}
