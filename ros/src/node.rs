//! The node without DDS and without a clock: messages with the time of their arrival go in, messages to publish come out.

use std::collections::VecDeque;
use std::path::Path;

use anyhow::{Context, ensure};
use self_cell::self_cell;
use sonarfix::config::RangerId;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::{Localizer, Mode, Start, UNKNOWN_HEADING, UNKNOWN_POSITION};
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::robot_file;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{
    Imu, JointState, LaserScan, OccupancyGrid, Odometry, PoseWithCovarianceStamped, RangeHeard,
    TFMessage, Twist,
};
use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::{Search, SearchParameters};

use crate::markers::{self, Drawn};
use crate::motion::{Motion, Odometer, Part, Planar, Wheels, between, moved, seconds};
use crate::parameters::Parameters;
use crate::problem::{Nanoseconds, Problem, Problems};
use crate::publication::Output;
use crate::ranges::Ranges;
use crate::report::{self, Outcomes};
use crate::search_motion::MotionRequests;
use crate::timeline::{Ahead, Heard, Timeline};
use crate::turns::Turns;
use crate::view::{Frames, View, particles};
use crate::walls::Walls;
use sonarfix_ros_messages::transforms::Transforms;

/// A message to the node.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// Of `odom_topic`.
    Odometry(Box<Odometry>),
    /// Of `joint_topic`.
    Joints(JointState),
    /// Of the topic of `range_topics` at this place.
    Range(usize, RangeHeard),
    /// Of `scan_topic`.
    Scan(LaserScan),
    /// Of `imu_topic`.
    Imu(Box<Imu>),
    /// Of `/tf`.
    Transforms(TFMessage),
    /// Of `/tf_static`.
    StaticTransforms(TFMessage),
    /// Of `map_topic`.
    Map(OccupancyGrid),
    /// Of `/initialpose`, or of the service `set_initial_pose`.
    InitialPose(Box<PoseWithCovarianceStamped>),
    /// Of the service `reinitialize_global_localization`.
    SearchAnywhere,
    /// Of the service `request_nomotion_update`.
    PublishNow,
    /// Bytes that are no message.
    Undecodable,
    /// Nothing: time has passed.
    Tick,
}

self_cell!(
    /// A timeline with the walls that its localizer borrows.
    struct Located {
        owner: Walls,
        #[covariant]
        dependent: Timeline,
    }
);

/// The start of the localizer.
#[derive(Debug, Clone, Copy)]
enum Begin {
    /// The pose is unknown.
    Unknown,
    /// A pose with its deviations.
    At(Start),
}

/// Time from one message to the next that is a jump of the clock: ahead, back.
const JUMP_AHEAD: Nanoseconds = 5_000_000_000;
const JUMP_BACK: Nanoseconds = 500_000_000;
/// The least deviations of a pose that is set: metres, radians. `RViz` and many programs send zeros.
const LEAST: (f64, f64) = (0.01, 0.01);
/// Longest time between two transforms: odometry alone changes none, but its validity must go on.
const TRANSFORM_PERIOD: Nanoseconds = 100_000_000;
/// The pings that are drawn.
const DRAWN: usize = 30;

/// The node.
pub struct Node {
    parameters: Parameters,
    config: RobotConfig,
    frames: Frames,
    is_active: bool,
    odometer: Odometer,
    turns: Turns,
    transforms: Transforms,
    ranges: Ranges,
    /// Walls that no localizer has taken yet.
    walls: Option<Walls>,
    located: Option<Located>,
    begin: Begin,
    problems: Problems,
    outcomes: Vec<Outcomes>,
    /// When the last range of each ranger arrived.
    heard_ranges: Vec<Option<Nanoseconds>>,
    drawn: VecDeque<Drawn>,
    /// `None` without `search_motion_topic`.
    motion_requests: Option<MotionRequests>,
    now: Nanoseconds,
    /// When the last odometry arrived.
    heard_odometry: Option<Nanoseconds>,
    published_pose: Option<Nanoseconds>,
    published_transform: Option<Nanoseconds>,
    published_report: Option<Nanoseconds>,
}

