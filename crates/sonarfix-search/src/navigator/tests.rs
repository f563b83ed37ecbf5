//! Every change of mode, with a search that has found what a test needs, and rules and limits in `f64`.

use std::boxed::Box;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use sonarfix::config::Config;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::map::{Map, Wall};

fn here() -> Pose {
    Pose::new(1.0, 1.5, Radians(0.2))
}

fn walls() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
    let wall = |ends: &[(f32, f32)]| {
        Wall::new(Point::new(ends[0].0, ends[0].1), Point::new(ends[1].0, ends[1].1)).unwrap()
    };
    corners.windows(2).map(wall).collect()
}

fn config() -> Config {
    let mut config = Config::for_track_width(Metres(0.2));
    config.rangers.first.max_range = Metres(3.5);
    config.rangers.first.min_range = Metres(0.05);
    config
}

fn start(pose: Pose) -> Start {
    Start { pose, position_deviation: Metres(0.02), heading_deviation: Radians(0.02) }
}

/// A navigator with its search, and the time.
struct Robot<'m> {
    navigator: Navigator<'m>,
    search: Box<Search<'m>>,
    ticks: u64,
}

impl<'m> Robot<'m> {
    fn new(walls: &'m [Wall]) -> Self {
        let (config, map) = (config(), Map::new(walls));
        let search = Box::new(Search::new(&config.rangers.first, map, SearchParameters::default()));
        let localizer = Localizer::new(config, map, start(here()), Instant::from_ticks(0)).unwrap();
        Self { navigator: Navigator::new(localizer), search, ticks: 0 }
    }

    fn in_mode(walls: &'m [Wall], mode: Mode) -> Self {
        let mut robot = Self::new(walls);
        robot.navigator.mode = mode;
        robot
    }

    fn drive(&mut self, right: f32, left: f32) {
        self.ticks += 100_000;
        let now = Instant::from_ticks(self.ticks);
        let travel = WheelTravel::new(right, left);
        self.navigator.odometry_with_turn(now, travel, None, Some(&mut self.search)).unwrap();
    }

    /// Measures the wall at the right bearing at its range.
    fn fix(&mut self) -> Fix {
        let aim = self.navigator.aim().unwrap();
        self.navigator.fix(&aim, Some(aim.range), Some(&mut self.search))
    }

    fn update(&mut self) -> Option<Mode> {
        self.navigator.update(&mut self.search)
    }

    fn pose(&self) -> Pose {
        self.navigator.localizer.pose()
    }

    fn deviations(&self) -> StandardDeviations {
        self.navigator.localizer.filter().standard_deviations()
    }

    fn verdict(&self) -> Verdict {
        self.navigator.localizer.health().verdict
    }

    fn degrade(&mut self) {
        for _ in 0..8 {
            self.navigator.localizer_mut().skip();
        }
        assert_eq!(self.verdict(), Verdict::Degraded);
    }
}

fn is_near(one: Pose, other: Pose) -> bool {
    (one.x - other.x).0.hypot((one.y - other.y).0) < 1e-4
        && one.heading.from(other.heading).abs().0 < 1e-4
}

fn moved(pose: Pose, dx: f32, dy: f32, turn: f32) -> Pose {
    Pose::new(pose.x.0 + dx, pose.y.0 + dy, Radians(pose.heading.radians().0 + turn))
}

