//! A robot with our firmware behind a serial link, as the node publishes it: what it estimates, heard and is asked to do. No port,
//! no DDS and no clock: bytes and the time of their arrival go in.

use std::time::Duration;

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::Telemetry;
use sonarfix_link::{Command, CommandResult, Estimate, Ping};
use sonarfix_monitor::request;
use sonarfix_ros_messages::geometry;
use sonarfix_ros_messages::messages::{PoseWithCovarianceStamped, Range, TFMessage};
use sonarfix_telemetry::Monitor;
use sonarfix_telemetry::conversation::{Conversation, Due, Outcome};

use crate::markers::{self, Drawn};
use crate::motion::{Planar, moved};
use crate::parameters::Parameters;
use crate::problem::{Nanoseconds, Problem, Problems};
use crate::publication::Output;
use crate::report;
use crate::view::{Frames, View, header, transform};

/// Silence of the robot that is reported, nanoseconds.
const SILENCE: Nanoseconds = 3_000_000_000;
/// How much slower the robot's clock may be, so that the estimate of its difference follows: 200 ppm.
const DRIFT: Nanoseconds = 5000;
/// The pings that are drawn.
const DRAWN: usize = 30;
/// `sensor_msgs/Range`'s number of ultrasound.
const ULTRASOUND: u8 = 0;

/// The robot's clock against that of ROS: the least difference between arrival and stamp is that of the shortest delay.
#[derive(Debug, Clone, Copy, Default)]
struct Difference(Option<(Nanoseconds, Nanoseconds)>);

impl Difference {
    fn time(&mut self, micros: u64, now: Nanoseconds) -> Nanoseconds {
        let robot = i64::try_from(micros).unwrap_or(i64::MAX / 2000) * 1000;
        let seen = now - robot;
        let kept = match self.0 {
            Some((least, at)) => (least + (now - at) / DRIFT).min(seen),
            None => seen,
        };
        self.0 = Some((kept, now));
        robot + kept
    }
}

/// A robot behind the link.
pub struct Bridge {
    parameters: Parameters,
    config: RobotConfig,
    walls: Vec<Wall>,
    frames: Frames,
    is_active: bool,
    monitor: Monitor,
    conversation: Conversation,
    difference: Difference,
    wheels: Option<[f64; 2]>,
    odometry: Planar,
    view: Option<View>,
    drawn: Vec<Drawn>,
    problems: Problems,
    last_command: String,
    heard: Option<Nanoseconds>,
    published_report: Option<Nanoseconds>,
}

impl Bridge {
    /// A robot of which nothing was received. The walls are those of the markers.
    #[must_use]
    pub fn new(parameters: &Parameters, config: RobotConfig, walls: Vec<Wall>) -> Self {
        Self {
            frames: Frames::of(parameters),
            parameters: parameters.clone(),
            config,
            walls,
            is_active: false,
            monitor: Monitor::of(config.localizer.prior),
            conversation: request::conversation(),
            difference: Difference::default(),
            wheels: None,
            odometry: [0.0; 3],
            view: None,
            drawn: Vec::new(),
            problems: Problems::default(),
            last_command: "none".to_owned(),
            heard: None,
            published_report: None,
        }
    }

    /// Begins or ends to publish.
    pub fn set_active(&mut self, is_active: bool) {
        self.is_active = is_active;
    }

    /// Takes the parameters that have changed.
    pub fn set_parameters(&mut self, parameters: &Parameters) {
        self.parameters = parameters.clone();
    }

    /// The last estimate.
    #[must_use]
    pub fn view(&self) -> Option<View> {
        self.view
    }

    /// Takes bytes of the robot that arrived at `now`.
    pub fn take(&mut self, bytes: &[u8], now: Nanoseconds) -> Vec<Output> {
        let mut out = Vec::new();
        for &byte in bytes {
            if let Some(received) = self.monitor.push(byte) {
                self.heard = Some(now);
                self.take_telemetry(&received.telemetry, now, &mut out);
            }
        }
        self.report_when_due(now, &mut out);
        if self.is_active { out } else { Vec::new() }
    }

