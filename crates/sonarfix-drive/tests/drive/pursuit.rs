//! Routes of a robot that has the commanded motion at once, with ten estimates a second.

use proptest::prelude::*;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, Radians};
use sonarfix::health::Verdict;
use sonarfix_drive::pursuit::{Limits, Progress, Pursuit, Reason, RouteError, Situation};
use sonarfix_link::Motion;

const LIMITS: Limits = Limits::SMALL;
/// Time between two estimates, seconds.
const PERIOD: f32 = 0.1;

fn tracking(pose: Pose) -> Situation {
    Situation { pose, deviation: Metres(0.01), verdict: Verdict::Tracking, ahead: None }
}

fn moved(pose: Pose, motion: Motion) -> Pose {
    let (length, turn) = (motion.speed.0 * PERIOD, motion.turn.0 * PERIOD);
    let middle = pose.heading.turned(Radians(0.5 * turn)).radians().0;
    let heading = pose.heading.turned(Radians(turn)).radians();
    Pose::new(pose.x.0 + length * middle.cos(), pose.y.0 + length * middle.sin(), heading)
}

fn distance(one: Point, other: Point) -> f32 {
    (one.x.0 - other.x.0).hypot(one.y.0 - other.y.0)
}

/// Distance of a point from a segment.
fn aside(point: Point, from: Point, to: Point) -> f32 {
    let (x, y) = (to.x.0 - from.x.0, to.y.0 - from.y.0);
    let (px, py) = (point.x.0 - from.x.0, point.y.0 - from.y.0);
    let share = ((px * x + py * y) / (x * x + y * y).max(1e-12)).clamp(0.0, 1.0);
    (px - share * x).hypot(py - share * y)
}

/// The poses up to the end of the route.
fn drive(start: Pose, route: &[Point]) -> Vec<Pose> {
    let mut pursuit = Pursuit::new(route, LIMITS).unwrap();
    let mut poses = vec![start];
    loop {
        let pose = *poses.last().unwrap();
        let (progress, motion) = pursuit.drive(&tracking(pose));
        assert!(motion.speed.0 >= 0.0 && motion.speed <= LIMITS.speed, "{motion:?}");
        assert!(motion.turn.0.abs() <= LIMITS.turn.0 * 1.001, "{motion:?}");
        if progress == Progress::Arrived {
            assert_eq!(motion, Motion::default());
            assert_eq!(pursuit.drive(&tracking(start)), (Progress::Arrived, Motion::default()));
            return poses;
        }
        assert!(progress == Progress::Driving && poses.len() < 2_000, "{progress:?} {pose:?}");
        poses.push(moved(pose, motion));
    }
}

fn any_point() -> impl Strategy<Value = Point> {
    (-3.0_f32..3.0, -3.0_f32..3.0).prop_map(|(x, y)| Point::new(x, y))
}

fn any_pose() -> impl Strategy<Value = Pose> {
    (any_point(), -3.2_f32..3.2)
        .prop_map(|(at, heading)| Pose::new(at.x.0, at.y.0, Radians(heading)))
}

proptest! {
    /// The robot arrives at every point, near the straight line, in about the time that the line takes.
    #[test]
    fn the_robot_arrives(start in any_pose(), end in any_point()) {
        let poses = drive(start, &[end]);
        let from = start.position();
        for pose in &poses {
            let off = aside(pose.position(), from, end);
            prop_assert!(off < 0.5 * LIMITS.look_ahead.0, "{} m off at {:?}", off, pose);
        }
        let last = poses.last().unwrap().position();
        prop_assert!(distance(last, end) <= LIMITS.tolerance.0);
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let seconds = PERIOD * poses.len() as f32;
        // A half turn takes 3 s and its end 1 s; the approach some time constants.
        let line = distance(from, end) / LIMITS.speed.0;
        prop_assert!(seconds < 1.1 * line + 8.0, "{} s of {}", seconds, line);
    }

    /// The robot stays within the look-ahead distance of a polyline, passes its corners within that distance and ends at its end.
    #[test]
    fn the_robot_follows_a_polyline(start in any_pose(), route in prop::collection::vec(any_point(), 1..6)) {
        let poses = drive(start, &route);
        let near = |point: Point| {
            poses.iter().map(|pose| distance(pose.position(), point)).fold(f32::MAX, f32::min)
        };
        // The travel between two estimates.
        let step = LIMITS.speed.0 * PERIOD;
        for corner in &route {
            prop_assert!(near(*corner) <= LIMITS.look_ahead.0 + step, "{:?} is missed", corner);
        }
        let corners: Vec<Point> = std::iter::once(start.position()).chain(route.clone()).collect();
        for pose in &poses {
            let legs = corners.windows(2).map(|leg| aside(pose.position(), leg[0], leg[1]));
            let off = legs.fold(f32::MAX, f32::min);
            prop_assert!(off < LIMITS.look_ahead.0, "{} m off at {:?}", off, pose);
        }
        let last = poses.last().unwrap().position();
        prop_assert!(distance(last, *route.last().unwrap()) <= LIMITS.tolerance.0);
    }

    /// Whatever is known about the robot, the motion is finite and within the limits; one that is stopped stands.
    #[test]
    fn any_situation_has_a_safe_motion(
        pose in any_pose(),
        deviation in prop::num::f32::ANY,
        ahead in prop::option::of(prop::num::f32::ANY),
        verdict in 0_usize..3,
        end in any_point(),
    ) {
        let verdict = [Verdict::Tracking, Verdict::Degraded, Verdict::Lost][verdict];
        let situation =
            Situation { pose, deviation: Metres(deviation), verdict, ahead: ahead.map(Metres) };
        let route = [end];
        let mut pursuit = Pursuit::new(&route, LIMITS).unwrap();
        let (progress, motion) = pursuit.drive(&situation);
        prop_assert!((0.0..=LIMITS.speed.0).contains(&motion.speed.0));
        prop_assert!(motion.turn.0.abs() <= LIMITS.turn.0 * 1.001);
        let is_certain = deviation <= LIMITS.max_deviation.0;
        let must_stand = verdict == Verdict::Lost || !is_certain;
        prop_assert!(!must_stand || motion == Motion::default());
        prop_assert_eq!(must_stand, matches!(progress, Progress::Stopped(Reason::Lost | Reason::Uncertain)));
        prop_assert!(progress == Progress::Driving || motion == Motion::default());
        if ahead.is_some_and(|ahead| ahead < LIMITS.clearance.0) {
            prop_assert!(motion.speed.0 <= 0.0, "{:?}", motion);
        }
    }
}

