//! What a PC asks and a microcontroller answers: postcard, one answer to each request.

use serde::{Deserialize, Serialize};
use sonarfix::aim::{Aim, NoAim};
use sonarfix::config::Config;
use sonarfix::ekf::{STATES, State};
use sonarfix::health::Health;
use sonarfix::localizer::{Fix, Localizer, OdometryError, Start};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Instant, Metres};

use crate::board::Board;
use crate::device::Refusal;
use crate::wires::{Actuators, Sensors};

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "there is one of it at a time, and no heap")]
pub enum Request<'a> {
    /// Begin a session, with a baked map.
    Begin(Begin, &'a [u8]),
    /// Of a localizer: the wheels rolled.
    Odometry(Instant, WheelTravel),
    /// Of a localizer: where should the sonar look?
    Aim,
    /// Of a localizer: what came back from where it looked last.
    Fix(Option<Metres>),
    /// Of a localizer: the sonar had its turn and nothing to look at.
    Skip,
    /// Of a loop: poll it.
    Poll(Sensors),
    /// End the session.
    End,
}

/// How a session begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Begin {
    /// When.
    pub at: Instant,
    /// Where the robot stands.
    pub start: Start,
    /// Its configuration.
    pub config: Config,
    /// What its loop drives; without it there is a localizer alone.
    pub board: Option<Board>,
}

/// What is answered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// The session has begun; what the loop did to its devices in that.
    Began(Actuators),
    /// It has not, or what was asked does not belong to it.
    Refused(Refusal),
    /// What became of the wheels' travel.
    Rolled(Result<(), OdometryError>, Belief),
    /// Where to look.
    Aimed(Result<Aim, NoAim>),
    /// What became of the range.
    Fixed(Fix, Belief),
    /// The verdict after a turn for nothing.
    Skipped(Health),
    /// What a poll did.
    Polled {
        /// To the devices.
        actuators: Actuators,
        /// What the robot believes; told whenever the loop did anything.
        belief: Option<Belief>,
        /// CRC-32 of the telemetry that was sent.
        telemetry: u32,
    },
    /// The session is over; bytes of stack that the deepest of its answers took, as far as that
    /// can be measured.
    Ended(u32),
}

/// Entries of the covariance's upper triangle.
pub const TRIANGLE: usize = STATES * (STATES + 1) / 2;

/// What a robot believes, to the last bit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// Pose and calibration.
    pub state: State,
    /// The covariance's upper triangle, row by row.
    pub covariance: [f32; TRIANGLE],
    /// The verdict on it.
    pub health: Health,
}

impl Belief {
    /// What a localizer believes.
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

    /// All its numbers but the health's: the states, then the covariance.
    pub fn numbers(&self) -> impl Iterator<Item = f32> {
        let State { x, y, heading, scale_right, scale_left, track_width_error, range_scale } =
            self.state;
        let states = [x, y, heading, scale_right, scale_left, track_width_error, range_scale];
        states.into_iter().chain(self.covariance)
    }
}
