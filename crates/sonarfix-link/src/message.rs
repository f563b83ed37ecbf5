//! The messages: telemetry from the robot, commands from the PC.
//!
//! They consist of the types of the localizer and of the robot's loop, so that no second definition can diverge from
//! them. A change of such a type may change the bytes of a message; a test over the bytes of every message
//! detects it, and [`VERSION`](crate::VERSION) is raised.
//!
//! # Non-finite policy
//! A NaN is transmitted unchanged. The localizer refuses values that are not finite when a command is executed.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{
    Duration, Instant, Metres, MetresPerSecond, Radians, RadiansPerSecond,
};
use sonarfix::health::Health;
use sonarfix::localizer::{Fix, GyroStatus, Mode, Start};
use sonarfix::map::WallId;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::TurnReading;
use sonarfix_hal::config::{NotLinked, RobotConfig, Unsupported};
use sonarfix_hal::ranger;
use sonarfix_hal::robot::{AbsoluteResult, Faults};

use crate::baked;
use crate::counters::ReceiverCounters;

/// [`Telemetry`] or [`SessionCommand`].
pub trait Message: Serialize + DeserializeOwned + sealed::Sealed {
    /// The kind in the frame, by which a receiver rejects an echo of its own frames.
    const KIND: u8;

    /// What stands for a message that this program cannot decode, if it is known.
    #[must_use]
    fn substitute(_postcard: &[u8]) -> Option<Self> {
        None
    }
}

mod sealed {
    pub trait Sealed {}
}

impl sealed::Sealed for Telemetry {}

impl Message for Telemetry {
    const KIND: u8 = 0;
}

impl sealed::Sealed for SessionCommand {}

impl Message for SessionCommand {
    const KIND: u8 = 1;

    fn substitute(postcard: &[u8]) -> Option<Self> {
        let (session, number, config) = split_command(postcard)?;
        let not_linked = baked::not_linked(config).filter(|_| number == SET_CONFIGURATION)?;
        Some(Self { session, command: Command::SetUnusable(not_linked) })
    }
}

/// The number of [`Command::SetConfiguration`] in postcard.
const SET_CONFIGURATION: u32 = 1;

/// The session of a command in postcard, its number, and its content.
fn split_command(postcard: &[u8]) -> Option<(u32, u32, &[u8])> {
    let (session, rest) = postcard::take_from_bytes(postcard).ok()?;
    let (number, content) = postcard::take_from_bytes(rest).ok()?;
    Some((session, number, content))
}

/// A message from the robot. Times are those of its own clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Telemetry {
    /// Identification, at the start and periodically.
    Hello(Hello),
    /// The localizer was initialized, at the start or by a command. The wheel travel is counted from here.
    Initialized(Estimate),
    /// The localizer has taken wheel travel.
    Odometry(Odometry),
    /// A ping is complete.
    Ping(Ping),
    /// No wall could be measured when a ping was due.
    SkippedPing(SkippedPing),
    /// The estimate, after every encoder sample.
    Estimate(Estimate),
    /// The status of the loop, periodically.
    LoopStatus(LoopStatus),
    /// The acknowledgement of a command.
    Ack(Ack),
    /// The pose of a running localizer was replaced; its calibration and the covariance of that are
    /// what they were, and distances are still counted from [`Self::Initialized`].
    PoseSet(Estimate),
    /// What determines the pose has changed.
    ModeChanged(ModeChanged),
    /// A ping of the search's sweep is complete, or one after [`Command::Point`].
    Sweep(Sweep),
    /// The progress of the search, once a second while it works.
    Search(SearchStatus),
    /// A hypothesis of the search, each once a second.
    Hypothesis(RankedHypothesis),
    /// The readings of the devices of a robot that waits, after [`Command::ShowDevices`].
    Devices(DeviceReadings),
    /// The gyro at the end of the wheel travel of the next [`Self::Odometry`].
    Turn(TurnReading),
    /// The state of the gyro, once a second.
    Gyro(GyroState),
    /// A heading, position or pose from outside was taken ([`Command::Absolute`]).
    Absolute(AbsoluteResult),
}