#[test]
fn a_lost_robot_begins_to_search_with_the_pose_it_had() {
    let walls = walls();
    let mut robot = Robot::new(&walls);
    assert_eq!(robot.update(), None);
    robot.degrade();
    assert_eq!((robot.update(), robot.navigator.mode()), (None, Mode::Tracking));
    robot.navigator.localizer.declare_lost();
    robot.search.find_unique(moved(here(), 1.0, 0.0, 0.0), (0.01, 0.01));
    robot.navigator.not_before = 7;
    robot.navigator.guessed = 7;
    assert_eq!(robot.update(), Some(Mode::Searching));
    assert_eq!(robot.verdict(), Verdict::Lost);
    assert_eq!((robot.deviations().x, robot.deviations().y), (UNKNOWN_POSITION, UNKNOWN_POSITION));
    assert!((robot.deviations().heading - UNKNOWN_HEADING).abs() < Radians(1e-5));
    assert_eq!((robot.search.answer(), robot.search.cycles()), (Answer::Searching, 0));
    assert_eq!((robot.navigator.not_before, robot.navigator.guessed), (0, 0));
    assert!(is_near(robot.search.ranked(0).unwrap().pose, here()));
    assert!(is_near(robot.pose(), here()));
    let prior = config().prior;
    let wheels = [prior.scale_right, prior.scale_left];
    let parameters = SearchParameters::calibrated(&config(), wheels, prior.track_width);
    let ([drift, turn_scale], region) = robot.search.begun();
    assert!((drift - parameters.drift.0).abs() < 1e-5, "{drift}");
    assert!((turn_scale - parameters.turn_scale).abs() < 1e-5, "{turn_scale}");
    assert_eq!(region, None);
}

#[test]
fn a_start_without_a_pose_searches_in_its_region() {
    let walls = walls();
    let region = Region { from: Point::new(0.0, 0.0), to: Point::new(2.0, 3.0) };
    for region in [None, Some(region)] {
        let mut robot = Robot::new(&walls);
        robot.navigator.search_in(region, &mut robot.search);
        assert_eq!((robot.navigator.mode(), robot.verdict()), (Mode::Searching, Verdict::Lost));
        assert_eq!(robot.search.begun().1, region);
        assert!(robot.search.ranked(0).is_none());
    }
}

/// With 1.5 times the deviations of the answer, at least 3 cm and 2°.
#[test]
fn a_unique_answer_is_handed_over() {
    let walls = walls();
    let there = moved(here(), 1.2, 0.4, 1.0);
    for (found, expected) in
        [((0.04, 0.05), (0.06, 0.075)), ((0.01, 0.01), (0.03, 2_f32.to_radians()))]
    {
        let mut robot = Robot::new(&walls);
        robot.navigator.search(&mut robot.search);
        assert_eq!(robot.update(), None);
        robot.navigator.accepted = 9;
        robot.navigator.driven = Metres(3.0);
        robot.search.find_unique(there, found);
        assert_eq!(robot.update(), Some(Mode::Provisional));
        assert!(is_near(robot.pose(), there));
        assert!((robot.deviations().x.0 - expected.0).abs() < 1e-4, "{:?}", robot.deviations());
        assert!(
            (robot.deviations().heading.0 - expected.1).abs() < 1e-4,
            "{:?}",
            robot.deviations()
        );
        assert_eq!(robot.verdict(), Verdict::Tracking);
        assert_eq!((robot.navigator.accepted, robot.navigator.driven), (0, Metres(0.0)));
        assert_eq!(robot.update(), None);
    }
}

/// Three pings without an accepted range, while the pose is provisional.
#[test]
fn a_hidden_wall_gives_way_to_the_nearest() {
    let walls = walls();
    for (mode, nearest) in [(Mode::Tracking, false), (Mode::Provisional, true)] {
        let mut robot = Robot::in_mode(&walls, mode);
        robot.navigator.unused = 0;
        let is = |robot: &Robot| robot.navigator.policy_with(Policy::Informative);
        for _ in 0..2 {
            let aim = robot.navigator.aim().unwrap();
            _ = robot.navigator.fix(&aim, None, Some(&mut robot.search));
            assert_eq!(is(&robot), Policy::Informative);
        }
        let aim = robot.navigator.aim().unwrap();
        _ = robot.navigator.fix(&aim, None, Some(&mut robot.search));
        let expected = if nearest { Policy::Nearest } else { Policy::Informative };
        assert_eq!(is(&robot), expected);
        assert!(matches!(robot.fix(), Fix::Accepted(_)));
        assert_eq!(is(&robot), Policy::Informative);
    }
}

