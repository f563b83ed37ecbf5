//! A simulated drive as the messages of a robot's base, with the truth beside them: for tests, measurements and examples.

use anyhow::{Context, ensure};
use sonarfix::localizer::Localizer;
use sonarfix_hal::robot::Report;
use sonarfix_link::{Estimate, Reporter, Telemetry};
use sonarfix_map::{Fidelity, Scenario};
use sonarfix_ros_messages::messages::{
    PoseWithCovarianceStamped, RangeHeard, TFMessage, TransformStamped,
};
use sonarfix_ros_messages::{geometry, messages};
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

use crate::motion::{Planar, moved};
use crate::node::Input;
use crate::problem::Nanoseconds;
use crate::view::{Frames, header};

/// The frame of the sonar.
pub const SONAR: &str = "sonar";
/// The ranges of a message, metres: the localizer has its own limits.
const LIMITS: [f32; 2] = [0.0, 100.0];

/// The pose at a time of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// The time.
    pub at: Nanoseconds,
    /// The true pose in the map.
    pub pose: Planar,
    /// The estimate of the robot's own localizer.
    pub estimate: Planar,
}

/// A drive.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The messages with the times of their arrival.
    pub messages: Vec<(Nanoseconds, Input)>,
    /// The telemetry of the robot, with its times.
    pub telemetry: Vec<(Nanoseconds, Telemetry)>,
    /// True and estimated poses, at the encoder ticks.
    pub truth: Vec<Truth>,
    /// The simulated robot, as its software is configured, and its map.
    pub scenario: Scenario,
    /// The pose at the start.
    pub start: PoseWithCovarianceStamped,
}

impl Drive {
    /// Simulates a drive with this seed; the run begins at the time `begin`.
    ///
    /// # Errors
    /// If the scenario has not the fidelity of pins, or the run fails.
    pub fn simulate(
        simulation: &Simulation,
        seed: u64,
        begin: Nanoseconds,
        frames: &Frames,
    ) -> anyhow::Result<Self> {
        let is_pins = simulation.scenario.fidelity == Fidelity::Pins;
        ensure!(is_pins, "only a robot of the fidelity \"pins\" has telemetry");
        let width = f64::from(simulation.scenario.robot.localizer.drive.track_width.0);
        let frames_of_messages = frames.clone();
        let mut recorder = Recorded {
            begin,
            last: begin,
            width,
            frames: frames_of_messages,
            ..Recorded::default()
        };
        simulation.run(seed, &mut recorder)?;
        let start = recorder.start.context("the robot did not start")?;
        let mut message = PoseWithCovarianceStamped {
            header: header(0, &frames.map),
            ..PoseWithCovarianceStamped::default()
        };
        let state = start.state;
        message.pose.pose = geometry::pose([state.x.0, state.y.0, state.heading.0].map(f64::from));
        let [x, y, turn] = [start.deviation.x.0, start.deviation.y.0, start.deviation.heading.0]
            .map(|deviation| f64::from(deviation).powi(2));
        message.pose.covariance =
            geometry::covariance([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, turn]]);
        Ok(Self {
            messages: recorder.messages,
            telemetry: recorder.telemetry,
            truth: recorder.truth,
            scenario: simulation.scenario.clone(),
            start: message,
        })
    }

    /// The room of the repository's example: a cheap robot, ten minutes.
    ///
    /// # Errors
    /// If the scenario cannot be parsed, or the run fails.
    pub fn classroom(seconds: f64, begin: Nanoseconds, frames: &Frames) -> anyhow::Result<Self> {
        Self::simulate(&Simulation::new(classroom()?).shortened(seconds), 0, begin, frames)
    }

    /// As [`Self::classroom`], without the furniture that is not in the map.
    ///
    /// # Errors
    /// As [`Self::classroom`].
    pub fn empty_classroom(
        seconds: f64,
        begin: Nanoseconds,
        frames: &Frames,
    ) -> anyhow::Result<Self> {
        let mut scenario = classroom()?;
        scenario.surroundings.obstacles.clear();
        Self::simulate(&Simulation::new(scenario).shortened(seconds), 0, begin, frames)
    }
}

fn classroom() -> anyhow::Result<Scenario> {
    const TEXT: &str = include_str!("../../crates/sonarfix-map/scenarios/classroom.toml");
    Ok(Scenario::parse(TEXT, "classroom.toml", std::path::Path::new("."))?)
}

