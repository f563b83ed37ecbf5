//! The travel of the wheels and the turn of the gyro, up to an instant, for the localizer.

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::Instant;

use super::odometer::Reading;
use super::poll::Poll;
use super::{AbsoluteResult, Hardware, Report, Robot, Step, StepResult, Tick};
use crate::time::{micros, since};

impl<'m> Robot<'m> {
    /// Reads both counters, and the gyro if there is one; `None` if a counter fails.
    pub(super) fn read(&mut self, poll: &mut Poll<'_, 'm, impl Hardware>) -> Option<Reading> {
        let reading = self.odometer.read(poll)?;
        Some(Reading { turn: self.yaw.as_ref().map(|yaw| yaw.reading(poll.now)), ..reading })
    }

    /// Samples the encoders, if a tick is due and no ping is in flight.
    pub(super) fn sample_encoders(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        if self.cycle.has_ping() || report.has_ended_ping() {
            return;
        }
        let now = poll.now;
        let Some(due) = self.ticks.take(now) else {
            return;
        };
        // Up to the previous poll a ping has delayed it; the time since then counts as late.
        let held = self.time >= due.due;
        let late = since(now, due.due.max(self.time));
        poll.faults.deadlines += u32::from(late > self.settings.tolerance);
        let lateness = since(now, due.due);
        let Tick { step, .. } =
            report.tick.insert(Tick { step: None, lateness, held, skipped: due.skipped });
        if let Some(reading) = self.read(poll) {
            self.advance(poll, &reading, step);
        }
        if step.as_ref().is_none_or(|step| matches!(step.result, StepResult::Discarded(_))) {
            self.tracker.localizer_mut().odometry_missing(now);
        }
    }

    /// Passes the travel of the wheels up to a reading to the localizer, and the turn of the gyro; writes the step in place,
    /// because it is large.
    pub(super) fn advance(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        &Reading { at, position, turn: reading }: &Reading,
        step: &mut Option<Step>,
    ) {
        let travel = self.odometer.travel_to(position);
        let turn = self.yaw.as_ref().and_then(|yaw| yaw.turn_to(&reading?));
        let search = poll.search.as_deref_mut();
        let result = match self.tracker.odometry_with_turn(at, travel, turn, search) {
            Ok(()) => StepResult::Accepted,
            Err(error) if self.is_credible(at, travel) => StepResult::Deferred(error),
            Err(error) => StepResult::Discarded(error),
        };
        if !matches!(result, StepResult::Deferred(_)) {
            self.odometer.settle(position);
        }
        if let (StepResult::Accepted, Some(yaw), Some(reading)) = (result, &mut self.yaw, reading) {
            yaw.settle(reading);
        }
        poll.faults.travel += u32::from(matches!(result, StepResult::Discarded(_)));
        *step = Some(Step { at, travel, turn: reading, result });
    }

    /// Whether the wheels can have travelled so far since the localizer's last step. Each of the two positions is
    /// quantized to one edge.
    fn is_credible(&self, at: Instant, travel: WheelTravel) -> bool {
        let seconds = 1e-6 * micros(since(at, self.localizer().time()));
        let fastest = self.localizer().config().max_wheel_speed.0 * seconds;
        let limit = fastest + 2.0 * self.odometer.wheels().coarser_tick().0;
        travel.right.abs().0 <= limit && travel.left.abs().0 <= limit
    }

    /// Passes one absolute measurement to the localizer, if one is due.
    #[inline]
    pub(super) fn take_absolute(&mut self) -> Option<AbsoluteResult> {
        let at = self.localizer().time();
        let (measured_at, measurement) = self.waiting.take(at)?;
        let fix = self.tracker.absolute(measured_at, &measurement);
        Some(AbsoluteResult { at, measured_at, measurement, fix })
    }
}
