//! A step of the wheels.

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::OdometryError;
use sonarfix::sensor::gyro::TurnReading;

/// Travel of both wheels, passed to the localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// The end of the travel.
    pub at: Instant,
    /// The travel since the last step that was not [`StepResult::Deferred`].
    pub travel: WheelTravel,
    /// The gyro at the end of the travel, if the robot has one.
    pub turn: Option<TurnReading>,
    /// The localizer's response.
    pub result: StepResult,
}

/// The localizer's response to a step. No encoder edge is lost without a report: the travel of a step is
/// accepted, part of the next step, or discarded here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StepResult {
    /// Accepted.
    Accepted,
    /// Refused for a reason in the loop and not in the wheels: a whole edge in so short a time appears too
    /// fast. The travel is part of the next step. A range that ended the step was fused with the pose
    /// before it.
    Deferred(OdometryError),
    /// Refused, and no wheel can have rolled so: the travel is discarded.
    Discarded(OdometryError),
}