/// The localizer may correct its calibration: the bend of the search is that of the odometry with which it began.
#[test]
fn the_search_takes_the_odometry_of_one_calibration() {
    let walls = walls();
    let mut robot = Robot::in_mode(&walls, Mode::Provisional);
    let filter = robot.navigator.localizer.filter();
    let state = StateEstimate { scale_right: 0.1, scale_left: 0.1, ..filter.state() };
    let deviation = filter.standard_deviations();
    robot.navigator.localizer.restart(state, deviation).unwrap();
    robot.drive(0.2, 0.2);
    assert!((robot.search.driven() - 0.2).abs() < 1e-6, "{}", robot.search.driven());
}

/// The best hypothesis of each cycle, if it fits: as an unknown pose.
#[test]
fn an_unknown_pose_is_guessed_once_a_cycle() {
    let walls = walls();
    let mut robot = Robot::new(&walls);
    robot.navigator.search(&mut robot.search);
    let (one, other) = (moved(here(), 1.0, 0.3, 0.5), moved(here(), -0.5, 0.3, 2.0));
    robot.search.find(one, (0.1, 0.1), 0.19);
    assert_eq!(robot.update(), None);
    assert!(is_near(robot.pose(), here()), "a fit of 0.19");
    robot.search.find(one, (0.1, 0.1), 0.21);
    assert_eq!(robot.update(), None);
    assert!(is_near(robot.pose(), one));
    assert_eq!((robot.deviations().x, robot.verdict()), (UNKNOWN_POSITION, Verdict::Lost));
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    // Dead reckoning until the next cycle.
    robot.drive(0.05, 0.03);
    let now = robot.pose();
    robot.search.propose(other).unwrap();
    assert_eq!(robot.update(), None);
    assert_eq!(robot.pose(), now);
    robot.search.find(other, (0.1, 0.1), 1.0);
    assert_eq!(robot.update(), None);
    assert!(is_near(robot.pose(), other));
}

/// The pose that was provisional is handed over again at the earliest two cycles later.
#[test]
fn a_provisional_pose_that_is_lost_leads_back_to_the_search() {
    let walls = walls();
    let mut robot = Robot::new(&walls);
    robot.navigator.search(&mut robot.search);
    robot.search.find_unique(here(), (0.01, 0.01));
    assert_eq!(robot.update(), Some(Mode::Provisional));
    robot.navigator.localizer.declare_lost();
    let cycles = robot.search.cycles();
    assert_eq!(robot.update(), Some(Mode::Searching));
    assert_eq!((robot.deviations().x, robot.verdict()), (UNKNOWN_POSITION, Verdict::Lost));
    assert_eq!(robot.search.cycles(), cycles, "the hypotheses stay");
    assert_eq!(robot.update(), None);
    robot.search.find_again();
    assert_eq!(robot.update(), None);
    robot.search.find_again();
    assert_eq!(robot.update(), Some(Mode::Provisional));
}

#[test]
fn another_unique_answer_becomes_the_provisional_pose() {
    let walls = walls();
    let mut robot = Robot::in_mode(&walls, Mode::Provisional);
    robot.search.find_unique(moved(here(), 0.1, 0.1, 0.1), (0.01, 0.01));
    assert_eq!(robot.update(), None);
    assert!(is_near(robot.pose(), here()));
    let there = moved(here(), 0.0, 0.6, 0.0);
    robot.search.find_unique(there, (0.01, 0.01));
    assert_eq!(robot.update(), Some(Mode::Provisional));
    assert!(is_near(robot.pose(), there));
    robot.search.find(here(), (0.01, 0.01), 1.0);
    assert_eq!(robot.update(), None, "not unique");
}

