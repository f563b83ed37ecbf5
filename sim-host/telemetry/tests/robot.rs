//! A robot on a page: what its orders become, and how a motion ends.

#![expect(clippy::unwrap_used, reason = "a test should stop")]

use std::time::Duration;

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, MetresPerSecond, Radians, RadiansPerSecond};
use sonarfix::localizer::Start;
use sonarfix_link::message::{Ack, CommandError};
use sonarfix_link::{
    Command, CommandResult, Motion, Receiver, Sender, SessionCommand, Telemetry, frame,
};
use sonarfix_telemetry::conversation::Conversation;
use sonarfix_telemetry::feed::{Feed, Scene};
use sonarfix_telemetry::order::Order;
use sonarfix_telemetry::robot::Robot;

/// Each number of the page's order is at its place in the command.
#[test]
fn the_numbers_of_set_pose_are_not_exchanged() {
    let text = r#"{"order": "set_pose", "x": 1, "y": 2, "heading": 0.5,
        "position_deviation": 0.25, "heading_deviation": 0.125}"#;
    let order: Order = serde_json::from_str(text).unwrap();
    let expected = Start {
        pose: Pose::new(1.0, 2.0, Radians(0.5)),
        position_deviation: Metres(0.25),
        heading_deviation: Radians(0.125),
    };
    assert_eq!(order.command(), Some(Command::SetPose(expected)));
}

/// A robot of a page with a session, which answers each command; its commands.
struct Driven {
    robot: Robot,
    receiver: Receiver<SessionCommand>,
    telemetry: Sender<Telemetry>,
    result: CommandResult,
}

impl Driven {
    fn new(result: CommandResult) -> Self {
        let (scene, mount) = Scene::of_robot(String::new(), None, None);
        let conversation = Conversation::new(0);
        let robot = Robot::new(Feed::nowhere(), scene, mount, conversation, || unreachable!());
        Self { robot, receiver: Receiver::new(), telemetry: Sender::new(), result }
    }

    /// The motions that are sent at this time.
    fn motions(&mut self, now: Duration) -> Vec<Motion> {
        let mut motions = Vec::new();
        // A frame is sent, answered, and its answer may have a consequence.
        for _ in 0..8 {
            let Some(bytes) = self.robot.obey(None, now) else { continue };
            for frame in bytes.into_iter().filter_map(|byte| self.receiver.push(byte)) {
                let result = match frame.message.command {
                    Command::OpenSession => CommandResult::Session(1),
                    Command::Drive(motion) => {
                        motions.push(motion);
                        self.result
                    }
                    other => unreachable!("{other:?}"),
                };
                let ack = Telemetry::Ack(Ack { sequence: frame.sequence, result });
                let mut buffer = frame::EMPTY;
                let bytes = self.telemetry.frame(&ack, &mut buffer);
                self.robot.take(bytes, |_, _| {}).unwrap();
            }
        }
        motions
    }
}

const DRIVE: Order = Order::Drive { speed: 0.1, turn: 0.5 };
const HELD: Motion = Motion { speed: MetresPerSecond(0.1), turn: RadiansPerSecond(0.5) };

/// A motion is renewed while a page repeats its order. Without the page the robot is commanded to stand after 300 ms, until the
/// page ends its commands.
#[test]
fn a_motion_of_a_page_ends_without_its_orders() {
    let mut driven = Driven::new(CommandResult::Done);
    let at = Duration::from_millis;
    for millis in (0..=1_000).step_by(100) {
        driven.robot.ask(DRIVE, at(millis));
        assert_eq!(driven.motions(at(millis)), [HELD], "after {millis} ms");
    }
    assert_eq!(driven.motions(at(1_290)), [HELD]);
    for millis in [1_300, 1_400, 9_000] {
        assert_eq!(driven.motions(at(millis)), [Motion::default()], "after {millis} ms");
    }
    driven.robot.ask(Order::Leave, at(9_100));
    assert_eq!(driven.motions(at(9_500)), []);
}

/// A refused motion is not sent again while it is held, and the page receives the reason.
#[test]
fn a_refused_motion_is_not_repeated() {
    let mut driven = Driven::new(CommandResult::Refused(CommandError::Waiting));
    let at = Duration::from_millis;
    driven.robot.ask(DRIVE, at(0));
    assert_eq!(driven.motions(at(0)), [HELD]);
    for millis in (100..=500).step_by(100) {
        driven.robot.ask(DRIVE, at(millis));
        assert_eq!(driven.motions(at(millis)), [], "after {millis} ms");
    }
    assert!(driven.robot.notice().contains("start it first"), "{}", driven.robot.notice());
    assert_eq!(driven.motions(at(2_000)), []);
}
