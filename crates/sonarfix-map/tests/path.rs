//! The path: the pose at any time, and the motion between two times.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;
use sonarfix_map::{Motion, Movement, Path, PathError, PathPlan, PathPose};

/// Rounding of a few hundred additions of coordinates within 100 m.
const ROUNDING: f64 = 1e-9;

fn plan(corners: &[[f64; 2]]) -> PathPlan {
    PathPlan { start: [0.0, 0.0], corners: corners.to_vec(), laps: 1, speed: 0.5, turn_rate: 0.25 }
}

/// The difference of two headings, in (−π, π].
fn angle_between(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(TAU);
    difference.min(TAU - difference)
}

fn is_near(a: PathPose, b: PathPose, tolerance: f64) -> bool {
    f64::hypot(a.x - b.x, a.y - b.y) <= tolerance
        && angle_between(a.heading, b.heading) <= tolerance
}

/// Moves a pose. Each motion is either straight or in place, so this is exact.
fn moved(pose: PathPose, motion: Motion) -> PathPose {
    PathPose {
        x: pose.x + motion.advance * pose.heading.cos(),
        y: pose.y + motion.advance * pose.heading.sin(),
        heading: pose.heading + motion.turn,
    }
}

#[test]
fn a_leg_is_driven_then_turned_after() {
    let path = Path::new(plan(&[[2.0, 0.0], [2.0, -1.0]])).unwrap();
    assert!(!path.is_closed());
    let movements: Vec<_> = path.legs().iter().map(|leg| leg.movement).collect();
    let expected = [Movement::Straight(2.0), Movement::Turn(-FRAC_PI_2), Movement::Straight(1.0)];
    assert_eq!(movements, expected);
    let turned_at = 4.0 + FRAC_PI_2 / 0.25;
    let cases = [
        (-1.0, [0.0, 0.0, 0.0]),
        (0.0, [0.0, 0.0, 0.0]),
        (1.0, [0.5, 0.0, 0.0]),
        (4.0, [2.0, 0.0, 0.0]),
        (5.0, [2.0, 0.0, -0.25]),
        (turned_at, [2.0, 0.0, -FRAC_PI_2]),
        (turned_at + 1.0, [2.0, -0.5, -FRAC_PI_2]),
        (1e6, [2.0, -1.0, -FRAC_PI_2]),
        (f64::NAN, [0.0, 0.0, 0.0]),
    ];
    for (time, [x, y, heading]) in cases {
        let pose = path.pose_at(time);
        assert!(is_near(pose, PathPose { x, y, heading }, ROUNDING), "{time}: {pose:?}");
    }
    assert!((path.duration() - turned_at - 2.0).abs() < ROUNDING);
    assert!((path.length() - 3.0).abs() < ROUNDING);
}

#[test]
fn a_turn_about_is_to_the_left_whatever_the_direction() {
    for step in 0..360 {
        let (sin, cos) = f64::from(step).to_radians().sin_cos();
        let there_and_back = [[10.0 * cos, 10.0 * sin], [0.0, 0.0]];
        let path = Path::new(plan(&there_and_back)).unwrap();
        let turns: Vec<_> = path
            .legs()
            .iter()
            .filter_map(|leg| match leg.movement {
                Movement::Turn(by) => Some(by),
                Movement::Straight(_) => None,
            })
            .collect();
        assert_eq!(turns.len(), 2, "{step}°");
        assert!(turns.iter().all(|by| (by - PI).abs() < ROUNDING), "{step}°: {turns:?}");
    }
}

#[test]
fn corners_in_a_line_are_passed_without_a_turn() {
    let path = Path::new(plan(&[[0.1, 0.3], [0.2, 0.6], [0.7, 2.1]])).unwrap();
    assert_eq!(path.legs().len(), 3);
}

#[test]
fn laps_do_not_add_up_rounding() {
    let triangle = [[7.3, 1.1], [3.7, 9.9], [0.0, 0.0]];
    let one = Path::new(plan(&triangle)).unwrap();
    let many = Path::new(PathPlan { laps: 1000, ..plan(&triangle) }).unwrap();
    assert_eq!(many.legs().len(), 1000 * one.legs().len());
    assert_eq!(many.pose_at(many.duration()), many.pose_at(0.0));
    assert_eq!(many.legs().last().unwrap().movement, one.legs().last().unwrap().movement);
}

#[test]
fn an_invalid_path_is_refused() {
    let good = plan(&[[1.0, 0.0], [1.0, 1.0]]);
    let with_corners =
        |corners: &[[f64; 2]]| PathPlan { corners: corners.to_vec(), ..good.clone() };
    let cases = [
        (PathPlan { start: [f64::NAN, 0.0], ..good.clone() }, PathError::Start),
        (with_corners(&[]), PathError::NoCorner),
        (with_corners(&[[1.0, 0.0], [0.0, 1.1e5]]), PathError::Corner(1)),
        (with_corners(&[[0.0, 0.0]]), PathError::SameCorner(0)),
        (with_corners(&[[1.0, 0.0], [1.0, 0.0]]), PathError::SameCorner(1)),
        (PathPlan { laps: 0, ..good.clone() }, PathError::Laps),
        (PathPlan { laps: 10_001, ..good.clone() }, PathError::Laps),
        (PathPlan { laps: 2, ..good.clone() }, PathError::OpenLaps),
        (PathPlan { speed: 0.0, ..good.clone() }, PathError::Speed),
        (PathPlan { speed: f64::NAN, ..good.clone() }, PathError::Speed),
        (PathPlan { turn_rate: f64::INFINITY, ..good.clone() }, PathError::TurnRate),
    ];
    for (plan, error) in cases {
        assert_eq!(Path::new(plan), Err(error));
    }
}

