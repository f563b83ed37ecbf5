//! The check of the devices while the loop does not run. The running loop only detects faults of devices that it uses.

use sonarfix::units::{Duration, Instant, Radians};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{Ranger, TriggerError};
use sonarfix_hal::robot::{EncoderFaults, Faults, Hardware};
use sonarfix_hal::servo::PointError;

use crate::time::after;

/// Period of the checks.
const PERIOD: Duration = Duration::from_ticks(1_000_000);
/// The longest time of a ranger: longer than any driver of `sonarfix-hal` takes.
const TIMEOUT: Duration = Duration::from_ticks(150_000);

/// A check of all devices, once a second: reads both counters, points the servo ahead, pings. Without a configuration
/// the servo is not checked.
///
/// ```text
///            due: count, point, trigger           echo, or no echo        
///   Resting ─────────────────────────▶ Pinging ────────────────────────────▶ Resting
/// ```
///
/// It cannot detect an unplugged quadrature encoder, which reads like a wheel at rest, nor a hobby servo that does not
/// turn, which has no feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Check {
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Resting { until: Instant },
    Pinging { since: Instant },
}

impl Check {
    /// A check that is due at `now`.
    #[must_use]
    pub fn new(now: Instant) -> Self {
        Self { state: State::Resting { until: now } }
    }

    /// Handles what is due; returns the faults that were found.
    pub fn poll(&mut self, now: Instant, hardware: &mut impl Hardware) -> Faults {
        let mut faults = Faults::default();
        match self.state {
            State::Resting { until } if now < until => {}
            State::Resting { .. } => {
                count(hardware, &mut faults);
                faults.servo = u32::from(has_servo_failed(now, hardware));
                self.trigger(now, hardware, &mut faults);
            }
            State::Pinging { since } => self.listen(now, since, hardware, &mut faults),
        }
        faults
    }

    fn trigger(&mut self, now: Instant, hardware: &mut impl Hardware, faults: &mut Faults) {
        match hardware.ranger().trigger(now) {
            Ok(()) => self.state = State::Pinging { since: now },
            // The echoes of the loop's last ping have not decayed.
            Err(TriggerError::TooSoon) => {
                self.state = State::Resting { until: after(now, TIMEOUT) }
            }
            Err(_) => self.end(now, true, faults),
        }
    }

    fn listen(
        &mut self,
        now: Instant,
        since: Instant,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
    ) {
        match hardware.ranger().poll(now) {
            Ok(Some(Ok(_))) => self.end(now, false, faults),
            Ok(Some(Err(reason))) => self.end(now, reason.is_fault(), faults),
            Ok(None) if now < after(since, TIMEOUT) => {}
            Ok(None) | Err(_) => self.end(now, true, faults),
        }
    }

    fn end(&mut self, now: Instant, has_ranger_failed: bool, faults: &mut Faults) {
        faults.ranger = u32::from(has_ranger_failed);
        self.state = State::Resting { until: after(now, PERIOD) };
    }
}

fn count(hardware: &mut impl Hardware, faults: &mut Faults) {
    let fault = |has_failed| EncoderFaults { errors: u32::from(has_failed), illegal: 0 };
    faults.right = fault(hardware.right().count().is_err());
    faults.left = fault(hardware.left().count().is_err());
}

fn has_servo_failed(now: Instant, hardware: &mut impl Hardware) -> bool {
    // A servo whose limits exclude straight ahead has not failed.
    matches!(hardware.servo().point(now, Radians(0.0)), Err(PointError::Pwm(_)))
}