/// The state of the gyro.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GyroState {
    /// The localizer's time.
    pub at: Instant,
    /// Its bias, and what became of its turns.
    pub status: GyroStatus,
}

/// The identification of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// Version of the firmware: major, minor, patch.
    pub firmware: [u8; 3],
    /// The map in flash.
    pub map: ImageStatus,
    /// The configuration in flash.
    pub configuration: ImageStatus,
    /// The cause of the last reset.
    pub reset: ResetCause,
}

/// The status of a baked image in flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ImageStatus {
    /// Valid, with this checksum.
    Valid(u32),
    /// No image was written.
    Missing,
    /// Damaged.
    Corrupt,
    /// Of this version, which the firmware does not read.
    Version(u16),
}

/// The cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// Power-on.
    PowerOn,
    /// A supply voltage below the threshold.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The watchdog expired: the loop hung, or missed its deadlines.
    Watchdog,
    /// The firmware.
    Software,
    /// Not reported by the chip.
    Unknown,
}

/// The localizer's estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// The localizer's time: that of the last wheel travel it took.
    pub at: Instant,
    /// Pose and calibration.
    pub state: StateEstimate,
    /// Their standard deviations: the square roots of the covariance's diagonal.
    pub deviation: StandardDeviations,
    /// The health verdict, and the quantities that it depends on.
    pub health: Health,
}

/// Wheel travel that the localizer has taken.
///
/// Each value is the total since [`Telemetry::Initialized`], so that a lost frame costs one sample and no
/// distance. The totals are `f64`, because the difference of two totals must be exactly the `f32` that the
/// localizer took (`docs/link.md` derives the bound).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Odometry {
    /// The time of the encoder sample.
    pub at: Instant,
    /// Distance that the right wheel has rolled since [`Telemetry::Initialized`], metres.
    pub right_metres: f64,
    /// Distance that the left wheel has rolled since then, metres.
    pub left_metres: f64,
}

/// A complete ping and the localizer's response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ping {
    /// The localizer's time at the update: the instant of the echo's reflection, or without an echo that of the last
    /// wheel travel.
    pub at: Instant,
    /// The wall and the bearing that were measured.
    pub aim: Aim,
    /// The echo, or why there is none.
    pub outcome: ranger::Outcome,
    /// The localizer's response.
    pub fix: Fix,
}

/// A ping that was due when no wall could be measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SkippedPing {
    /// The localizer's time.
    pub at: Instant,
    /// Why no wall could be measured.
    pub reason: NoAim,
}

/// A change of what determines the pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModeChanged {
    /// The new mode.
    pub mode: Mode,
    /// The estimate after it. While searching its pose has no meaning.
    pub estimate: Estimate,
}

/// A ping at a bearing, without a wall that it is to measure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sweep {
    /// The localizer's time: the instant of the echo's reflection, or without an echo that of the last wheel travel. Without
    /// the loop, the time at which the ping ended.
    pub at: Instant,
    /// The bearing of the sonar.
    pub bearing: Radians,
    /// The echo, or why there is none.
    pub outcome: ranger::Outcome,
}

/// The progress of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SearchStatus {
    /// The localizer's time.
    pub at: Instant,
    /// What determines the pose.
    pub mode: Mode,
    /// What the search has found so far.
    pub answer: SearchAnswer,
    /// Pings in its window.
    pub pings: u16,
    /// Complete cycles.
    pub cycles: u32,
}

/// What the search has found (`Answer` of `sonarfix-search`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SearchAnswer {
    /// Not enough for an answer.
    Searching,
    /// So many hypotheses fit.
    Several(u8),
    /// The position along this wall is undetermined.
    Along(WallId),
    /// No pose fits.
    Nowhere,
    /// One pose fits.
    Unique,
}

