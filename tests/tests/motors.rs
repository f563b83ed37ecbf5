//! The example of motor code, which the boards run, on a robot with unequal motors.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, MetresPerSecond, Radians};
use sonarfix::health::Verdict;
use sonarfix_motors::commanded::{Commanded, Inputs, Wheel};
use sonarfix_motors::{Drive, Estimate, Pattern};

/// Wheel speed at the full voltage, m/s, and track width, m.
const FULL_SPEED: f32 = 0.5;
const TRACK_WIDTH: f32 = 0.16;

/// A robot without inertia, and the strengths of its motors.
struct Robot {
    pose: Pose,
    strengths: [f32; 2],
}

impl Robot {
    /// Drives for a millisecond.
    fn drive(&mut self, drive: Drive) {
        let [right, left] = self.strengths;
        let (right, left) = (drive.right * right * FULL_SPEED, drive.left * left * FULL_SPEED);
        let (turn, length) = (0.001 * (right - left) / TRACK_WIDTH, 0.0005 * (right + left));
        let heading = self.pose.heading.turned(Radians(turn));
        let (sin, cos) = heading.radians().0.sin_cos();
        self.pose = Pose::new(
            self.pose.x.0 + length * cos,
            self.pose.y.0 + length * sin,
            heading.radians(),
        );
    }
}

fn tracking(pose: Pose) -> Estimate {
    Estimate { pose, verdict: Verdict::Tracking }
}

/// For any start and motors that differ by a fifth, the robot goes to and fro on its line.
#[test]
fn the_motor_pattern_stays_on_its_line() {
    for degrees in [0.0_f32, 90.0, 179.9, -135.0] {
        for strengths in [[1.0, 1.0], [1.1, 0.9], [0.9, 1.1]] {
            let heading = degrees.to_radians();
            let start = Pose::new(1.0, -2.0, Radians(heading));
            let mut robot = Robot { pose: start, strengths };
            let mut pattern = Pattern::default();
            let (mut ends, mut was_ahead) = (0, true);
            for _ in 0..30_000 {
                let drive = pattern.drive(Some(tracking(robot.pose)));
                assert!(drive.right.abs().max(drive.left.abs()) < 0.6, "{drive:?}");
                let is_ahead = drive.right + drive.left > 0.0;
                ends += i32::from(is_ahead != was_ahead);
                was_ahead = is_ahead;
                robot.drive(drive);
                let (x, y) = (robot.pose.x.0 - 1.0, robot.pose.y.0 + 2.0);
                let (sin, cos) = heading.sin_cos();
                let (along, aside) = (x * cos + y * sin, y * cos - x * sin);
                let name = format!("{degrees}°, {strengths:?}: {along} m, {aside} m");
                assert!((-0.01..Pattern::LENGTH + 0.01).contains(&along), "{name}");
                assert!(aside.abs() < 0.04, "{name}");
            }
            // 30 s at 0.2 m/s: twelve lengths.
            assert!((10..=12).contains(&ends), "{degrees}°, {strengths:?}: {ends} ends");
        }
    }
}

/// A robot that is disabled or lost stands still; a pose set elsewhere begins another line.
#[test]
fn the_motor_pattern_stops_without_an_estimate() {
    let mut pattern = Pattern::default();
    let pose = Pose::new(1.0, 1.0, Radians(0.5));
    let ahead = pattern.drive(Some(tracking(pose)));
    assert!(ahead.right > 0.0 && ahead.left > 0.0, "{ahead:?}");
    assert_eq!(pattern.drive(None), Drive::STOP);
    let lost = Estimate { pose, verdict: Verdict::Lost };
    assert_eq!(pattern.drive(Some(lost)), Drive::STOP);
    assert_eq!(pattern.drive(Some(tracking(pose))), ahead);
    let elsewhere = Pose::new(5.0, 1.0, Radians(2.0));
    assert_eq!(pattern.drive(Some(tracking(elsewhere))), Drive::STOP);
    assert_eq!(pattern.drive(Some(tracking(elsewhere))), ahead);
}

/// One input of each bridge carries the pulses, the other one is low.
#[test]
fn the_inputs_of_the_motor_driver_have_the_sign_of_the_voltage() {
    let inputs = |right, left| Drive { right, left }.inputs(800);
    assert_eq!(inputs(0.5, -0.25), [400, 0, 0, 200]);
    assert_eq!(inputs(-1.0, 1.0), [0, 800, 800, 0]);
    assert_eq!(inputs(7.0, -7.0), [800, 0, 0, 800]);
    assert_eq!(inputs(f32::NAN, -f32::NAN), [0; 4]);
    assert_eq!(Drive::STOP.inputs(u16::MAX), [0; 4]);
    assert_eq!(Drive { right: 9.0, left: f32::INFINITY }.inputs(u16::MAX), [65_535, 0, 65_535, 0]);
}