#[test]
fn a_pose_is_confirmed_by_two_metres_twenty_ranges_and_the_search() {
    let walls = walls();
    for (accepted, driven, is_unique, mode) in [
        (20, 2.0, true, Mode::Tracking),
        (19, 5.0, true, Mode::Provisional),
        (90, 1.99, true, Mode::Provisional),
        (90, 5.0, false, Mode::Provisional),
        (21, 2.1, true, Mode::Tracking),
    ] {
        let mut robot = Robot::in_mode(&walls, Mode::Provisional);
        if is_unique {
            robot.search.find_unique(here(), (0.01, 0.01));
        } else {
            robot.search.find(here(), (0.01, 0.01), 1.0);
        }
        (robot.navigator.accepted, robot.navigator.driven) = (accepted, Metres(driven));
        let changed = (mode == Mode::Tracking).then_some(mode);
        assert_eq!((robot.update(), robot.navigator.mode()), (changed, mode));
        let driven = if mode == Mode::Tracking { 0.0 } else { driven };
        assert_eq!(robot.navigator.driven, Metres(driven));
    }
}

/// The distance and the ranges count from the last time at which the verdict was not `Tracking`.
#[test]
fn a_degraded_pose_is_not_confirmed() {
    let walls = walls();
    let mut robot = Robot::in_mode(&walls, Mode::Provisional);
    (robot.navigator.accepted, robot.navigator.driven) = (30, Metres(3.0));
    robot.degrade();
    assert_eq!((robot.update(), robot.navigator.mode()), (None, Mode::Provisional));
    assert_eq!((robot.navigator.accepted, robot.navigator.driven), (0, Metres(0.0)));
}

/// Accepted ranges count while the pose is provisional, and the search takes the pings then.
#[test]
fn ranges_of_a_provisional_pose_are_passed_to_the_search() {
    let walls = walls();
    for (mode, taken) in [(Mode::Tracking, 0), (Mode::Provisional, 1)] {
        let mut robot = Robot::in_mode(&walls, mode);
        assert!(matches!(robot.fix(), Fix::Accepted(_)));
        assert_eq!((robot.navigator.accepted, robot.search.pings()), (taken, usize::from(taken)));
        let aim = robot.navigator.localizer().aim_at(Radians(-0.2)).unwrap();
        assert!(!matches!(robot.navigator.fix(&aim, None, None), Fix::Accepted(_)));
        assert_eq!(robot.navigator.accepted, taken);
    }
}

/// An echo from nearer than the shortest range counts as no echo.
#[test]
fn the_search_takes_ranges_from_the_shortest_on() {
    let walls = walls();
    for (range, expected) in [(0.05, Some(0.05)), (0.049, None), (1.0, Some(1.0))] {
        let mut robot = Robot::new(&walls);
        let Robot { navigator, search, .. } = &mut robot;
        assert_eq!(navigator.ping(Radians(0.1), Some(Metres(range)), search), Ok(true));
        // The last 8 bits of a range are the weight of its ping.
        let kept = |range: f32| f32::from_bits(range.to_bits() & !255);
        assert_eq!(search.latest_range(), expected.map(kept));
    }
    let mut robot = Robot::new(&walls);
    let Robot { navigator, search, .. } = &mut robot;
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(navigator.ping(Radians(0.1), Some(Metres(bad)), search), Err(InvalidInput));
    }
    assert_eq!(navigator.ping(Radians(0.1), None, search), Ok(true));
}

#[test]
fn a_measured_pose_is_tracked() {
    let walls = walls();
    let mut robot = Robot::in_mode(&walls, Mode::Searching);
    robot.navigator.driven = Metres(5.0);
    let mut bad = start(here());
    bad.position_deviation = Metres(-1.0);
    assert!(robot.navigator.set_pose(&bad).is_err());
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    let there = moved(here(), 0.5, 0.5, 0.5);
    robot.navigator.set_pose(&start(there)).unwrap();
    assert_eq!((robot.navigator.mode(), robot.navigator.driven), (Mode::Tracking, Metres(0.0)));
    assert!(is_near(robot.pose(), there));
}

