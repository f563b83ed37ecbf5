//! What is said: telemetry by the robot, commands by the PC.
//!
//! The parts are the core's and the loop's own types: there is no second definition that could
//! drift from them. The price is that a change of theirs may change bytes here; a test over the
//! bytes of every message notices, and then [`VERSION`](crate::VERSION) goes up.
//!
//! # Non-finite policy
//! Nothing here computes. A NaN is carried as it is; whoever acts on a command gives it to the
//! localizer, which refuses what is not finite.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::config::Config;
use sonarfix::health::Health;
use sonarfix::localizer::{Fix, Start};
use sonarfix::units::{Duration, Instant};
use sonarfix_hal::ranger;
use sonarfix_hal::robot::Faults;

use sonarfix::ekf::State;

use crate::receiver::Counters;

/// Either of [`Telemetry`] and [`Command`].
pub trait Message: Serialize + DeserializeOwned + sealed::Sealed {
    /// What the frame says of itself, so that a receiver knows its own from the other's echo.
    const KIND: u8;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Telemetry {}
    impl Sealed for super::Command {}
}

impl Message for Telemetry {
    const KIND: u8 = 0;
}

impl Message for Command {
    const KIND: u8 = 1;
}

/// What a robot says. Times are its own clock's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Telemetry {
    /// Who it is: at its start, and now and then for whoever listens since.
    Hello(Hello),
    /// The localizer begins, at its start and after every command that begins it anew. What was
    /// rolled is counted from here.
    Began(Estimate),
    /// The localizer has taken a step of the wheels.
    Step(Step),
    /// The sonar has had its turn.
    Look(Look),
    /// The sonar's turn came and there was nothing to look at.
    Skip(Skip),
    /// The estimate, after every encoder tick.
    Estimate(Estimate),
    /// How the loop fares, now and then.
    Loop(Loop),
    /// The answer to a command.
    Ack(Ack),
}

/// Who the robot is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// Version of the firmware: major, minor, patch.
    pub firmware: [u8; 3],
    /// The map in its flash.
    pub map: Flashed,
    /// The configuration in its flash.
    pub configuration: Flashed,
    /// Why it started.
    pub reset: Reset,
}

/// What a robot found where something should be baked into its flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flashed {
    /// It is there and whole; its checksum.
    Valid(u32),
    /// Nothing was ever baked there.
    Missing,
    /// What is there is damaged, or of a version that this firmware does not read.
    Corrupt,
}

/// Why a robot started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reset {
    /// The power came.
    PowerOn,
    /// The power was too low for a while.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The watchdog was not fed: the loop hung, or missed its deadlines.
    Watchdog,
    /// The firmware itself.
    Software,
    /// The chip does not say.
    Unknown,
}

/// The localizer's estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// The localizer's time: that of the last step it took.
    pub at: Instant,
    /// Pose and calibration.
    pub state: State,
    /// Their standard deviations: the square roots of the covariance's diagonal.
    pub deviation: State,
    /// The verdict on it, and the numbers behind the verdict.
    pub health: Health,
}

/// A step of the wheels that the localizer has taken.
///
/// It says how far the wheels have rolled in all and not since the step before, so that a frame
/// that is lost costs its instant and no way. In `f64`, because the difference of two totals
/// must be the very `f32` that the localizer was told (`docs/link.md` says why it is).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// The time up to which the wheels rolled.
    pub at: Instant,
    /// How far the right wheel has rolled since [`Telemetry::Began`], metres.
    pub right_metres: f64,
    /// How far the left wheel has, metres.
    pub left_metres: f64,
}

/// The end of a ping, and what the localizer made of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Look {
    /// The localizer's time when it was told: an echo's reflection, or of one that did not come
    /// the step before.
    pub at: Instant,
    /// What was looked at.
    pub aim: Aim,
    /// The echo, or why there is none.
    pub outcome: ranger::Outcome,
    /// What the localizer made of it.
    pub fix: Fix,
}

/// A turn of the sonar without anything to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Skip {
    /// The localizer's time.
    pub at: Instant,
    /// Why.
    pub reason: NoAim,
}

/// How the loop fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loop {
    /// When.
    pub at: Instant,
    /// Whether the loop runs, or waits: for a start, a map, a configuration.
    pub running: bool,
    /// What went wrong since the start, missed deadlines included.
    pub faults: Faults,
    /// The longest that a poll has taken.
    pub worst_poll: Duration,
    /// What the robot's receiver made of the commands.
    pub commands: Counters,
}

/// The answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ack {
    /// The sequence number of the command's frame.
    pub sequence: u16,
    /// What became of it.
    pub outcome: Outcome,
}

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Outcome {
    /// It was done.
    Done,
    /// The answer to [`Command::MapChecksum`].
    Map(Flashed),
    /// It was not done, and nothing has changed.
    Refused(Refused),
}

/// Why a command was not done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refused {
    /// The configuration breaks a rule; [`Config::check`] says which.
    Configuration,
    /// The pose or its deviations are not finite, or a deviation is negative.
    Pose,
    /// The robot has no map to do it with ([`Hello::map`]).
    NoMap,
    /// The robot has no configuration to do it with ([`Hello::configuration`]).
    NoConfiguration,
    /// It could not be written to flash.
    Storage,
    /// The robot does not know where it stands, and must be told first ([`Command::SetPose`]).
    NoPose,
}

impl core::fmt::Display for Refused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Configuration => "the configuration breaks a rule",
            Self::Pose => "the pose or its deviations are not finite, or one is negative",
            Self::NoMap => "the robot has no valid map in its flash",
            Self::NoConfiguration => "the robot has no valid configuration in its flash",
            Self::Storage => "the robot could not write to its flash",
            Self::NoPose => "the robot does not know where it stands: set its pose first",
        })
    }
}

/// What a robot is told to do. Each is answered with an [`Ack`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Begin anew from this pose.
    SetPose(Start),
    /// Begin anew with this configuration, and keep it over the next start.
    SetConfiguration(Config),
    /// Run the loop.
    Start,
    /// Stop the loop: no tick, no look, until [`Self::Start`].
    Stop,
    /// Forget what was learned of wheels and ranger, and begin anew from the estimated pose.
    ResetCalibration,
    /// Say the checksum of the map in flash.
    MapChecksum,
}
