//! The motion in a program without the feature `drive`: a command is refused, and a robot that searches does not move by itself.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Mode;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig};
use sonarfix_hal::robot::Report;
use sonarfix_link::Motion;
use sonarfix_link::message::CommandError;

use super::command::refused;
use crate::time::NEVER;

#[derive(Default)]
pub(super) struct Drive {}

#[expect(clippy::unused_self, reason = "those of the feature depend on it")]
impl Drive {
    pub fn command(&mut self, _: Instant, _: Motion, _: &RobotConfig) -> Result<(), CommandError> {
        Err(refused(NotLinked(Feature::Drive)))
    }

    pub fn observe(&mut self, _: &Report, _: Mode, _: &RobotConfig) {}

    pub fn stop(&mut self) {}

    pub fn deadline(&self) -> Instant {
        NEVER
    }
}