impl Node {
    /// A node with these parameters; reads the robot file and the map file.
    ///
    /// # Errors
    /// If a file cannot be read, or the parameters do not fit the robot.
    pub fn read(parameters: &Parameters) -> anyhow::Result<Self> {
        let file = parameters.text("robot_file");
        ensure!(!file.is_empty(), "robot_file: set it to a robot file (docs/formats.md)");
        let config = robot_file::read(Path::new(file)).context("robot_file")?;
        let map = parameters.text("map_file");
        let walls = (!map.is_empty()).then(|| Walls::read(Path::new(map)).context("map_file"));
        Self::new(parameters, config, walls.transpose()?)
    }

    /// A node of this robot; without walls it waits for a grid.
    ///
    /// # Errors
    /// If the parameters do not fit the robot.
    pub fn new(
        parameters: &Parameters,
        config: RobotConfig,
        walls: Option<Walls>,
    ) -> anyhow::Result<Self> {
        let rangers = config.localizer.rangers.iter().count();
        let topics = parameters.texts("range_topics").len();
        ensure!(
            topics <= rangers,
            "range_topics: it has {topics} topics, but the robot file has {rangers} rangers"
        );
        let bearings = parameters.numbers("range_bearings");
        ensure!(
            bearings.is_empty() || bearings.len() == topics,
            "range_bearings: it needs a bearing for each of the {topics} range_topics, or none"
        );
        let motion_requests = MotionRequests::of(parameters, &config)?;
        let wheels = Wheels {
            track_width: f64::from(config.localizer.drive.track_width.0),
            max_speed: f64::from(config.localizer.max_wheel_speed.0),
            radius: parameters.number("wheel_radius"),
        };
        let frames = Frames::of(parameters);
        Ok(Self {
            begin: begin(parameters),
            odometer: Odometer::new(wheels, parameters.nanoseconds("odometry_timeout")),
            ranges: Ranges::new(&frames.base, bearings, parameters.numbers("scan_bearings")),
            outcomes: vec![Outcomes::default(); rangers],
            heard_ranges: vec![None; rangers],
            parameters: parameters.clone(),
            config,
            frames,
            walls,
            is_active: false,
            turns: Turns::default(),
            transforms: Transforms::default(),
            located: None,
            problems: Problems::default(),
            drawn: VecDeque::new(),
            motion_requests,
            now: 0,
            heard_odometry: None,
            published_pose: None,
            published_transform: None,
            published_report: None,
        })
    }

    /// Begins or ends to publish; returns the last message, if there is one.
    pub fn set_active(&mut self, is_active: bool) -> Option<Output> {
        self.is_active = is_active;
        let requests = self.motion_requests.as_mut().filter(|_| !is_active)?;
        requests.stop().map(Output::Velocity)
    }

    /// Takes the parameters that have changed.
    pub fn set_parameters(&mut self, parameters: &Parameters) {
        self.parameters = parameters.clone();
    }

    /// The counts of what was wrong.
    #[must_use]
    pub fn problems(&self) -> &Problems {
        &self.problems
    }

    /// The estimate, if there is one.
    #[must_use]
    pub fn view(&self) -> Option<View> {
        let timeline = self.located.as_ref()?.borrow_dependent();
        let navigator = timeline.navigator();
        let at = timeline.time();
        let odometry = self.odometer.pose_at(at)?;
        Some(View::of(navigator.localizer(), navigator.mode(), at, odometry))
    }

    /// Takes a message that arrived at `now`; returns what is to be published.
    pub fn take(&mut self, input: Input, now: Nanoseconds) -> Vec<Output> {
        self.watch_clock(now);
        let mut out = Vec::new();
        match input {
            Input::Odometry(message) => self.take_odometry(&message, &mut out),
            Input::Joints(message) => self.take_joints(&message, &mut out),
            Input::Range(place, message) => self.take_range(place, &message, &mut out),
            Input::Scan(message) => self.take_scan(message, &mut out),
            Input::Imu(message) => {
                let at = message.header.stamp.nanoseconds();
                if !self.turns.take(at, message.angular_velocity.z) {
                    self.report(Problem::ImuNotFinite);
                }
            }
            Input::Transforms(message) => self.take_transforms(&message, false, &mut out),
            Input::StaticTransforms(message) => self.take_transforms(&message, true, &mut out),
            Input::Map(message) => self.take_map(&message),
            Input::InitialPose(message) => self.take_pose(&message, &mut out),
            Input::SearchAnywhere => self.search_anywhere(),
            Input::PublishNow => self.publish_pose(&mut out),
            Input::Undecodable => self.report(Problem::Undecodable),
            Input::Tick => {}
        }
        self.hear_waiting(&mut out);
        self.publish_report(&mut out);
        if !self.is_active {
            return Vec::new();
        }
        out.extend(self.requested_velocity().map(Output::Velocity));
        out
    }

