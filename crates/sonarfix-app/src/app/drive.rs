//! The motion that the PC commands, with its dead-man.

use sonarfix::geometry::units::Instant;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::Motion;
use sonarfix_link::message::CommandError;

use crate::time::{NEVER, after};

/// The commanded motion. Without the feature `drive` the same name stands for nothing.
#[derive(Default)]
pub(super) struct Drive(Option<Commanded>);

#[derive(Clone, Copy)]
struct Commanded {
    motion: Motion,
    /// From when on it is no longer valid.
    until: Instant,
}

impl Drive {
    /// Takes a motion that was commanded at `now`.
    ///
    /// # Errors
    /// [`CommandError::Motion`]: the motion before stays.
    pub fn command(
        &mut self,
        now: Instant,
        motion: Motion,
        config: &RobotConfig,
    ) -> Result<(), CommandError> {
        let most = config.localizer.max_wheel_speed;
        let wheels = motion.wheels(config.localizer.drive.track_width);
        // The comparison does not hold for NaN. Speeds of both wheels in the range imply a finite motion.
        if !wheels.iter().all(|wheel| wheel.0.abs() <= most.0) {
            return Err(CommandError::Motion);
        }
        self.0 = Some(Commanded { motion, until: after(now, Motion::LASTS) });
        Ok(())
    }

    /// Ends the motion.
    pub fn stop(&mut self) {
        self.0 = None;
    }

    /// The motion at `now`.
    pub fn motion(&self, now: Instant) -> Option<Motion> {
        let Commanded { motion, until } = self.0?;
        (now < until).then_some(motion)
    }

    /// When the motion ends if it is not renewed.
    pub fn deadline(&self) -> Instant {
        self.0.map_or(NEVER, |Commanded { until, .. }| until)
    }
}
