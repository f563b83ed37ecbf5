//! The motion for the motor code: that which the PC commands, with its dead-man, else that of a robot that searches for its pose.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Mode;
use sonarfix_drive::search_motion::{SearchMover, Speeds};
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::NoEcho;
use sonarfix_hal::robot::{Report, Step, StepResult, SweepResult};
use sonarfix_link::Motion;
use sonarfix_link::message::CommandError;

use crate::time::{NEVER, after};

/// The motion. Without the feature `drive` the same name stands for nothing.
#[derive(Default)]
pub(super) struct Drive {
    commanded: Option<Commanded>,
    search: Option<SearchMover>,
}

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
        self.commanded = Some(Commanded { motion, until: after(now, Motion::LASTS) });
        Ok(())
    }

    /// Takes what a poll of the loop has measured, for the motion of a robot that searches.
    pub fn observe(&mut self, report: &Report, mode: Mode, config: &RobotConfig) {
        let Some(motion) = config.start.motion().filter(|_| mode == Mode::Searching) else {
            self.search = None;
            return;
        };
        let track_width = config.localizer.drive.track_width;
        let mover = self.search.get_or_insert_with(|| {
            let speeds = Speeds::within(config.localizer.max_wheel_speed, track_width);
            SearchMover::new(motion, speeds)
        });
        let mut roll = |step: Option<&Step>| {
            // The next step contains the travel of one that was deferred.
            let step = step.filter(|step| !matches!(step.result, StepResult::Deferred(_)));
            if let Some(step) = step {
                mover.odometry(step.travel, track_width);
            }
        };
        let swept = report.swept.as_ref();
        roll(report.reached.as_ref());
        roll(swept.and_then(SweepResult::step));
        roll(report.tick.as_ref().and_then(|tick| tick.step.as_ref()));
        if let Some((bearing, outcome)) = swept.map(SweepResult::ping)
            && !outcome.is_err_and(NoEcho::is_fault)
        {
            mover.ping(bearing, outcome.ok().map(|echo| echo.range));
        }
    }

    /// Ends the motion.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// The motion at `now`.
    pub fn motion(&self, now: Instant) -> Option<Motion> {
        let commanded = self.commanded.as_ref().filter(|commanded| now < commanded.until);
        let searching = || self.search.as_ref().map(SearchMover::motion);
        commanded.map(|commanded| commanded.motion).or_else(searching)
    }

    /// When the commanded motion ends if it is not renewed.
    pub fn deadline(&self) -> Instant {
        self.commanded.as_ref().map_or(NEVER, |commanded| commanded.until)
    }
}