    /// The velocity of a robot that searches, if it is to be published.
    fn requested_velocity(&mut self) -> Option<Twist> {
        let timeline = self.located.as_ref().map(Located::borrow_dependent);
        let is_searching = timeline.is_some_and(Timeline::is_searching);
        let timeout = self.parameters.nanoseconds("odometry_timeout");
        self.motion_requests.as_mut()?.due(is_searching, timeout, self.now)
    }

    fn report(&mut self, problem: Problem) {
        self.problems.add(problem, self.now);
    }

    /// Notices a clock that was set. The inputs of the time before are of another time.
    fn watch_clock(&mut self, now: Nanoseconds) {
        let before = std::mem::replace(&mut self.now, now);
        if before == 0 {
            return;
        }
        if now < before - JUMP_BACK {
            self.report(Problem::ClockBack);
            self.transforms.forget_moving();
            self.turns.forget();
            self.ranges.forget();
            self.odometer.forget();
            (self.heard_odometry, self.published_report) = (None, None);
            (self.published_pose, self.published_transform) = (None, None);
        } else if now > before + JUMP_AHEAD {
            self.report(Problem::ClockAhead);
        }
    }

    /// Whether a stamp is ahead of the clock.
    fn is_future(&self, at: Nanoseconds) -> bool {
        // Zero: a simulated clock that has not begun.
        self.now != 0 && at > self.now + self.parameters.nanoseconds("max_future")
    }

    fn take_odometry(&mut self, message: &Odometry, out: &mut Vec<Output>) {
        let frames = &self.frames;
        let is_ours = message.header.frame_id.trim_start_matches('/') == frames.odom
            && message.child_frame_id.trim_start_matches('/') == frames.base;
        if !is_ours {
            return self.report(Problem::OdometryFrame);
        }
        if self.is_future(message.header.stamp.nanoseconds()) {
            return self.report(Problem::OdometryFuture);
        }
        let is_first = self.odometer.last().is_none();
        let motion = self.odometer.take(message);
        self.take_motion(motion, is_first, out);
    }

    fn take_joints(&mut self, message: &JointState, out: &mut Vec<Output>) {
        if self.is_future(message.header.stamp.nanoseconds()) {
            return self.report(Problem::OdometryFuture);
        }
        let is_first = self.odometer.last().is_none();
        let motion = self.odometer.take_joints(message, self.parameters.texts("wheel_joints"));
        self.take_motion(motion, is_first, out);
    }

    fn take_motion(&mut self, motion: Motion, is_first: bool, out: &mut Vec<Output>) {
        if let Some(problem) = motion.problem {
            self.report(problem);
        }
        self.heard_odometry = Some(self.now);
        let Some((at, _)) = self.odometer.last() else { return };
        if self.located.is_none() {
            self.locate(at);
        } else if is_first || motion.is_clock_reset {
            self.turns.forget();
            self.begin_motion_anew();
            let since = motion.parts.first().map_or(at, |part| part.from);
            self.with_timeline(|timeline| timeline.set_clock(since));
        }
        let has_gyro =
            self.config.localizer.gyro.is_some() && !self.parameters.text("imu_topic").is_empty();
        let is_new = !motion.parts.is_empty();
        for mut part in motion.parts {
            part.turn = self.turns.angle(part.from, part.to).filter(|_| has_gyro);
            if has_gyro && part.turn.is_none() {
                self.report(Problem::ImuGap);
            }
            self.advance(&part);
        }
        let unplaced = self.with_timeline(|timeline| {
            // A method's path has one lifetime, and this closure any.
            timeline.take_unplaced()
        });
        for _ in 0..unplaced.unwrap_or(0) {
            self.report(Problem::RangeUnplaced);
        }
        if is_new || is_first {
            self.publish_estimate(false, out);
        }
    }

    /// Takes a travel with the ranges in it.
    fn advance(&mut self, part: &Part) {
        match self.with_timeline(|timeline| timeline.advance(part)) {
            Some(Ok(heard)) => {
                let history = self.parameters.nanoseconds("history");
                if let Some(requests) = &mut self.motion_requests {
                    requests.travel(part, history, self.now);
                }
                self.record(&heard);
            }
            Some(Err(_)) => {
                self.report(Problem::OdometryRefused);
                self.begin_motion_anew();
            }
            None => {}
        }
    }