/// Modes of another navigator: only a search replaces the calibration, and tracking nothing.
#[test]
fn a_recorded_mode_is_adopted_with_its_state() {
    let walls = walls();
    let there = moved(here(), 0.5, 0.5, 0.5);
    let state = StateEstimate { scale_right: 0.01, ..StateEstimate::at_pose(there) };
    let deviation = StandardDeviations {
        x: Metres(0.3),
        y: Metres(0.3),
        heading: Radians(0.3),
        ..Robot::new(&walls).deviations()
    };
    for (mode, pose, scale, verdict) in [
        (Mode::Tracking, here(), 0.0, Verdict::Tracking),
        (Mode::Searching, there, 0.01, Verdict::Lost),
        (Mode::Provisional, there, 0.0, Verdict::Tracking),
    ] {
        let mut robot = Robot::new(&walls);
        robot.navigator.adopt(mode, state, deviation).unwrap();
        assert_eq!((robot.navigator.mode(), robot.verdict()), (mode, verdict));
        assert!(is_near(robot.pose(), pose), "{mode:?}");
        let is = robot.navigator.localizer.filter().state().scale_right;
        assert!((is - scale).abs() < 1e-6, "{mode:?}: {is}");
        let expected = if mode == Mode::Tracking { 0.02 } else { 0.3 };
        assert!((robot.deviations().x.0 - expected).abs() < 1e-5, "{mode:?}");
        let bad = StandardDeviations { x: Metres(-1.0), ..deviation };
        assert_eq!(robot.navigator.adopt(mode, state, bad).is_ok(), mode == Mode::Tracking);
    }
}

/// Every 10 m with the verdict `Tracking`; the older of two is used.
#[test]
fn checkpoints_are_taken_while_the_ranges_agree() {
    let walls = walls();
    let mut robot = Robot::new(&walls);
    let first = robot.navigator.checkpoints;
    robot.navigator.driven = Metres(9.0);
    robot.drive(0.03, 0.01);
    assert_eq!(robot.navigator.checkpoints, first);
    assert!((robot.navigator.driven.0 - 9.02).abs() < 1e-4);
    // Exactly, and without travel.
    robot.navigator.driven = CHECKPOINT;
    robot.drive(0.0, 0.0);
    let taken = Calibration::of(&robot.navigator.localizer);
    assert_eq!(robot.navigator.checkpoints, [taken, first[0]]);
    assert_ne!(taken, first[0]);
    assert_eq!(robot.navigator.driven, Metres(0.0));
    robot.drive(0.03, 0.01);
    robot.degrade();
    robot.navigator.driven = Metres(10.5);
    robot.drive(0.0, 0.0);
    assert_eq!(robot.navigator.checkpoints, [taken, first[0]]);
    assert_eq!(robot.navigator.driven, Metres(0.0));
    // While the pose is unknown, none is taken.
    robot.navigator.set_pose(&start(here())).unwrap();
    robot.navigator.mode = Mode::Searching;
    robot.navigator.driven = Metres(10.5);
    robot.drive(0.0, 0.0);
    assert_eq!(robot.navigator.checkpoints, [taken, first[0]]);
    // The older one is used.
    robot.navigator.checkpoints[0].state.scale_left = 0.01;
    robot.navigator.checkpoints[1].state.scale_right = 0.02;
    robot.navigator.search(&mut robot.search);
    let state = robot.navigator.localizer.filter().state();
    assert!((state.scale_right - 0.02).abs() < 1e-6 && state.scale_left.abs() < 1e-6, "{state:?}");
}

/// As many evaluations as are granted, until the pose is confirmed.
#[test]
fn work_ends_when_the_pose_is_tracked() {
    let walls = walls();
    let mut robot = Robot::in_mode(&walls, Mode::Provisional);
    (robot.navigator.accepted, robot.navigator.driven) = (20, Metres(2.0));
    robot.search.find_unique(here(), (0.01, 0.01));
    assert_eq!(robot.navigator.work(5, &mut robot.search), Some(Mode::Tracking));
    assert_eq!(robot.navigator.work(5, &mut robot.search), None);
    robot.navigator.search(&mut robot.search);
    robot.search.find_unique(here(), (0.01, 0.01));
    assert_eq!(robot.navigator.work(0, &mut robot.search), Some(Mode::Provisional));
    assert_eq!(robot.navigator.work(5, &mut robot.search), None);
}

