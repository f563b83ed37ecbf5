//! The messages: requests of the PC and answers of the microcontroller, one to each request, in postcard.

use serde::{Deserialize, Serialize};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::filter::ekf::{STATES, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Instant, Metres};
use sonarfix::health::Health;
use sonarfix::localizer::{AbsoluteFix, Fix, Localizer, OdometryError, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_hal::config::RobotConfig;

use crate::load::Load;
use crate::wires::{Actuators, Sensors};

/// A request.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "there is one of it at a time, and no heap")]
pub enum Request<'a> {
    /// Begins a session with a baked map.
    Begin(Begin, &'a [u8]),
    /// Localizer session: wheel travel, and the turn by the gyro.
    Odometry(Instant, WheelTravel, Option<MeasuredTurn>),
    /// Localizer session: the bearing of the next ping.
    Aim,
    /// Localizer session: the range at the last aim; none without an echo.
    Fix(Option<Metres>),
    /// Localizer session: the due ping is skipped.
    SkipPing,
    /// Loop session: one poll.
    Poll(Sensors),
    /// Ends the session.
    End,
    /// A heading, position or pose that was measured at this time.
    Absolute(Instant, AbsoluteMeasurement),
}

/// The parameters of a session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Begin {
    /// Time of the start.
    pub at: Instant,
    /// Start pose; none for a loop that searches for it.
    pub start: Option<Start>,
    /// Configuration of the robot.
    pub config: RobotConfig,
    /// What the session runs.
    pub kind: SessionKind,
    /// What arrives over the link of a loop.
    pub load: Load,
}

/// What a session runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SessionKind {
    /// A localizer alone.
    Localizer,
    /// The shipped loop with its drivers.
    Loop,
}

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum RequestError {
    /// The map image is invalid.
    Map,
    /// The localizer refuses its configuration or its start.
    Start,
    /// A device of the board has invalid parameters.
    Board,
    /// The request does not belong to this kind of session, or to its current state.
    OutOfPlace,
    /// The request could not be decoded.
    Unreadable,
}

impl core::fmt::Display for RequestError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Map => "the map image is invalid",
            Self::Start => "the localizer refuses its configuration or its start",
            Self::Board => "a device of the board has invalid parameters",
            Self::OutOfPlace => "the request does not belong to this session",
            Self::Unreadable => "the request cannot be decoded",
        })
    }
}

impl core::error::Error for RequestError {}

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// The session has begun; what the loop did to its devices.
    Started(Actuators),
    /// The request was refused.
    Refused(RequestError),
    /// The result of the wheel travel.
    Odometry(Result<(), OdometryError>, Snapshot),
    /// The aim.
    Aim(Result<Aim, NoAim>),
    /// The result of the range.
    Fix(Fix, Snapshot),
    /// The health after a skipped ping.
    Skipped(Health),
    /// The result of a poll.
    Polled {
        /// What it did to the devices.
        actuators: Actuators,
        /// The localizer, if the loop did anything.
        snapshot: Option<Snapshot>,
        /// CRC-32 of the telemetry that was sent.
        telemetry: u32,
    },
    /// The session has ended; bytes of stack of its deepest call, zero if they are not measured.
    Ended(u32),
    /// Localizer session: the result of a heading, position or pose.
    Absolute(AbsoluteFix, Snapshot),
    /// Loop session: whether it waits for its encoder sample.
    Waits(bool),
}

/// Entries of the covariance's upper triangle.
pub const TRIANGLE: usize = STATES * (STATES + 1) / 2;

/// All bits of a localizer's estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Pose and calibration.
    pub state: StateEstimate,
    /// The covariance's upper triangle, row by row.
    pub covariance: [f32; TRIANGLE],
    /// The health verdict.
    pub health: Health,
}

impl Snapshot {
    /// The estimate of a localizer.
    #[must_use]
    pub fn of(localizer: &Localizer) -> Self {
        let filter = localizer.filter();
        let p = filter.covariance();
        let upper = (0..STATES).flat_map(|row| (row..STATES).map(move |column| (row, column)));
        let mut covariance = [0.0; TRIANGLE];
        for (entry, at) in covariance.iter_mut().zip(upper) {
            *entry = p.get(at).copied().unwrap_or(f32::NAN);
        }
        Self { state: filter.state(), covariance, health: localizer.health() }
    }

    /// The states, then the covariance.
    pub fn numbers(&self) -> impl Iterator<Item = f32> {
        self.state.to_array().into_iter().chain(self.covariance)
    }
}
