//! The example drive through the node, in simulated time, against the robot's own localizer.

use sonarfix_ros::drive::{Drive, Errors};
use sonarfix_ros::motion::between;
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::Parameters;
use sonarfix_ros::view::Frames;
use sonarfix_ros::walls::Walls;

#[test]
fn the_node_estimates_what_the_robot_does() {
    let parameters = Parameters::default();
    let drive = Drive::classroom(120.0, 1_000_000_000, &Frames::of(&parameters)).unwrap();
    let walls = Walls::new(&drive.scenario.floor);
    let mut node = Node::new(&parameters, drive.scenario.robot, Some(walls)).unwrap();
    node.set_active(true);
    node.take(Input::InitialPose(Box::new(drive.start.clone())), 1_000_000_000);
    let mut truths = drive.truth.iter().peekable();
    let (mut own, mut of_node) = (Errors::default(), Errors::default());
    let mut largest = [0.0_f64; 3];
    for (at, input) in drive.messages {
        while let Some(truth) = truths.next_if(|truth| truth.at < at) {
            let Some(view) = node.view().filter(|view| view.at == truth.at) else { continue };
            own.add(truth.estimate, truth.pose);
            of_node.add(view.pose, truth.pose);
            let off = between(truth.estimate, view.pose);
            for (largest, off) in largest.iter_mut().zip(off) {
                *largest = largest.max(off.abs());
            }
        }
        node.take(input, at);
    }
    println!("robot {:?}, node {:?}, largest difference {largest:?}", own.rms(), of_node.rms());
    println!("{:?}", node.problems().values());
    assert!(own.count() > 1000, "{}", own.count());
    for (own, of_node) in own.rms().into_iter().zip(of_node.rms()) {
        assert!((of_node / own - 1.0).abs() < 0.02);
    }
}