/// A robot on a floor with friction, that a PC drives.
struct CommandedRobot {
    code: Commanded,
    strengths: [f32; 2],
    travel: [f32; 2],
    millis: u64,
    drive: Drive,
}

/// Travel for a tick; the left encoder counts down.
const TICK: [f32; 2] = [0.0005, -0.0005];
/// The duty below which a wheel does not turn.
const FRICTION: f32 = 0.1;

impl CommandedRobot {
    fn new(strengths: [f32; 2]) -> Self {
        let code = Commanded::default();
        Self { code, strengths, travel: [0.0; 2], millis: 0, drive: Drive::STOP }
    }

    fn inputs(&self, speeds: Option<[f32; 2]>) -> Inputs {
        let wheel = |travel: f32, tick: f32| Wheel {
            #[expect(clippy::cast_possible_truncation, reason = "some metres")]
            position: (travel / tick).floor() as i64,
            travel_per_tick: Metres(tick),
        };
        let ([right, left], [right_tick, left_tick]) = (self.travel, TICK);
        Inputs {
            now: Instant::from_ticks(1_000 * self.millis),
            estimate: tracking(Pose::new(1.0, 1.0, Radians(0.0))),
            speeds: speeds.map(|speeds| speeds.map(MetresPerSecond)),
            wheels: Some([wheel(right, right_tick), wheel(left, left_tick)]),
        }
    }

    /// Drives for so many milliseconds with a poll every 10 ms; the mean speeds of the wheels.
    fn drive(&mut self, millis: u64, speeds: Option<[f32; 2]>) -> [f32; 2] {
        let before = self.travel;
        for milli in 0..millis {
            if milli % 10 == 0 {
                let inputs = self.inputs(speeds);
                self.drive = self.code.drive(Some(inputs));
            }
            let voltages = [self.drive.right, self.drive.left];
            for ((travel, voltage), strength) in
                self.travel.iter_mut().zip(voltages).zip(self.strengths)
            {
                let moving = (voltage.abs() - FRICTION).max(0.0) * voltage.signum();
                *travel += 0.001 * FULL_SPEED * strength * moving;
            }
            self.millis += 1;
        }
        #[expect(clippy::cast_precision_loss, reason = "some seconds")]
        let seconds = 0.001 * millis as f32;
        [0, 1].map(|side| (self.travel[side] - before[side]) / seconds)
    }
}

/// Wheels of unequal motors have the commanded speeds, ahead, back and on the spot, and stand when the motion has ended.
#[test]
fn the_wheels_have_the_commanded_speeds() {
    for strengths in [[1.0, 1.0], [1.3, 0.8]] {
        let mut robot = CommandedRobot::new(strengths);
        for speeds in [[0.2, 0.2], [-0.15, -0.1], [0.05, -0.05]] {
            robot.drive(2_000, Some(speeds));
            let mean = robot.drive(2_000, Some(speeds));
            for (mean, wanted) in mean.iter().zip(speeds) {
                let is_close = (mean - wanted).abs() < 0.03 * wanted.abs() + 0.001;
                assert!(is_close, "{mean} of {wanted} by {strengths:?}");
            }
        }
        assert_eq!(robot.code.drive(Some(robot.inputs(None))), Drive::STOP);
        assert!(robot.drive(1_000, None).iter().all(|speed| speed.abs() < 1e-9));
    }
}

/// The example pattern drives before the first motion only, and again after the motors were disabled.
#[test]
fn a_robot_that_was_commanded_stands_afterwards() {
    let mut robot = CommandedRobot::new([1.0; 2]);
    let pattern = Pattern::default().drive(Some(robot.inputs(None).estimate));
    assert_ne!(pattern, Drive::STOP);
    assert_eq!(robot.code.drive(Some(robot.inputs(None))), pattern);
    robot.drive(500, Some([0.2; 2]));
    assert_eq!(robot.code.drive(Some(robot.inputs(None))), Drive::STOP);
    assert_eq!(robot.code.drive(None), Drive::STOP);
    assert_eq!(robot.code.drive(Some(robot.inputs(None))), pattern);
}

/// Without encoders no motion is followed, and a pause of the polls begins at rest: the travel of the pause is no speed.
#[test]
fn an_encoder_that_cannot_be_read_stops_the_wheels() {
    let mut robot = CommandedRobot::new([1.0; 2]);
    robot.drive(1_000, Some([0.2; 2]));
    let blind = Inputs { wheels: None, ..robot.inputs(Some([0.2; 2])) };
    assert_eq!(robot.code.drive(Some(blind)), Drive::STOP);
    let mut fresh = CommandedRobot::new([1.0; 2]);
    let first = fresh.code.drive(Some(fresh.inputs(Some([0.2; 2]))));
    robot.drive(1_000, Some([0.2; 2]));
    robot.millis += 5_000;
    robot.travel = [3.0; 2];
    assert_eq!(robot.code.drive(Some(robot.inputs(Some([0.2; 2])))), first);
}
