//! The motion of the robot, and the distances that its wheels roll.

use sonarfix_map::{Path, Truth as Parameters};

use super::follower::Command;
use crate::angle;
use crate::trace::Pose;

/// The motion of the robot over the floor.
#[derive(Debug, Clone)]
pub enum Course<'a> {
    /// Exactly along a path.
    OnPath {
        /// The path.
        path: &'a Path,
        /// How far the robot is ahead of its schedule because it was carried along the path, seconds.
        ahead: f64,
    },
    /// As commanded.
    Steered {
        /// The current pose.
        pose: Pose,
        /// Encoder speeds that the motor controller regulates to, right and left, m/s.
        speeds: [f64; 2],
    },
}

impl Course<'_> {
    /// Commanded motion, at rest at first.
    pub fn steered(pose: Pose) -> Self {
        Self::Steered { pose, speeds: [0.0, 0.0] }
    }

    /// Sets the wheel speeds that give the nominal robot this motion.
    pub fn steer(&mut self, command: Command, nominal_track_width: f64) {
        if let Self::Steered { speeds, .. } = self {
            let half_turn = 0.5 * nominal_track_width * command.turn_rate;
            *speeds = [command.speed + half_turn, command.speed - half_turn];
        }
    }

    /// Carries the robot along its path by this time of driving, seconds; the wheels do not roll. Without effect on a
    /// commanded motion.
    pub fn carry(&mut self, seconds: f64) {
        if let Self::OnPath { ahead, .. } = self {
            *ahead += seconds;
        }
    }

    /// Puts the robot down at a pose; the wheels do not roll. Without effect on an exact path.
    pub fn put_down(&mut self, at: Pose) {
        if let Self::Steered { pose, .. } = self {
            *pose = at;
        }
    }

    /// Drives from one time to another, seconds; returns how far the wheels rolled, metres.
    pub fn drive(&mut self, from: f64, to: f64, parameters: &Parameters) -> [f64; 2] {
        match self {
            Self::OnPath { path, ahead } => {
                let mut rolled = [0.0, 0.0];
                for piece in path.motion_between(from + *ahead, to + *ahead) {
                    let half_turn = 0.5 * parameters.track_width * piece.turn;
                    rolled[0] += piece.advance + half_turn;
                    rolled[1] += piece.advance - half_turn;
                }
                rolled
            }
            Self::Steered { pose, speeds } => {
                let rolled = rolled(*speeds, to - from, parameters);
                *pose = moved(*pose, rolled, parameters.track_width);
                rolled
            }
        }
    }

    /// The pose at a time not before `now`, seconds, if the command does not change.
    pub fn pose_at(&self, now: f64, time: f64, parameters: &Parameters) -> Pose {
        match self {
            Self::OnPath { path, ahead } => {
                let pose = path.pose_at(time + ahead);
                Pose { x: pose.x, y: pose.y, heading: pose.heading }
            }
            // As below with a chord of zero, without its sine and cosine.
            Self::Steered { pose, .. } if time <= now => {
                Pose { x: pose.x + 0.0, y: pose.y + 0.0, heading: angle::wrap(pose.heading + 0.0) }
            }
            Self::Steered { pose, speeds } => {
                moved(*pose, rolled(*speeds, time - now, parameters), parameters.track_width)
            }
        }
    }
}

/// The distances that the wheels roll at these encoder speeds.
fn rolled(speeds: [f64; 2], seconds: f64, parameters: &Parameters) -> [f64; 2] {
    let [right, left] = speeds.map(|speed| speed * seconds);
    [right * (1.0 + parameters.scale_right), left * (1.0 + parameters.scale_left)]
}

/// The exact arc of two wheels at constant speeds.
fn moved(pose: Pose, [right, left]: [f64; 2], track_width: f64) -> Pose {
    let turn = (right - left) / track_width;
    let advance = f64::midpoint(right, left);
    // The chord of the arc: sin(x)/x, which is 1 for a straight line.
    let half = 0.5 * turn;
    let chord = if half.abs() < 1e-9 { advance } else { advance * libm::sin(half) / half };
    let (sin, cos) = libm::sincos(pose.heading + half);
    Pose {
        x: pose.x + chord * cos,
        y: pose.y + chord * sin,
        heading: angle::wrap(pose.heading + turn),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sonarfix_map::Scenario;

    fn parameters() -> Parameters {
        Scenario::paper().unwrap().truth
    }

    fn drive(course: &mut Course, seconds: f64, steps: u32) -> [f64; 2] {
        let step = seconds / f64::from(steps);
        let mut sum = [0.0, 0.0];
        for n in 0..steps {
            let from = f64::from(n) * step;
            let [right, left] = course.drive(from, from + step, &parameters());
            sum = [sum[0] + right, sum[1] + left];
        }
        sum
    }

    proptest! {
        /// An arc is the same in one step, in many steps, and predicted ahead of time.
        #[test]
        fn an_arc_does_not_depend_on_its_steps(
            speed in -1.0..1.0, turn_rate in -2.0..2.0, steps in 2_u32..50,
        ) {
            let start = Pose { x: 1.0, y: 2.0, heading: 0.5 };
            let mut once = Course::steered(start);
            once.steer(Command { speed, turn_rate }, 0.35);
            let mut often = once.clone();
            let ahead = once.pose_at(0.0, 3.0, &parameters());
            let (one, many) = (drive(&mut once, 3.0, 1), drive(&mut often, 3.0, steps));
            prop_assert!((one[0] - many[0]).abs() + (one[1] - many[1]).abs() < 1e-9);
            let (one, many) =
                (once.pose_at(0.0, 0.0, &parameters()), often.pose_at(0.0, 0.0, &parameters()));
            for other in [many, ahead] {
                prop_assert!((one.x - other.x).abs() < 1e-9, "{one:?} {other:?}");
                prop_assert!((one.y - other.y).abs() < 1e-9, "{one:?} {other:?}");
                prop_assert!(angle::wrap(one.heading - other.heading).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_smaller_wheel_curves_the_path() {
        let mut course = Course::steered(Pose::default());
        course.steer(Command { speed: 0.4, turn_rate: 0.0 }, 0.35);
        drive(&mut course, 10.0, 10);
        let pose = course.pose_at(0.0, 0.0, &parameters());
        // The right wheel rolls 0.67 % less than the left: 4 m · 0.0067 / 0.3488 m to the right.
        assert!((pose.heading + 0.0768).abs() < 1e-3, "{pose:?}");
    }
}