/// A path of up to eight random corners, closed half of the time and then of up to three laps.
fn any_path() -> impl Strategy<Value = Path> {
    let coordinate = || -50.0..50.0_f64;
    let point = move || [coordinate(), coordinate()];
    let corners = prop::collection::vec(point(), 1..8);
    let numbers = (0.05..2.0_f64, 0.05..3.0_f64, 1_u32..4, any::<bool>());
    (point(), corners, numbers).prop_filter_map(
        "two corners fall together",
        |(start, mut corners, numbers)| {
            let (speed, turn_rate, laps, closed) = numbers;
            if closed {
                corners.push(start);
            }
            let laps = if closed { laps } else { 1 };
            Path::new(PathPlan { start, corners, laps, speed, turn_rate }).ok()
        },
    )
}

/// Times from the start of a path to its end: any, and those at which every second leg begins, so
/// that some pieces are cut at a corner and others lead over one.
fn partition(path: &Path, shares: &[f64]) -> Vec<f64> {
    let end = path.duration();
    let mut times: Vec<_> = shares.iter().map(|share| share * end).collect();
    times.extend(path.legs().iter().map(|leg| leg.start_time).step_by(2));
    times.push(0.0);
    times.push(end);
    times.sort_by(f64::total_cmp);
    times
}

proptest! {
    /// Each leg starts at the time and the pose of the end of the previous one; a closed path ends at its start.
    #[test]
    fn legs_follow_on_each_other(path in any_path()) {
        for pair in path.legs().windows(2) {
            prop_assert_eq!(pair[0].to, pair[1].from);
            prop_assert!((pair[0].end_time() - pair[1].start_time).abs() < ROUNDING);
        }
        if path.is_closed() {
            prop_assert!(is_near(path.pose_at(path.duration()), path.pose_at(0.0), ROUNDING));
        }
    }

    /// The speed never exceeds that of the plan.
    #[test]
    fn the_pose_is_continuous(path in any_path(), share in 0.0..1.0_f64, step in 0.0..0.01_f64) {
        let starts = path.legs().iter().map(|leg| leg.start_time - 0.5 * step);
        for time in starts.chain([share * path.duration()]) {
            let (before, after) = (path.pose_at(time), path.pose_at(time + step));
            let distance = f64::hypot(after.x - before.x, after.y - before.y);
            let turn = angle_between(after.heading, before.heading);
            prop_assert!(distance <= path.plan().speed * step + ROUNDING, "{} at {}", distance, time);
            prop_assert!(turn <= path.plan().turn_rate * step + ROUNDING, "{} at {}", turn, time);
        }
    }

    /// The pieces of a path sum up to the whole, in distance and in angle, wherever it is divided.
    #[test]
    fn pieces_sum_to_the_whole(path in any_path(), shares in prop::collection::vec(0.0..1.0_f64, 0..30)) {
        let amounts = |from, to| {
            path.motion_between(from, to).fold((0.0, 0.0, 0.0), |sum, piece| {
                (sum.0 + piece.advance, sum.1 + piece.turn, sum.2 + piece.turn.abs())
            })
        };
        let mut sum = (0.0, 0.0, 0.0);
        for pair in partition(&path, &shares).windows(2) {
            let piece = amounts(pair[0], pair[1]);
            sum = (sum.0 + piece.0, sum.1 + piece.1, sum.2 + piece.2);
        }
        let whole = amounts(-1.0, path.duration() + 1.0);
        prop_assert!((sum.0 - whole.0).abs() < ROUNDING, "{:?} {:?}", sum, whole);
        prop_assert!((sum.1 - whole.1).abs() < ROUNDING, "{:?} {:?}", sum, whole);
        prop_assert!((sum.2 - whole.2).abs() < ROUNDING, "{:?} {:?}", sum, whole);
        prop_assert!((whole.0 - path.length()).abs() < ROUNDING);
    }

    /// Integrating the motions gives the pose of the path.
    #[test]
    fn motions_lead_to_the_poses(path in any_path(), shares in prop::collection::vec(0.0..1.0_f64, 1..30)) {
        let mut pose = path.pose_at(0.0);
        for pair in partition(&path, &shares).windows(2) {
            pose = path.motion_between(pair[0], pair[1]).fold(pose, moved);
            let expected = path.pose_at(pair[1]);
            prop_assert!(is_near(pose, expected, ROUNDING), "{:?} {:?}", pose, expected);
        }
    }

    /// Without time, or with time running backwards, there is no motion.
    #[test]
    fn no_time_is_no_motion(path in any_path(), share in -0.1..1.1_f64, back in 0.0..100.0_f64) {
        let time = share * path.duration();
        for piece in path.motion_between(time, time - back) {
            prop_assert!(piece.advance.abs() + piece.turn.abs() <= 0.0);
        }
    }
}
