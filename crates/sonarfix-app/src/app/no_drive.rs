//! The commanded motion in a program without the feature `drive`: it is refused.

use sonarfix::geometry::units::Instant;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig};
use sonarfix_link::Motion;
use sonarfix_link::message::CommandError;

use super::command::refused;
use crate::time::NEVER;

#[derive(Default)]
pub(super) struct Drive {}

#[expect(clippy::unused_self, reason = "those of a commanded motion depend on it")]
impl Drive {
    pub fn command(&mut self, _: Instant, _: Motion, _: &RobotConfig) -> Result<(), CommandError> {
        Err(refused(NotLinked(Feature::Drive)))
    }

    pub fn stop(&mut self) {}

    pub fn deadline(&self) -> Instant {
        NEVER
    }
}
