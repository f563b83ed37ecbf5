//! The motion that the node requests of the robot's base while it searches for the pose: that of the robot file, as the
//! firmware drives it ([`SearchMover`]).
//!
//! Pings and travels count in the order of their stamps, although pings may arrive late: what the robot has driven since an echo
//! is no free travel any more. Therefore they are kept as long as a ping may be late, and the motion follows from all of them. A
//! ping counts before the whole travel in which it was measured: the free travel may be too short by that, never too long.

use std::collections::VecDeque;

use anyhow::Context;
use sonarfix::config::RangerId;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix_drive::search_motion::{SearchMover, Speeds};
use sonarfix_hal::config::{RobotConfig, SearchMotion};
use sonarfix_link::Motion;
use sonarfix_ros_messages::messages::{Twist, Vector3};

use crate::motion::Part;
use crate::parameters::Parameters;
use crate::problem::Nanoseconds;
use crate::timeline::{Beam, Echo, Heard, single};

/// Time without a ping after which the robot stands, and begins anew with the next one.
const SILENCE: Nanoseconds = 1_000_000_000;
/// The most pings and travels that are kept.
const MOST_KEPT: usize = 2000;

/// What the motion follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    /// The bearing in the robot frame, and the range; `None` without an echo.
    Ping(Radians, Option<Metres>),
    Travel(WheelTravel),
}

impl Event {
    fn of(beam: &Beam) -> Self {
        let range = match beam.echo {
            Echo::None => None,
            // An object at the ranger.
            Echo::TooNear => Some(Metres(0.0)),
            Echo::At(range) => Some(Metres(single(range))),
        };
        Self::Ping(Radians(single(beam.bearing)), range)
    }

    fn apply(&self, mover: &mut SearchMover, track_width: Metres) {
        match *self {
            Self::Ping(bearing, range) => mover.ping(bearing, range),
            Self::Travel(travel) => mover.odometry(travel, track_width),
        }
    }

    /// A ping is before a travel that ends at the same time.
    fn order(&self, at: Nanoseconds) -> (Nanoseconds, bool) {
        (at, matches!(self, Self::Travel(_)))
    }
}

/// The pings and travels of a search.
#[derive(Debug, Clone)]
struct Course {
    track_width: Metres,
    /// The mover before those that are kept.
    mover: SearchMover,
    /// With their stamps, in their order.
    kept: VecDeque<(Nanoseconds, Event)>,
}

impl Course {
    fn add(&mut self, at: Nanoseconds, event: Event) {
        let is_before =
            |(other, kept): &(Nanoseconds, Event)| kept.order(*other) <= event.order(at);
        let place = self.kept.partition_point(is_before);
        self.kept.insert(place, (at, event));
        if self.kept.len() > MOST_KEPT {
            self.forget_oldest();
        }
    }

    /// Keeps only what is not older than `oldest`.
    fn forget(&mut self, oldest: Nanoseconds) {
        while self.kept.front().is_some_and(|(at, _)| *at < oldest) {
            self.forget_oldest();
        }
    }

    fn forget_oldest(&mut self) {
        if let Some((_, event)) = self.kept.pop_front() {
            event.apply(&mut self.mover, self.track_width);
        }
    }

    fn motion(&self) -> Motion {
        let mut mover = self.mover;
        for (_, event) in &self.kept {
            event.apply(&mut mover, self.track_width);
        }
        mover.motion()
    }
}

/// The motion that the node requests.
#[derive(Debug, Clone)]
pub struct MotionRequests {
    motion: SearchMotion,
    speeds: Speeds,
    track_width: Metres,
    /// `None` while the robot does not search, or begins anew.
    course: Option<Course>,
    /// When the last ping and the last travel arrived.
    heard_ping: Option<Nanoseconds>,
    heard_travel: Option<Nanoseconds>,
    /// Whether a travel has arrived since the last request.
    has_travelled: bool,
    /// The last request.
    requested: Motion,
}