/// Records the messages of a run.
#[derive(Default)]
struct Recorded {
    begin: Nanoseconds,
    width: f64,
    frames: Frames,
    reporter: Option<Reporter>,
    start: Option<Estimate>,
    wheels: [f64; 2],
    pose: Planar,
    messages: Vec<(Nanoseconds, Input)>,
    telemetry: Vec<(Nanoseconds, Telemetry)>,
    truth: Vec<Truth>,
    last: Nanoseconds,
}

impl Recorded {
    fn time(&self, at: sonarfix::geometry::units::Instant) -> Nanoseconds {
        self.begin + i64::try_from(at.ticks()).unwrap_or(i64::MAX / 2000) * 1000
    }

    fn take(&mut self, telemetry: Telemetry) {
        match &telemetry {
            Telemetry::Initialized(estimate) => self.start = Some(*estimate),
            Telemetry::Odometry(step) => {
                let at = self.time(step.at);
                self.step(at, [step.right_metres, step.left_metres]);
            }
            Telemetry::Ping(ping) => {
                let range = ping.outcome.map_or(f32::INFINITY, |echo| echo.range.0);
                self.ping(self.time(ping.at), f64::from(ping.aim.bearing.0), range);
            }
            Telemetry::Sweep(sweep) => {
                let range = sweep.outcome.map_or(f32::INFINITY, |echo| echo.range.0);
                self.ping(self.time(sweep.at), f64::from(sweep.bearing.0), range);
            }
            _ => {}
        }
        self.telemetry.push((self.last, telemetry));
    }

    fn step(&mut self, at: Nanoseconds, wheels: [f64; 2]) {
        let [right, left] = wheels;
        let [old_right, old_left] = std::mem::replace(&mut self.wheels, wheels);
        let (right, left) = (right - old_right, left - old_left);
        let (turn, ahead) = ((right - left) / self.width, 0.5 * (right + left));
        self.pose =
            moved(self.pose, [ahead * (0.5 * turn).cos(), ahead * (0.5 * turn).sin(), turn]);
        let mut message = messages::Odometry {
            header: header(at, &self.frames.odom),
            child_frame_id: self.frames.base.clone(),
            ..messages::Odometry::default()
        };
        message.pose.pose = geometry::pose(self.pose);
        self.last = at;
        self.messages.push((at, Input::Odometry(Box::new(message))));
    }

    fn ping(&mut self, at: Nanoseconds, bearing: f64, range: f32) {
        let mut transform = TransformStamped {
            header: header(at, &self.frames.base),
            child_frame_id: SONAR.to_owned(),
            ..TransformStamped::default()
        };
        transform.transform.rotation = geometry::quaternion(bearing);
        let [min_range, max_range] = LIMITS;
        let heard = RangeHeard {
            header: header(at, SONAR),
            field_of_view: 0.4,
            min_range,
            max_range,
            range,
            ..RangeHeard::default()
        };
        let arrival = at.max(self.last);
        self.messages.push((arrival, Input::Transforms(TFMessage { transforms: vec![transform] })));
        self.messages.push((arrival, Input::Range(0, heard)));
    }
}

impl Recorder for Recorded {
    #[expect(clippy::cast_possible_truncation, reason = "seconds of a run")]
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let Tick { time, truth, estimate, .. } = make();
        let planar = |pose: sonarfix_sim::trace::Pose| [pose.x, pose.y, pose.heading];
        if let Some(truth) = truth {
            let at = self.begin + (time * 1e6).round() as Nanoseconds * 1000;
            self.truth.push(Truth {
                at,
                pose: planar(truth.pose),
                estimate: planar(estimate.pose),
            });
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn began(&mut self, localizer: &Localizer) {
        let (reporter, began) = Reporter::begin(localizer);
        self.reporter = Some(reporter);
        self.take(began);
    }

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        let Some(mut reporter) = self.reporter.take() else { return };
        reporter.report(report, localizer, &mut |telemetry: &Telemetry| self.take(*telemetry));
        self.reporter = Some(reporter);
    }
}

/// The errors of poses: root mean square of x, y (metres) and the heading (radians), and the number of poses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    sums: [f64; 3],
    count: u32,
}

impl Errors {
    /// Adds the error of a pose.
    pub fn add(&mut self, estimate: Planar, truth: Planar) {
        let [x, y, heading] = estimate;
        let [true_x, true_y, true_heading] = truth;
        let errors = [x - true_x, y - true_y, crate::motion::wrapped(heading - true_heading)];
        for (sum, error) in self.sums.iter_mut().zip(errors) {
            *sum += error * error;
        }
        self.count += 1;
    }

    /// The root mean squares.
    #[must_use]
    pub fn rms(&self) -> [f64; 3] {
        self.sums.map(|sum| (sum / f64::from(self.count.max(1))).sqrt())
    }

    /// The number of poses.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }
}