    /// The port cannot be used.
    pub fn port_failed(&mut self, now: Nanoseconds) {
        self.problems.add(Problem::LinkSilent, now);
    }

    /// Adds a command to the robot; whether there was room for it.
    pub fn command(&mut self, command: Command) -> bool {
        self.conversation.add(command)
    }

    /// Passes a pose to the robot, if it is one.
    pub fn set_pose(&mut self, message: &PoseWithCovarianceStamped, now: Nanoseconds) {
        if message.header.frame_id.trim_start_matches('/') != self.frames.map {
            return self.problems.add(Problem::PoseFrame, now);
        }
        let planar = geometry::planar(&message.pose.pose);
        let deviations = geometry::deviations(&message.pose.covariance);
        let (Some(pose), Some(deviations)) = (planar, deviations) else {
            return self.problems.add(Problem::PoseNotFinite, now);
        };
        self.command(Command::SetPose(start(pose, deviations)));
    }

    /// The bytes to send now, if some are due. `time` is that since any fixed moment, and never goes back.
    pub fn to_send(&mut self, time: Duration, now: Nanoseconds) -> Option<Vec<u8>> {
        match self.conversation.poll(time) {
            Due::Send(bytes) => Some(bytes),
            Due::End(outcome) => {
                self.note(outcome, now);
                None
            }
            Due::Nothing => None,
        }
    }

    fn note(&mut self, outcome: Outcome, now: Nanoseconds) {
        self.last_command = match outcome {
            Outcome::Answered(result) | Outcome::Driven(Some(result)) => match result {
                CommandResult::Refused(error) => format!("refused: {error}"),
                _ => "executed".to_owned(),
            },
            Outcome::Silence | Outcome::Driven(None) => "not answered".to_owned(),
        };
        if self.last_command != "executed" {
            self.problems.add(Problem::CommandFailed, now);
        }
    }

    fn take_telemetry(&mut self, telemetry: &Telemetry, now: Nanoseconds, out: &mut Vec<Output>) {
        match telemetry {
            Telemetry::Initialized(estimate) => {
                self.difference = Difference::default();
                self.wheels = None;
                self.take_estimate(estimate, now, out);
            }
            Telemetry::Odometry(step) => self.drive([step.right_metres, step.left_metres]),
            Telemetry::Estimate(estimate) | Telemetry::PoseSet(estimate) => {
                self.take_estimate(estimate, now, out);
            }
            Telemetry::Ping(ping) => self.take_ping(ping, now, out),
            Telemetry::Ack(ack) => {
                if let Some(outcome) = self.conversation.take(ack) {
                    self.note(outcome, now);
                }
            }
            _ => {}
        }
    }

    /// The pose by the encoders alone. The first reading is the travel before this node listened.
    fn drive(&mut self, wheels: [f64; 2]) {
        let [right, left] = wheels;
        let [old_right, old_left] = self.wheels.replace(wheels).unwrap_or(wheels);
        let (right, left) = (right - old_right, left - old_left);
        let turn = (right - left) / f64::from(self.config.localizer.drive.track_width.0);
        let ahead = 0.5 * (right + left);
        let step = [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn];
        self.odometry = moved(self.odometry, step);
    }

    fn take_estimate(&mut self, estimate: &Estimate, now: Nanoseconds, out: &mut Vec<Output>) {
        let view = View {
            at: self.difference.time(estimate.at.ticks(), now),
            pose: [estimate.state.x.0, estimate.state.y.0, estimate.state.heading.0].map(f64::from),
            covariance: covariance(estimate),
            odometry: self.odometry,
            mode: self.monitor.mode(),
            verdict: estimate.health.verdict,
        };
        self.view = Some(view);
        out.push(Output::Odometry(Box::new(view.odometry_message(&self.frames))));
        let mut transforms = Vec::new();
        if self.parameters.flag("tf_broadcast") && view.has_pose() {
            let tolerance = self.parameters.nanoseconds("transform_tolerance");
            transforms.push(view.map_to_odom(&self.frames, tolerance));
        }
        if self.parameters.flag("publish_odom_tf") {
            transforms.push(view.odom_to_base(&self.frames));
        }
        if !transforms.is_empty() {
            out.push(Output::Transforms(TFMessage { transforms }));
        }
        if view.has_pose() {
            out.push(Output::Pose(Box::new(view.pose_message(&self.frames))));
        }
    }