/// A hypothesis of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RankedHypothesis {
    /// The localizer's time.
    pub at: Instant,
    /// Its rank, from 0, the best.
    pub rank: u8,
    /// The robot's pose.
    pub pose: Pose,
    /// The larger axis of the position's error ellipse, one deviation.
    pub position_deviation: Metres,
    /// One deviation of the heading.
    pub heading_deviation: Radians,
    /// Mean weighted log-likelihood per ping, relative to a place without walls.
    pub fit: f32,
    /// The share of the echoes that the map explains.
    pub explained: f32,
}

/// What the devices of a robot read, before the loop interprets it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DeviceReadings {
    /// The time of the readings.
    pub at: Instant,
    /// The right encoder.
    pub right: EncoderReading,
    /// The left encoder.
    pub left: EncoderReading,
    /// The servo; `None` if it could not be commanded, or without a configuration.
    pub servo: Option<ServoReading>,
    /// The result of the last ping; `None` before the first one has ended.
    pub ping: Option<ranger::Outcome>,
}

/// The reading of an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EncoderReading {
    /// The count of the hardware, which wraps around; `None` if it cannot be read.
    pub count: Option<u32>,
    /// The width of the counter in bits; higher bits of the count have no meaning.
    pub bits: u8,
    /// Illegal transitions since the start, where the hardware detects them.
    pub illegal: u32,
    /// The travel of the wheel for a count of one more by the configuration, metres: negative for a mirrored wheel, zero
    /// without a configuration.
    pub metres_per_edge: f32,
}

/// The state of the servo.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ServoReading {
    /// The bearing to which it is commanded, or at which the sonar is fixed.
    pub bearing: Radians,
    /// The width of its pulses, µs; zero for a sonar at a fixed bearing.
    pub micros: f32,
}

/// The status of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LoopStatus {
    /// The time of the report.
    pub at: Instant,
    /// Whether the loop runs. Otherwise it waits for [`Command::Start`], a map or a configuration.
    pub running: bool,
    /// Faults since the start, missed deadlines included.
    pub faults: Faults,
    /// The longest duration of a poll.
    pub worst_poll: Duration,
    /// The counters of the robot's receiver of commands.
    pub commands: ReceiverCounters,
    /// The writes to the flash.
    pub flash: FlashStatus,
    /// [`noise_factor`](sonarfix::localizer::Localizer::noise_factor) of the localizer; 1 without one.
    pub noise_factor: f32,
}

/// The writes of a robot to its flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FlashStatus {
    /// All writes, those of earlier runs included.
    pub writes: u32,
    /// Those since the start that have failed: what they contained is lost when the robot is switched off.
    pub failures: u32,
}

/// The acknowledgement of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ack {
    /// The sequence number of the command's frame.
    pub sequence: u16,
    /// The result of the command.
    pub result: CommandResult,
}

/// The result of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum CommandResult {
    /// The command was executed.
    Done,
    /// The result of [`Command::MapChecksum`].
    Map(ImageStatus),
    /// The command was refused and has changed nothing.
    Refused(CommandError),
    /// The result of [`Command::OpenSession`]: the number of the new session.
    Session(u32),
}

/// Why a command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CommandError {
    /// The configuration violates a rule; [`RobotConfig::check`] names it.
    Configuration,
    /// The pose or a deviation is not finite, or a deviation is negative.
    Pose,
    /// There is no valid map in flash ([`Hello::map`]).
    NoMap,
    /// There is no valid configuration in flash ([`Hello::configuration`]).
    NoConfiguration,
    /// The pose is unknown; set it first ([`Command::SetPose`]).
    NoPose,
    /// The board cannot be the robot that the configuration describes.
    Unsupported(Unsupported),
    /// The frame is of another session, or earlier than the last one of this session.
    Session,
    /// The configuration does not let the robot search for its pose ([`RobotConfig::start`]).
    NoSearch,
    /// The loop runs; stop it first ([`Command::Stop`]).
    Running,
    /// The loop does not run; start it first ([`Command::Start`]).
    Waiting,
    /// An earlier measurement of this kind waits for its encoder sample.
    Occupied,
    /// The bearing is not within the limits of the servo.
    OutOfReach,
    /// The motion is not finite, or a wheel would be faster than
    /// [`max_wheel_speed`](sonarfix::config::Config::max_wheel_speed).
    Motion,
}