#[test]
fn each_reason_stops_the_robot_and_ends() {
    let route = [Point::new(2.0, 0.0)];
    let mut pursuit = Pursuit::new(&route, LIMITS).unwrap();
    let pose = Pose::new(0.0, 0.0, Radians(0.0));
    let fine = tracking(pose);
    let reasons = [
        (Situation { verdict: Verdict::Lost, ..fine }, Reason::Lost),
        (tracking(Pose { x: Metres(f32::NAN), ..pose }), Reason::Lost),
        (Situation { deviation: Metres(0.11), ..fine }, Reason::Uncertain),
        (Situation { deviation: Metres(f32::NAN), ..fine }, Reason::Uncertain),
        (Situation { ahead: Some(Metres(0.29)), ..fine }, Reason::Obstructed),
    ];
    for (situation, reason) in reasons {
        let stopped = (Progress::Stopped(reason), Motion::default());
        assert_eq!(pursuit.drive(&situation), stopped);
        let (progress, motion) = pursuit.drive(&fine);
        assert!(
            progress == Progress::Driving && motion.speed.0 > 0.1,
            "after {reason}: {motion:?}"
        );
    }
    // An object that is far enough, and a verdict that is not yet Lost, do not stop it.
    let far = Situation { ahead: Some(Metres(0.31)), verdict: Verdict::Degraded, ..fine };
    assert_eq!(pursuit.drive(&far).0, Progress::Driving);
}

/// At its end the robot waits for a certain pose, and corrects its place by it.
#[test]
fn an_uncertain_robot_has_not_arrived() {
    let route = [Point::new(2.0, 0.0)];
    let mut pursuit = Pursuit::new(&route, LIMITS).unwrap();
    let at = |x, deviation| Situation {
        deviation: Metres(deviation),
        ..tracking(Pose::new(x, 0.0, Radians(0.0)))
    };
    let uncertain = (Progress::Stopped(Reason::Uncertain), Motion::default());
    assert_eq!(pursuit.drive(&at(1.99, 0.03)), uncertain);
    assert_eq!(pursuit.drive(&at(1.9, 0.015)).0, Progress::Driving);
    assert_eq!(pursuit.drive(&at(1.99, 0.015)).0, Progress::Arrived);
}

/// With an object ahead, a robot whose route leads elsewhere turns on the spot.
#[test]
fn the_robot_turns_away_from_an_object() {
    let route = [Point::new(0.0, 2.0)];
    let mut pursuit = Pursuit::new(&route, LIMITS).unwrap();
    let pose = Pose::new(0.0, 0.0, Radians(0.0));
    let situation = Situation { ahead: Some(Metres(0.2)), ..tracking(pose) };
    let (progress, motion) = pursuit.drive(&situation);
    assert_eq!(progress, Progress::Driving);
    assert!(motion.turn.0 > 0.5 && motion.speed.0.abs() <= 0.0, "{motion:?}");
}

#[test]
fn invalid_routes_and_limits_are_refused_by_name() {
    let route = [Point::new(1.0, 0.0)];
    assert_eq!(Pursuit::new(&[], LIMITS), Err(RouteError::Empty));
    assert_eq!(Pursuit::new(&[Point::new(f32::NAN, 0.0)], LIMITS), Err(RouteError::Point));
    let limits = [
        Limits { speed: MetresPerSecond(0.0), ..LIMITS },
        Limits { tolerance: Metres(f32::NAN), ..LIMITS },
        Limits { clearance: Metres(f32::INFINITY), ..LIMITS },
        Limits { approach: Duration::from_ticks(0), ..LIMITS },
    ];
    for limits in limits {
        assert_eq!(Pursuit::new(&route, limits), Err(RouteError::Limit));
    }
    let limits = Limits { look_ahead: LIMITS.tolerance, ..LIMITS };
    assert_eq!(Pursuit::new(&route, limits), Err(RouteError::LookAhead));
}