    fn begin_motion_anew(&mut self) {
        if let Some(requests) = &mut self.motion_requests {
            requests.begin_anew();
        }
    }

    fn with_timeline<T>(&mut self, work: impl FnOnce(&mut Timeline) -> T) -> Option<T> {
        let history = self.parameters.nanoseconds("history");
        let searches = self.parameters.flag("search_when_lost");
        let located = self.located.as_mut()?;
        Some(located.with_dependent_mut(|_, timeline| {
            timeline.set(history, searches);
            work(timeline)
        }))
    }

    /// Starts the localizer, once there are walls and odometry.
    fn locate(&mut self, at: Nanoseconds) {
        let Some(walls) = self.walls.take() else { return };
        let (config, begin) = (self.config.localizer, self.begin);
        let start = match begin {
            Begin::At(start) => start,
            Begin::Unknown => unknown(),
        };
        let made = Located::try_new_or_recover(walls, |walls| {
            let map = walls.map();
            let localizer = Localizer::new(config, map, start, Timeline::start())?;
            let search =
                Box::new(Search::new(&config.rangers.first, map, SearchParameters::of(&config)));
            let mut timeline = Timeline::new(Navigator::new(localizer), search, at);
            if matches!(begin, Begin::Unknown) {
                timeline.search_from_start();
            }
            Ok::<_, sonarfix::localizer::StartError>(timeline)
        });
        match made {
            Ok(located) => self.located = Some(located),
            Err((walls, _)) => {
                self.walls = Some(walls);
                self.begin = Begin::Unknown;
                self.report(Problem::PoseRefused);
            }
        }
    }

    fn take_range(&mut self, place: usize, message: &RangeHeard, out: &mut Vec<Output>) {
        let at = message.header.stamp.nanoseconds();
        if self.is_future(at) {
            return self.report(Problem::RangeFuture);
        }
        let Ok(ranger) = u8::try_from(place) else { return };
        self.hear_from(place);
        match self.ranges.range(RangerId(ranger), message, self.now) {
            Ok(()) => self.hear_waiting(out),
            Err(problem) => self.report(problem),
        }
    }

    fn take_scan(&mut self, message: LaserScan, out: &mut Vec<Output>) {
        if self.is_future(message.header.stamp.nanoseconds()) {
            return self.report(Problem::RangeFuture);
        }
        self.hear_from(RangerId::FIRST.index());
        match self.ranges.scan(message, self.now) {
            Ok(()) => self.hear_waiting(out),
            Err(problem) => self.report(problem),
        }
    }

    fn hear_from(&mut self, ranger: usize) {
        if let Some(heard) = self.heard_ranges.get_mut(ranger) {
            *heard = Some(self.now);
        }
    }

    /// Passes the ranges on whose bearings are known.
    fn hear_waiting(&mut self, out: &mut Vec<Output>) {
        if self.ranges.is_empty() {
            return;
        }
        let found = self.ranges.due(&self.transforms, self.now);
        for problem in found.problems {
            self.report(problem);
        }
        let is_any = !found.beams.is_empty();
        for beam in found.beams {
            match self.with_timeline(|timeline| timeline.take(beam)) {
                Some(Ok(heard)) => self.record(&heard),
                Some(Err(problem)) => self.report(problem),
                None => self.report(Problem::RangeBeforeStart),
            }
        }
        if is_any {
            self.publish_estimate(true, out);
        }
    }

    fn take_transforms(&mut self, message: &TFMessage, is_static: bool, out: &mut Vec<Output>) {
        for transform in &message.transforms {
            if !self.transforms.take(transform, is_static) {
                self.report(Problem::TransformNotFinite);
            }
        }
        self.hear_waiting(out);
    }

    /// Takes a grid. The pose and the calibration of a localizer that runs are kept.
    fn take_map(&mut self, message: &OccupancyGrid) {
        let is_known = self.located.is_some() || self.walls.is_some();
        let has_file = !self.parameters.text("map_file").is_empty();
        if has_file || (is_known && self.parameters.flag("first_map_only")) {
            return;
        }
        let Ok(walls) = Walls::find(message) else { return self.report(Problem::MapInvalid) };
        self.report(Problem::MapFromGrid);
        if let Some(located) = self.located.take()
            && !self.parameters.flag("always_reset_initial_pose")
        {
            self.begin = begin_of(located.borrow_dependent());
        }
        self.walls = Some(walls);
        if let Some((at, _)) = self.odometer.last() {
            self.locate(at);
        }
    }