impl MotionRequests {
    /// The requests of a robot; `None` without `search_motion_topic`.
    ///
    /// # Errors
    /// If there is the topic, but no motion in the robot file.
    pub fn of(parameters: &Parameters, config: &RobotConfig) -> anyhow::Result<Option<Self>> {
        if parameters.text("search_motion_topic").is_empty() {
            return Ok(None);
        }
        let motion = config.start.motion().context(
            "search_motion_topic: the robot file has no search_motion. Add it (docs/driving.md), or leave search_motion_topic empty",
        )?;
        let track_width = config.localizer.drive.track_width;
        Ok(Some(Self {
            motion,
            speeds: Speeds::within(config.localizer.max_wheel_speed, track_width),
            track_width,
            course: None,
            heard_ping: None,
            heard_travel: None,
            has_travelled: false,
            requested: Motion::default(),
        }))
    }

    /// Takes a travel that arrived at `now`; `history` is how late a ping may arrive. After a gap the robot begins anew.
    pub fn travel(&mut self, part: &Part, history: Nanoseconds, now: Nanoseconds) {
        (self.heard_travel, self.has_travelled) = (Some(now), true);
        if part.is_gap {
            self.begin_anew();
        }
        if let Some(course) = &mut self.course {
            let travel = WheelTravel::new(single(part.right), single(part.left));
            course.add(part.to, Event::Travel(travel));
            course.forget(part.to - history);
        }
    }

    /// Takes the ranges that the search has taken by `now`: those of the first ranger.
    pub fn hear(&mut self, heard: &[Heard], now: Nanoseconds) {
        let beams = heard.iter().map(|heard| &heard.beam);
        for beam in beams.filter(|beam| beam.ranger == RangerId::FIRST) {
            self.heard_ping = Some(now);
            if let Some(course) = &mut self.course {
                course.add(beam.at, Event::of(beam));
            }
        }
    }

    /// Forgets pings and travels: where the robot has gone since them is not known.
    pub fn begin_anew(&mut self) {
        self.course = None;
    }

    /// The velocity to publish at `now`, if there is one: with each travel while the robot moves, and when it changes. The robot
    /// stands if it does not search, without a ping, and without odometry for longer than `timeout`.
    pub fn due(
        &mut self,
        is_searching: bool,
        timeout: Nanoseconds,
        now: Nanoseconds,
    ) -> Option<Twist> {
        let is_within = |last: Option<Nanoseconds>, most| {
            // The clock may have been set back.
            last.is_some_and(|last| (0..=most).contains(&(now - last)))
        };
        let has_inputs =
            is_within(self.heard_ping, SILENCE) && is_within(self.heard_travel, timeout);
        if !is_searching || !has_inputs {
            return self.stop();
        }
        let course = self.course.get_or_insert_with(|| Course {
            track_width: self.track_width,
            mover: SearchMover::new(self.motion, self.speeds),
            kept: VecDeque::new(),
        });
        let motion = course.motion();
        self.request(motion)
    }

    /// Ends the motion; the velocity zero, if it is to be published.
    pub fn stop(&mut self) -> Option<Twist> {
        self.begin_anew();
        self.request(Motion::default())
    }

    /// Zero is published once.
    fn request(&mut self, motion: Motion) -> Option<Twist> {
        let is_renewed = std::mem::take(&mut self.has_travelled) && motion != Motion::default();
        let is_changed = std::mem::replace(&mut self.requested, motion) != motion;
        (is_changed || is_renewed).then(|| twist(motion))
    }
}

