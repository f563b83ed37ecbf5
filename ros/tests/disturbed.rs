//! Inputs that are late, repeated, reordered, ahead of the clock, not finite, in wrong frames or missing, at five times of a drive
//! each: every case has a named problem, and the pose is right at the end.

#![expect(
    clippy::indexing_slicing,
    clippy::semicolon_if_nothing_returned,
    clippy::unwrap_used,
    reason = "all of this file is a test, its helpers too"
)]

use sonarfix::health::Verdict;
use sonarfix_ros::drive::Drive;
use sonarfix_ros::motion::between;
use sonarfix_ros::node::{Input, Node};
use sonarfix_ros::parameters::Parameters;
use sonarfix_ros::problem::{Nanoseconds, Problem};
use sonarfix_ros::publication::Output;
use sonarfix_ros::view::Frames;
use sonarfix_ros::walls::Walls;
use sonarfix_ros_messages::messages::{Odometry, RangeHeard, Time};

const SECOND: Nanoseconds = 1_000_000_000;
const BEGIN: Nanoseconds = 1000 * SECOND;
const LENGTH: f64 = 60.0;

type Message = (Nanoseconds, Input);

fn stamp(time: &mut Time, by: Nanoseconds) {
    *time = Time::of_nanoseconds(time.nanoseconds() + by);
}

/// Changes the stamps of a message.
fn restamp(input: &mut Input, by: Nanoseconds) {
    match input {
        Input::Odometry(message) => stamp(&mut message.header.stamp, by),
        Input::Range(_, message) => stamp(&mut message.header.stamp, by),
        Input::Transforms(message) => {
            for transform in &mut message.transforms {
                stamp(&mut transform.header.stamp, by);
            }
        }
        _ => {}
    }
}

/// The places of the messages from a time on that fulfil a condition.
fn places(messages: &[Message], from: Nanoseconds, is: impl Fn(&Input) -> bool) -> Vec<usize> {
    let all = messages.iter().enumerate();
    all.filter(|(_, (at, input))| *at >= from && is(input)).map(|(place, _)| place).collect()
}

fn is_odometry(input: &Input) -> bool {
    matches!(input, Input::Odometry(_))
}

fn is_range(input: &Input) -> bool {
    matches!(input, Input::Range(..))
}

fn is_transform(input: &Input) -> bool {
    matches!(input, Input::Transforms(_))
}

fn change_odometry(messages: &mut [Message], at: Nanoseconds, change: impl Fn(&mut Odometry)) {
    let place = places(messages, at, is_odometry)[0];
    if let Input::Odometry(message) = &mut messages[place].1 {
        change(message);
    }
}

fn change_range(messages: &mut [Message], at: Nanoseconds, change: impl Fn(&mut RangeHeard)) {
    let place = places(messages, at, is_range)[0];
    if let Input::Range(_, message) = &mut messages[place].1 {
        change(message);
    }
}

/// Delays the arrival of the first message of a kind.
fn delay(messages: &mut Vec<Message>, at: Nanoseconds, by: Nanoseconds, is: fn(&Input) -> bool) {
    let place = places(messages, at, is)[0];
    let (arrival, input) = messages.remove(place);
    insert(messages, arrival + by, input);
}

fn insert(messages: &mut Vec<Message>, at: Nanoseconds, input: Input) {
    let place = messages.partition_point(|(other, _)| *other <= at);
    messages.insert(place, (at, input));
}

fn repeat(messages: &mut Vec<Message>, at: Nanoseconds, is: fn(&Input) -> bool) {
    let place = places(messages, at, is)[0];
    messages.insert(place + 1, messages[place].clone());
}

/// Removes the messages of a kind for ten seconds.
fn drop_for_ten(messages: &mut Vec<Message>, at: Nanoseconds, is: fn(&Input) -> bool) {
    messages.retain(|(time, input)| !((at..at + 10 * SECOND).contains(time) && is(input)));
}

/// All later messages arrive with other stamps, and at other times of the clock if that was set as well.
fn shift(messages: &mut [Message], at: Nanoseconds, by: Nanoseconds, is_clock: bool) {
    for (arrival, input) in messages.iter_mut().filter(|(time, _)| *time >= at) {
        restamp(input, by);
        if is_clock {
            *arrival += by;
        }
    }
}

