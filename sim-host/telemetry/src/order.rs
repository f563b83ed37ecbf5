//! What a page may ask for.

use std::sync::mpsc::{Receiver, SyncSender};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};
use sonarfix_link::Command;

/// An order of a page, as JSON like `{"order": "set_pose", "x": 1, "y": 2, "heading": 0.5}`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "order", rename_all = "snake_case", deny_unknown_fields)]
pub enum Order {
    /// Start the robot's loop.
    Start,
    /// Stop it.
    Stop,
    /// Search for the pose.
    Search,
    /// Discard the learned calibration.
    ResetCalibration,
    /// Show for a minute what the devices of a robot that waits read.
    ShowDevices,
    /// Initialize the localizer at a pose.
    SetPose {
        /// Metres along the map's x axis.
        x: f32,
        /// Metres along the map's y axis.
        y: f32,
        /// Radians counter-clockwise from the map's x axis.
        heading: f32,
        /// Standard deviation of x and y, metres.
        position_deviation: f32,
        /// Standard deviation of the heading, radians.
        heading_deviation: f32,
    },
    /// Pass a position that was measured now to the localizer.
    Position {
        /// Metres along the map's x axis.
        x: f32,
        /// Metres along the map's y axis.
        y: f32,
        /// Standard deviation of x and of y, metres.
        deviation: f32,
    },
    /// Drive with this motion. A page repeats the order as long as it holds the motion; without it the robot stands soon.
    Drive {
        /// Forward speed, m/s; negative: backwards.
        speed: f32,
        /// Turn rate, rad/s, counter-clockwise.
        turn: f32,
    },
    /// Command no motion any more: the robot is left to its motor code.
    Leave,
    /// Begin or end a recording.
    Record {
        /// Whether it is to begin.
        on: bool,
    },
    /// Halt or continue a simulation or a replay.
    Pause {
        /// Whether it is to halt.
        on: bool,
    },
    /// The speed of a simulation or a replay.
    Speed {
        /// Its time over real time.
        factor: f64,
    },
}

impl Order {
    /// Its name in words.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Search => "search",
            Self::ResetCalibration => "reset of the calibration",
            Self::ShowDevices => "show devices",
            Self::SetPose { .. } => "set pose",
            Self::Position { .. } => "position",
            Self::Drive { .. } => "drive",
            Self::Leave => "leave",
            Self::Record { .. } => "recording",
            Self::Pause { .. } => "pause",
            Self::Speed { .. } => "speed",
        }
    }

    /// The robot's command; `None` for an order to this program, and for a motion, which is renewed.
    #[must_use]
    pub fn command(&self) -> Option<Command> {
        Some(match *self {
            Self::Start => Command::Start,
            Self::Stop => Command::Stop,
            Self::Search => Command::Search,
            Self::ResetCalibration => Command::ResetCalibration,
            Self::ShowDevices => Command::ShowDevices,
            Self::SetPose { x, y, heading, position_deviation, heading_deviation } => {
                Command::SetPose(Start {
                    pose: Pose::new(x, y, Radians(heading)),
                    position_deviation: Metres(position_deviation),
                    heading_deviation: Radians(heading_deviation),
                })
            }
            Self::Position { x, y, deviation } => Command::Absolute {
                age: sonarfix::geometry::units::Duration::from_ticks(0),
                measurement: AbsoluteMeasurement::Position {
                    point: Point::new(x, y),
                    noise: PositionNoise::circular(Metres(deviation)),
                },
            },
            Self::Drive { .. }
            | Self::Leave
            | Self::Record { .. }
            | Self::Pause { .. }
            | Self::Speed { .. } => return None,
        })
    }
}

/// The answer to an order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Reply {
    /// Whether it was executed.
    pub done: bool,
    /// In words.
    pub text: String,
}

impl Reply {
    /// It was executed.
    #[must_use]
    pub fn done(text: &str) -> Self {
        Self { done: true, text: text.to_owned() }
    }

    /// It was not, for this reason.
    #[must_use]
    pub fn refused(text: &str) -> Self {
        Self { done: false, text: text.to_owned() }
    }
}

/// An order, and where its answer goes.
#[derive(Debug)]
pub struct Ordered {
    /// The order.
    pub order: Order,
    reply: SyncSender<Reply>,
}

impl Ordered {
    /// An order with the other end of its answer.
    #[must_use]
    pub fn new(order: Order, reply: SyncSender<Reply>) -> Self {
        Self { order, reply }
    }

    /// Answers it. The page may have gone.
    pub fn answer(self, reply: Reply) {
        let _ = self.reply.try_send(reply);
    }
}

/// The orders of all pages.
#[derive(Debug)]
pub struct Orders(Receiver<Ordered>);

impl Orders {
    /// Those that this end of a channel receives.
    #[must_use]
    pub fn new(received: Receiver<Ordered>) -> Self {
        Self(received)
    }

    /// The next order, if there is one.
    #[must_use]
    pub fn next(&self) -> Option<Ordered> {
        self.0.try_recv().ok()
    }

    /// Waits for an order.
    #[must_use]
    pub fn wait(&self, patience: Duration) -> Option<Ordered> {
        self.0.recv_timeout(patience).ok()
    }
}
