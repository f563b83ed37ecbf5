//! The search for the pose: constructed rooms, symmetric poses, and windows of random pings.

use proptest::prelude::*;
use sonarfix::config::{Config, RangerParameters};
use sonarfix::geometry::pose::{Heading, Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix_search::search::{Answer, Hypothesis, InvalidInput, Region, Search, SearchParameters};

/// Evaluations after each ping: a cycle or two in a room of a few walls.
pub(crate) const EVALUATIONS: u16 = 10_000;

pub(crate) fn sonar() -> RangerParameters {
    let mut sonar = Config::for_track_width(Metres(0.2)).rangers.first;
    sonar.mount = Point::new(0.08, 0.0);
    sonar.servo = (Radians::from_degrees(-100.0), Radians::from_degrees(100.0));
    sonar.cone = Radians::from_degrees(15.0);
    sonar.max_range = Metres(3.5);
    sonar
}

/// A room by its outline, counter-clockwise.
pub(crate) struct Room {
    pub(crate) walls: Vec<Wall>,
    /// Corners that are concave from inside.
    corners: Vec<Point>,
}

impl Room {
    fn new(outline: &[(f32, f32)]) -> Self {
        let points: Vec<Point> = outline.iter().map(|&(x, y)| Point::new(x, y)).collect();
        let ends = points.iter().zip(points.iter().cycle().skip(1));
        let walls: Vec<Wall> = ends.map(|(a, b)| Wall::new(*a, *b).unwrap()).collect();
        let joints = walls.iter().zip(walls.iter().cycle().skip(1));
        let concave = joints.filter(|(wall, next)| wall.signed_distance(next.to()).0 > 0.0);
        let corners = concave.map(|(_, next)| next.from()).collect();
        Self { walls, corners }
    }

    /// A room that no rotation maps to itself.
    pub(crate) fn irregular() -> Self {
        Self::new(&[(0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (3.2, 2.0), (3.2, 4.1), (0.0, 4.1)])
    }

    fn rectangle() -> Self {
        Self::new(&[(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)])
    }

    /// The nearest foot or corner in the cone, without noise. It is measured through walls, too: in
    /// these rooms a nearer one answers first.
    pub(crate) fn echo(&self, pose: Pose, bearing: Radians) -> Option<Metres> {
        let sonar = sonar();
        let from = pose.to_map(sonar.mount);
        let axis = pose.heading.turned(bearing);
        let feet = self.walls.iter().filter_map(|wall| {
            let (along, distance) = (wall.along(from), wall.signed_distance(from));
            let is_on_wall = along >= Metres(0.0) && along <= wall.length();
            is_on_wall.then(|| (distance.abs(), wall.direction_from(distance)))
        });
        let corners = self.corners.iter().map(|corner| {
            let (dx, dy) = ((corner.x - from.x).0, (corner.y - from.y).0);
            (Metres(dx.hypot(dy)), Heading::new(Radians(dy.atan2(dx))))
        });
        let heard = feet.chain(corners).filter(|(distance, direction)| {
            axis.from(*direction).abs() <= sonar.cone && *distance <= sonar.max_range
        });
        heard.map(|(distance, _)| distance).min_by(|one, other| one.0.total_cmp(&other.0))
    }
}

/// Drives from a pose with a constant turn per step of 3 cm, a ping each, and returns the true end.
fn drive(search: &mut Search, room: &Room, mut pose: Pose, turn: f32, pings: usize) -> Pose {
    for _ in 0..pings {
        let step = 0.03;
        let middle = pose.heading.turned(Radians(0.5 * turn));
        let ahead = Pose { heading: middle, ..pose }.to_map(Point::new(step, 0.0));
        pose = Pose { x: ahead.x, y: ahead.y, heading: pose.heading.turned(Radians(turn)) };
        search.odometry(Metres(step), Radians(turn)).unwrap();
        let bearing = search.aim();
        search.ping(bearing, room.echo(pose, bearing)).unwrap();
        search.poll(EVALUATIONS);
    }
    pose
}

fn is_at(hypothesis: &Hypothesis, pose: Pose) -> bool {
    let (found, heading) = (hypothesis.pose, hypothesis.pose.heading.from(pose.heading));
    (found.x - pose.x).0.hypot((found.y - pose.y).0) < 0.1 && heading.abs().0 < 0.1
}

pub(crate) fn start(x: f32, y: f32, degrees: f32) -> Pose {
    Pose::new(x, y, Radians::from_degrees(degrees))
}

#[test]
fn a_robot_in_a_room_without_symmetry_is_found_once_it_has_driven() {
    // On a circle of 1 m about (1.6, 2.0).
    for pose in [start(2.6, 2.0, 90.0), start(1.6, 3.0, 180.0), start(1.6, 1.0, 0.0)] {
        let room = Room::irregular();
        let mut search: Search =
            Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
        let end = drive(&mut search, &room, pose, 0.03, 160);
        let Answer::Unique(found) = search.answer() else {
            panic!("{end:?}: {:?}", search.answer());
        };
        assert!(is_at(&found, end), "{found:?}, but the robot is at {end:?}");
    }
}

/// In a rectangle the pings of a quarter lap also fit the pose that is rotated by 180° about the centre.
#[test]
fn a_rotationally_symmetric_room_gives_both_poses_and_no_unique_one() {
    let room = Room::rectangle();
    for (x, y, degrees) in [(1.0, 0.8, 10.0), (3.0, 1.2, 95.0), (0.7, 2.2, -45.0)] {
        let mut search: Search =
            Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
        let mut pose = start(x, y, degrees);
        for _ in 0..60 {
            pose = drive(&mut search, &room, pose, 0.04, 1);
            assert!(!matches!(search.answer(), Answer::Unique(_)), "at {pose:?}");
        }
        let twin = Pose::new(
            4.0 - pose.x.0,
            3.0 - pose.y.0,
            pose.heading.turned(Radians(core::f32::consts::PI)).radians(),
        );
        let Answer::Several(count) = search.answer() else { panic!("{:?}", search.answer()) };
        let answers: Vec<Hypothesis> = search.hypotheses().take(count).collect();
        for one in [pose, twin] {
            assert!(answers.iter().any(|answer| is_at(answer, one)), "{one:?} of {answers:?}");
        }
    }
}

/// A start region that holds one of the two poses makes it the only one.
#[test]
fn a_start_region_decides_between_the_poses_of_a_symmetric_room() {
    let room = Room::rectangle();
    let region = Region { from: Point::new(0.0, 0.0), to: Point::new(2.0, 1.5) };
    let mut search: Search =
        Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
    search.begin_within(region);
    let mut pose = start(1.2, 0.8, 10.0);
    let is_found = (0..200).any(|_| {
        pose = drive(&mut search, &room, pose, 0.04, 1);
        matches!(search.answer(), Answer::Unique(found) if is_at(&found, pose))
    });
    assert!(is_found, "{pose:?}: {:?}", search.answer());
}

#[test]
fn a_proposed_pose_is_scored_like_any_other() {
    let room = Room::irregular();
    let mut search: Search =
        Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
    let end = drive(&mut search, &room, start(1.0, 1.0, 20.0), 0.01, 40);
    let off = Pose::new(end.x.0 + 0.1, end.y.0 - 0.1, end.heading.radians());
    search.propose(off).unwrap();
    let cycles = search.cycles();
    while search.cycles() < cycles + 2 {
        search.poll(EVALUATIONS);
    }
    assert!(search.hypotheses().any(|hypothesis| is_at(&hypothesis, end)));
    let nan = Pose::new(f32::NAN, 0.0, Radians(0.0));
    assert_eq!(search.propose(nan), Err(InvalidInput));
}

#[test]
fn invalid_input_is_refused() {
    let room = Room::rectangle();
    let mut search: Search =
        Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(search.odometry(Metres(bad), Radians(0.0)), Err(InvalidInput));
        assert_eq!(search.odometry(Metres(0.0), Radians(bad)), Err(InvalidInput));
        assert_eq!(search.ping(Radians(bad), None), Err(InvalidInput));
        assert_eq!(search.ping(Radians(0.0), Some(Metres(bad))), Err(InvalidInput));
    }
    // Finite, but sums of them would not be.
    for bad in [1.1e6, -1.1e6, f32::MAX] {
        assert_eq!(search.odometry(Metres(bad), Radians(0.0)), Err(InvalidInput));
        assert_eq!(search.odometry(Metres(0.0), Radians(bad)), Err(InvalidInput));
        for pose in [Pose::new(bad, 0.0, Radians(0.0)), Pose::new(0.0, bad, Radians(0.0))] {
            assert_eq!(search.propose(pose), Err(InvalidInput));
        }
    }
    assert_eq!(search.ping(Radians(0.0), Some(Metres(-0.1))), Err(InvalidInput));
    assert_eq!(search.ping(Radians(0.0), Some(Metres(1.0))), Ok(true));
    assert_eq!(search.ping(Radians(0.0), Some(Metres(1.0))), Ok(false), "not novel");
}

#[test]
fn the_state_fits_in_four_kibibytes() {
    // On this computer three lengths, and the address and length of the walls, are wider than on a microcontroller, where
    // `cargo xtask budgets` compares the size with the same limit.
    let wider = 5 * (size_of::<usize>() - 4);
    let size = size_of::<Search>();
    assert!(size <= 4096 + wider, "{size} bytes");
}

/// Any ping of any window: also ranges that no wall of the room explains.
fn any_ping() -> impl Strategy<Value = (f32, f32, f32, Option<f32>)> {
    (-0.5_f32..0.5, -0.7_f32..0.7, -3.1_f32..3.1, proptest::option::of(0.05_f32..5.0))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Random pings give no pose that is not finite.
    #[test]
    fn random_windows_give_finite_poses(pings in prop::collection::vec(any_ping(), 12..120)) {
        let room = Room::irregular();
        let mut search: Search =
            Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
        for (advance, turn, bearing, range) in pings {
            search.odometry(Metres(advance), Radians(turn)).unwrap();
            search.ping(Radians(bearing), range.map(Metres)).unwrap();
            search.poll(500);
            for hypothesis in search.hypotheses() {
                prop_assert!(hypothesis.pose.is_finite(), "{hypothesis:?}");
                prop_assert!(hypothesis.position_deviation.is_finite(), "{hypothesis:?}");
                prop_assert!(hypothesis.heading_deviation.is_finite(), "{hypothesis:?}");
            }
        }
    }

    /// Pings that are all of one wall do not determine the position along it.
    #[test]
    fn one_wall_is_never_a_unique_answer(
        distance in 1.0_f32..2.5, slant in -0.1_f32..0.1, steps in 50_usize..80,
    ) {
        let room = Room::irregular();
        let mut search: Search =
            Search::new(&sonar(), Map::new(&room.walls), SearchParameters::default());
        for n in 0..steps {
            search.odometry(Metres(0.1), Radians(0.0)).unwrap();
            let travelled = 0.1 * f32::from(u16::try_from(n).unwrap());
            let range = distance + slant * travelled;
            search.ping(Radians(core::f32::consts::FRAC_PI_2), Some(Metres(range))).unwrap();
            search.poll(EVALUATIONS);
            prop_assert!(!matches!(search.answer(), Answer::Unique(_)), "{:?}", search.answer());
        }
        let is_open = matches!(search.answer(), Answer::Along { .. } | Answer::Several(_));
        prop_assert!(is_open, "{:?}", search.answer());
    }
}
