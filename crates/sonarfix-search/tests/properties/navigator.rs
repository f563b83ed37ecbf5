//! The modes of the navigator: every change of mode, in a room without symmetry.

use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix_search::navigator::{Mode, Navigator, UNKNOWN_HEADING, UNKNOWN_POSITION};
use sonarfix_search::search::{Search, SearchParameters};

use crate::search::{EVALUATIONS, Room, sonar, start};

const TRACK_WIDTH: f32 = 0.2;
/// Travel of a step, metres, and turn, radians: a circle of 1 m.
const STEP: f32 = 0.03;
const TURN: f32 = 0.03;

/// A robot on a circle of 1 m about (1.6, 2.0).
struct Robot<'a> {
    room: &'a Room,
    navigator: Navigator<'a>,
    search: Box<Search<'a>>,
    truth: Pose,
    steps: u64,
}

impl<'a> Robot<'a> {
    /// A robot at `truth` that tracks the pose `estimate`.
    fn new(room: &'a Room, truth: Pose, estimate: Pose) -> Self {
        let mut config = Config::for_track_width(Metres(TRACK_WIDTH));
        config.rangers.first = sonar();
        let map = Map::new(&room.walls);
        let search = Search::new(&config.rangers.first, map, SearchParameters::of(&config));
        let start = Start {
            pose: estimate,
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.02),
        };
        let localizer = Localizer::new(config, map, start, Instant::from_ticks(0)).unwrap();
        let navigator = Navigator::new(localizer);
        Self { room, navigator, search: Box::new(search), truth, steps: 0 }
    }

    /// Drives a step, pings and searches.
    fn step(&mut self) {
        let middle = self.truth.heading.turned(Radians(0.5 * TURN));
        let ahead = Pose { heading: middle, ..self.truth }.to_map(Point::new(STEP, 0.0));
        let heading = self.truth.heading.turned(Radians(TURN));
        self.truth = Pose { x: ahead.x, y: ahead.y, heading };
        self.steps += 1;
        let now = Instant::from_ticks(self.steps * 100_000);
        let aside = 0.5 * TURN * TRACK_WIDTH;
        let travel = WheelTravel::new(STEP + aside, STEP - aside);
        let (navigator, search) = (&mut self.navigator, &mut *self.search);
        navigator.odometry_with_turn(now, travel, None, Some(search)).unwrap();
        if navigator.mode() == Mode::Searching {
            let bearing = search.aim();
            navigator.ping(bearing, self.room.echo(self.truth, bearing), search).unwrap();
        } else if let Ok(aim) = navigator.aim() {
            let _ = navigator.fix(&aim, self.room.echo(self.truth, aim.bearing), Some(search));
        } else {
            navigator.localizer_mut().skip();
        }
        navigator.work(EVALUATIONS, search);
    }

    /// Drives until the mode is another; returns how far.
    fn until_changed(&mut self, most: u32) -> f32 {
        let mode = self.navigator.mode();
        let mut driven = 0.0;
        for _ in 0..most {
            self.step();
            driven += STEP;
            if self.navigator.mode() != mode {
                return driven;
            }
        }
        panic!("the mode is still {mode:?} after {driven} m");
    }

    /// Carries it along the circle by this angle.
    fn carry(&mut self, angle: f32) {
        let (sin, cos) = angle.sin_cos();
        let (dx, dy) = (self.truth.x.0 - 1.6, self.truth.y.0 - 2.0);
        let at = Pose::new(1.6 + cos * dx - sin * dy, 2.0 + sin * dx + cos * dy, Radians(0.0));
        self.truth = Pose { heading: self.truth.heading.turned(Radians(angle)), ..at };
    }

    fn error(&self) -> f32 {
        let pose = self.navigator.localizer().pose();
        (pose.x - self.truth.x).0.hypot((pose.y - self.truth.y).0)
    }

    fn verdict(&self) -> Verdict {
        self.navigator.localizer().health().verdict
    }
}

fn on_circle() -> Pose {
    start(2.6, 2.0, 90.0)
}

#[test]
fn a_search_on_command_hands_over_and_is_confirmed() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), on_circle());
    assert_eq!(robot.navigator.mode(), Mode::Tracking);
    robot.navigator.search(&mut robot.search);
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    assert_eq!(robot.verdict(), Verdict::Lost);
    let unknown = robot.navigator.localizer().filter().standard_deviations();
    assert!(unknown.x >= UNKNOWN_POSITION && unknown.heading >= UNKNOWN_HEADING);

    robot.until_changed(400);
    assert_eq!(robot.navigator.mode(), Mode::Provisional);
    assert!(robot.error() < 0.1, "{}", robot.error());
    // What the answer is handed over with, less a ping and a step.
    let known = robot.navigator.localizer().filter().standard_deviations();
    assert!(known.x > Metres(0.0) && known.x < Metres(0.2), "{known:?}");

    let driven = robot.until_changed(400);
    assert_eq!(robot.navigator.mode(), Mode::Tracking);
    assert!(driven >= 1.9, "confirmed after {driven} m");
    assert!(robot.error() < 0.05, "{}", robot.error());
    assert_eq!(robot.verdict(), Verdict::Tracking);
}

#[test]
fn a_start_without_a_pose_searches_at_once() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), start(0.5, 0.5, 0.0));
    robot.navigator.search_in(None, &mut robot.search);
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    robot.until_changed(400);
    assert_eq!(robot.navigator.mode(), Mode::Provisional);
    assert!(robot.error() < 0.1, "{}", robot.error());
}

#[test]
fn a_lost_robot_searches() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), start(1.0, 1.0, 0.0));
    robot.until_changed(200);
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    assert_eq!(robot.verdict(), Verdict::Lost);
    robot.until_changed(400);
    assert_eq!(robot.navigator.mode(), Mode::Provisional);
    assert!(robot.error() < 0.1, "{}", robot.error());
}

#[test]
fn a_provisional_pose_that_fails_leads_back_to_the_search() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), on_circle());
    robot.navigator.search(&mut robot.search);
    robot.until_changed(400);
    assert_eq!(robot.navigator.mode(), Mode::Provisional);
    robot.carry(core::f32::consts::FRAC_PI_2);
    robot.until_changed(200);
    assert_eq!(robot.navigator.mode(), Mode::Searching);
    assert_eq!(robot.verdict(), Verdict::Lost);
}

/// On the other side of the circle the room is nearly the same: ranges confirm the wrong pose, and the right one remains a hypothesis.
#[test]
fn a_pose_with_a_rival_is_not_confirmed() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), on_circle());
    robot.navigator.search(&mut robot.search);
    robot.until_changed(400);
    robot.carry(core::f32::consts::PI);
    for _ in 0..200 {
        robot.step();
        assert!(robot.navigator.mode() != Mode::Tracking || robot.error() < 0.1);
    }
}

#[test]
fn a_measured_pose_ends_the_search() {
    let room = Room::irregular();
    let mut robot = Robot::new(&room, on_circle(), start(0.5, 0.5, 0.0));
    robot.navigator.search(&mut robot.search);
    robot.step();
    let measured = Start {
        pose: robot.truth,
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.02),
    };
    robot.navigator.set_pose(&measured).unwrap();
    assert_eq!(robot.navigator.mode(), Mode::Tracking);
    for _ in 0..40 {
        robot.step();
    }
    assert_eq!(robot.navigator.mode(), Mode::Tracking);
    assert!(robot.error() < 0.05, "{}", robot.error());
}
