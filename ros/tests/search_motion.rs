//! A robot that searches moves as the node requests it: a base that drives with the velocities, in a world of walls, whose odometry and
//! ranges go back to the node.

#![expect(clippy::unwrap_used, reason = "all of this file is a test, its helpers too")]
#![expect(clippy::float_cmp, reason = "the velocity of a robot that stands is exactly zero")]

use std::path::PathBuf;

use sonarfix::geometry::units::Metres;
use sonarfix::localizer::Mode;
use sonarfix_hal::config::{RobotConfig, SearchMotion, SearchMotionKind, StartPose};
use sonarfix_map::{Floor, NamedWall, robot_file};
use sonarfix_ros::drive::{Drive, SONAR};
use sonarfix_ros::lifecycle::Transition;
use sonarfix_ros::managed::{Effect, Managed};
use sonarfix_ros::motion::{Planar, between, moved, seconds};
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::{Parameters, Value};
use sonarfix_ros::problem::{Nanoseconds, Problem};
use sonarfix_ros::publication::Output;
use sonarfix_ros::view::{Frames, header, transform};
use sonarfix_ros::walls::Walls;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{Odometry, RangeHeard, TFMessage, Time, Twist};
use sonarfix_sim::world::segment::distance;
use sonarfix_sim::world::sensor::SensorModel;
use sonarfix_sim::world::{Ping, World};

const MILLISECOND: Nanoseconds = 1_000_000;
const SECOND: Nanoseconds = 1000 * MILLISECOND;
const BEGIN: Nanoseconds = 1000 * SECOND;
const STEP: Nanoseconds = 10 * MILLISECOND;
const ODOMETRY_PERIOD: Nanoseconds = 50 * MILLISECOND;
const PING_PERIOD: Nanoseconds = 70 * MILLISECOND;
/// How late a range arrives.
const DELAY: Nanoseconds = 30 * MILLISECOND;
/// The base stops after this time without a velocity.
const WATCHDOG: Nanoseconds = 200 * MILLISECOND;
/// Radius of the robot, metres.
const RADIUS: f64 = 0.1;
/// The sweep of the servo, radians.
const LIMIT: f64 = 1.5;
const SERVO_STEP: f64 = 0.17;

/// A room of 7 m × 6 m without symmetry.
fn floor() -> Floor {
    let corners = [
        [0.0, 0.0],
        [7.0, 0.0],
        [7.0, 3.5],
        [4.5, 3.5],
        [4.5, 6.0],
        [1.2, 6.0],
        [1.2, 4.6],
        [0.0, 4.6],
    ];
    let ends = corners.iter().zip(corners.iter().cycle().skip(1)).enumerate();
    let wall = |(n, (from, to)): (usize, (&[f64; 2], &[f64; 2]))| {
        NamedWall::new(format!("wall {n}"), *from, *to).unwrap()
    };
    Floor::new(ends.map(wall).collect())
}

/// The robot of the classroom.
fn config(kind: SearchMotionKind) -> RobotConfig {
    let mut config = Drive::empty_classroom(1.0, 0, &Frames::default()).unwrap().scenario.robot;
    let motion = SearchMotion { kind, bumper: Metres(0.3) };
    config.start = StartPose::Exploring { region: None, motion };
    config
}

fn parameters(topic: &str) -> Parameters {
    let mut parameters = Parameters::default();
    parameters.set("search_motion_topic", Value::Text(topic.into())).unwrap();
    parameters
}

/// What takes messages: a node, with or without its states.
trait Takes {
    fn take(&mut self, input: Input, now: Nanoseconds) -> Vec<Output>;
}

impl Takes for Node {
    fn take(&mut self, input: Input, now: Nanoseconds) -> Vec<Output> {
        Node::take(self, input, now)
    }
}

impl Takes for Managed {
    fn take(&mut self, input: Input, now: Nanoseconds) -> Vec<Output> {
        Managed::take(self, input, now);
        published(self.effects())
    }
}

fn published(effects: Vec<Effect>) -> Vec<Output> {
    let output = |effect| if let Effect::Publish(output) = effect { Some(output) } else { None };
    effects.into_iter().filter_map(output).collect()
}

/// Ahead, m/s, and counter-clockwise, rad/s.
fn velocity(twist: &Twist) -> [f64; 2] {
    let (linear, angular) = (&twist.linear, &twist.angular);
    assert_eq!([linear.y, linear.z, angular.x, angular.y], [0.0; 4]);
    [linear.x, angular.z]
}

/// What is published of the motion.
fn velocities(out: &[Output]) -> Vec<[f64; 2]> {
    let twist = |output: &Output| {
        if let Output::Velocity(twist) = output { Some(velocity(twist)) } else { None }
    };
    out.iter().filter_map(twist).collect()
}