fn reset_odometry(messages: &mut [Message], at: Nanoseconds) {
    let mut origin = None;
    for (_, input) in messages.iter_mut().filter(|(time, _)| *time >= at) {
        let Input::Odometry(message) = input else { continue };
        let pose = sonarfix_ros_messages::geometry::planar(&message.pose.pose).unwrap();
        let origin = *origin.get_or_insert(pose);
        message.pose.pose = sonarfix_ros_messages::geometry::pose(between(origin, pose));
    }
}

type Change = fn(&mut Vec<Message>, Nanoseconds);

/// Each disturbance with the problem that it is reported as; `None`, if it is no problem.
fn cases() -> Vec<(&'static str, Option<Problem>, Change)> {
    use Problem as P;
    vec![
        ("range a little late", None, |m, at| delay(m, at, SECOND / 3, is_range)),
        ("range too late", Some(P::RangeLate), |m, at| delay(m, at, 3 * SECOND, is_range)),
        ("range twice", Some(P::RangeRepeated), |m, at| repeat(m, at, is_range)),
        ("ranges reordered", None, |m, at| delay(m, at, 6 * SECOND / 10, is_range)),
        ("range ahead of the clock", Some(P::RangeFuture), |m, at| {
            change_range(m, at, |range| stamp(&mut range.header.stamp, 10 * SECOND));
        }),
        ("range not a number", Some(P::RangeNotFinite), |m, at| {
            change_range(m, at, |range| range.range = f32::NAN)
        }),
        ("range negative infinite", None, |m, at| {
            change_range(m, at, |range| range.range = f32::NEG_INFINITY)
        }),
        ("range in a wrong frame", Some(P::RangeFrame), |m, at| {
            change_range(m, at, |range| range.header.frame_id = "camera".into());
        }),
        ("transforms missing", Some(P::RangeTransform), |m, at| drop_for_ten(m, at, is_transform)),
        ("transform late", None, |m, at| delay(m, at, SECOND / 20, is_transform)),
        ("transform not finite", Some(P::TransformNotFinite), |m, at| {
            let place = places(m, at, is_transform)[0];
            if let Input::Transforms(message) = &mut m[place].1 {
                message.transforms[0].transform.rotation.w = f64::NAN;
            }
        }),
        ("odometry twice", Some(P::OdometryRepeated), |m, at| repeat(m, at, is_odometry)),
        ("odometry reordered", Some(P::OdometryReordered), |m, at| {
            delay(m, at, SECOND / 5, is_odometry)
        }),
        ("odometry ahead of the clock", Some(P::OdometryFuture), |m, at| {
            change_odometry(m, at, |odometry| stamp(&mut odometry.header.stamp, 10 * SECOND));
        }),
        ("odometry not a number", Some(P::OdometryNotFinite), |m, at| {
            change_odometry(m, at, |odometry| odometry.pose.pose.position.x = f64::NAN);
        }),
        ("odometry without a rotation", Some(P::OdometryNotFinite), |m, at| {
            change_odometry(m, at, |odometry| odometry.pose.pose.orientation.w = 5.0);
        }),
        ("odometry in a wrong frame", Some(P::OdometryFrame), |m, at| {
            change_odometry(m, at, |odometry| odometry.header.frame_id = "map".into());
        }),
        ("odometry of another robot", Some(P::OdometryFrame), |m, at| {
            change_odometry(m, at, |odometry| odometry.child_frame_id = "other".into());
        }),
        ("no odometry for ten seconds", Some(P::OdometryGap), |m, at| {
            drop_for_ten(m, at, is_odometry)
        }),
        ("ranges without odometry", Some(P::RangeUnplaced), |m, at| {
            drop_for_ten(m, at, is_odometry)
        }),
        ("nothing for ten seconds", Some(P::ClockAhead), |m, at| drop_for_ten(m, at, |_| true)),
        ("no range for ten seconds", None, |m, at| drop_for_ten(m, at, is_range)),
        ("odometry reset", Some(P::OdometryReset), |m, at| reset_odometry(m, at)),
        ("stamps of the base set back", Some(P::OdometryClockReset), |m, at| {
            shift(m, at, -100 * SECOND, false)
        }),
        ("clock set back", Some(P::ClockBack), |m, at| shift(m, at, -50 * SECOND, true)),
        ("clock set ahead", Some(P::OdometryGap), |m, at| shift(m, at, 60 * SECOND, true)),
        ("bytes that are no message", Some(P::Undecodable), |m, at| {
            insert(m, at, Input::Undecodable)
        }),
    ]
}

struct Course {
    parameters: Parameters,
    drive: Drive,
}