proptest! {
    /// The best hypothesis follows the odometry as the localizer does, with the scales of the wheels.
    #[test]
    fn hypotheses_follow_the_odometry_of_the_localizer(
        (right, left) in (-0.05_f32..0.05, -0.05_f32..0.05),
        travels in prop::collection::vec((-0.1_f32..0.1, -0.1_f32..0.1), 1..20),
        mode in prop::sample::select(&[Mode::Searching, Mode::Provisional][..]),
    ) {
        let walls = walls();
        let mut robot = Robot::new(&walls);
        let (state, deviation) = (robot.navigator.localizer.filter().state(), robot.deviations());
        let state = StateEstimate { scale_right: right, scale_left: left, ..state };
        robot.navigator.adopt(Mode::Searching, state, deviation).unwrap();
        robot.navigator.mode = mode;
        robot.search.find(here(), (0.1, 0.1), 1.0);
        let mut driven = 0.0;
        for (right, left) in travels {
            robot.drive(right, left);
            driven += 0.5 * (right.abs() + left.abs());
        }
        prop_assert!(is_near(robot.search.ranked(0).unwrap().pose, robot.pose()));
        prop_assert!((robot.navigator.driven.0 - driven).abs() < 1e-4);
    }

    /// A calibration with twice its deviations, at most those of the prior.
    #[test]
    fn a_calibration_without_its_correlations_is_less_certain(
        (right, left, track, range) in (0.0_f32..0.02, 0.0_f32..0.02, 0.0_f32..0.02, 0.0_f32..0.02),
        (scale_right, scale_left) in (-0.05_f32..0.05, -0.05_f32..0.05),
    ) {
        let walls = walls();
        let robot = Robot::new(&walls);
        let localizer = &robot.navigator.localizer;
        let prior = localizer.config().prior;
        let state = StateEstimate { scale_right, scale_left, ..StateEstimate::at_pose(moved(here(), 9.0, 9.0, 1.0)) };
        let deviation = StandardDeviations {
            scale_right: right, scale_left: left, track_width_error: Metres(track), range_scale: range, ..robot.deviations()
        };
        let (state_of, known) = Calibration { state, deviation }.without_pose(localizer);
        prop_assert!(is_near(state_of.pose(), here()));
        prop_assert_eq!((state_of.scale_right, state_of.scale_left), (scale_right, scale_left));
        prop_assert_eq!((known.x, known.y, known.heading), (UNKNOWN_POSITION, UNKNOWN_POSITION, UNKNOWN_HEADING));
        for (is, of, prior) in [
            (known.scale_right, right, prior.scale_right),
            (known.scale_left, left, prior.scale_left),
            (known.track_width_error.0, track, prior.track_width.0),
            (known.range_scale, range, prior.range_scale),
        ] {
            prop_assert!((f64::from(is) - (2.0 * f64::from(of)).min(prior.into())).abs() < 1e-7);
        }
    }

    /// Another pose is more than 0.5 m or 0.35 rad away.
    #[test]
    fn an_answer_elsewhere_contradicts_a_pose(
        (dx, dy) in (-0.8_f32..0.8, -0.8_f32..0.8), turn in -0.7_f32..0.7, (x, y) in (0.0_f32..4.0, 0.0_f32..3.0),
    ) {
        let walls = walls();
        let mut robot = Robot::new(&walls);
        robot.navigator.set_pose(&start(Pose::new(x, y, Radians(0.3)))).unwrap();
        robot.search.find_unique(moved(robot.pose(), dx, dy, turn), (0.01, 0.01));
        let (distance, turn) = (f64::from(dx).hypot(dy.into()), f64::from(turn.abs()));
        prop_assume!((distance - 0.5).abs() > 1e-4 && (turn - 0.35).abs() > 1e-4);
        prop_assert_eq!(robot.navigator.is_contradicted(&robot.search), distance > 0.5 || turn > 0.35);
    }
}
