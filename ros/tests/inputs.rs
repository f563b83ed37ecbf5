//! The further inputs of the node: wheels as joints, an IMU, a scan, a grid.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]

use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_ros::drive::Drive;
use sonarfix_ros::motion::{Planar, between};
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::{Parameters, Value};
use sonarfix_ros::problem::Problem;
use sonarfix_ros::view::{Frames, header};
use sonarfix_ros::walls::Walls;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    Imu, JointState, LaserScan, OccupancyGrid, Odometry, Vector3,
};

const BEGIN: i64 = 1_000_000_000_000;
const RADIUS: f64 = 0.03;

fn text(parameters: &mut Parameters, name: &str, value: &str) {
    parameters.set_text(name, value).unwrap();
}

fn drive(parameters: &Parameters) -> Drive {
    Drive::empty_classroom(40.0, BEGIN, &Frames::of(parameters)).unwrap()
}

fn begun(mut node: Node, drive: &Drive) -> Node {
    node.set_active(true);
    node.take(Input::InitialPose(Box::new(drive.start.clone())), BEGIN);
    node
}

fn node(parameters: &Parameters, drive: &Drive) -> Node {
    let walls = Walls::new(&drive.scenario.floor);
    begun(Node::new(parameters, drive.scenario.robot, Some(walls)).unwrap(), drive)
}

fn is_close(found: Planar, expected: Planar, metres: f64, radians: f64) -> bool {
    let [x, y, heading] = between(expected, found);
    x.hypot(y) < metres && heading.abs() < radians
}

/// The wheels of the drive, from the poses of its odometry.
#[test]
fn joints_give_the_estimate_of_the_odometry() {
    let mut parameters = Parameters::default();
    let drive = drive(&parameters);
    let mut usual = node(&parameters, &drive);
    text(&mut parameters, "odometry_source", "joints");
    text(&mut parameters, "wheel_radius", &RADIUS.to_string());
    let mut of_joints = node(&parameters, &drive);
    let width = f64::from(drive.scenario.robot.localizer.drive.track_width.0);
    let (mut last, mut wheels) = ([0.0; 3], [0.0_f64; 2]);
    for (at, input) in drive.messages.iter().cloned() {
        usual.take(input.clone(), at);
        let input = match input {
            Input::Odometry(message) => {
                let pose = geometry::planar(&message.pose.pose).unwrap();
                let [dx, dy, turn] = between(last, pose);
                let ahead = dx * (0.5 * turn).cos() + dy * (0.5 * turn).sin();
                wheels[0] += (ahead + 0.5 * width * turn) / RADIUS;
                wheels[1] += (ahead - 0.5 * width * turn) / RADIUS;
                last = pose;
                Input::Joints(JointState {
                    header: message.header.clone(),
                    name: vec!["right_wheel_joint".into(), "left_wheel_joint".into()],
                    position: wheels.into(),
                    ..JointState::default()
                })
            }
            other => other,
        };
        of_joints.take(input, at);
    }
    let (found, expected) = (of_joints.view().unwrap(), usual.view().unwrap());
    assert!(is_close(found.pose, expected.pose, 1e-4, 1e-4), "{found:?} {expected:?}");
    assert!(is_close(found.odometry, expected.odometry, 1e-6, 1e-6));
}

/// An IMU that measures the true turns.
#[test]
fn an_imu_measures_the_turns() {
    let mut parameters = Parameters::default();
    text(&mut parameters, "imu_topic", "imu");
    let mut drive = drive(&parameters);
    drive.scenario.robot.localizer.gyro = Some(GyroParameters::MPU_6050);
    let mut node = node(&parameters, &drive);
    let mut truths = drive.truth.windows(2).peekable();
    for (at, input) in drive.messages.iter().cloned() {
        while let Some(&[from, to]) =
            truths.next_if(|pair| pair.first().is_some_and(|it| it.at <= at))
        {
            let [.., turn] = between(from.pose, to.pose);
            let seconds = sonarfix_ros::motion::seconds(to.at - from.at);
            for part in 0..10 {
                let imu = Imu {
                    header: header(from.at + part * (to.at - from.at) / 10, "imu"),
                    angular_velocity: Vector3 { x: 0.0, y: 0.0, z: turn / seconds },
                    ..Imu::default()
                };
                node.take(Input::Imu(Box::new(imu)), at);
            }
        }
        node.take(input, at);
    }
    assert!(node.problems().count(Problem::ImuGap) < 5, "{:?}", node.problems().values());
    let (view, truth) = (node.view().unwrap(), drive.truth.last().unwrap().pose);
    assert!(is_close(view.pose, truth, 0.03, 0.02), "{view:?} {truth:?}");
}