impl core::fmt::Display for CommandError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Configuration => "the configuration violates a rule",
            Self::Pose => "the pose or a deviation is not finite, or a deviation is negative",
            Self::NoMap => "the robot has no valid map in its flash",
            Self::NoConfiguration => "the robot has no valid configuration in its flash",
            Self::NoPose => "the robot's pose is unknown: set it first",
            Self::Session => "the command's session has ended: send it again in a new one",
            Self::NoSearch => "the robot does not search: its robot file needs start = \"unknown\"",
            Self::Running => "the loop runs: stop it first",
            Self::Waiting => "the loop does not run: start it first",
            Self::Occupied => "an earlier measurement of this kind waits for its encoder sample",
            Self::OutOfReach => "the servo does not reach this bearing",
            Self::Motion => {
                "the motion is not finite, or a wheel would be faster than max_wheel_speed"
            }
            Self::Unsupported(reason) => return write!(f, "{reason}"),
        })
    }
}

/// A message to the robot: a command in a session. Each is answered with an [`Ack`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SessionCommand {
    /// The number of the session, from the answer to [`Command::OpenSession`]; any number for that command itself.
    pub session: u32,
    /// The command.
    pub command: Command,
}

/// A command to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(clippy::large_enum_variant, reason = "there is one of it at a time, and no heap")]
pub enum Command {
    /// Initializes the localizer at this pose.
    SetPose(Start),
    /// Initializes the localizer with this configuration, and stores it for the next start.
    SetConfiguration(RobotConfig),
    /// Starts the loop.
    Start,
    /// Stops the loop: no encoder sample and no ping until [`Self::Start`].
    Stop,
    /// Discards the learned calibration, and initializes the localizer at the estimated pose.
    ResetCalibration,
    /// Requests the checksum of the map in flash.
    MapChecksum,
    /// Opens a session and ends the one before: its commands are refused from now on.
    OpenSession,
    /// Declares the pose unknown: a running robot searches for it, one that waits does so when it is started.
    Search,
    /// For a minute, while the loop does not run: turns the servo in turn ahead and to both of its limits, pings, and sends
    /// [`Telemetry::Devices`] ten times a second. Refused while the loop runs.
    ShowDevices,
    /// Passes a heading, position or pose to the localizer of a running loop, at the next encoder sample; the outcome is a
    /// [`Telemetry::Absolute`].
    Absolute {
        /// How long ago it was measured when this frame was sent first. It is not repeated later with the same age.
        age: Duration,
        /// The measurement.
        measurement: AbsoluteMeasurement,
    },
    /// As [`Self::ShowDevices`], with the servo at this bearing: once it has settled, the ranger pings, and each ping is a
    /// [`Telemetry::Sweep`].
    Point(Radians),
    /// Drives with this motion, for [`Motion::LASTS`] after the robot has read the frame. A program that drives on sends
    /// the command again before that, as a new frame: a repeated frame is executed once. Refused while the loop does
    /// not run.
    Drive(Motion),
    /// Stands for a [`Self::SetConfiguration`] that a program received and cannot decode, because it was built without a part
    /// of it. It is refused, and never sent.
    #[serde(skip)]
    SetUnusable(NotLinked),
}

/// A motion over the floor, with the nominal track width.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// Forward speed; negative: backwards.
    pub speed: MetresPerSecond,
    /// Turn rate, counter-clockwise.
    pub turn: RadiansPerSecond,
}

impl Motion {
    /// The time after which a robot stops if its [`Command::Drive`] is not renewed.
    pub const LASTS: Duration = Duration::from_ticks(300_000);

    /// The speeds of the right and the left wheel of a robot with this track width.
    #[must_use]
    pub fn wheels(&self, track_width: Metres) -> [MetresPerSecond; 2] {
        let half_turn = 0.5 * track_width.0 * self.turn.0;
        [MetresPerSecond(self.speed.0 + half_turn), MetresPerSecond(self.speed.0 - half_turn)]
    }
}