    fn take_pose(&mut self, message: &PoseWithCovarianceStamped, out: &mut Vec<Output>) {
        if message.header.frame_id.trim_start_matches('/') != self.frames.map {
            return self.report(Problem::PoseFrame);
        }
        let planar = geometry::planar(&message.pose.pose);
        let deviations = geometry::deviations(&message.pose.covariance);
        let (Some(pose), Some(deviations)) = (planar, deviations) else {
            return self.report(Problem::PoseNotFinite);
        };
        let start = start(self.moved_since(pose, message.header.stamp.nanoseconds()), deviations);
        self.begin = Begin::At(start);
        if let Some(Err(problem)) = self.with_timeline(|timeline| timeline.set_pose(&start)) {
            self.report(problem);
        }
        self.publish_estimate(true, out);
    }

    /// A pose of an earlier time, moved by the odometry since.
    fn moved_since(&self, pose: Planar, at: Nanoseconds) -> Planar {
        let (Some(then), Some((last, now))) = (self.odometer.pose_at(at), self.odometer.last())
        else {
            return pose;
        };
        // A stamp of zero is no time.
        if at == 0 || at >= last { pose } else { moved(pose, between(then, now)) }
    }

    fn search_anywhere(&mut self) {
        self.begin = Begin::Unknown;
        if let Some(located) = &mut self.located {
            located.with_dependent_mut(|_, timeline| timeline.search_anywhere());
        }
    }

    /// Counts outcomes and keeps the pings, for the motion and for the drawing.
    fn record(&mut self, heard: &[Heard]) {
        if let Some(requests) = &mut self.motion_requests {
            requests.hear(heard, self.now);
        }
        let Some(view) = self.view() else { return };
        for heard in heard {
            let ranger = heard.beam.ranger;
            if let Some(outcomes) = self.outcomes.get_mut(ranger.index()) {
                outcomes.add(heard);
            }
            let (Some(range), Some(sonar)) =
                (heard.beam.echo.range(), self.config.localizer.rangers.get(ranger))
            else {
                continue;
            };
            let mount = [sonar.mount.x.0, sonar.mount.y.0].map(f64::from);
            self.drawn.push_back(Drawn::new(
                view.pose,
                mount,
                heard.beam.bearing,
                range,
                heard.fix,
            ));
            if self.drawn.len() > DRAWN {
                self.drawn.pop_front();
            }
        }
    }

    /// The newest estimate: at the time of a range that waits for odometry, or of the odometry.
    fn newest(&self) -> Option<View> {
        let timeline = self.located.as_ref()?.borrow_dependent();
        let Some(Ahead { navigator, part, .. }) = timeline.ahead() else { return self.view() };
        let (_, last) = self.odometer.last()?;
        let turn = (part.right - part.left) / f64::from(self.config.localizer.drive.track_width.0);
        let ahead = 0.5 * (part.right + part.left);
        let step = [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn];
        Some(View::of(navigator.localizer(), navigator.mode(), part.to, moved(last, step)))
    }

    /// Publishes the transform, and the pose if it has news or is due.
    fn publish_estimate(&mut self, has_news: bool, out: &mut Vec<Output>) {
        let Some(view) = self.newest() else { return };
        let mut transforms = Vec::new();
        let tolerance = self.parameters.nanoseconds("transform_tolerance");
        let period = TRANSFORM_PERIOD.min(tolerance / 2);
        // The stamps of the odometry may be set back without the clock.
        let is_early = |last: Nanoseconds| (last..last + period).contains(&view.at);
        let is_needed = has_news || !self.published_transform.is_some_and(is_early);
        if is_needed && self.parameters.flag("tf_broadcast") && view.has_pose() {
            self.published_transform = Some(view.at);
            transforms.push(view.map_to_odom(&self.frames, tolerance));
        }
        if self.parameters.flag("publish_odom_tf") {
            transforms.push(view.odom_to_base(&self.frames));
        }
        if !transforms.is_empty() {
            out.push(Output::Transforms(TFMessage { transforms }));
        }
        let period = self.parameters.nanoseconds("pose_period");
        let is_due =
            self.published_pose.is_none_or(|last| view.at < last || view.at - last >= period);
        if has_news || is_due {
            self.publish_pose(out);
        }
    }