fn standing(at: i64, frames: &Frames) -> Input {
    let mut message = Odometry {
        header: header(at, &frames.odom),
        child_frame_id: frames.base.clone(),
        ..Odometry::default()
    };
    message.pose.pose = geometry::pose([0.0; 3]);
    Input::Odometry(Box::new(message))
}

/// A robot at (1.5, 1.5) m in the room of 6 m × 8 m, which faces along x, and whose start is off by centimetres. Its ranger is
/// 6 cm ahead.
#[test]
fn beams_of_a_scan_correct_the_pose() {
    let mut parameters = Parameters::default();
    text(&mut parameters, "base_frame_id", "base_link");
    text(&mut parameters, "scan_topic", "scan");
    let quarter = std::f64::consts::FRAC_PI_2;
    parameters.set("scan_bearings", Value::Doubles(vec![-quarter, quarter, 0.0])).unwrap();
    let (drive, frames) = (drive(&parameters), Frames::of(&parameters));
    let mut node = node(&parameters, &drive);
    node.take(standing(BEGIN, &frames), BEGIN);
    let mut start = drive.start.clone();
    start.pose.pose = geometry::pose([1.54, 1.47, 0.01]);
    start.pose.covariance =
        geometry::covariance([[0.0025, 0.0, 0.0], [0.0, 0.0025, 0.0], [0.0, 0.0, 0.0009]]);
    node.take(Input::InitialPose(Box::new(start)), BEGIN);
    for n in 1..40 {
        let at = BEGIN + n * 100_000_000;
        let mut ranges = vec![f32::INFINITY; 181];
        for (beam, range) in [(0, 1.5), (90, 4.44), (180, 6.5)] {
            *ranges.get_mut(beam).unwrap() = range;
        }
        let scan = LaserScan {
            header: header(at, "base_link"),
            angle_min: -1.570_796_4,
            angle_max: 1.570_796_4,
            angle_increment: 0.017_453_292,
            range_min: 0.1,
            range_max: 10.0,
            ranges,
            ..LaserScan::default()
        };
        node.take(standing(at, &frames), at);
        node.take(Input::Scan(scan), at);
    }
    let view = node.view().unwrap();
    // The ranger of the robot file reaches 3.5 m: of the three beams the one to the right counts.
    let [_, y, _] = view.pose;
    assert!((y - 1.5).abs() < 0.01, "{view:?}");
}

/// A grid of the room, whose walls are lines of cells of 5 cm.
#[test]
fn a_grid_becomes_walls_and_keeps_the_pose() {
    let parameters = Parameters::default();
    let drive = drive(&parameters);
    let mut node = begun(Node::new(&parameters, drive.scenario.robot, None).unwrap(), &drive);
    let (width, height) = (140_usize, 180_usize);
    let mut grid = OccupancyGrid { header: header(BEGIN, "map"), ..OccupancyGrid::default() };
    grid.info.resolution = 0.05;
    (grid.info.width, grid.info.height) = (140, 180);
    grid.info.origin = geometry::pose([-0.475, -0.475, 0.0]);
    let is_wall = |x: usize, y: usize| {
        ([9, 129].contains(&x) && (9..=169).contains(&y))
            || ([9, 169].contains(&y) && (9..=129).contains(&x))
    };
    grid.data = (0..width * height)
        .map(|cell| 100 * i8::from(is_wall(cell % width, cell / width)))
        .collect();
    let mut half_read = grid.clone();
    half_read.data.pop();
    node.take(Input::Map(half_read), BEGIN);
    assert_eq!(node.problems().count(Problem::MapInvalid), 1);
    node.take(Input::Map(grid.clone()), BEGIN);
    assert_eq!(node.problems().count(Problem::MapFromGrid), 1);
    for (place, (at, input)) in drive.messages.iter().cloned().enumerate() {
        if place == drive.messages.len() / 2 {
            // A map server that restarts.
            let before = node.view().unwrap();
            node.take(Input::Map(grid.clone()), at);
            assert!(is_close(node.view().unwrap().pose, before.pose, 1e-6, 1e-6));
        }
        node.take(input, at);
    }
    let (view, truth) = (node.view().unwrap(), drive.truth.last().unwrap().pose);
    assert!(is_close(view.pose, truth, 0.08, 0.05), "{view:?} {truth:?}");
}