impl Course {
    fn new() -> Self {
        let parameters = Parameters::default();
        // In an empty room, where the localizer itself is not in doubt.
        let drive = Drive::empty_classroom(LENGTH, BEGIN, &Frames::of(&parameters)).unwrap();
        Self { parameters, drive }
    }

    fn node(&self) -> Node {
        let walls = Walls::new(&self.drive.scenario.floor);
        let mut node = Node::new(&self.parameters, self.drive.scenario.robot, Some(walls)).unwrap();
        node.set_active(true);
        node.take(Input::InitialPose(Box::new(self.drive.start.clone())), BEGIN);
        node
    }

    /// Runs the drive with a disturbance, and checks that a pose is published up to the end.
    fn run(&self, change: Change, at: Nanoseconds) -> Node {
        let mut messages = self.drive.messages.clone();
        change(&mut messages, at);
        let (mut node, mut published) = (self.node(), 0);
        let end = messages.len() - 20;
        for (number, (at, input)) in messages.into_iter().enumerate() {
            let out = node.take(input, at);
            let is_pose = |output: &&Output| matches!(output, Output::Pose(_));
            published += out.iter().filter(is_pose).count() * usize::from(number > end);
        }
        assert!(published > 0, "no pose at the end");
        node
    }
}

#[test]
fn every_disturbance_is_named_and_harmless() {
    let course = Course::new();
    let truth = course.drive.truth.last().unwrap().pose;
    let mut count = 0;
    for (name, problem, change) in cases() {
        for second in [12, 17, 23, 28, 34] {
            let node = course.run(change, BEGIN + second * SECOND + SECOND / 7);
            let counts = node.problems().values();
            let context = format!("{name} at {second} s: {counts:?}");
            if let Some(problem) = problem {
                assert!(node.problems().count(problem) > 0, "{context}");
            } else {
                let usual = [Problem::NoOdometry, Problem::RangeBeforeStart];
                assert!(node.problems().occurred().all(|it| usual.contains(&it)), "{context}");
            }
            let view = node.view().unwrap();
            let [x, y, heading] = between(truth, view.pose);
            assert!(x.hypot(y) < 0.08 && heading.abs() < 0.08, "{x} {y} {heading} {context}");
            assert_ne!(view.verdict, Verdict::Lost, "{context}");
            count += 1;
        }
    }
    assert!(count >= 100, "{count}");
}

/// A range that arrives within the history gives the same estimate as one in time.
#[test]
fn a_late_range_is_used_at_its_time() {
    let course = Course::new();
    let pose = |node: &Node| node.view().unwrap().pose.map(f64::to_bits);
    let usual = course.run(|_, _| {}, BEGIN);
    let late = course.run(
        |messages, _| {
            for (at, input) in messages.iter_mut() {
                if is_range(input) {
                    *at += SECOND / 4;
                }
            }
            messages.sort_by_key(|(at, _)| *at);
        },
        BEGIN,
    );
    assert_eq!(pose(&usual), pose(&late));
}

/// Poses that are not used leave the estimate as it is.
#[test]
fn poses_that_are_none_are_named() {
    let course = Course::new();
    let mut node = course.run(|_, _| {}, BEGIN);
    let before = node.view().unwrap();
    let now = BEGIN + 61 * SECOND;
    let mut pose = course.drive.start.clone();
    pose.header.frame_id = "odom".into();
    node.take(Input::InitialPose(Box::new(pose)), now);
    assert_eq!(node.problems().count(Problem::PoseFrame), 1);
    let mut pose = course.drive.start.clone();
    pose.pose.covariance.0[0][0] = f64::NAN;
    node.take(Input::InitialPose(Box::new(pose)), now);
    let mut pose = course.drive.start.clone();
    pose.pose.pose.position.y = f64::INFINITY;
    node.take(Input::InitialPose(Box::new(pose)), now);
    assert_eq!(node.problems().count(Problem::PoseNotFinite), 2);
    assert_eq!(node.view().unwrap(), before);
    // One of another place is used, and moved by the odometry since its stamp.
    let mut pose = course.drive.start.clone();
    pose.pose.pose = sonarfix_ros_messages::geometry::pose([2.0, 3.0, 0.5]);
    node.take(Input::InitialPose(Box::new(pose)), now);
    let off = between([2.0, 3.0, 0.5], node.view().unwrap().pose);
    assert!(off.iter().all(|off| off.abs() < 1e-6), "{off:?}");
}