/// The base, its sonar on a servo, and the world around them.
struct Robot {
    world: World,
    sensor: SensorModel,
    frames: Frames,
    mount: [f64; 2],
    start: Planar,
    pose: Planar,
    now: Nanoseconds,
    command: [f64; 2],
    commanded: Nanoseconds,
    bearing: f64,
    servo_step: f64,
    /// Messages that have not arrived, with the time when they do.
    underway: Vec<(Nanoseconds, Input)>,
    /// Least distance from a wall, and distance driven.
    nearest: f64,
    driven: f64,
    /// All velocities.
    received: Vec<[f64; 2]>,
    /// Changes each message.
    spoil: fn(&mut Input),
}

impl Robot {
    fn new(config: &RobotConfig, start: Planar) -> Self {
        let mount = config.localizer.rangers.first.mount;
        Self {
            world: World::new(&floor()),
            sensor: SensorModel::hc_sr04(),
            frames: Frames::of(&Parameters::default()),
            mount: [mount.x.0, mount.y.0].map(f64::from),
            start,
            pose: start,
            now: BEGIN,
            command: [0.0; 2],
            commanded: BEGIN,
            bearing: 0.0,
            servo_step: SERVO_STEP,
            underway: Vec::new(),
            nearest: f64::INFINITY,
            driven: 0.0,
            received: Vec::new(),
            spoil: |_| {},
        }
    }

    fn follow(&mut self, out: &[Output]) {
        for command in velocities(out) {
            self.received.push(command);
            (self.command, self.commanded) = (command, self.now);
        }
    }

    fn roll(&mut self) {
        self.now += STEP;
        let is_stopped = self.now - self.commanded > WATCHDOG;
        let [ahead, turn] = if is_stopped { [0.0; 2] } else { self.command };
        let [ahead, turn] = [ahead, turn].map(|speed| speed * seconds(STEP));
        self.pose =
            moved(self.pose, [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn]);
        self.driven += ahead.abs();
        let [x, y, _] = self.pose;
        let walls = self.world.walls().iter();
        self.nearest =
            walls.map(|wall| distance([x, y], wall.nearest([x, y]))).fold(self.nearest, f64::min);
    }

    fn odometry(&self) -> Odometry {
        let mut message = Odometry {
            header: header(self.now, &self.frames.odom),
            child_frame_id: self.frames.base.clone(),
            ..Odometry::default()
        };
        message.pose.pose = geometry::pose(between(self.start, self.pose));
        message
    }

    /// A ping, and the next step of the servo.
    fn range(&mut self) -> (TFMessage, RangeHeard) {
        let [x, y, direction] = moved(self.pose, [self.mount[0], self.mount[1], self.bearing]);
        let ping = Ping { time: 0.0, sonar_after: &|_| [x, y], direction };
        let reflectors = self.world.reflectors(&ping, &self.sensor);
        let heard = reflectors.iter().find(|reflector| reflector.audible > 0.5);
        #[expect(clippy::cast_possible_truncation, reason = "as the message has it")]
        let range = heard.map_or(f32::INFINITY, |reflector| reflector.distance as f32);
        let [min_range, max_range] = [0.02, 3.5];
        let header = header(self.now, SONAR);
        let message = RangeHeard { header, min_range, max_range, range, ..RangeHeard::default() };
        let place = [self.mount[0], self.mount[1], self.bearing];
        let transforms = vec![transform(self.now, [&self.frames.base, SONAR], place)];
        if (self.bearing + self.servo_step).abs() > LIMIT {
            self.servo_step = -self.servo_step;
        }
        self.bearing += self.servo_step;
        (TFMessage { transforms }, message)
    }

    /// Sends a message that arrives after a delay.
    fn send(&mut self, delay: Nanoseconds, mut input: Input) {
        (self.spoil)(&mut input);
        self.underway.push((self.now + delay, input));
    }

    /// Drives for a step, and exchanges messages with the node.
    fn step(&mut self, node: &mut impl Takes) {
        self.roll();
        if self.now % ODOMETRY_PERIOD == 0 {
            self.send(0, Input::Odometry(Box::new(self.odometry())));
        }
        if self.now % PING_PERIOD == 0 {
            let (transforms, range) = self.range();
            self.send(0, Input::Transforms(transforms));
            self.send(DELAY, Input::Range(0, range));
        }
        let (due, later) = self.underway.drain(..).partition(|(at, _)| *at <= self.now);
        self.underway = later;
        let due: Vec<(Nanoseconds, Input)> = due;
        for (_, input) in due.into_iter().chain([(self.now, Input::Tick)]) {
            let out = node.take(input, self.now);
            self.follow(&out);
        }
    }

