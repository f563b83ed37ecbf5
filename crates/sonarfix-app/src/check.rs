//! Whether the devices are there: asked while the loop does not run, for the loop itself finds
//! out only of those that it comes to use.

use sonarfix::units::{Duration, Instant, Radians};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{Ranger, TriggerError};
use sonarfix_hal::robot::{EncoderFaults, Faults, Hardware};
use sonarfix_hal::servo::PointError;

use crate::time::after;

/// From one check to the next.
const PERIOD: Duration = Duration::from_ticks(1_000_000);
/// How long a ranger may take: longer than any of our drivers.
const PATIENCE: Duration = Duration::from_ticks(150_000);

/// A check of all devices, once a second: reads both counters, sends the servo ahead, pings.
///
/// ```text
///            due: count, point, trigger           echo, or reason for none
///   Resting ─────────────────────────▶ Pinging ────────────────────────────▶ Resting
/// ```
///
/// What it cannot see: a quadrature encoder that is unplugged looks like a wheel that stands, and
/// a hobby servo has no way to say that it does not turn.
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

    /// Does what is due; gives what was found to be wrong.
    pub fn poll(&mut self, now: Instant, hardware: &mut impl Hardware) -> Faults {
        let mut faults = Faults::default();
        match self.state {
            State::Resting { until } if now < until => {}
            State::Resting { .. } => {
                count(hardware, &mut faults);
                faults.servo = u32::from(is_servo_dead(now, hardware));
                self.trigger(now, hardware, &mut faults);
            }
            State::Pinging { since } => self.listen(now, since, hardware, &mut faults),
        }
        faults
    }

    fn trigger(&mut self, now: Instant, hardware: &mut impl Hardware, faults: &mut Faults) {
        match hardware.ranger().trigger(now) {
            Ok(()) => self.state = State::Pinging { since: now },
            // Echoes of the loop's last ping: the next poll will do.
            Err(TriggerError::TooSoon) => {
                self.state = State::Resting { until: after(now, PATIENCE) }
            }
            Err(TriggerError::Device(_)) => self.end(now, true, faults),
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
            Ok(None) if now < after(since, PATIENCE) => {}
            Ok(None) | Err(_) => self.end(now, true, faults),
        }
    }

    fn end(&mut self, now: Instant, is_ranger_dead: bool, faults: &mut Faults) {
        faults.ranger = u32::from(is_ranger_dead);
        self.state = State::Resting { until: after(now, PERIOD) };
    }
}

fn count(hardware: &mut impl Hardware, faults: &mut Faults) {
    let found = |is_dead| EncoderFaults { errors: u32::from(is_dead), illegal: 0 };
    faults.right = found(hardware.right().count().is_err());
    faults.left = found(hardware.left().count().is_err());
}

fn is_servo_dead(now: Instant, hardware: &mut impl Hardware) -> bool {
    // One that does not reach ahead is no dead one.
    matches!(hardware.servo().point(now, Radians(0.0)), Err(PointError::Pwm(_)))
}
