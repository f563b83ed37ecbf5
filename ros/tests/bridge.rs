//! A robot behind the link, without a port: its telemetry as bytes, and what the node publishes of it.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use std::time::Duration;

use sonarfix_link::message::Ack;
use sonarfix_link::{Command, CommandResult, Receiver, Sender, SessionCommand, Telemetry, frame};
use sonarfix_ros::bridge::Bridge;
use sonarfix_ros::drive::Drive;
use sonarfix_ros::hostile::Random;
use sonarfix_ros::motion::{between, moved};
use sonarfix_ros::parameters::{Parameters, Value};
use sonarfix_ros::publication::Output;
use sonarfix_ros::view::Frames;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::TransformStamped;

const BEGIN: i64 = 1_000_000_000_000;
/// The delay of the link, nanoseconds.
const DELAY: i64 = 3_000_000;

fn bytes(sender: &mut Sender<Telemetry>, telemetry: &Telemetry) -> Vec<u8> {
    let mut buffer = frame::EMPTY;
    sender.frame(telemetry, &mut buffer).to_vec()
}

fn placed(transform: &TransformStamped) -> [f64; 3] {
    let of = &transform.transform;
    [of.translation.x, of.translation.y, geometry::heading(&of.rotation).unwrap()]
}

#[test]
fn what_the_robot_estimates_is_published_at_its_time() {
    let mut parameters = Parameters::default();
    parameters.set("publish_odom_tf", Value::Bool(true)).unwrap();
    let drive = Drive::classroom(20.0, BEGIN, &Frames::of(&parameters)).unwrap();
    let mut bridge = Bridge::new(&parameters, drive.scenario.robot, Vec::new());
    bridge.set_active(true);
    let mut sender = Sender::starting_at(0);
    let (mut poses, mut ranges, mut reports, mut compared) = (0, 0, 0, 0);
    for (at, telemetry) in &drive.telemetry {
        for output in bridge.take(&bytes(&mut sender, telemetry), at + DELAY) {
            match output {
                Output::Pose(pose) => {
                    poses += 1;
                    let stamp = pose.header.stamp.nanoseconds();
                    let truth = drive.truth.iter().find(|truth| truth.at + DELAY == stamp);
                    let Some(truth) = truth else { continue };
                    compared += 1;
                    let off = between(truth.estimate, geometry::planar(&pose.pose.pose).unwrap());
                    assert!(off[0].hypot(off[1]) < 1e-6, "{stamp}: {off:?}");
                }
                Output::Transforms(message) if message.transforms.len() == 2 => {
                    let [map, odom] = [0, 1].map(|place| placed(&message.transforms[place]));
                    let off = between(bridge.view().unwrap().pose, moved(map, odom));
                    assert!(off.iter().all(|off| off.abs() < 1e-6), "{off:?}");
                }
                Output::Range(range) => {
                    ranges += 1;
                    assert!(range.min_range < range.max_range);
                }
                Output::Diagnostics(_) => reports += 1,
                _ => {}
            }
        }
    }
    assert!(compared > 20, "{compared} of {poses}");
    assert!(poses > 20 && ranges > 20 && reports >= 19, "{poses} {ranges} {reports}");
}

#[test]
fn a_pose_becomes_a_command_that_is_repeated_until_it_is_answered() {
    let parameters = Parameters::default();
    let drive = Drive::classroom(1.0, BEGIN, &Frames::of(&parameters)).unwrap();
    let mut bridge = Bridge::new(&parameters, drive.scenario.robot, Vec::new());
    bridge.set_pose(&drive.start, BEGIN);
    let (mut robot, mut sender) = (Receiver::<SessionCommand>::new(), Sender::starting_at(0));
    let mut commands = Vec::new();
    while let Some(sent) = bridge.to_send(Duration::ZERO, BEGIN) {
        let frame = sent.iter().filter_map(|&byte| robot.push(byte)).last().unwrap();
        commands.push(frame.message.command);
        let result = match frame.message.command {
            Command::OpenSession => CommandResult::Session(7),
            _ => CommandResult::Done,
        };
        let ack = Telemetry::Ack(Ack { sequence: frame.sequence, result });
        bridge.take(&bytes(&mut sender, &ack), BEGIN);
    }
    assert!(matches!(commands[..], [Command::OpenSession, Command::SetPose(_)]), "{commands:?}");
    // A pose in another frame is none of the robot's.
    let mut other = drive.start.clone();
    other.header.frame_id = "odom".into();
    bridge.set_pose(&other, BEGIN);
    assert_eq!(bridge.to_send(Duration::ZERO, BEGIN), None);
}

#[test]
fn noise_on_the_line_does_no_harm() {
    let parameters = Parameters::default();
    let drive = Drive::classroom(5.0, BEGIN, &Frames::of(&parameters)).unwrap();
    let mut bridge = Bridge::new(&parameters, drive.scenario.robot, Vec::new());
    bridge.set_active(true);
    let (mut sender, mut random) = (Sender::starting_at(0), Random::new(3));
    for (number, (at, telemetry)) in drive.telemetry.iter().enumerate() {
        let right = bytes(&mut sender, telemetry);
        if number % 3 == 0 {
            bridge.take(&random.bytes(&right), at + DELAY);
            bridge.take(&[0], at + DELAY);
        }
        bridge.take(&right, at + DELAY);
    }
    let (found, truth) = (bridge.view().unwrap(), drive.truth.last().unwrap().estimate);
    let off = between(truth, found.pose);
    assert!(off[0].hypot(off[1]) < 0.1, "{off:?}");
}