    fn publish_pose(&mut self, out: &mut Vec<Output>) {
        let Some(view) = self.newest().filter(View::has_pose) else { return };
        self.published_pose = Some(view.at);
        out.push(Output::Pose(Box::new(view.pose_message(&self.frames))));
    }

    /// Publishes diagnostics, markers, calibration and hypotheses, if they are due.
    fn publish_report(&mut self, out: &mut Vec<Output>) {
        let period = self.parameters.nanoseconds("diagnostics_period");
        if self.published_report.is_some_and(|last| self.now - last < period) {
            return;
        }
        self.published_report = Some(self.now);
        self.watch_silence();
        let timeline = self.located.as_ref().map(Located::borrow_dependent);
        let navigator = timeline.map(Timeline::navigator);
        let localizer = navigator.map(Navigator::localizer);
        let found =
            |it: &Navigator| (it.localizer().health(), it.mode(), it.localizer().mismatch());
        let health = navigator.map(found);
        let has_walls = self.walls.is_some() || localizer.is_some();
        let waits_for = if has_walls { "odometry" } else { "a map" };
        let mut statuses =
            vec![report::localization(health, waits_for), report::inputs(&self.problems, self.now)];
        for (number, (outcomes, heard)) in self.outcomes.iter().zip(&self.heard_ranges).enumerate()
        {
            let silent_for = heard.map(|last| seconds(self.now.saturating_sub(last)));
            statuses.push(report::ranger(number, outcomes, silent_for));
        }
        out.push(Output::Diagnostics(report::array(self.now, statuses)));
        if let Some(localizer) = localizer {
            let (filter, width) = (localizer.filter(), localizer.config().drive.track_width);
            let (state, deviation) = (filter.state(), filter.standard_deviations());
            let message = report::calibration(width, &state, &deviation, self.now);
            out.push(Output::Calibration(message));
        }
        self.draw(out);
    }

    fn watch_silence(&mut self) {
        let timeout = self.parameters.nanoseconds("odometry_timeout");
        if self.heard_odometry.is_none_or(|last| self.now - last > timeout) {
            self.report(Problem::NoOdometry);
        }
        if self.walls.is_none() && self.located.is_none() {
            self.report(Problem::NoMap);
        }
    }

    fn draw(&mut self, out: &mut Vec<Output>) {
        let (Some(located), Some(view)) = (&self.located, self.view()) else { return };
        if self.parameters.flag("publish_markers") {
            let walls = located.borrow_owner().walls();
            let pings = self.drawn.make_contiguous();
            out.push(Output::Markers(markers::markers(&view, walls, pings, &self.frames)));
        }
        if view.mode != Mode::Tracking {
            let search = located.borrow_dependent().search();
            out.push(Output::Particles(particles(search, view.at, &self.frames)));
        }
    }
}

/// The start by the parameters.
fn begin(parameters: &Parameters) -> Begin {
    if !parameters.flag("set_initial_pose") {
        return Begin::Unknown;
    }
    let number = |name: &str| parameters.number(&format!("initial_pose.{name}"));
    let deviations = [number("position_deviation"), number("heading_deviation")];
    Begin::At(start([number("x"), number("y"), number("yaw")], deviations))
}

/// The start of a localizer with another map: where this one is.
fn begin_of(timeline: &Timeline) -> Begin {
    if timeline.is_searching() {
        return Begin::Unknown;
    }
    let localizer = timeline.navigator().localizer();
    let deviations = localizer.filter().standard_deviations();
    let position = if deviations.x > deviations.y { deviations.x } else { deviations.y };
    Begin::At(Start {
        pose: localizer.pose(),
        position_deviation: position,
        heading_deviation: deviations.heading,
    })
}

#[expect(clippy::cast_possible_truncation, reason = "the localizer computes in f32")]
fn start([x, y, heading]: Planar, [position, turn]: [f64; 2]) -> Start {
    let (least_position, least_turn) = LEAST;
    let most_turn = f64::from(UNKNOWN_HEADING.0);
    Start {
        pose: Pose::new(x as f32, y as f32, Radians(heading as f32)),
        position_deviation: Metres(position.max(least_position) as f32),
        heading_deviation: Radians(turn.clamp(least_turn, most_turn) as f32),
    }
}

fn unknown() -> Start {
    Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: UNKNOWN_POSITION,
        heading_deviation: UNKNOWN_HEADING,
    }
}