    fn take_ping(&mut self, ping: &Ping, now: Nanoseconds, out: &mut Vec<Output>) {
        let at = self.difference.time(ping.at.ticks(), now);
        let Some(sonar) = self.config.localizer.rangers.get(ping.aim.ranger) else { return };
        let echo = ping.outcome.map(|echo| echo.range.0);
        let frame = format!("sonar_{}", ping.aim.ranger.0);
        let placement = [sonar.mount.x.0, sonar.mount.y.0, ping.aim.bearing.0].map(f64::from);
        let transforms = vec![transform(at, [&self.frames.base, &frame], placement)];
        out.push(Output::Transforms(TFMessage { transforms }));
        out.push(Output::Range(Range {
            header: header(at, &frame),
            radiation_type: ULTRASOUND,
            field_of_view: 2.0 * sonar.cone.0,
            min_range: sonar.min_range.0,
            max_range: sonar.max_range.0,
            range: echo.unwrap_or(f32::INFINITY),
            variance: 0.0,
        }));
        let (Some(view), Ok(range)) = (self.view, echo) else { return };
        let mount = [sonar.mount.x.0, sonar.mount.y.0].map(f64::from);
        let bearing = f64::from(ping.aim.bearing.0);
        self.drawn.push(Drawn::new(view.pose, mount, bearing, f64::from(range), Some(ping.fix)));
        if self.drawn.len() > DRAWN {
            self.drawn.remove(0);
        }
    }

    fn report_when_due(&mut self, now: Nanoseconds, out: &mut Vec<Output>) {
        let period = self.parameters.nanoseconds("diagnostics_period");
        let is_early = |last: Nanoseconds| now >= last && now - last < period;
        if self.published_report.is_some_and(is_early) {
            return;
        }
        self.published_report = Some(now);
        if self.heard.is_none_or(|last| now - last > SILENCE) {
            self.problems.add(Problem::LinkSilent, now);
        }
        let statuses = vec![self.localization(), report::inputs(&self.problems, now), self.link()];
        out.push(Output::Diagnostics(report::array(now, statuses)));
        if let (Some(view), true) = (&self.view, self.parameters.flag("publish_markers")) {
            out.push(Output::Markers(markers::markers(
                view,
                &self.walls,
                &self.drawn,
                &self.frames,
            )));
        }
        if let Some(estimate) = self.monitor.estimate() {
            let (state, deviation) = (&estimate.state, &estimate.deviation);
            let width = self.config.localizer.drive.track_width;
            out.push(Output::Calibration(report::calibration(width, state, deviation, now)));
        }
    }

    fn localization(&self) -> sonarfix_ros_messages::messages::DiagnosticStatus {
        let (mode, mismatch) = (self.monitor.mode(), self.monitor.mismatch());
        let health = self.monitor.estimate().map(|estimate| (estimate.health, mode, mismatch));
        report::localization(health, "the robot")
    }

    fn link(&self) -> sonarfix_ros_messages::messages::DiagnosticStatus {
        let (counters, gaps) = (self.monitor.counters(), self.monitor.gaps());
        let values = vec![
            report::value("frames", counters.frames),
            report::value("bytes skipped", counters.skipped()),
            report::value("frames lost", format!("{gaps:?}")),
            report::value("last command", &self.last_command),
        ];
        report::status(report::OK, "link", "counters of the receiver", values)
    }
}

/// The link transmits the deviations alone.
fn covariance(estimate: &Estimate) -> [[f64; 3]; 3] {
    let deviation = &estimate.deviation;
    let [x, y, heading] = [deviation.x.0, deviation.y.0, deviation.heading.0]
        .map(|deviation| f64::from(deviation) * f64::from(deviation));
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, heading]]
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn start([x, y, heading]: Planar, [position, turn]: [f64; 2]) -> Start {
    Start {
        pose: Pose::new(x as f32, y as f32, Radians(heading as f32)),
        position_deviation: Metres(position.max(0.01) as f32),
        heading_deviation: Radians(turn.max(0.01) as f32),
    }
}