    fn run(&mut self, node: &mut impl Takes, length: Nanoseconds) {
        for _ in 0..length / STEP {
            self.step(node);
        }
    }

    /// What was published since the last call.
    fn take_received(&mut self) -> Vec<[f64; 2]> {
        std::mem::take(&mut self.received)
    }
}

fn is_searching(node: &Node) -> bool {
    node.view().is_none_or(|view| view.mode == Mode::Searching)
}

fn node(parameters: &Parameters, config: &RobotConfig) -> Node {
    let mut node = Node::new(parameters, *config, Some(Walls::new(&floor()))).unwrap();
    assert_eq!(node.set_active(true), None);
    node
}

/// A robot that moves.
fn moving(kind: SearchMotionKind) -> (Node, Robot) {
    let config = config(kind);
    let mut node = node(&parameters("cmd_vel"), &config);
    let mut robot = Robot::new(&config, [2.4, 3.2, 0.3]);
    while robot.command == [0.0; 2] {
        assert!(robot.now < BEGIN + 20 * SECOND && is_searching(&node), "it stands");
        robot.step(&mut node);
    }
    robot.run(&mut node, SECOND / 2);
    robot.take_received();
    (node, robot)
}

#[test]
fn the_robot_finds_its_pose_and_touches_no_wall() {
    let config = config(SearchMotionKind::Ahead);
    for start in [[2.4, 3.2, 0.3], [0.8, 0.8, 0.8]] {
        let mut node = node(&parameters("cmd_vel"), &config);
        let mut robot = Robot::new(&config, start);
        while is_searching(&node) {
            assert!(robot.now < BEGIN + 120 * SECOND, "{start:?}: no pose");
            robot.step(&mut node);
        }
        let [x, y, heading] = between(robot.pose, node.view().unwrap().pose);
        assert!(x.hypot(y) < 0.06 && heading.abs() < 0.06, "{start:?}: {x} {y} {heading}");
        assert!(robot.driven > 0.2 && robot.nearest > RADIUS, "{start:?}: {}", robot.nearest);
        let stops = robot.take_received();
        let [before @ .., last] = stops.as_slice() else { panic!("it has not moved") };
        assert_eq!(*last, [0.0; 2], "{start:?}");
        assert!(before.last().is_some_and(|before| *before != [0.0; 2]), "{start:?}");
        robot.run(&mut node, 5 * SECOND);
        assert_eq!(robot.take_received(), Vec::<[f64; 2]>::new(), "{start:?}");
    }
}

/// The velocities go on with each odometry message, so that the base does not stop.
#[test]
fn the_velocity_is_repeated() {
    let (mut node, mut robot) = moving(SearchMotionKind::Spin);
    robot.run(&mut node, SECOND);
    assert_eq!(i64::try_from(robot.take_received().len()), Ok(SECOND / ODOMETRY_PERIOD));
}

#[test]
fn without_a_topic_nothing_moves() {
    let config = config(SearchMotionKind::Ahead);
    let mut node = node(&parameters(""), &config);
    let mut robot = Robot::new(&config, [2.4, 3.2, 0.3]);
    robot.run(&mut node, 10 * SECOND);
    assert_eq!(robot.take_received(), Vec::<[f64; 2]>::new());
    assert!(is_searching(&node));
}

#[test]
fn a_topic_without_a_motion_in_the_robot_file_is_an_error() {
    let mut config = config(SearchMotionKind::Ahead);
    config.start = StartPose::Unknown { region: None };
    let Err(error) = Node::new(&parameters("cmd_vel"), config, None) else {
        panic!("it has started")
    };
    assert!(error.to_string().contains("search_motion"), "{error}");
}

fn spoil_odometry(input: &mut Input) {
    if let Input::Odometry(message) = input {
        message.pose.pose.position.x = f64::NAN;
    }
}

fn spoil_range(input: &mut Input) {
    if let Input::Range(_, message) = input {
        message.range = f32::NAN;
    }
}

/// Neither odometry nor ranges that are no numbers move the robot.
#[test]
fn what_is_no_number_stops_the_robot() {
    let spoils: [(fn(&mut Input), _); 2] =
        [(spoil_odometry, Problem::OdometryNotFinite), (spoil_range, Problem::RangeNotFinite)];
    for kind in [SearchMotionKind::Ahead, SearchMotionKind::Spin] {
        for (spoil, problem) in spoils {
            let (mut node, mut robot) = moving(kind);
            robot.spoil = spoil;
            robot.run(&mut node, 3 * SECOND / 2);
            let received = robot.take_received();
            let zeros = received.iter().filter(|velocity| **velocity == [0.0; 2]).count();
            assert_eq!((received.last(), zeros), (Some(&[0.0; 2]), 1), "{kind:?} {problem:?}");
            robot.run(&mut node, 10 * SECOND);
            assert_eq!(robot.take_received(), Vec::<[f64; 2]>::new(), "{kind:?} {problem:?}");
            assert!(node.problems().count(problem) > 0 && is_searching(&node));
        }
    }
}