/// As REP 103: m/s ahead, rad/s counter-clockwise.
fn twist(motion: Motion) -> Twist {
    Twist {
        linear: Vector3 { x: motion.speed.0.into(), ..Vector3::default() },
        angular: Vector3 { z: motion.turn.0.into(), ..Vector3::default() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonarfix::config::Config;
    use sonarfix_hal::config::{SearchMotionKind, StartPose};

    const BUMPER: f64 = 0.3;
    const HISTORY: Nanoseconds = 1_000_000_000;
    const TIMEOUT: Nanoseconds = 500_000_000;
    const PERIOD: Nanoseconds = 50_000_000;
    /// The motion ahead.
    const AHEAD: [f64; 2] = [0.25, 0.0];

    fn config(kind: Option<SearchMotionKind>) -> RobotConfig {
        let mut config = RobotConfig::with_common_parts(Config::for_track_width(Metres(0.16)));
        if let Some(kind) = kind {
            let motion = SearchMotion { kind, bumper: Metres(single(BUMPER)) };
            config.start = StartPose::Exploring { region: None, motion };
        }
        config
    }

    /// A robot that searches, with its time.
    struct Robot {
        requests: MotionRequests,
        now: Nanoseconds,
    }

    impl Robot {
        fn new(kind: SearchMotionKind) -> Self {
            let mut parameters = Parameters::default();
            parameters.set_text("search_motion_topic", "cmd_vel").unwrap();
            let requests = MotionRequests::of(&parameters, &config(Some(kind))).unwrap().unwrap();
            let mut robot = Self { requests, now: 1000 * HISTORY };
            robot.travel(0.0);
            robot.ping(0.0, None);
            robot.due();
            robot
        }

        /// Its sweep has found free floor.
        fn driving() -> Self {
            let mut robot = Self::new(SearchMotionKind::Ahead);
            for step in -6_i8..=6 {
                robot.ping(f64::from(10 * step), Some(2.0));
                robot.travel(0.0);
            }
            assert_eq!(robot.due(), Some(AHEAD));
            robot
        }

        fn part(&self, advance: f64) -> Part {
            let (from, to) = (self.now - PERIOD, self.now);
            let [right, left] = [advance; 2];
            Part { from, to, right, left, turn: None, is_gap: false, is_unobserved: false }
        }

        fn travel(&mut self, advance: f64) {
            self.now += PERIOD;
            self.requests.travel(&self.part(advance), HISTORY, self.now);
        }

        fn beam(&self, degrees: f64, range: Option<f64>) -> Beam {
            let bearing = f64::to_radians(degrees);
            let echo = range.map_or(Echo::None, Echo::At);
            Beam { at: self.now, ranger: RangerId::FIRST, bearing, echo }
        }

        fn hear(&mut self, beam: Beam) {
            self.requests.hear(&[Heard { beam, fix: None }], self.now);
        }

        fn ping(&mut self, degrees: f64, range: Option<f64>) {
            self.hear(self.beam(degrees, range));
        }

        /// What is published: m/s ahead, rad/s, rounded.
        fn due(&mut self) -> Option<[f64; 2]> {
            let rounded = |number: f64| (number * 1e4).round() / 1e4;
            let twist = self.requests.due(true, TIMEOUT, self.now)?;
            Some([rounded(twist.linear.x), rounded(twist.angular.z)])
        }
    }

    #[test]
    fn the_topic_needs_a_motion_and_the_motion_a_topic() {
        let mut parameters = Parameters::default();
        let with_motion = config(Some(SearchMotionKind::Spin));
        assert!(MotionRequests::of(&parameters, &with_motion).unwrap().is_none());
        parameters.set_text("search_motion_topic", "cmd_vel").unwrap();
        let error = MotionRequests::of(&parameters, &config(None)).unwrap_err().to_string();
        assert!(error.contains("has no search_motion. Add it"), "{error}");
    }

    /// Two centimetres were left at the ping, and three are driven before it arrives.
    #[test]
    fn a_late_ping_counts_at_its_time() {
        let [mut usual, mut late] = [Robot::driving(), Robot::driving()];
        let beam = usual.beam(0.0, Some(BUMPER + 0.02));
        usual.hear(beam);
        for robot in [&mut usual, &mut late] {
            robot.travel(0.015);
            assert_eq!(robot.due(), Some(AHEAD));
            robot.travel(0.015);
        }
        late.hear(beam);
        let turn = usual.due();
        assert!(turn.is_some_and(|[ahead, turn]| ahead == 0.0 && turn != 0.0), "{turn:?}");
        assert_eq!(late.due(), turn);
    }

    /// What is older than the history is forgotten, but for what follows from it.
    #[test]
    fn a_long_search_keeps_a_history() {
        let mut robot = Robot::driving();
        for step in 0..1000 {
            robot.ping([-60.0, 0.0, 60.0, 0.0][step % 4], Some(2.0));
            robot.travel(0.0);
            assert_eq!(robot.due(), Some(AHEAD));
        }
        let kept = |robot: &Robot| robot.requests.course.as_ref().unwrap().kept.len();
        assert!((40..45).contains(&kept(&robot)), "{}", kept(&robot));
        for _ in 0..3000 {
            robot.ping(0.0, Some(2.0));
        }
        assert_eq!(kept(&robot), MOST_KEPT);
    }

    #[test]
    fn it_is_published_with_each_travel_and_when_it_changes() {
        let mut robot = Robot::driving();
        robot.ping(10.0, Some(2.0));
        assert_eq!(robot.due(), None);
        robot.travel(0.001);
        assert_eq!(robot.due(), Some(AHEAD));
        robot.ping(20.0, Some(0.1));
        assert!(robot.due().is_some_and(|[ahead, _]| ahead == 0.0));
    }

    /// An echo from nearer than the ranger can measure has no range, and is no free floor. Other rangers do not sweep.
    #[test]
    fn an_object_at_the_first_ranger_ends_the_way_ahead() {
        let mut robot = Robot::driving();
        robot.hear(Beam { ranger: RangerId(1), ..robot.beam(0.0, Some(0.1)) });
        assert_eq!(robot.due(), None);
        robot.hear(Beam { echo: Echo::TooNear, ..robot.beam(0.0, None) });
        assert!(robot.due().is_some_and(|[ahead, _]| ahead == 0.0));
    }

    /// Zero, once, after each reason to stand; then it begins anew, with a sweep.
    #[test]
    fn a_robot_that_stands_is_left_alone() {
        let silent_odometry = |robot: &mut Robot| robot.now += TIMEOUT + 1;
        let silent_sonar = |robot: &mut Robot| {
            while robot.requests.heard_ping.unwrap() + SILENCE >= robot.now {
                robot.travel(0.0);
            }
        };
        let clock_set_back = |robot: &mut Robot| robot.now -= 100 * HISTORY;
        let gap = |robot: &mut Robot| {
            robot.now += PERIOD;
            let part = Part { is_gap: true, ..robot.part(0.0) };
            robot.requests.travel(&part, HISTORY, robot.now);
        };
        let not_finite = |robot: &mut Robot| robot.travel(f64::NAN);
        let reasons: [&dyn Fn(&mut Robot); 5] =
            [&silent_odometry, &silent_sonar, &clock_set_back, &gap, &not_finite];
        for (number, reason) in reasons.into_iter().enumerate() {
            let mut robot = Robot::driving();
            reason(&mut robot);
            assert_eq!(robot.due(), Some([0.0; 2]), "{number}");
            robot.ping(0.0, Some(2.0));
            for _ in 0..10 {
                robot.travel(0.0);
                assert_eq!(robot.due(), None, "{number}");
            }
        }
        let mut robot = Robot::driving();
        assert!(robot.requests.due(false, TIMEOUT, robot.now).is_some());
        assert!(robot.requests.due(false, TIMEOUT, robot.now).is_none());
        assert!(robot.requests.stop().is_none());
    }

    /// The turn is not used up while no ping arrives.
    #[test]
    fn a_spin_waits_for_the_sonar() {
        let mut robot = Robot::new(SearchMotionKind::Spin);
        robot.travel(0.0);
        assert!(robot.due().is_some_and(|[ahead, turn]| ahead == 0.0 && turn > 0.0));
        robot.now += SILENCE;
        robot.travel(0.0);
        assert_eq!(robot.due(), Some([0.0; 2]));
        robot.ping(0.0, None);
        robot.travel(0.0);
        assert!(robot.due().is_some());
    }
}
