//! Turns the polls of the robot's loop into telemetry, for firmware, simulator and emulator.

#[cfg(feature = "search")]
mod search;

use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::health::Health;
use sonarfix::localizer::{Localizer, Mode};
use sonarfix_hal::robot::{self, PingResult, Report, StepResult};

use crate::message::{
    Estimate, GyroState, ModeChanged, Odometry, Ping, SkippedPing, Sweep, Telemetry,
};

/// Turns what the loop did into telemetry, in the order of the localizer's inputs. The telemetry contains all of
/// its inputs: replayed from [`Telemetry::Initialized`] on, they reproduce the estimates bit for bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reporter {
    /// The last wheel travel taken, with the total distances.
    last: Odometry,
    /// The next message on the search: its status, then one hypothesis after the other.
    next: u8,
    /// When the state of the gyro is sent next.
    gyro_due: Instant,
}

/// Where the messages of a [`Reporter`] go: a function that takes them, or a line that may have no room.
pub trait Outlet {
    /// Sends the message, or drops it without building it.
    fn send_built(&mut self, build: impl FnOnce() -> Telemetry);
}

impl<F: FnMut(&Telemetry)> Outlet for F {
    fn send_built(&mut self, build: impl FnOnce() -> Telemetry) {
        self(&build());
    }
}

/// Time between two messages on the gyro.
const GYRO_PERIOD: Duration = Duration::from_ticks(1_000_000);

impl Reporter {
    /// A reporter for a localizer that was just initialized, and the first message.
    ///
    /// The initial state is read from the localizer, which returns it bit for bit if the calibration starts at zero and both
    /// wheels have the same scale-error deviation (it stores their mean and difference). Otherwise use [`Self::resume`].
    #[must_use]
    pub fn begin(localizer: &Localizer) -> (Self, Telemetry) {
        let Estimate { at, state, deviation, .. } = estimate(localizer);
        Self::resume(at, state, deviation)
    }

    /// A reporter for a localizer that was created by [`Localizer::resume`] with the same arguments, and the first
    /// message.
    #[must_use]
    pub fn resume(
        at: Instant,
        state: StateEstimate,
        deviation: StandardDeviations,
    ) -> (Self, Telemetry) {
        let last = Odometry { at, right_metres: 0.0, left_metres: 0.0 };
        let began = Estimate { at, state, deviation, health: Health::default() };
        (Self { last, next: 0, gyro_due: at }, Telemetry::Initialized(began))
    }

    /// Whether the report of a poll of the loop can have messages.
    #[must_use]
    pub fn has_messages(report: &Report) -> bool {
        report.absolute.is_some()
            || report.reached.is_some()
            || report.ping_result.is_some()
            || report.swept.is_some()
            || report.tick.is_some()
            || matches!(report.aimed, Some(Err(_)))
            || report.mode.is_some()
    }

    /// Passes the messages of one poll of the loop to `outlet`. `localizer` is that of the loop, after the poll.
    pub fn report(&mut self, report: &Report, localizer: &Localizer, outlet: &mut impl Outlet) {
        if let Some(result) = &report.absolute {
            outlet.send_built(|| Telemetry::Absolute(*result));
        }
        self.step(report.reached.as_ref(), outlet);
        if let Some(heard) = &report.ping_result {
            self.ping(heard, outlet);
        }
        if let Some(swept) = &report.swept {
            self.step(swept.step(), outlet);
            let (at, (bearing, outcome)) = (self.last.at, swept.ping());
            outlet.send_built(|| Telemetry::Sweep(Sweep { at, bearing, outcome }));
        }
        if let Some(tick) = &report.tick {
            self.step(tick.step.as_ref(), outlet);
            outlet.send_built(|| Telemetry::Estimate(estimate(localizer)));
            self.gyro(localizer, outlet);
        }
        if let Some(Err(reason)) = report.aimed {
            let at = self.last.at;
            outlet.send_built(|| Telemetry::SkippedPing(SkippedPing { at, reason }));
        }
        if let Some(mode) = report.mode {
            outlet.send_built(|| mode_changed(mode, localizer));
        }
    }

    /// The message after the pose of the localizer has been replaced.
    #[must_use]
    pub fn pose_set(&self, localizer: &Localizer) -> Telemetry {
        Telemetry::PoseSet(estimate(localizer))
    }

    /// The localizer's time in the last message.
    #[must_use]
    pub fn time(&self) -> Instant {
        self.last.at
    }

    /// Passes the messages of a step to `outlet`, if there was one: the turn that was measured, then the travel.
    pub fn step(&mut self, step: Option<&robot::Step>, outlet: &mut impl Outlet) {
        // Travel that was not taken has changed nothing; it is repeated, or counted as a fault.
        if let Some(step) = step.filter(|step| step.result == StepResult::Accepted) {
            self.last = Odometry {
                at: step.at,
                right_metres: self.last.right_metres + f64::from(step.travel.right.0),
                left_metres: self.last.left_metres + f64::from(step.travel.left.0),
            };
            if let Some(turn) = step.turn {
                outlet.send_built(|| Telemetry::Turn(turn));
            }
            let last = self.last;
            outlet.send_built(|| Telemetry::Odometry(last));
        }
    }

    /// The state of the gyro, when a second has passed since the last one.
    fn gyro(&mut self, localizer: &Localizer, outlet: &mut impl Outlet) {
        let Some(status) = localizer.gyro() else {
            return;
        };
        let at = localizer.time();
        if at >= self.gyro_due {
            self.gyro_due = at.checked_add_duration(GYRO_PERIOD).unwrap_or(at);
            outlet.send_built(|| Telemetry::Gyro(GyroState { at, status }));
        }
    }

    fn ping(&mut self, heard: &PingResult, outlet: &mut impl Outlet) {
        // An echo without a matching encoder sample did not reach the localizer.
        if let PingResult { aim, outcome, fix: Some(fix), .. } = heard {
            let (at, aim, outcome, fix) = (self.last.at, *aim, *outcome, *fix);
            outlet.send_built(|| Telemetry::Ping(Ping { at, aim, outcome, fix }));
        }
    }
}

/// The message after the mode of a robot has changed.
#[must_use]
pub fn mode_changed(mode: Mode, localizer: &Localizer) -> Telemetry {
    Telemetry::ModeChanged(ModeChanged { mode, estimate: estimate(localizer) })
}

/// The localizer's estimate as a message.
#[must_use]
pub fn estimate(localizer: &Localizer) -> Estimate {
    let filter = localizer.filter();
    Estimate {
        at: localizer.time(),
        state: filter.state(),
        deviation: filter.standard_deviations(),
        health: localizer.health(),
    }
}