/// Odometry that does not arrive any more.
#[test]
fn silence_of_the_odometry_stops_the_robot() {
    let (mut node, robot) = moving(SearchMotionKind::Spin);
    let tick = |node: &mut Node, after| velocities(&node.take(Input::Tick, robot.now + after));
    assert_eq!(tick(&mut node, 400 * MILLISECOND), Vec::<[f64; 2]>::new());
    assert_eq!(tick(&mut node, 600 * MILLISECOND), [[0.0; 2]]);
    assert_eq!(tick(&mut node, 700 * MILLISECOND), Vec::<[f64; 2]>::new());
}

/// What the base moved is not known if its clock is set back, or if it moved faster than its wheels can: the robot sweeps first.
#[test]
fn a_travel_that_is_not_known_stops_the_robot() {
    let (mut node, robot) = moving(SearchMotionKind::Ahead);
    let mut message = robot.odometry();
    let mut received = Vec::new();
    for number in 1..=10 {
        message.header.stamp = Time::of_nanoseconds(robot.now - 100 * SECOND + number * STEP);
        let input = Input::Odometry(Box::new(message.clone()));
        received.extend(velocities(&node.take(input, robot.now + number * STEP)));
    }
    assert_eq!(node.problems().count(Problem::OdometryClockReset), 1);
    assert_eq!(received, [[0.0; 2]]);

    let (mut node, mut robot) = moving(SearchMotionKind::Ahead);
    let most = f64::from(config(SearchMotionKind::Ahead).localizer.max_wheel_speed.0);
    robot.now += ODOMETRY_PERIOD - robot.now % ODOMETRY_PERIOD;
    robot.pose = moved(robot.pose, [1.05 * most * seconds(ODOMETRY_PERIOD), 0.0, 0.0]);
    let input = Input::Odometry(Box::new(robot.odometry()));
    assert_eq!(velocities(&node.take(input, robot.now)), [[0.0; 2]]);
    assert_eq!(node.problems().count(Problem::OdometryRefused), 1);
}

/// A pose that a person sets ends the search.
#[test]
fn a_pose_that_is_set_stops_the_robot() {
    let (mut node, robot) = moving(SearchMotionKind::Spin);
    let mut pose = Drive::empty_classroom(1.0, 0, &Frames::default()).unwrap().start;
    pose.header = header(robot.now, "map");
    pose.pose.pose = geometry::pose(robot.pose);
    assert_eq!(velocities(&node.take(Input::InitialPose(Box::new(pose)), robot.now)), [[0.0; 2]]);
}

/// The node with its states, from files.
fn managed() -> (Managed, Robot) {
    let config = config(SearchMotionKind::Spin);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let mut parameters = parameters("cmd_vel");
    let files = [("robot", robot_file::text(&config)), ("map", floor().to_toml())];
    for (name, text) in files {
        let file = folder.join(format!("search_motion_{name}.toml"));
        std::fs::write(&file, text).unwrap();
        parameters.set_text(&format!("{name}_file"), file.to_str().unwrap()).unwrap();
    }
    let mut managed = Managed::new("/sonarfix".into(), parameters);
    assert!(managed.change(Transition::Configure, BEGIN), "{:?}", managed.effects());
    (managed, Robot::new(&config, [2.4, 3.2, 0.3]))
}

/// It stands with the end of the activity, before its topics are removed, and begins anew with the next one.
#[test]
fn a_node_that_is_deactivated_stops_the_robot() {
    let (mut managed, mut robot) = managed();
    robot.run(&mut managed, 2 * SECOND);
    assert_eq!(robot.take_received(), Vec::<[f64; 2]>::new());
    for end in [Transition::Deactivate, Transition::Shutdown] {
        assert!(managed.change(Transition::Activate, robot.now));
        robot.run(&mut managed, 2 * SECOND);
        assert!(robot.take_received().last().is_some_and(|[_, turn]| *turn > 0.0));
        assert!(managed.change(end, robot.now));
        let effects = managed.effects();
        assert!(matches!(effects[..], [Effect::Publish(_), Effect::Changed(..)]), "{effects:?}");
        assert_eq!(velocities(&published(effects)), [[0.0; 2]]);
        robot.run(&mut managed, 2 * SECOND);
        assert_eq!(robot.take_received(), Vec::<[f64; 2]>::new());
    }
}
