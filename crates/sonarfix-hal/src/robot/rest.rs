//! When a poll of the loop has something to do.

use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::localizer::Mode;

use super::cycle::Cycle;
use super::rangers::can_ping_at;
use super::{Hardware, Robot};
use crate::ranger::Ranger;
use crate::time::{AT_ONCE, NEVER, after, since};

/// Period of the polls of a loop whose next deadline is not known.
pub const PACE: Duration = Duration::from_ticks(1_000);
/// An executor that polls within this time when it is asked to poll at once is prompt: between the two polls there may be one that
/// sends telemetry. Chosen, between the longest polls of a Cortex-M0+ and a period of the encoders.
pub const PROMPT: Duration = Duration::from_ticks(5_000);

impl Robot<'_> {
    /// Whether a poll at `now` has nothing to do. If so, it is done: [`Self::poll`] need not be called, and would return
    /// an empty report. If not, [`Self::poll`] is to be called at the same `now`.
    ///
    /// For a loop that is also polled for other reasons, or at a fixed rate: this takes a tenth of the instructions of an empty
    /// poll.
    ///
    /// # Panics
    /// Never.
    pub fn rest(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        if now < self.time || now >= self.rests_until || !self.is_silent(now, hardware) {
            return false;
        }
        self.time = now;
        true
    }

    /// Whether the ping in flight has no outcome at `now`, if there is one.
    fn is_silent(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        let Cycle::Listening { polled, target, .. } = &mut self.cycle else {
            return true;
        };
        let polled = *polled.get_or_insert(now);
        if self.ping_end.is_none() {
            match hardware.ranger_of(target.ranger()).poll(now) {
                Ok(None) => return since(now, polled) < self.settings.patience,
                Ok(outcome) => self.ping_end = Some(outcome),
                Err(_) => self.ping_end = Some(None),
            }
        }
        false
    }

    /// The next instant at which a poll has something to do besides a ping in flight.
    pub(super) fn next_deadline(&self, hardware: &mut impl Hardware) -> Instant {
        if self.waiting.is_due(self.localizer().time()) {
            return AT_ONCE;
        }
        let next = match self.cycle {
            // Ticks are delayed until it has ended.
            Cycle::Listening { .. } => NEVER,
            Cycle::Choosing { .. } | Cycle::Reached { .. } => AT_ONCE,
            Cycle::Idle { until } => until.min(self.ticks.next()),
            Cycle::Turning { ranger, target, .. } => {
                let ready_at = can_ping_at(self.localizer().config(), ranger, &target, hardware);
                ready_at.min(self.ticks.next())
            }
        };
        self.yaw.as_ref().map_or(next, |yaw| next.min(yaw.next()))
    }

    /// Judges by the time of a poll whether the executor is prompt.
    #[inline]
    pub(super) fn judge_executor(&mut self, now: Instant) {
        if self.has_asked {
            self.is_prompt = since(now, self.time) <= PROMPT;
        }
    }

    /// Whether polls before the next deadline have nothing to do. A search works at every poll.
    pub(super) fn can_rest(&self) -> bool {
        self.odometer.has_begun() && self.mode() == Mode::Tracking
    }

    /// When the loop must be polled next, if no edge of the echo is stamped earlier: at the next deadline of ticks, sonar, servo
    /// or gyro, and every [`PACE`] where no deadline is known (a search, a ranger without [`Ranger::poll_at`]). An instant that
    /// has passed: at once.
    pub fn next_poll(&self, hardware: &mut impl Hardware) -> Instant {
        let paced = after(self.time, PACE);
        let deadline = match self.cycle {
            Cycle::Listening { polled, target, .. } => {
                let timeout = polled.map_or(NEVER, |polled| after(polled, self.settings.patience));
                hardware.ranger_of(target.ranger()).poll_at().unwrap_or(AT_ONCE).min(timeout)
            }
            _ => NEVER,
        };
        let deadline = deadline.min(self.next_deadline(hardware));
        if !self.can_rest() {
            return deadline.min(paced);
        }
        // A deadline that has passed without effect, such as that of a ranger that is not ready.
        let is_waiting = deadline <= self.time && !self.has_worked;
        if is_waiting { paced } else { deadline }
    }

    /// The next instant at which a poll has something to do; `None` while a ping is in flight, when the loop
    /// should be polled at the rate that the ranger requires. For an executor that sleeps, and for a simulator.
    pub fn idle_until(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        let is_listening = matches!(self.cycle, Cycle::Listening { .. });
        (!is_listening).then(|| self.next_deadline(hardware))
    }
}
