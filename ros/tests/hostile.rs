//! Hostile bytes to the decoder of each subscription, and what they decode to, to the node: no panic, and still right afterwards.

use sonarfix_ros::drive::Drive;
use sonarfix_ros::hostile::{Random, targets};
use sonarfix_ros::motion::between;
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::{Parameters, Value};
use sonarfix_ros::view::Frames;
use sonarfix_ros::walls::Walls;

const TRIES: i64 = 5000;
const BEGIN: i64 = 1_000_000_000_000;

#[test]
fn hostile_bytes_do_no_harm() {
    let mut parameters = Parameters::default();
    // The frames of the right messages are empty, and so are those of most hostile ones.
    for frame in ["global_frame_id", "odom_frame_id", "base_frame_id"] {
        parameters.set(frame, Value::Text(String::new())).unwrap();
    }
    let drive = Drive::empty_classroom(5.0, BEGIN, &Frames::of(&parameters)).unwrap();
    let walls = Walls::new(&drive.scenario.floor);
    let mut node = Node::new(&parameters, drive.scenario.robot, Some(walls)).unwrap();
    node.set_active(true);
    for (number, target) in targets().into_iter().enumerate() {
        let mut random = Random::new(number as u64 + 7);
        let mut decoded = 0;
        for step in 0..TRIES {
            if let Some(input) = (target.decode)(&random.bytes(&target.message)) {
                decoded += 1;
                node.take(input, BEGIN - 10_000_000_000_000 + step * 1_000_000);
            }
        }
        assert!(decoded > 0, "{}: none was a message", target.name);
    }
    // As after a restart of the robot: its stamps are of another time.
    node.take(Input::Tick, BEGIN - 1);
    for (at, input) in drive.messages.iter().cloned() {
        node.take(input, at);
    }
    let (last, _) = *drive.messages.last().unwrap();
    node.take(Input::InitialPose(Box::new(drive.start.clone())), last);
    for step in 0..20 {
        node.take(Input::Tick, last + step * 1_000_000);
    }
    let start = sonarfix_ros_messages::geometry::planar(&drive.start.pose.pose).unwrap();
    let off = between(start, node.view().unwrap().pose);
    assert!(off.iter().all(|off| off.abs() < 0.05), "{off:?}");
}
